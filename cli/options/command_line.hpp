// SPDX-License-Identifier: GPL-2.0-or-later
// The command line: commands, their options and flags, help. The one face of CLI11, which takes long to compile.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lobatto {

// What is wrong with a number that begins otherwise, as in formulas: "write 0.5, not .5". Empty: nothing.
std::string number_complaint(const std::string& number);

// What may be asked of an option or a flag after it was declared.
class Option {
public:
    explicit Option(CLI::Option* option) : option_(option) {}

    Option& required();
    Option& excludes(const Option& other);      // both at once are an error
    Option& one_value_each();                   // an option that may be repeated takes one value each time
    Option& show_default();                     // in the help
    Option& shown_as(const std::string& word);  // what its value is called in the help: "FOLDER"
    Option& between(std::int64_t least, std::int64_t most);
    Option& one_of(const std::vector<int>& values);
    Option& one_of(const std::vector<std::string>& values);
    // `complaint` says what is wrong with a value; empty: nothing.
    Option& checked_by(std::function<std::string(const std::string&)> complaint);

private:
    CLI::Option* option_;
};

// A command and its arguments. What is declared outlives the parsing: it is written to.
class Command {
public:
    explicit Command(CLI::App* app) : app_(app) {}

    // A name such as "SCENE" stands at a fixed place; "-o,--output" and "--step" are given by name.
    Option option(const std::string& name, std::string& target, const std::string& help);
    Option option(const std::string& name, std::vector<std::string>& target, const std::string& help);
    Option option(const std::string& name, std::optional<std::string>& target, const std::string& help);
    Option option(const std::string& name, int& target, const std::string& help);
    Option option(const std::string& name, std::int64_t& target, const std::string& help);
    Option option(const std::string& name, std::optional<int>& target, const std::string& help);
    Option option(const std::string& name, std::optional<std::int64_t>& target, const std::string& help);
    Option option(const std::string& name, double& target, const std::string& help);
    Option option(const std::string& name, std::optional<double>& target, const std::string& help);
    // Each value given goes to `take`.
    Option option(const std::string& name, std::function<void(const std::string&)> take, const std::string& help);
    // One of some words, each of which stands for a value.
    template <class Enum>
    Option choice(const std::string& name, Enum& target, const std::vector<std::pair<std::string, Enum>>& words,
                  const std::string& help) {
        std::vector<std::pair<std::string, int>> numbers;
        for (const auto& [word, value] : words) numbers.emplace_back(word, static_cast<int>(value));
        return choice_of(
            name, [&target](int value) { target = static_cast<Enum>(value); }, numbers, help);
    }
    Option flag(const std::string& name, bool& target, const std::string& help);
    Option flag(const std::string& name, std::function<void()> is_given, const std::string& help);

    void footer(const std::string& text);  // the end of its help
    void does(std::function<void()> work);

private:
    Option choice_of(const std::string& name, std::function<void(int)> store,
                     const std::vector<std::pair<std::string, int>>& words, const std::string& help);

    CLI::App* app_;
};

// Thrown by a command when everything worth saying has been printed.
struct ExitCode {
    int code;
};

// Wrong arguments: what is said of them.
struct WrongArguments {
    std::string message;
};

// What the help says of a command, piece by piece: for manual pages and completions.
struct CommandHelp {
    struct Item {
        std::vector<std::string> names;  // "-o", "--output"; of a value at a fixed place "SCENE"
        std::string value;               // what its value is called; empty: a flag
        std::vector<std::string> words;  // of which the value is one; empty: of others
        std::string text;
        bool is_required = false, is_repeated = false, is_placed = false;
    };
    std::string name, description, footer;
    std::vector<Item> items;
};

class CommandLine {
public:
    CommandLine(const std::string& description, const std::string& name);
    ~CommandLine();
    void version(const std::string& text);
    Command command(const std::string& name, const std::string& description);
    void footer(const std::string& text);
    std::string description() const;
    std::string end_of_help() const;
    std::vector<CommandHelp> commands() const;
    // Runs the command that the arguments name, or prints the help. Throws WrongArguments, and what commands throw.
    void run(int argc, char** argv);

private:
    WrongArguments complaint(const std::string& what) const;

    std::unique_ptr<CLI::App> app_;
};

}  // namespace lobatto

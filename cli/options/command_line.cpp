// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <iostream>
#include <limits>
#include <map>
#include <system_error>

namespace lobatto {

std::string number_complaint(const std::string& number) {
    const std::size_t first = number.find_first_not_of("+-");
    if (first == std::string::npos || number[first] != '.') return "";
    return fmt::format("a number begins with a digit: write 0{}, not {}", number.substr(first), number.substr(first));
}

namespace {

// What is wrong with a whole number for an Integer: 1e16, 2.5, or one with too many digits.
template <class Integer>
std::string whole_number_complaint(const std::string& number) {
    Integer value{};
    const char* const end = number.data() + number.size();
    const auto [stopped, error] = std::from_chars(number.data() + number.starts_with('+'), end, value);
    if (error == std::errc{} && stopped == end) return "";
    return fmt::format("a whole number in digits is wanted, at most {}, not {}", std::numeric_limits<Integer>::max(),
                       number);
}

}  // namespace

Option& Option::required() {
    option_->required();
    return *this;
}

Option& Option::excludes(const Option& other) {
    option_->excludes(other.option_);
    return *this;
}

Option& Option::one_value_each() {
    option_->allow_extra_args(false);
    return *this;
}

Option& Option::show_default() {
    option_->capture_default_str();
    return *this;
}

Option& Option::shown_as(const std::string& type_name) {
    option_->type_name(type_name);
    return *this;
}

Option& Option::between(std::int64_t least, std::int64_t most) {
    option_->check(CLI::Range(least, most));
    return *this;
}

Option& Option::one_of(const std::vector<int>& values) {
    option_->check(CLI::IsMember(values));
    return *this;
}

Option& Option::one_of(const std::vector<std::string>& values) {
    option_->check(CLI::IsMember(values));
    return *this;
}

Option& Option::checked_by(std::function<std::string(const std::string&)> complaint) {
    option_->check(std::move(complaint));
    return *this;
}

Option Command::option(const std::string& name, std::string& target, const std::string& help) {
    return Option(app_->add_option(name, target, help));
}

Option Command::option(const std::string& name, std::vector<std::string>& target, const std::string& help) {
    return Option(app_->add_option(name, target, help));
}

Option Command::option(const std::string& name, std::optional<std::string>& target, const std::string& help) {
    return Option(app_->add_option(name, target, help));
}

Option Command::option(const std::string& name, int& target, const std::string& help) {
    return Option(app_->add_option(name, target, help)).checked_by(whole_number_complaint<int>);
}

Option Command::option(const std::string& name, std::int64_t& target, const std::string& help) {
    return Option(app_->add_option(name, target, help)).checked_by(whole_number_complaint<std::int64_t>);
}

Option Command::option(const std::string& name, std::optional<int>& target, const std::string& help) {
    return Option(app_->add_option(name, target, help)).checked_by(whole_number_complaint<int>);
}

Option Command::option(const std::string& name, std::optional<std::int64_t>& target, const std::string& help) {
    return Option(app_->add_option(name, target, help)).checked_by(whole_number_complaint<std::int64_t>);
}

Option Command::option(const std::string& name, double& target, const std::string& help) {
    return Option(app_->add_option(name, target, help)).checked_by(number_complaint);
}

Option Command::option(const std::string& name, std::optional<double>& target, const std::string& help) {
    return Option(app_->add_option(name, target, help)).checked_by(number_complaint);
}

Option Command::choice_of(const std::string& name, std::function<void(int)> store,
                          const std::vector<std::pair<std::string, int>>& words, const std::string& help) {
    const std::map<std::string, int> table(words.begin(), words.end());
    CLI::Option* option = app_->add_option_function<int>(name, std::move(store), help);
    option->transform(CLI::CheckedTransformer(table).description(""));
    return Option(option);
}

Option Command::flag(const std::string& name, bool& target, const std::string& help) {
    return Option(app_->add_flag(name, target, help));
}

void Command::footer(const std::string& text) {
    app_->footer(text);
}

void Command::does(std::function<void()> work) {
    app_->callback(std::move(work));
}

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : app_(std::make_unique<CLI::App>(description, name)) {
    app_->require_subcommand(0, 1);
}

CommandLine::~CommandLine() = default;

void CommandLine::version(const std::string& text) {
    app_->set_version_flag("--version", text);
}

Command CommandLine::command(const std::string& name, const std::string& description) {
    return Command(app_->add_subcommand(name, description));
}

void CommandLine::footer(const std::string& text) {
    app_->footer(text);
}

void CommandLine::run(int argc, char** argv) {
    try {
        app_->parse(argc, argv);
        if (app_->get_subcommands().empty()) std::cout << app_->help();
    } catch (const CLI::Success& help_or_version) {
        app_->exit(help_or_version);  // prints it
    } catch (const CLI::ParseError& error) {
        throw complaint(error.what());
    }
}

WrongArguments CommandLine::complaint(const std::string& what) const {
    const auto chosen = app_->get_subcommands();
    if (!chosen.empty())
        return {fmt::format("{}\n`lobatto {} --help` shows what can be given.", what, chosen.front()->get_name())};
    const auto extras = app_->remaining();
    if (extras.empty() || extras.front().starts_with('-'))
        return {fmt::format("{}\n`lobatto --help` shows what can be given.", what)};
    const std::string& word = extras.front();
    std::vector<std::string> names;
    for (const CLI::App* command : app_->get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(command->get_name());
    const std::string hint = word.ends_with(".toml") ? fmt::format(" Did you mean `lobatto run {}`?", word) : "";
    return {fmt::format("unknown command '{}'; the commands are: {}.{}", word, fmt::join(names, ", "), hint)};
}

}  // namespace lobatto

// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/command_line.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>
#include <limits>
#include <map>
#include <system_error>

#include "generator/formula/text/suggest.hpp"
#include "runtime/files/cells.hpp"

namespace lobatto {

std::string number_complaint(const std::string& number) {
    const std::size_t first = number.find_first_not_of("+-");
    if (first == std::string::npos || number[first] != '.') return "";
    return fmt::format("a number begins with a digit: write 0{}, not {}", number.substr(first), number.substr(first));
}

namespace {

// An empty word, as "$STEP" is where STEP is not set, must not mean that the option was not given.
std::string empty_complaint(const std::string& word) {
    return word.empty() ? "the value is empty; give one, or leave the option out" : "";
}

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

// The same for a number.
std::string any_number_complaint(const std::string& number) {
    if (const std::string complaint = number_complaint(number); !complaint.empty()) return complaint;
    double value{};
    const char* const end = number.data() + number.size();
    const auto [stopped, error] = std::from_chars(number.data() + number.starts_with('+'), end, value);
    if (error != std::errc::invalid_argument && stopped == end) return "";
    return fmt::format("a number is wanted, such as 0.25 or 1e-6, not {}", number);
}

// "TYPE:{plain,clean}": what the value is called, and what there is to say of it.
std::pair<std::string, std::string> value_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    const std::size_t colon = type.find(':');
    return {type.substr(0, colon), colon == std::string::npos ? "" : type.substr(colon + 1)};
}

// Of "{plain,clean}".
std::vector<std::string> words_in(std::string_view limits) {
    if (!limits.starts_with('{') || !limits.ends_with('}')) return {};
    const auto words = cells_of(limits.substr(1, limits.size() - 2));
    return {words.begin(), words.end()};
}

// ": plain, clean", or " (2 to 12)" of "INT in [2 - 12]".
std::string limits_text(const std::string& limits) {
    if (const auto words = words_in(limits); !words.empty()) return fmt::format(": {}", fmt::join(words, ", "));
    const std::size_t open = limits.find('['), dash = limits.find(" - ");
    if (open == std::string::npos || dash == std::string::npos) return "";
    return fmt::format(" ({} to {})", limits.substr(open + 1, dash - open - 1),
                       limits.substr(dash + 3, limits.size() - dash - 4));
}

std::string capital(std::string word) {
    if (word.front() >= 'a' && word.front() <= 'z') word.front() = static_cast<char>(word.front() - 'a' + 'A');
    return word;
}

std::string described(const CLI::Option& option) {
    std::string text = option.get_description();
    if (option.get_type_size() == 0) return text;
    const std::string limits = limits_text(value_of(option).second);
    const std::vector<std::string> words = words_in(value_of(option).second);
    const bool are_named = !words.empty() && std::all_of(words.begin(), words.end(), [&](const std::string& word) {
        return text.find(word) != std::string::npos || text.find(capital(word)) != std::string::npos;
    });
    if (!are_named) text += limits;
    if (!option.get_default_str().empty()) text += " (default: " + option.get_default_str() + ")";
    if (option.get_required() && !option.get_positional()) text += " (required)";
    return text;
}

// One way of saying things in all helps.
class HelpText : public CLI::Formatter {
public:
    HelpText() {
        column_width(30);
        label("Positionals", "Arguments");
        label("Subcommands", "Commands");
        label("SUBCOMMAND", "COMMAND");
    }
    std::string make_option_opts(const CLI::Option* option) const override {
        if (option->get_type_size() == 0 || option->get_positional()) return "";
        return " " + value_of(*option).first;
    }
    std::string make_option_desc(const CLI::Option* option) const override { return described(*option); }
};

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

Option& Option::shown_as(const std::string& word) {
    option_->type_name(word);
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
    Option option(app_->add_option(name, target, help));
    if (name.starts_with('-')) option.checked_by(empty_complaint);  // names of scenes have an error of their own
    return option;
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
    return Option(app_->add_option(name, target, help)).checked_by(any_number_complaint);
}

Option Command::option(const std::string& name, std::optional<double>& target, const std::string& help) {
    return Option(app_->add_option(name, target, help)).checked_by(any_number_complaint);
}

Option Command::option(const std::string& name, std::function<void(const std::string&)> take, const std::string& help) {
    return Option(app_->add_option_function<std::vector<std::string>>(
        name,
        [take = std::move(take)](const std::vector<std::string>& values) {
            for (const std::string& value : values) take(value);
        },
        help));
}

Option Command::choice_of(const std::string& name, std::function<void(int)> store,
                          const std::vector<std::pair<std::string, int>>& words, const std::string& help) {
    const std::map<std::string, int> table(words.begin(), words.end());
    std::vector<std::string> all;
    for (const auto& [word, value] : words) all.push_back(word);
    CLI::Option* option = app_->add_option_function<std::string>(
        name, [table, store = std::move(store)](const std::string& word) { store(table.at(word)); }, help);
    return Option(option).one_of(all);
}

Option Command::flag(const std::string& name, bool& target, const std::string& help) {
    return Option(app_->add_flag(name, target, help));
}

Option Command::flag(const std::string& name, std::function<void()> is_given, const std::string& help) {
    return Option(app_->add_flag_callback(name, std::move(is_given), help));
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
    app_->formatter(std::make_shared<HelpText>());
    app_->set_help_flag("-h,--help", "Print this help and exit");
}

CommandLine::~CommandLine() = default;

void CommandLine::version(const std::string& text) {
    app_->set_version_flag("--version", text, "Print the version and exit");
}

Command CommandLine::command(const std::string& name, const std::string& description) {
    return Command(app_->add_subcommand(name, description)->group("Commands"));
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
    } catch (const CLI::RequiredError& error) {
        // A misspelt option says more than what is missing.
        const auto chosen = app_->get_subcommands();
        for (const std::string& word : chosen.empty() ? std::vector<std::string>() : chosen.front()->remaining())
            if (word.starts_with("--") && word.size() > 2)
                throw complaint("The following argument was not expected: " + word);
        throw complaint(error.what());
    } catch (const CLI::ExtrasError&) {  // CLI11 tells them in the wrong order
        const auto chosen = app_->get_subcommands();
        const std::vector<std::string> words = chosen.empty() ? app_->remaining() : chosen.front()->remaining();
        throw complaint(fmt::format("The following argument{} not expected: {}", words.size() == 1 ? " was" : "s were",
                                    fmt::join(words, " ")));
    } catch (const CLI::ParseError& error) {
        throw complaint(error.what());
    }
}

std::string CommandLine::description() const {
    return app_->get_description();
}

std::string CommandLine::end_of_help() const {
    return app_->get_footer();
}

std::vector<CommandHelp> CommandLine::commands() const {
    std::vector<CommandHelp> all;
    for (const CLI::App* command : app_->get_subcommands([](const CLI::App*) { return true; })) {
        CommandHelp help{command->get_name(), command->get_description(), command->get_footer(), {}};
        for (const CLI::Option* option : command->get_options()) {
            CommandHelp::Item item;
            item.is_placed = option->get_positional();
            if (item.is_placed) item.names.push_back(option->get_name(true));
            for (const std::string& name : option->get_snames()) item.names.push_back("-" + name);
            for (const std::string& name : option->get_lnames()) item.names.push_back("--" + name);
            const auto [value, limits] = value_of(*option);
            if (option->get_type_size() != 0) item.value = item.is_placed ? item.names.front() : value;
            item.words = words_in(limits);
            item.text = described(*option);
            item.is_required = option->get_required();
            item.is_repeated = option->get_expected_max() > 1;
            help.items.push_back(item);
        }
        all.push_back(help);
    }
    return all;
}

namespace {

// What a misspelt option was probably meant to be.
std::string option_hint(const std::string& what, const CLI::App& command) {
    const std::size_t at = what.find("--");
    if (what.find("not expected") == std::string::npos || at == std::string::npos) return "";
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    const std::string word = what.substr(at, what.find_first_of(" =", at) - at);
    if (command.get_parent() != nullptr)
        for (const CLI::App* other : command.get_parent()->get_subcommands([](const CLI::App*) { return true; }))
            for (const CLI::Option* option : other->get_options())
                if (option->check_name(word)) return fmt::format(". `lobatto {}` has it", other->get_name());
    const std::string hint = suggestion(word, names);
    return hint.empty() ? "" : "." + hint;
}

}  // namespace

WrongArguments CommandLine::complaint(const std::string& what) const {
    const auto chosen = app_->get_subcommands();
    if (!chosen.empty())
        return {fmt::format("{}{}\n`lobatto {} --help` shows what can be given.", what,
                            option_hint(what, *chosen.front()), chosen.front()->get_name())};
    const auto extras = app_->remaining();
    if (extras.empty() || extras.front().starts_with('-'))
        return {fmt::format("{}{}\n`lobatto --help` shows what can be given.", what, option_hint(what, *app_))};
    const std::string& word = extras.front();
    std::vector<std::string> names;
    for (const CLI::App* command : app_->get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(command->get_name());
    const std::string hint =
        word.ends_with(".toml") ? fmt::format(" Did you mean `lobatto run {}`?", word) : suggestion(word, names);
    return {fmt::format("unknown command '{}'; the commands are: {}.{}", word, fmt::join(names, ", "), hint)};
}

}  // namespace lobatto

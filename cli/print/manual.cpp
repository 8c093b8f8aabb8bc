// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/print/manual.hpp"

#include <fmt/format.h>

namespace lobatto {

namespace {

// For troff: backslashes and leading points are commands, a bare hyphen may become another sign.
std::string in_troff(const std::string& text) {
    std::string result;
    bool begins = true;
    for (const char c : text) {
        if (begins && (c == '.' || c == '\'')) result += "\\&";
        if (c == '\\')
            result += "\\e";
        else if (c == '-')
            result += "\\-";
        else
            result += c;
        begins = c == '\n';
    }
    return result;
}

std::string head_of(const std::string& name, const std::string& description) {
    return fmt::format(".TH {} 1 \"\" \"Lobatto {}\" \"Lobatto\"\n.SH NAME\n{} \\- {}\n", in_troff(name),
                       LOBATTO_VERSION, in_troff(name), in_troff(description));
}

// Footers are paragraphs of lines, those that are indented examples.
std::string section_of(const std::string& title, const std::string& text) {
    return fmt::format(".SH {}\n.nf\n{}\n.fi\n", title, in_troff(text));
}

std::string page_of(const CommandHelp& command) {
    std::string usage, options;
    for (const CommandHelp::Item& item : command.items) {
        std::string names;
        for (const std::string& name : item.names)
            names += (names.empty() ? "" : ", ") + ("\\fB" + in_troff(name)) + "\\fR";
        if (item.is_placed)
            usage += fmt::format(" {}{}{}{}", item.is_required ? "" : "[", item.value, item.is_repeated ? " ..." : "",
                                 item.is_required ? "" : "]");
        else if (!item.value.empty())
            names += " \\fI" + in_troff(item.value) + "\\fR";
        options += fmt::format(".TP\n{}\n{}\n", names, in_troff(item.text));
    }
    return head_of("lobatto-" + command.name, command.description) +
           fmt::format(".SH SYNOPSIS\n\\fBlobatto {}\\fR [OPTIONS]{}\n.SH OPTIONS\n{}", in_troff(command.name), usage,
                       options) +
           section_of("EXAMPLES", command.footer) + ".SH SEE ALSO\n\\fBlobatto\\fR(1)\n";
}

std::string first_page(const CommandLine& program, const std::vector<CommandHelp>& commands) {
    std::string page =
        head_of("lobatto", program.description()) + ".SH SYNOPSIS\n\\fBlobatto\\fR COMMAND [OPTIONS]\n.SH COMMANDS\n";
    for (const CommandHelp& command : commands)
        page +=
            fmt::format(".TP\n\\fBlobatto\\-{}\\fR(1)\n{}\n", in_troff(command.name), in_troff(command.description));
    return page + section_of("EXIT CODES AND EXAMPLES", program.end_of_help());
}

bool is_file(const CommandHelp::Item& item) {
    return item.value == "FILE" || item.value == "FILES" || item.value == "FOLDER" || item.value == "SCENE" ||
           item.value == "SCENES" || item.value == "PARTS" || item.value == "OUTPUT";
}

std::string joined_names(const CommandHelp& command) {
    std::string all;
    for (const CommandHelp::Item& item : command.items)
        for (const std::string& name : item.names)
            if (!item.is_placed) all += (all.empty() ? "" : " ") + name;
    return all;
}

std::string for_bash(const std::vector<CommandHelp>& commands) {
    std::string names, options, words;
    for (const CommandHelp& command : commands) {
        names += (names.empty() ? "" : " ") + command.name;
        options += fmt::format("        {}) options=\"{}\" ;;\n", command.name, joined_names(command));
        for (const CommandHelp::Item& item : command.items)
            if (!item.words.empty())
                words += fmt::format(
                    "        {}:{}) mapfile -t COMPREPLY < <(IFS=,; compgen -W \"{}\" -- \"$word\"); return ;;\n",
                    command.name, item.names.back(), fmt::join(item.words, ","));
    }
    return "# Completions of lobatto for bash.\n"
           "_lobatto() {\n"
           "    local word=\"${COMP_WORDS[COMP_CWORD]}\" before=\"${COMP_WORDS[COMP_CWORD-1]}\" "
           "command=\"${COMP_WORDS[1]}\" "
           "options=\"\"\n"
           "    if ((COMP_CWORD == 1)); then\n"
           "        COMPREPLY=($(compgen -W \"" +
           names +
           " --help --version\" -- \"$word\"))\n"
           "        return\n"
           "    fi\n"
           "    case \"$command:$before\" in\n" +
           words +
           "    esac\n"
           "    case \"$command\" in\n" +
           options +
           "    esac\n"
           "    if [[ $word == -* ]]; then\n"
           "        COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
           "    else\n"
           "        mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n"
           "    fi\n"
           "}\n"
           "complete -o filenames -F _lobatto lobatto ./lobatto\n";
}

// Within quotes of zsh and fish, which end at a single one.
std::string quotable(const std::string& text) {
    std::string result;
    for (const char c : text) result += c == '\'' ? "’" : std::string(1, c);
    return result;
}

std::string for_zsh(const std::vector<CommandHelp>& commands) {
    std::string names, cases;
    const auto escaped = [](const std::string& text) {
        std::string result;
        for (const char c : quotable(text)) {
            if (c == '[' || c == ']' || c == ':') result += '\\';
            result += c;
        }
        return result;
    };
    for (const CommandHelp& command : commands) {
        names += fmt::format("        '{}:{}'\n", command.name, escaped(command.description));
        cases += fmt::format("        {})\n            _arguments", command.name);
        for (const CommandHelp::Item& item : command.items) {
            const std::string action = !item.words.empty() ? fmt::format("({})", fmt::join(item.words, " "))
                                       : is_file(item)     ? "_files"
                                                           : " ";
            if (item.is_placed) {
                cases += fmt::format(" '{}:{}:{}'", item.is_repeated ? "*" : "", item.value, action);
                continue;
            }
            for (const std::string& name : item.names)
                cases += fmt::format(" '{}{}[{}]{}'", item.is_repeated ? "*" : "", name, escaped(item.text),
                                     item.value.empty() ? "" : fmt::format(":{}:{}", item.value, action));
        }
        cases += " ;;\n";
    }
    return "#compdef lobatto\n# Completions of lobatto for zsh.\n_lobatto() {\n    local -a commands=(\n" + names +
           "    )\n    if ((CURRENT == 2)); then\n        _describe command commands\n        return\n    fi\n"
           "    local command=$words[2]\n    shift words\n    ((CURRENT--))\n    case $command in\n" +
           cases +
           "    esac\n}\nif [[ $funcstack[1] == _lobatto ]]; then _lobatto \"$@\"; else compdef _lobatto lobatto; fi\n";
}

std::string for_fish(const std::vector<CommandHelp>& commands) {
    std::string text = "# Completions of lobatto for fish.\n";
    for (const CommandHelp& command : commands) {
        text += fmt::format("complete -c lobatto -n __fish_use_subcommand -a {} -d '{}'\n", command.name,
                            quotable(command.description));
        for (const CommandHelp::Item& item : command.items) {
            if (item.is_placed) continue;
            text += fmt::format("complete -c lobatto -n '__fish_seen_subcommand_from {}'", command.name);
            for (const std::string& name : item.names)
                text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
            if (!item.value.empty()) text += is_file(item) ? " -r" : " -x";
            if (!item.words.empty()) text += fmt::format(" -a '{}'", fmt::join(item.words, " "));
            text += fmt::format(" -d '{}'\n", quotable(item.text));
        }
    }
    return text;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> manual_pages(const CommandLine& program) {
    const std::vector<CommandHelp> commands = program.commands();
    std::vector<std::pair<std::string, std::string>> pages{{"lobatto.1", first_page(program, commands)}};
    for (const CommandHelp& command : commands) pages.emplace_back("lobatto-" + command.name + ".1", page_of(command));
    return pages;
}

std::string completions(const CommandLine& program, Shell shell) {
    const std::vector<CommandHelp> commands = program.commands();
    return shell == Shell::bash ? for_bash(commands) : shell == Shell::zsh ? for_zsh(commands) : for_fish(commands);
}

}  // namespace lobatto

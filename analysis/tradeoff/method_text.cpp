// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/method_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <vector>

#include "runtime/files/partial_file.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

std::vector<std::string> method_lines(const Choice& choice) {
    const Candidate& candidate = choice.measurement.candidate;
    const bool lobatto = candidate.member.family == Family::lobatto;
    std::vector<std::string> lines = {fmt::format("family = \"{}\"", word_of(candidate.member.family)),
                                      fmt::format("{} = {}", lobatto ? "points" : "stages", candidate.member.points)};
    if (candidate.member.arithmetic == StepArithmetic::clean) lines.push_back("arithmetic = \"clean\"");
    if (candidate.member.precision != Precision::double_)
        lines.push_back("numbers = \"" + precision_name(candidate.member.precision) + '"');
    if (!choice.clock.empty()) lines.push_back("clock = \"" + choice.clock + '"');
    if (candidate.tolerance > 0) lines.push_back("tolerance = " + exact_text(candidate.tolerance));
    return lines;
}

// In numbers with more digits than a double has, the step is a fraction: so many of them are the end.
std::string step_text(const Choice& choice) {
    const Candidate& candidate = choice.measurement.candidate;
    if (candidate.member.precision == Precision::double_) return exact_text(choice.step());
    return fmt::format("\"{}/{}\"", exact_text(choice.until), candidate.steps);
}

// The lines of a TOML file, each with the table it stands in; lines inside a text of several lines belong to it.
struct Line {
    std::string text, table, key;  // key: what is set on this line; empty for comments, headers, and inner lines
    bool header = false;
};

std::vector<Line> lines_of(const std::string& text) {
    static const std::regex header(R"(^\s*\[\s*([A-Za-z_]+)\s*\]\s*(#.*)?$)"), key(R"x(^\s*"?([A-Za-z_]+)"?\s*=)x");
    std::vector<Line> lines;
    std::string table;
    bool inside = false;  // of """ or '''
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        Line line{text.substr(begin, end - begin), table, "", false};
        if (line.text.ends_with('\r')) line.text.pop_back();
        begin = end + 1;
        std::smatch match;
        if (!inside && std::regex_match(line.text, match, header)) {
            table = line.table = match[1];
            line.header = true;
        } else if (!inside && std::regex_search(line.text, match, key)) {
            line.key = match[1];
        }
        for (const char* quotes : {"\"\"\"", "'''"})
            for (std::size_t at = line.text.find(quotes); at != std::string::npos; at = line.text.find(quotes, at + 3))
                inside = !inside;
        lines.push_back(line);
    }
    return lines;
}

// What follows the value on a line: "  # seconds".
std::string comment_of(const std::string& line) {
    char quote = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (quote != 0 && line[i] == '\\' && quote == '"') {
            ++i;
        } else if (quote != 0 ? line[i] == quote : line[i] == '"' || line[i] == '\'') {
            quote = quote == 0 ? line[i] : '\0';
        } else if (quote == 0 && line[i] == '#') {
            return line.substr(line.find_last_not_of(" \t", i - 1) + 1);
        }
    }
    return "";
}

bool sets_output(const std::string& text, const std::vector<std::string>& keys) {
    const std::vector<Line> lines = lines_of(text);
    return std::any_of(lines.begin(), lines.end(), [&](const Line& line) {
        return line.table == "output" && std::find(keys.begin(), keys.end(), line.key) != keys.end();
    });
}

}  // namespace

std::string method_text(const Choice& choice) {
    std::string text = "[method]\n";
    for (const std::string& line : method_lines(choice)) text += line + '\n';
    return text + fmt::format("\n[run]\nstep = {}\nuntil = {}\n", step_text(choice), exact_text(choice.until));
}

std::string stability_text(const Choice& choice) {
    const double radians = choice.step() * choice.frequency;
    if (std::isnan(choice.stability_limit))
        return choice.clock.empty() ? "no linear limit is known with constraints, walls or switches"
                                    : "no linear limit is known with a clock";
    if (!std::isfinite(choice.stability_limit)) return fmt::format("h omega = {:.3g}, stable for every step", radians);
    return fmt::format("h omega = {:.3g} of at most {:.4g}, omega the largest frequency met{}", radians,
                       choice.stability_limit, radians > choice.stability_limit ? "; it is met only for moments" : "");
}

std::string with_choice(const std::string& text, const Choice& choice, double error, bool until) {
    std::vector<std::string> method = method_lines(choice);
    method.front() +=
        fmt::format(" # lobatto tune --error {:.2g}: {:.1g} to t = {:.6g}, {:.3g} ns per unit of time", error,
                    choice.measurement.error, choice.until, choice.measurement.seconds / choice.until * 1e9);
    std::string result;
    bool has_method = false;
    const std::vector<Line> lines = lines_of(text);
    std::map<std::string, std::string> comments;  // of [run]
    for (const Line& line : lines)
        if (line.table == "run" && !line.key.empty()) comments[line.key] = comment_of(line.text);
    for (const Line& line : lines) {
        if (line.header && line.table == "method") {
            has_method = true;
            result += line.text + '\n';
            for (const std::string& added : method) result += added + '\n';
            continue;
        }
        if (line.table == "method" && !line.key.empty()) continue;
        if (line.header && line.table == "run") {
            if (!has_method) {
                result += "[method]\n";
                for (const std::string& added : method) result += added + '\n';
                result += '\n';
                has_method = true;
            }
            result += line.text + '\n' + "step = " + step_text(choice) + comments["step"] + '\n';
            result += "error = " + exact_text(error) + comments["error"] + '\n';
            if (until) result += "until = " + exact_text(choice.until) + comments["until"] + '\n';
            continue;
        }
        const bool replaced =
            line.table == "run" && (line.key == "step" || line.key == "steps_per_period" || line.key == "period" ||
                                    line.key == "error" || (until && line.key == "until"));
        if (!replaced) result += line.text + '\n';
    }
    return text.find("\r\n") == std::string::npos ? result : std::regex_replace(result, std::regex("\n"), "\r\n");
}

void write_method(const Choice& choice, const Scene& scene, double error, bool until) {
    const std::string text = with_choice(scene.source.content(), choice, error, until);
    const Candidate& candidate = choice.measurement.candidate;
    if ((scene.clock ? scene.clock->text : "") != choice.clock && sets_output(text, {"every", "dense"}))
        throw InputError(fmt::format(
            "{}: the method cannot be written into this file: the choice has {}, and `every` or `dense` in [output] "
            "mean something else there ({}). Change them, and copy the lines above",
            scene.path, choice.clock.empty() ? "no clock" : "the clock " + choice.clock,
            choice.clock.empty() ? "a number of steps" : "a time"));
    const auto fits = [&] {
        try {
            const Scene back = read_scene(Source(scene.path, text));
            return back.method.family == candidate.member.family && back.method.points == candidate.member.points &&
                   back.method.tolerance == candidate.tolerance &&
                   back.method.arithmetic == candidate.member.arithmetic &&
                   back.method.numbers == candidate.member.precision &&
                   (back.clock ? back.clock->text : "") == choice.clock &&
                   back.evaluate(back.run.step, "the step").to_double() == choice.step();
        } catch (const InputError&) {  // of a text that nobody has written
            return false;
        }
    };
    if (!fits())
        throw InputError(
            fmt::format("{}: the method cannot be written into this file, whose [method] or [run] is laid out "
                        "unusually; copy the lines above",
                        scene.path));
    const std::string now = read_whole(scene.path).value_or(""), mark = "\xEF\xBB\xBF";  // of the order of bytes
    const bool is_marked = now.starts_with(mark);
    if (now.substr(is_marked ? mark.size() : 0) != scene.source.content())
        throw InputError(fmt::format(
            "{}: the file has changed since it was read, so nothing is written; copy the lines above into it",
            scene.path));
    write_whole(scene.path, "the scene", (is_marked ? mark : "") + text, "copy the lines above into it");
}

}  // namespace lobatto

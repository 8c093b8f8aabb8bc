// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/tradeoff/page.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <string_view>

#include "cli/tradeoff/report.hpp"
#include "runtime/build/compiler.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

std::string escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '&':
                result += "&amp;";
                break;
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '"':
                result += "&quot;";
                break;
            default:
                result += c;
        }
    }
    return result;
}

// A picture as an address that holds it: names inside one picture cannot meet those of another.
std::string data_address(const std::string& svg) {
    std::string address = "data:image/svg+xml;charset=utf-8,";
    for (const char c : svg) {
        const bool plain = (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
                           std::string_view("-_.~ ,:;=/()").find(c) != std::string_view::npos;
        address += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
    return address;
}

// The first "model name" of the processor.
std::string processor_name() {
    const std::string identity = processor_identity();
    const std::size_t at = identity.find("model name");
    if (at == std::string::npos) return "unknown processor";
    const std::size_t colon = identity.find(':', at), end = identity.find('\n', at);
    return colon < end ? identity.substr(colon + 2, end - colon - 2) : "unknown processor";
}

const std::map<std::string, std::string> captions = {
    {"work_precision",
     "Work against precision: each point is a whole run. Further right is more accurate, lower is faster."},
    {"error", "The error of the best ways to some accuracies, against time."},
    {"energy", "Their energy errors: bounded where steps are iterated to rounding."}};

const char* const style = R"(
body { font: 16px/1.5 "DejaVu Sans", sans-serif; color: #222; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
table { border-collapse: collapse; font-size: 0.85rem; } th, td { padding: 0.15rem 0.7rem; text-align: right; white-space: nowrap; border-bottom: 1px solid #ddd; }
th { white-space: normal; } td.text, th.text { text-align: left; } table.words td { white-space: normal; } figure { margin: 1.5rem 0; } img { max-width: 100%; } figcaption { color: #555; font-size: 0.9rem; }
pre { background: #f5f5f5; padding: 0.8rem; overflow-x: auto; font-size: 0.8rem; } .note { background: #fff3cd; padding: 0.6rem 0.8rem; }
)";

std::string front_rows(const Experiment& experiment) {
    std::string rows;
    const auto optional = [](double value) {
        return std::isfinite(value) ? fmt::format("{:.1e}", value) : std::string("–");
    };
    for (const Measurement& m : front_rows_of(experiment)) {
        const Candidate& c = m.candidate;
        rows += fmt::format(
            "<tr><td>{:.1e}</td><td>{:.3g}</td><td class=\"text\">{}</td><td>{:.4g}</td><td class=\"text\">{}</td>"
            "<td>{}</td><td>{:.2f}</td><td>{:.3g}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.4g}</td></tr>\n",
            m.error, m.seconds / experiment.until() * 1e9, c.name(), m.step, precision_name(c.member.precision),
            c.tolerance > 0 ? fmt::format("{:.0e}", c.tolerance) : "rounding", m.iterations,
            m.gradients / experiment.until(), optional(m.energy_error), optional(m.drift), optional(m.defect),
            m.reaches);
    }
    return rows;
}

}  // namespace

std::string report_page(const Experiment& experiment, const std::string& folder,
                        const std::vector<std::string>& pictures, const std::string& json) {
    const Scene& scene = experiment.scene();
    std::string figures, findings;
    for (const std::string& name : pictures)
        figures += fmt::format("<figure><img alt=\"{}\" src=\"{}\"><figcaption>{}</figcaption></figure>\n", name,
                               data_address(read_whole(folder + "/" + name + ".svg").value_or("")), captions.at(name));
    for (const Finding& finding : experiment.derivation().findings)
        findings +=
            fmt::format("<tr><td class=\"text\">{}</td><td class=\"text\">{}</td><td class=\"text\">{}</td></tr>\n",
                        escaped(finding.name), finding.holds ? "yes" : "no", escaped(finding.reason));
    // "</" inside data would end the script.
    std::string data;
    for (std::size_t i = 0; i < json.size(); ++i)
        data += json[i] == '<' ? std::string("\\u003c") : std::string(1, json[i]);
    return fmt::format(
        R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="generator" content="Lobatto">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}: speed and accuracy</title>
<style>{style}</style>
</head>
<body>
<h1>{title}: what accuracy costs</h1>
<p>To t = {until:.6g}. Errors of states are relative to the amplitude of the motion, errors of energy to the largest energy of motion.</p>
<p{note}>{reference}</p>
<h2>The best ways</h2>
<table><thead><tr><th>error</th><th>ns per unit of time</th><th class="text">method</th><th>step</th><th class="text">number type</th><th>iterated to</th>
<th>iterations per step</th><th>gradients per unit</th><th>energy error</th><th>drift</th><th>symplectic defect</th><th>followed until</th></tr></thead>
<tbody>
{front}</tbody></table>
{figures}<h2>The scene</h2>
<pre>{scene}</pre>
<h2>Its structure</h2>
<table class="words"><tbody>
{findings}</tbody></table>
<h2>The machine</h2>
<p>{machine}; one thread, processor time, the least of some repetitions. Kernels compiled by {compiler}.</p>
<h2>The data</h2>
<p>All {count} measurements are in this page, as JSON, in the element with the name "data".</p>
<script type="application/json" id="data">
{data}</script>
</body>
</html>
)",
        fmt::arg("title", escaped(scene.title.empty() ? scene.name : scene.title)), fmt::arg("style", style),
        fmt::arg("until", experiment.until()), fmt::arg("note", experiment.is_chaotic() ? " class=\"note\"" : ""),
        fmt::arg("reference", escaped(reference_text(experiment))), fmt::arg("front", front_rows(experiment)),
        fmt::arg("figures", figures), fmt::arg("scene", escaped(scene.source.content())),
        fmt::arg("findings", findings), fmt::arg("machine", escaped(processor_name())),
        fmt::arg("compiler", escaped(find_compiler(false).words.back())),
        fmt::arg("count", experiment.store().all().size()), fmt::arg("data", data));
}

}  // namespace lobatto

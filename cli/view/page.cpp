// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/view/page.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string_view>

#include "cli/print/embedded.hpp"

namespace lobatto {

namespace {

using Json = nlohmann::ordered_json;

constexpr double comfortable_period = 2, shortest_show = 8, longest_show = 600;  // seconds

std::string base64(const std::vector<std::uint8_t>& bytes) {
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (i + k < bytes.size() ? bytes[i + k] : 0);
        for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[group >> (18 - 6 * k) & 63];
    }
    return text;
}

template <class Word>
std::string packed(const std::vector<Word>& words) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(words.size() * sizeof(Word));
    for (const Word word : words)
        for (std::size_t k = 0; k < sizeof(Word); ++k) bytes.push_back(static_cast<std::uint8_t>(word >> (8 * k)));
    return base64(bytes);
}

Json json_of(const ViewChannel& channel) {
    const auto [least, most] = std::minmax_element(channel.begin(), channel.end());
    if (*least == *most) return *least;
    const double scale = 65535 / (*most - *least);
    std::vector<std::uint16_t> words;
    for (const double value : channel)
        words.push_back(static_cast<std::uint16_t>(std::lround((value - *least) * scale)));
    return {{"least", *least}, {"most", *most}, {"d", packed(words)}};
}

Json json_of(const ViewFigure& figure) {
    Json json{{"kind", figure.kind}, {"places", figure.places}, {"colour", figure.colour}};
    if (figure.trail) json["trail"] = true;
    if (figure.closed) json["closed"] = true;
    if (figure.still) json["still"] = true;
    if (figure.many) json["many"] = true;
    if (figure.kind == "circle") json["radius"] = figure.radius;
    return json;
}

Json json_of(const ViewMotion& motion) {
    std::vector<std::uint32_t> times;
    for (const double time : motion.times) times.push_back(std::bit_cast<std::uint32_t>(static_cast<float>(time)));
    Json channels = Json::array(), figures = Json::array(), curves = Json::object(), events = Json::array();
    for (const ViewChannel& channel : motion.channels) channels.push_back(json_of(channel));
    for (const ViewFigure& figure : motion.figures) figures.push_back(json_of(figure));
    for (const ViewCurve& curve : motion.curves) {
        curves[curve.name] = {{"label", curve.label}, {"y", curve.y}};
        if (!curve.is_over_time) curves[curve.name]["x"] = curve.x;
    }
    for (const ViewEvent& event : motion.events) events.push_back({{"t", event.time}, {"kind", event.kind}});
    return {{"label", motion.label}, {"note", motion.note}, {"times", packed(times)},
            {"channels", channels},  {"figures", figures},  {"profile", motion.is_profile},
            {"curves", curves},      {"events", events},    {"event_names", motion.event_names}};
}

// In a script element nothing may look like an end of it, or like a comment.
std::string in_script(std::string json) {
    std::string safe;
    for (const char c : json) {
        if (c == '<')
            safe += "\\u003c";
        else
            safe += c;
    }
    return safe;
}

std::string in_html(const std::string& text) {
    std::string safe;
    for (const char c : text)
        safe += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : c == '"' ? "&quot;" : std::string(1, c);
    return safe;
}

// Puts a text in the place of a mark, once. What was put in is not looked at again.
void put(std::string& page, std::size_t& from, const std::string& mark, std::string_view text) {
    const std::size_t at = page.find(mark, from);
    page.replace(at, mark.size(), text);
    from = at + text.size();
}

// How often a channel passes its mean, in a unit of time.
double crossings(const ViewChannel& channel, double duration) {
    const double mean = std::accumulate(channel.begin(), channel.end(), 0.0) / static_cast<double>(channel.size());
    long count = 0;
    for (std::size_t i = 1; i < channel.size(); ++i)
        if ((channel[i - 1] < mean) != (channel[i] < mean)) ++count;
    return static_cast<double>(count) / duration;
}

}  // namespace

double comfortable_rate(const std::vector<ViewMotion>& motions) {
    double fastest = 0, end = 0;
    for (const ViewMotion& motion : motions) {
        end = std::max(end, motion.times.back());
        for (const ViewFigure& figure : motion.figures)
            for (const auto& place : figure.places)
                for (const std::size_t channel : place)
                    if (end > 0) fastest = std::max(fastest, crossings(motion.channels[channel], motion.times.back()));
    }
    if (end == 0) return 1;
    const double rate = fastest > 0 ? 2 / (fastest * comfortable_period) : end / shortest_show;
    const double bounded = std::clamp(rate, end / longest_show, end / shortest_show);
    const double power = std::pow(10, std::floor(std::log10(bounded)));
    return power * (bounded / power < 2 ? 1 : bounded / power < 5 ? 2 : 5);
}

namespace {

std::string_view part_of_page(std::string_view name) {
    return std::find_if(page_texts.begin(), page_texts.end(), [&](const EmbeddedText& one) { return one.name == name; })
        ->text;
}

}  // namespace

std::string page_of(const std::string& title, const std::vector<ViewMotion>& motions,
                    const std::vector<ViewChart>& charts, double rate) {
    Json runs = Json::array(), drawn = Json::array();
    for (const ViewMotion& motion : motions) runs.push_back(json_of(motion));
    for (const ViewChart& chart : charts)
        drawn.push_back({{"title", chart.title}, {"curves", chart.curves}, {"phase", chart.phase}});
    const Json data{{"title", title}, {"rate", rate}, {"runs", runs}, {"charts", drawn}};
    std::string page(part_of_page("page.html"));
    std::size_t from = 0;
    put(page, from, "@TITLE@", in_html(title));
    put(page, from, "@STYLE@", part_of_page("page.css"));
    put(page, from, "@DATA@", in_script(data.dump(-1, ' ', false, Json::error_handler_t::replace)));
    put(page, from, "@SCRIPT@", part_of_page("page.js"));
    return page;
}

}  // namespace lobatto

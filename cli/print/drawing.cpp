// SPDX-License-Identifier: GPL-2.0-or-later
// Drawings through gnuplot.
#include "cli/print/drawing.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "runtime/build/process.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"
#include "runtime/files/scratch_folder.hpp"

namespace lobatto {

namespace {

// Colours that stay apart for every eye and in grey (Okabe and Ito).
const char* const style = R"(
set datafile separator ","
set border 3 lc rgb "#444444" lw 1.2
set tics nomirror out scale 0.6 tc rgb "#222222"
set grid lc rgb "#e4e4e4" lw 1 lt 1
set style line 1 lc rgb "#999999" lw 2
set style line 2 lc rgb "#0072b2" lw 2 pt 7 ps 0.75
set style line 3 lc rgb "#d55e00" lw 2 pt 8 ps 1.3
set style line 4 lc rgb "#009e73" lw 2 pt 4 ps 0.9
set style line 12 lc rgb "#0072b2" lw 2 dt 3
set style line 13 lc rgb "#d55e00" lw 2 dt 3
set style line 14 lc rgb "#009e73" lw 2 dt 3
set key outside top center horizontal maxrows 1 reverse Left samplen 2 width -1
)";

constexpr int not_found = 127;  // exit code of env

// What gnuplot makes of a script for one of its terminals. `path`: of the picture, for errors.
std::string drawn(const std::string& folder, const std::string& path, const std::string& terminal,
                  const std::string& script, const std::string& without) {
    const std::string otherwise = without.empty() ? elsewhere : without;
    const ScratchFolder workplace(folder + "/.lobatto-drawing-", "the picture", path, otherwise);
    write_whole(
        workplace / "script", "the picture's script",
        fmt::format("set terminal {}{}set output \"{}/picture\"\n{}", terminal, style, workplace.name(), script),
        otherwise);
    ProcessRequest request;
    request.arguments = {"/usr/bin/env", "gnuplot", workplace.name() + "/script"};
    request.folder = folder;
    request.environment = {{"LC_ALL", "C"}};
    const ProcessResult result = run_process(request);
    if (result.exit_code == not_found)
        throw MachineError(fmt::format("cannot draw {}: gnuplot is missing. Install it (apt install gnuplot-nox){}",
                                       path, without.empty() ? "" : ", or " + without));
    const std::string picture = read_whole(workplace / "picture").value_or("");
    // On a full disk gnuplot leaves a part of it, and is content.
    const bool is_whole = terminal.starts_with("svg")   ? picture.ends_with("</svg>\n\n")
                          : terminal.starts_with("png") ? picture.find("IEND") != std::string::npos
                                                        : !picture.empty();
    if (!result.succeeded() || !is_whole)
        throw MachineError(fmt::format("gnuplot could not draw {}: {}", path,
                                       !result.output.empty() ? result.output
                                       : result.succeeded()   ? "the picture is not whole. Is the disk full?"
                                                              : "no message"));
    return picture;
}

std::string svg_terminal(int width, int height) {
    return fmt::format("svg size {},{} dynamic font \"DejaVu Sans,15\" background rgb \"white\"", width, height);
}

}  // namespace

void draw(const std::string& folder, const std::string& name, const std::string& script, int width, int height,
          const std::string& without) {
    const std::string path = (std::filesystem::path(folder) / (name + ".svg")).string();
    write_whole(path, "the picture", drawn(folder, path, svg_terminal(width, height), script, without),
                without.empty() ? elsewhere : without);
}

void draw_picture(const std::string& path, const std::string& script, int width, int height) {
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    const std::string terminal = path.ends_with(".png")
                                     ? fmt::format("pngcairo size {},{} font \"DejaVu Sans,11\"", width, height)
                                     : svg_terminal(width, height);
    write_whole(path, "the picture", drawn(folder.empty() ? "." : folder.string(), path, terminal, script, ""));
}

std::string drawn_in_characters(const std::string& script, int columns, int rows) {
    return drawn(std::filesystem::temp_directory_path().string(), "in the terminal",
                 fmt::format("dumb size {},{}", columns, rows), script, "");
}

std::string gnuplot_text(const std::string& text) {
    std::string result = "'";
    for (const char c : text) {
        const bool is_control = static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
        // A line's end would end the text, and the rest be a command.
        result += c == '\'' ? "''" : std::string(1, is_control ? ' ' : c);
        if (result.ends_with("]]>")) result.insert(result.size() - 1, " ");  // gnuplot writes it as it is into an SVG
    }
    return result + "'";
}

}  // namespace lobatto

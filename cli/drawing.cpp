// SPDX-License-Identifier: GPL-2.0-or-later
// Drawings as SVG files, through gnuplot.
#include "cli/drawing.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "runtime/cache.hpp"
#include "runtime/error.hpp"
#include "runtime/process.hpp"

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

}  // namespace

void draw(const std::string& folder, const std::string& name, const std::string& script, int width, int height,
          const std::string& advice) {
    const std::string path = folder + "/" + name + ".gnuplot";
    write_file(path, fmt::format("set terminal svg size {},{} dynamic font \"DejaVu Sans,15\" background rgb "
                                 "\"white\"{}set output \"{}.svg\"\n{}",
                                 width, height, style, name, script));
    ProcessRequest request;
    request.arguments = {"/usr/bin/env", "gnuplot", name + ".gnuplot"};
    request.folder = folder;
    request.environment = {{"LC_ALL", "C"}};
    const ProcessResult result = run_process(request);
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    if (!result.succeeded())
        throw MachineError(fmt::format("gnuplot could not draw {}: {}{}", name,
                                       result.output.empty() ? "no message\n" : result.output, advice));
}

}  // namespace lobatto

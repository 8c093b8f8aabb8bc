// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto plot: the curves of trajectories and tables.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/plot/plot_script.hpp"
#include "cli/print/drawing.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/tell.hpp"
#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_panels = 6;
enum class Log { none, x, y, xy };

struct PlotCommand {
    std::vector<std::string> files;
    std::string x;               // empty: the first column
    std::vector<std::string> y;  // a panel each, "a,b" together
    Log log = Log::none;
    bool points = false, events = false, terminal = false;
    std::string output;
};

std::vector<std::string> names_in(const std::string& list) {
    std::vector<std::string> names;
    for (std::size_t begin = 0; begin <= list.size();) {
        std::size_t end = begin;  // a comma within brackets belongs to a name
        for (int depth = 0; end < list.size() && (list[end] != ',' || depth > 0); ++end)
            depth += list[end] == '[' ? 1 : list[end] == ']' ? -1 : 0;
        if (end > begin) names.push_back(list.substr(begin, end - begin));
        begin = end + 1;
    }
    if (names.empty()) throw InputError("--y: name a column, or several with commas, as in --y theta,H");
    return names;
}

// Whether a column is the coordinate `time` of a clock, and says again what x says.
bool repeats(const NumberTable& table, const NumberTable::Column& x, const NumberTable::Column& column) {
    if (!column.name.starts_with("time") || !table.has("p_" + column.name)) return false;
    double largest = 0;
    for (const double value : x.values) largest = std::fmax(largest, std::fabs(value));
    for (std::size_t i = 0; i < x.values.size(); ++i)
        if (!(std::fabs(column.values[i] - x.values[i]) <= 1e-9 * largest)) return false;
    return true;
}

// All but x and the momenta, a panel each, as far as there is room: the energy last.
std::vector<std::vector<std::string>> panels_of(const NumberTable& table, const std::string& x) {
    std::vector<std::vector<std::string>> panels;
    for (const NumberTable::Column& column : table.columns)
        if (column.name != x && !column.name.starts_with("p_") && column.name != "H" &&
            !repeats(table, table.column(x), column))
            panels.push_back({column.name});
    const bool has_energy = table.has("H") && x != "H";
    panels.resize(std::min(panels.size(), most_panels - (has_energy ? 1 : 0)));
    if (has_energy) panels.push_back({"H"});
    if (panels.empty())
        throw InputError(fmt::format("{}: beside {} there is nothing to draw; name columns with --y", table.path, x));
    return panels;
}

// run.csv: run.events.csv.
std::string events_beside(const std::string& path) {
    const std::filesystem::path file(path);
    return (file.parent_path() / file.stem()).string() + ".events.csv";
}

std::string plot_path(const PlotCommand& options) {
    const std::string path = output_path(options.output, result_name(options.files.front()) + ".svg");
    if (!path.ends_with(".svg") && !path.ends_with(".png"))
        throw InputError(fmt::format("-o: {} is neither a .svg nor a .png", path));
    for (const std::string& file : options.files) keep_scene(file, path);
    keep_foreign(path);
    return path;
}

void plot(const PlotCommand& options) {
    std::vector<NumberTable> tables, events;
    for (const std::string& file : options.files) {
        if (file.ends_with(".toml"))
            throw InputError(
                fmt::format("{} is a scene; `lobatto run {}` makes a trajectory, which can be plotted, and "
                            "`lobatto view {}` a page on which it moves",
                            file, file, file));
        tables.push_back(read_number_table(file));
        const std::string beside = events_beside(file);
        if (!options.events) continue;
        if (tables.back().kind == "sweep")
            throw InputError(
                fmt::format("--events: {} is the table of a sweep; the events of a run can be marked", file));
        if (!std::filesystem::exists(beside))
            throw InputError(fmt::format("--events: there is no {}; a run whose scene has events writes it", beside));
        events.push_back(read_number_table(beside, true));
        const std::string &origin = tables.back().origin, &other = events.back().origin;
        if (!origin.empty() && !other.empty() && origin != other)
            throw InputError(fmt::format("--events: {} is of another run than {} ({}not {}); run the scene again",
                                         beside, file, other, origin.substr(0, origin.size() - 2)));
    }
    PlotRequest request;
    request.x = options.x.empty() ? tables.front().columns.front().name : options.x;
    for (const std::string& list : options.y) request.y.push_back(names_in(list));
    if (request.y.empty()) request.y = panels_of(tables.front(), tables.front().column(request.x).name);
    if (request.y.size() > most_panels)
        throw InputError(fmt::format("--y: {} panels; at most {}: names with commas between share one",
                                     request.y.size(), most_panels));
    request.log_x = options.log == Log::x || options.log == Log::xy;
    request.log_y = options.log == Log::y || options.log == Log::xy;
    request.points = options.points;
    const std::vector<std::string> notes = left_out(tables, request);
    if (options.terminal) {
        winsize size{};
        const bool is_known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20;
        const int columns = is_known ? size.ws_col : 80, rows = is_known ? std::min<int>(size.ws_row - 2, 30) : 24;
        std::string text;
        for (const auto& panel : request.y) {
            PlotRequest one = request;
            one.y = {panel};
            text += drawn_in_characters(plot_script(tables, events, one, false), columns, std::max(rows, 12));
        }
        fmt::print("{}", text);
        for (const std::string& note : notes) tell("lobatto: warning: {}.\n", note);
        return;
    }
    const std::string path = plot_path(options);
    const int panels = static_cast<int>(request.y.size());
    draw_picture(path, plot_script(tables, events, request, true), 900, panels == 1 ? 560 : 120 + 210 * panels);
    print_row("picture", path);
    for (const std::string& note : notes) tell("lobatto: warning: {}.\n", note);
}

}  // namespace

void add_plot(CommandLine& program) {
    Command command =
        program.command("plot", "Draw the columns of trajectories and tables: SVG, PNG, or in the terminal");
    const auto options = std::make_shared<PlotCommand>();
    command.option("FILES", options->files, "What runs and sweeps wrote: .csv, .npy or .h5; several in one picture")
        .required();
    command.option("--x", options->x, "The column along the x axis (default: the first one)").shown_as("COLUMN");
    command.option("--y", options->y, "Columns of one panel, with commas between; repeated: one more panel")
        .one_value_each()
        .shown_as("COLUMNS");
    command.choice("--log", options->log, {{"x", Log::x}, {"y", Log::y}, {"xy", Log::xy}}, "Axes that are logarithmic")
        .shown_as("AXES");
    command.flag("--points", options->points, "Dots instead of lines");
    command.flag("--events", options->events, "Mark the events that stand in the file beside a run's");
    const Option output =
        command.option("-o,--output", options->output, "Picture, .svg or .png (default: out/NAME.svg)")
            .shown_as("FILE");
    command.flag("--terminal", options->terminal, "Draw in characters, on standard output").excludes(output);
    command.footer("Example:\n  lobatto run scenes/pendulum.toml\n  lobatto plot out/pendulum.csv --x q --y p_q");
    command.does([options] { plot(*options); });
}

}  // namespace lobatto

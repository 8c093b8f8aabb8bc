// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto merge: the parts of a sweep become its table.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/print/summary.hpp"
#include "cli/print/sweep_summary.hpp"
#include "cli/print/tell.hpp"
#include "cli/table/table_file.hpp"
#include "cli/table/table_reader.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

constexpr std::size_t rows_at_once = 4096;

struct MergeOptions {
    std::string output;
    std::vector<std::string> parts;
    bool quiet = false;
};

// The parts by their numbers: of one sweep, each once, none missing.
class Parts {
public:
    Parts(const std::vector<std::string>& paths, TableFormat format) : format_(format) {
        for (const std::string& path : paths) {
            refuse_interrupted(path);
            if (table_format(path) != format)
                throw InputError(
                    fmt::format("{}: parts and the table that is made of them have the same ending", path));
            const TableHead head = reader(path).head();
            if (!head.shard)
                throw InputError(fmt::format("{} is no part of a sweep: it was not written with --shard", path));
            if (by_number_.empty()) {
                head_ = head;
            } else {
                std::string what = difference(head_, head);
                if (what.empty() &&
                    (head.shard->of != head_.shard->of || head.shard->trajectories != head_.shard->trajectories))
                    what = fmt::format("shards of {} there, of {} here", head_.shard->of, head.shard->of);
                if (what.empty() && head.version != head_.version)
                    what = fmt::format("written by Lobatto {} there, {} here", head_.version, head.version);
                if (!what.empty())
                    throw InputError(
                        fmt::format("{} and {} are of different sweeps: {}", by_number_.begin()->second, path, what));
            }
            if (head.shard->compiled != head_.shard->compiled && rounds_otherwise_.empty()) rounds_otherwise_ = path;
            const auto [other, is_new] = by_number_.emplace(head.shard->number, path);
            if (!is_new)
                throw InputError(fmt::format("{} and {} are both shard {}/{}; leave one of both out", other->second,
                                             path, head.shard->number, head.shard->of));
        }
        require_all();
    }

    // The head of the whole table.
    TableHead head() const {
        TableHead whole = head_;
        whole.shard.reset();
        return whole;
    }
    std::size_t count() const { return by_number_.size(); }
    // A part that was not computed as the others were; empty: there is none.
    const std::string& rounds_otherwise() const { return rounds_otherwise_; }
    std::int64_t trajectories() const { return head_.shard->trajectories; }

    // All rows, in the order of the trajectories.
    void each_block(const std::function<void(const std::vector<TableCell>&, std::size_t rows)>& take) const {
        const std::size_t width = head_.columns.size();
        for (const auto& [number, path] : by_number_) {
            const Shard shard{number, head_.shard->of, head_.shard->trajectories, ""};
            TableReader part = reader(path);
            std::vector<TableCell> cells;
            std::int64_t next = shard.first();  // that may come
            std::int64_t taken = 0;             // rows
            for (std::size_t rows; (rows = part.read(cells, rows_at_once)) > 0;) {
                for (std::size_t row = 0; row < rows; ++row) {
                    const std::int64_t index = whole_in(cells[row * width]);
                    if (index == next)
                        ++next;
                    else if (index != next - 1 || next == shard.first())
                        throw InputError(
                            fmt::format("{} is damaged: trajectory {} stands where {} should", path, index, next));
                }
                taken += static_cast<std::int64_t>(rows);
                take(cells, rows);
            }
            if (next != shard.last())
                throw InputError(fmt::format("{} is not complete: it has {} of {}. Continue it with --resume", path,
                                             next - shard.first(),
                                             counted(shard.last() - shard.first(), "trajectory", "trajectories")));
            if (!part.rows_told())
                throw InputError(
                    fmt::format("{} is damaged: its last line, which says how many rows it has, is missing", path));
            if (*part.rows_told() != taken)
                throw InputError(fmt::format("{} is damaged: it has {}, and says that it has {}", path,
                                             counted(taken, "row", "rows"), *part.rows_told()));
        }
    }

private:
    TableReader reader(const std::string& path) const { return {path, format_, path + ".json"}; }

    // Until a part ends its rows stand in NAME.partial.
    static void refuse_interrupted(const std::string& path) {
        const std::string ending = ".partial";
        const bool is_named = path.ends_with(ending);
        const std::string left = is_named ? path : path + ending;
        if (!is_named && (std::filesystem::exists(path) || !std::filesystem::exists(left))) return;
        throw InputError(
            fmt::format("{} is of a sweep that goes on or was stopped; --resume continues it, and ends with {}", left,
                        left.substr(0, left.size() - ending.size())));
    }

    void require_all() const {
        constexpr std::size_t told = 20;
        std::vector<std::int64_t> missing;
        for (std::int64_t number = 1; number <= head_.shard->of; ++number)
            if (!by_number_.contains(number)) missing.push_back(number);
        if (missing.empty()) return;
        const std::size_t count = missing.size();
        missing.resize(std::min(count, told));
        throw InputError(fmt::format("{} of {} shards {} missing: {}{}. Compute {} with --shard {}/{} --resume{}",
                                     count, head_.shard->of, count == 1 ? "is" : "are", fmt::join(missing, ", "),
                                     count > told ? ", …" : "", count == 1 ? "it" : "them", missing.front(),
                                     head_.shard->of, count == 1 ? "" : " and so on"));
    }

    TableFormat format_;
    TableHead head_;
    std::map<std::int64_t, std::string> by_number_;
    std::string rounds_otherwise_;
};

// The column of the statuses: its name may end with underscores.
std::size_t status_column(const TableHead& head) {
    const auto is_status = [](const TableColumn& column) { return column.whole && column.name.starts_with("status"); };
    const auto found = std::find_if(head.columns.begin(), head.columns.end(), is_status);
    if (found == head.columns.end())
        throw InputError("the parts have no column of statuses: they are no tables of sweeps");
    return static_cast<std::size_t>(found - head.columns.begin());
}

void merge(const MergeOptions& options) {
    const TableFormat format = table_format(options.output);
    const Parts parts(options.parts, format);
    std::error_code none;
    for (const std::string& part : options.parts)
        if (std::filesystem::equivalent(part, options.output, none))
            throw InputError(fmt::format("{}: the table would overwrite this part; give it another name", part));
    keep_foreign(options.output);
    if (format == TableFormat::npy) keep_foreign(options.output + ".json");
    const TableHead head = parts.head();
    const std::size_t width = head.columns.size(), status = status_column(head);
    TableFile table(options.output, format, head);
    std::int64_t failed = 0;
    try {
        parts.each_block([&](const std::vector<TableCell>& cells, std::size_t rows) {
            for (std::size_t row = 0; row < rows; ++row) failed += whole_in(cells[row * width + status]) != 0;
            table.add(cells.data(), rows);
        });
        table.finish();
    } catch (...) {
        table.discard();
        throw;
    }
    if (!parts.rounds_otherwise().empty())
        tell(
            "lobatto: warning: {} was computed on another kind of processor, or by another compiler, than the first of "
            "the parts; last digits may differ from those of one process.\n",
            parts.rounds_otherwise());
    if (options.quiet || is_standard_output(options.output)) return;
    print_row("shards", fmt::format("{}", parts.count()));
    print_row("trajectories",
              fmt::format("{}{}", parts.trajectories(), failed == 0 ? "" : fmt::format(", {} failed", failed)));
    print_row("table", fmt::format("{}, {}", options.output, counted(table.rows(), "row", "rows")));
}

}  // namespace

void add_merge(CommandLine& program) {
    Command command = program.command("merge", "Make one table of the parts of a sweep that --shard divided");
    const auto options = std::make_shared<MergeOptions>();
    command.option("PARTS", options->parts, "All parts, in any order").required();
    command.option("-o,--output", options->output, "Table to write: .csv, .npy or .h5, as the parts are")
        .shown_as("FILE")
        .required();
    command.flag("--quiet", options->quiet, "Print nothing but warnings and errors");
    command.footer(
        "Example:\n  lobatto sweep scenes/pendulum.toml --vary q=0:3:100 --until 10 --shard 1/2 -o first.npy\n"
        "  lobatto sweep scenes/pendulum.toml --vary q=0:3:100 --until 10 --shard 2/2 -o second.npy\n"
        "  lobatto merge first.npy second.npy -o table.npy");
    command.does([options] { merge(*options); });
}

}  // namespace lobatto

// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/table/resumed_table.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "cli/table/table_reader.hpp"
#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

constexpr std::size_t rows_of_block = 4096;

bool is_there(const std::string& path, std::size_t bytes) {
    std::error_code none;
    return std::filesystem::is_regular_file(path, none) && std::filesystem::file_size(path, none) > bytes;
}

std::string shard_name(const TableHead& head) {
    return head.shard ? fmt::format("shard {}/{}", head.shard->number, head.shard->of) : "a whole sweep";
}

void require_same(const std::string& path, const TableHead& there, const TableHead& here) {
    std::string what = difference(there, here);
    if (what.empty() && there.shard && here.shard && there.shard->number == here.shard->number &&
        there.shard->of == here.shard->of && there.shard != here.shard)
        what = "it was computed on another kind of processor or by another compiler, which rounds otherwise";
    if (what.empty() && there.shard != here.shard)
        what = fmt::format("{} there, {} here", shard_name(there), shard_name(here));
    if (!what.empty())
        throw InputError(fmt::format(
            "{} belongs to another sweep: {}. Give that sweep's options, or run without --resume to start again", path,
            what));
}

// Goes through the rows of whole trajectories in their order.
class TrajectoriesOf {
public:
    TrajectoriesOf(const std::string& path, TableReader& reader, std::int64_t first)
        : path_(path), reader_(reader), next_(first) {}

    // `take`: rows of one trajectory. The last one is kept back.
    void each(const std::function<void(const TableCell* rows, std::size_t count)>& take) {
        const std::size_t width = reader_.head().columns.size();
        std::vector<TableCell> block, waiting;  // rows of trajectory next_
        std::int64_t begin = reader_.head_bytes();
        kept_bytes = begin;
        for (std::size_t count; (count = reader_.read(block, rows_of_block)) > 0;) {
            for (std::size_t row = 0; row < count; ++row) {
                const TableCell* const cells = block.data() + row * width;
                const std::int64_t index = whole_in(cells[0]);
                if (!waiting.empty() && index == next_ + 1) {
                    take(waiting.data(), waiting.size() / width);
                    kept_rows += static_cast<std::int64_t>(waiting.size() / width);
                    kept_bytes = begin;
                    waiting.clear();
                    ++next_;
                } else if (index != next_) {
                    throw MachineError(fmt::format(
                        "cannot continue with {}: trajectory {} follows where {} should. Run without --resume to start "
                        "again",
                        path_, index, next_));
                }
                waiting.insert(waiting.end(), cells, cells + width);
                begin = reader_.bytes_to(row);
            }
        }
    }

    std::int64_t next() const { return next_; }
    std::int64_t kept_rows = 0, kept_bytes = 0;

private:
    const std::string& path_;
    TableReader& reader_;
    std::int64_t next_;
};

}  // namespace

std::optional<ResumedTable> resume_table(const std::string& path, TableFormat format, const TableHead& head,
                                         std::int64_t first, const std::function<void(const TableCell*)>& see) {
    const std::size_t width = head.columns.size();
    const std::string partial = path + ".partial";
    const auto see_last = [&](const TableCell* rows, std::size_t count) { see(rows + (count - 1) * width); };
    // A process that was killed before it had written a row leaves nothing.
    const std::size_t least = format == TableFormat::csv ? csv_head(head).size() : npy_head(head.columns, 0).size();
    if (is_there(partial, least)) {
        // A process that was killed just before its end has already renamed NAME.partial.json to NAME.json.
        const std::string json = (is_there(partial + ".json", 0) ? partial : path) + ".json";
        TableReader reader(partial, format == TableFormat::h5 ? TableFormat::npy : format, json);
        require_same(partial, reader.head(), head);
        TrajectoriesOf trajectories(partial, reader, first);
        trajectories.each(see_last);
        const std::int64_t kept = trajectories.kept_rows == 0 ? 0 : trajectories.kept_bytes;
        return ResumedTable{std::make_unique<TableFile>(path, format, head, kept, trajectories.kept_rows),
                            trajectories.next()};
    }
    if (!is_there(path, 0)) return std::nullopt;
    TableReader reader(path, format, path + ".json");
    require_same(path, reader.head(), head);
    TrajectoriesOf trajectories(path, reader, first);
    auto table = std::make_unique<TableFile>(path, format, head);
    trajectories.each([&](const TableCell* rows, std::size_t count) {
        table->add(rows, count);
        see_last(rows, count);
    });
    return ResumedTable{std::move(table), trajectories.next()};
}

}  // namespace lobatto

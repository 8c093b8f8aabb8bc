// SPDX-License-Identifier: GPL-2.0-or-later
// The table of a sweep that was killed or interrupted, taken up again.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "cli/table/table_file.hpp"

namespace lobatto {

// A table to go on with, from trajectory `next` on.
struct ResumedTable {
    std::unique_ptr<TableFile> table;
    std::int64_t next = 0;
};

// What is left of the table `path` with this head, whose first trajectory is `first`: NAME.partial, or NAME itself.
// The last trajectory that is in it is left out, because some of its rows may be missing. `see`: told the last row of
// each other. Nothing where nothing is left. InputError where it belongs to another sweep, MachineError where it is
// damaged.
std::optional<ResumedTable> resume_table(const std::string& path, TableFormat format, const TableHead& head,
                                         std::int64_t first, const std::function<void(const TableCell*)>& see);

}  // namespace lobatto

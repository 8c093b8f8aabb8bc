// SPDX-License-Identifier: GPL-2.0-or-later
// The trajectory of a run: as CSV, which can be continued and holds numbers of any kind, or as a table.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/table/table_file.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

class TrajectoryOutput {
public:
    // `kept`: as TrajectoryFile; of CSV. Other formats have a column for each of the doubles that a number is a sum of.
    TrajectoryOutput(const std::string& path, TableFormat format, const Scene& scene, const TrajectoryHeader& header,
                     const Written& kept);

    void write(const Records& records);
    void finish();
    bool can_go_on() const { return text_ && text_->is_regular(); }
    void sync() { text_->sync(); }                        // of one that can go on
    Written written() const { return text_->written(); }  // likewise

private:
    std::optional<TrajectoryFile> text_;
    std::optional<TableFile> table_;
    std::size_t columns_ = 0, beside_ = 0;  // of a row: of the state, and after it
    std::size_t parts_ = 1;                 // of a number
    bool energy_ = false;
    std::vector<TableCell> cells_;
};

}  // namespace lobatto

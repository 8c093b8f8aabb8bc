// SPDX-License-Identifier: GPL-2.0-or-later
// Curves of tables as a script for gnuplot.
#pragma once

#include <string>
#include <vector>

#include "cli/plot/number_table.hpp"

namespace lobatto {

struct PlotRequest {
    std::string x;                            // a column
    std::vector<std::vector<std::string>> y;  // columns, those of one panel together
    bool log_x = false, log_y = false;
    bool points = false;  // dots instead of lines
};

// `events`: of each table, those beside it, or without columns. InputError: a column that is not there, or nothing that
// a logarithmic axis could show.
std::string plot_script(const std::vector<NumberTable>& tables, const std::vector<NumberTable>& events,
                        const PlotRequest& request, bool in_colour);

// What logarithmic axes leave out, a sentence for each curve: "a.csv: 3 of 5 rows of y over x are not drawn: ...".
std::vector<std::string> left_out(const std::vector<NumberTable>& tables, const PlotRequest& request);

}  // namespace lobatto

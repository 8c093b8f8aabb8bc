// SPDX-License-Identifier: GPL-2.0-or-later
// Tables of numbers that runs and sweeps have written, read back: CSV, NumPy's .npy, HDF5.
#pragma once

#include <string>
#include <vector>

namespace lobatto {

struct NumberTable {
    struct Column {
        std::string name, unit;  // the unit "" where it is not told
        std::vector<double> values;
    };
    std::string path;
    std::string title;  // of the scene, where the file tells it
    std::vector<Column> columns;
    std::string kind = {};    // "trajectory", "events", "sweep", likewise
    std::string origin = {};  // method, kernel and parameters of the run, likewise

    // The column of a name; x[3] is x_3. InputError with the names that there are.
    const Column& column(const std::string& name) const;
    // Whether there is one.
    bool has(const std::string& name) const;
};

// InputError where it cannot be read, or is no table of numbers: which line, and what stands there; also where it has
// no row, unless it `may_be_empty`.
NumberTable read_number_table(const std::string& path, bool may_be_empty = false);

}  // namespace lobatto

// SPDX-License-Identifier: GPL-2.0-or-later
// Starts in columns: a file of --starts, as CSV or as an array of NumPy.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

// `columns[c][i]`: what the column named `names[c]` says of row i; finite numbers in the units of the scene.
struct StartTable {
    std::string path;
    std::vector<std::string> names;
    std::vector<std::vector<double>> columns;
    std::int64_t rows = 0;
    std::string digest;  // of the file
};

// FILE.csv: lines with # are comments, then a line of names, then rows of numbers. FILE.npy: records with names, or two
// dimensions of n or 2n columns: the positions, then the velocities or momenta of the scene. A column "q(0)" is q, as
// tables of sweeps write it. InputError, with line and column in CSV, for anything else.
StartTable read_starts(const Scene& scene, const std::string& path);

}  // namespace lobatto

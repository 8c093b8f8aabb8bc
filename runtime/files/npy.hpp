// SPDX-License-Identifier: MIT
// Arrays of NumPy (.npy), read: numbers in one or two dimensions, and records with names.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace lobatto {

struct NpyArray {
    std::vector<std::size_t> shape;
    std::vector<std::string> names;            // of the columns of records; without records none
    std::vector<std::vector<double>> columns;  // each as long as the first dimension
};

// Of the bytes of a file: floats of 4 and 8 bytes, integers, truth values, little-endian. std::invalid_argument, which
// says why, for anything else, and where there are fewer bytes than the head says.
NpyArray read_npy(const std::string& bytes);

}  // namespace lobatto

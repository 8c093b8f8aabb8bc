// SPDX-License-Identifier: GPL-2.0-or-later
// Which coordinates act on one another: groups whose equations are solved together, in an order that keeps coupled ones
// near.
#pragma once

#include <cstddef>
#include <set>
#include <vector>

namespace lobatto {

struct Group {
    std::vector<int> coordinates;  // indices into the unknowns' coordinates, and after these into the constraints
    int bandwidth = 0;             // the largest distance in this order of two that are coupled
};

// Couplings between coordinates: who occurs in whose equations.
class Couplings {
public:
    explicit Couplings(std::size_t count) : neighbours_(count) {}
    void add(int a, int b);

    // Connected components, each in the order of Cuthill and McKee reversed: breadth first from a far end, neighbours
    // with few neighbours first.
    std::vector<Group> groups() const;

private:
    std::vector<int> breadth_first(int start) const;
    std::size_t degree(int k) const { return neighbours_[static_cast<std::size_t>(k)].size(); }
    int bandwidth(const std::vector<int>& order) const;

    std::vector<std::set<int>> neighbours_;
};

}  // namespace lobatto

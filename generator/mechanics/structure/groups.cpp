// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/structure/groups.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>

namespace lobatto {

void Couplings::add(int a, int b) {
    if (a == b) return;
    neighbours_[static_cast<std::size_t>(a)].insert(b);
    neighbours_[static_cast<std::size_t>(b)].insert(a);
}

std::vector<Group> Couplings::groups() const {
    std::vector<Group> result;
    std::vector<bool> known(neighbours_.size(), false);
    for (std::size_t first = 0; first < neighbours_.size(); ++first) {
        if (known[first]) continue;
        Group natural;
        natural.coordinates = breadth_first(static_cast<int>(first));
        for (const int k : natural.coordinates) known[static_cast<std::size_t>(k)] = true;
        Group ordered;
        ordered.coordinates = breadth_first(breadth_first(natural.coordinates.back()).back());
        std::reverse(ordered.coordinates.begin(), ordered.coordinates.end());
        std::sort(natural.coordinates.begin(), natural.coordinates.end());
        natural.bandwidth = bandwidth(natural.coordinates);
        ordered.bandwidth = bandwidth(ordered.coordinates);
        result.push_back(ordered.bandwidth < natural.bandwidth ? ordered : natural);
    }
    return result;
}

std::vector<int> Couplings::breadth_first(int start) const {
    std::vector<int> order{start};
    std::set<int> seen{start};
    for (std::size_t next = 0; next < order.size(); ++next) {
        const auto& here = neighbours_[static_cast<std::size_t>(order[next])];
        std::vector<int> fresh;
        for (const int k : here)
            if (seen.insert(k).second) fresh.push_back(k);
        std::stable_sort(fresh.begin(), fresh.end(), [&](int a, int b) { return degree(a) < degree(b); });
        order.insert(order.end(), fresh.begin(), fresh.end());
    }
    return order;
}

int Couplings::bandwidth(const std::vector<int>& order) const {
    std::map<int, int> place;
    for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = static_cast<int>(i);
    int widest = 0;
    for (const int k : order)
        for (const int other : neighbours_[static_cast<std::size_t>(k)])
            widest = std::max(widest, std::abs(place.at(k) - place.at(other)));
    return widest;
}

}  // namespace lobatto

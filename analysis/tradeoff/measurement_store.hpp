// SPDX-License-Identifier: GPL-2.0-or-later
// Measurements on disk: one line of JSON each, so that an interrupted run goes on where it was.
#pragma once

#include <fstream>
#include <map>
#include <string>

#include "analysis/tradeoff/candidate.hpp"

namespace lobatto {

class MeasurementStore {
public:
    using Key = decltype(std::declval<Candidate>().key());

    // Only in memory.
    MeasurementStore() = default;
    // Reads what the file holds when its first line has the same `subject`: what is measured, and on what machine. Else
    // it is begun anew; a torn last line is left out. MachineError when it cannot be written.
    MeasurementStore(const std::string& path, const std::string& subject);

    const Measurement* find(const Candidate& candidate) const;
    const Measurement& add(const Measurement& measurement);  // in place of an earlier one of the same candidate
    const std::map<Key, Measurement>& all() const { return measurements_; }
    std::size_t found() const { return found_; }  // in the file, when it was opened

private:
    std::map<Key, Measurement> measurements_;
    std::string path_;
    std::ofstream file_;
    std::size_t found_ = 0;
};

}  // namespace lobatto

// SPDX-License-Identifier: MIT
// Trajectories as CSV files that round-trip: every number is a text that reads back to the same bits, the shortest for
// double (runtime/files/decimal.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "runtime/files/checksum.hpp"
#include "runtime/files/partial_file.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// What the comment lines at the head of a file say. No dates, paths or machines: same scene, same bytes.
struct TrajectoryHeader {
    std::string scene;                                            // its title
    std::string method;                                           // "Lobatto, 4 points, h = 0.05"
    std::string kernel;                                           // digest
    std::vector<std::pair<std::string, std::string>> parameters;  // names and exact values
    std::vector<std::pair<std::string, std::string>>
        columns;         // names and units ("" when unknown): t, q.., p.. when they are kept, others, and H
    bool energy = true;  // whether the last column is H
    std::vector<std::string> events;  // of a file of events, whose first column counts them from 1: what they are
    int beside = 0;                   // columns before H that are not of the state: Records::beside
};

// The lines before the first row.
std::string text_of(const TrajectoryHeader& header);

// Rows go into a PartialFile as whole lines, block by block, so that a killed run leaves readable rows.
class TrajectoryFile {
public:
    // `kept`: what there is of an earlier file with this header, after which it goes on; nothing for a new one. All
    // functions throw MachineError, which names the path, when the machine refuses or the file was altered.
    TrajectoryFile(const std::string& path, const TrajectoryHeader& header, const Written& kept = {});

    // Rows may be longer than the file's: the momenta, which come last, are not kept then.
    void write(const Records& records);
    void write(const EventRecords& records);
    void finish() { file_.finish(); }
    void sync() { file_.sync(); }
    Written written() const { return checksum_.written(); }
    bool is_regular() const { return file_.is_regular(); }

private:
    void add_to_checksum(std::int64_t size);
    void append(const double* row, std::size_t count, int parts);
    void flush();

    PartialFile file_;
    Checksum checksum_;  // of all that is in it
    bool energy_ = true;
    std::size_t columns_ = 0, beside_ = 0;  // of a row: of the state, and after it
    std::string text_;
};

// The shortest text that reads back to the same double.
std::string exact_text(double value);
void append_number(std::string& text, double value);

}  // namespace lobatto

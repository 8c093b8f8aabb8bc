// SPDX-License-Identifier: MIT
// Rows as text, in whole blocks, and back.
#include "runtime/run/output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>

#include "runtime/error.hpp"
#include "runtime/files/decimal.hpp"

namespace lobatto {

void append_number(std::string& text, double value) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

std::string exact_text(double value) {
    std::string text;
    append_number(text, value);
    return text;
}

std::string text_of(const TrajectoryHeader& header) {
    std::string text =
        fmt::format("# lobatto {}\n# scene: {}\n# method: {}\n# kernel: {}\n",
                    header.events.empty() ? "trajectory" : "events", header.scene, header.method, header.kernel);
    const char* separator = "# parameters: ";
    for (const auto& [name, value] : header.parameters) {
        text += fmt::format("{}{} = {}", separator, name, value);
        separator = ", ";
    }
    if (!header.parameters.empty()) text += '\n';
    for (std::size_t i = 0; i < header.events.size(); ++i)
        text += fmt::format("# event {}: {}\n", i + 1, header.events[i]);
    separator = "# columns: ";
    for (const auto& [name, unit] : header.columns) {
        text += separator + (unit.empty() ? name : fmt::format("{} [{}]", name, unit));
        separator = ", ";
    }
    separator = "\n";
    for (const auto& [name, unit] : header.columns) {
        text += separator + name;
        separator = ",";
    }
    return text + '\n';
}

TrajectoryFile::TrajectoryFile(const std::string& path, const TrajectoryHeader& header, const Written& kept)
    : file_(path, "the trajectory", kept.size),
      energy_(header.energy),
      columns_(header.columns.size() - static_cast<std::size_t>(header.beside) - (header.energy ? 1 : 0)),
      beside_(static_cast<std::size_t>(header.beside)),
      text_(text_of(header)) {
    if (kept.size == 0) {
        flush();
    } else {
        add_to_checksum(kept.size);
        if (file_.read(0, text_.size()) != text_ || checksum_.written() != kept) {
            if (file_.is_copy()) file_.discard();
            throw MachineError(fmt::format(
                "cannot continue with the trajectory in {}: it is not what the run had written. Run without "
                "--resume to start again",
                file_.is_copy() ? path : file_.partial()));
        }
        text_.clear();
    }
}

// What stands in the file.
void TrajectoryFile::add_to_checksum(std::int64_t size) {
    constexpr std::int64_t block = 1 << 20;
    std::string bytes;
    for (std::int64_t at = 0; at < size; at += std::ssize(bytes)) {
        bytes = file_.read(at, static_cast<std::size_t>(std::min(block, size - at)));
        if (bytes.empty()) return;
        checksum_.add(bytes);
    }
}

void TrajectoryFile::write(const Records& records) {
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double *const rows = records.whole != nullptr ? records.whole : records.rows,
                            *const energy = records.whole != nullptr ? records.whole_energy : records.energy;
        append(rows + i * records.columns * records.parts, columns_, records.parts);
        if (beside_ > 0) {
            text_ += ',';
            append(records.beside + static_cast<std::size_t>(i * records.parts) * beside_, beside_, records.parts);
        }
        if (energy_) {
            text_ += ',';
            append(energy + i * records.parts, 1, records.parts);
        }
        text_ += '\n';
    }
    flush();
}

void TrajectoryFile::write(const EventRecords& records) {
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* const row =
            (records.whole != nullptr ? records.whole : records.rows) + i * records.columns * records.parts;
        append_number(text_, row[0] + 1);
        text_ += ',';
        append(row + records.parts, columns_ - 1, records.parts);
        text_ += '\n';
    }
    flush();
}

void TrajectoryFile::append(const double* row, std::size_t count, int parts) {
    for (std::size_t column = 0; column < count; ++column) {
        if (column > 0) text_ += ',';
        if (parts == 1)
            append_number(text_, row[column]);
        else
            text_ += decimal_text(row + column * static_cast<std::size_t>(parts), parts);
    }
}

void TrajectoryFile::flush() {
    file_.write(text_);
    checksum_.add(text_);
    text_.clear();
}

}  // namespace lobatto

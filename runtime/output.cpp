// SPDX-License-Identifier: MIT
// Writes rows in whole blocks with write(2), so that nothing waits in a buffer when the process is killed.
#include "runtime/output.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>

#include "runtime/error.hpp"

namespace lobatto {

namespace {

[[noreturn]] void fail(const std::string& path, int error) {
    const char* advice = error == ENOSPC || error == EDQUOT ? ". Free some space, or choose another place with -o"
                         : error == ENOENT ? ". Create its folder first, or choose another place with -o"
                         : error == EACCES || error == EROFS || error == EPERM || error == ENOTDIR || error == EISDIR
                             ? ". Choose another place with -o"
                             : "";
    throw MachineError(fmt::format("cannot write the trajectory to {}: {}{}", path, std::strerror(error), advice));
}

void append_number(std::string& text, double value) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

// A file that is ours alone: opened, locked, emptied.
int open_locked(const std::string& path) {
    while (true) {
        const int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
        if (descriptor < 0) fail(path, errno);
        if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
            const int error = errno;
            close(descriptor);
            if (error != EWOULDBLOCK) fail(path, error);
            throw MachineError(
                fmt::format("cannot write the trajectory to {}: another run is writing it. Wait for it, or choose "
                            "another place with -o",
                            path));
        }
        struct stat ours {
        }, named{};
        const bool same = fstat(descriptor, &ours) == 0 && stat(path.c_str(), &named) == 0 &&
                          ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
        if (same && ftruncate(descriptor, 0) == 0) return descriptor;
        const int error = errno;
        close(descriptor);
        if (same) fail(path, error);  // else another run has just finished it under its final name: open a new one
    }
}

}  // namespace

std::string exact_text(double value) {
    std::string text;
    append_number(text, value);
    return text;
}

TrajectoryFile::TrajectoryFile(const std::string& path, const TrajectoryHeader& header)
    : path_(path), energy_(header.energy), columns_(header.columns.size() - (header.energy ? 1 : 0)) {
    struct stat status {};
    if (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
        partial_ = path_;
        descriptor_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
        if (descriptor_ < 0) fail(path_, errno);
    } else {
        const std::unique_ptr<char, void (*)(void*)> target(realpath(path.c_str(), nullptr),
                                                            std::free);  // through symbolic links
        if (target) path_ = target.get();
        partial_ = path_ + ".partial";
        descriptor_ = open_locked(partial_);
    }
    text_ = fmt::format("# lobatto {}\n# scene: {}\n# method: {}\n# kernel: {}\n",
                        header.events.empty() ? "trajectory" : "events", header.scene, header.method, header.kernel);
    const char* separator = "# parameters: ";
    for (const auto& [name, value] : header.parameters) {
        text_ += fmt::format("{}{} = {}", separator, name, exact_text(value));
        separator = ", ";
    }
    if (!header.parameters.empty()) text_ += '\n';
    for (std::size_t i = 0; i < header.events.size(); ++i)
        text_ += fmt::format("# event {}: {}\n", i + 1, header.events[i]);
    separator = "# columns: ";
    for (const auto& [name, unit] : header.columns) {
        text_ += separator + (unit.empty() ? name : fmt::format("{} [{}]", name, unit));
        separator = ", ";
    }
    separator = "\n";
    for (const auto& [name, unit] : header.columns) {
        text_ += separator + name;
        separator = ",";
    }
    text_ += '\n';
    flush();
}

TrajectoryFile::~TrajectoryFile() {
    if (descriptor_ >= 0) close(descriptor_);
}

void TrajectoryFile::write(const Records& records) {
    for (std::int64_t i = 0; i < records.count; ++i) {
        append(records.rows + i * records.columns, columns_);
        if (energy_) {
            text_ += ',';
            append_number(text_, records.energy[i]);
        }
        text_ += '\n';
    }
    flush();
}

void TrajectoryFile::write(const EventRecords& records) {
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* row = records.rows + i * records.columns;
        append_number(text_, row[0] + 1);
        text_ += ',';
        append(row + 1, columns_ - 1);
        text_ += '\n';
    }
    flush();
}

void TrajectoryFile::append(const double* row, std::size_t count) {
    for (std::size_t column = 0; column < count; ++column) {
        if (column > 0) text_ += ',';
        append_number(text_, row[column]);
    }
}

void TrajectoryFile::finish() {
    if (partial_ != path_ && std::rename(partial_.c_str(), path_.c_str()) != 0) fail(path_, errno);
    const int descriptor = std::exchange(descriptor_, -1);
    if (close(descriptor) != 0) fail(path_, errno);
}

void TrajectoryFile::flush() {
    const char* begin = text_.data();
    std::size_t left = text_.size();
    while (left > 0) {
        const ssize_t written = ::write(descriptor_, begin, left);
        if (written < 0) {
            if (errno == EINTR) continue;
            fail(partial_, errno);
        }
        begin += written;
        left -= static_cast<std::size_t>(written);
    }
    text_.clear();
}

TrajectoryTable read_trajectory(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw MachineError(fmt::format("cannot read {}: {}", path, std::strerror(errno)));
    TrajectoryTable table;
    for (std::string line; std::getline(file, line) && !file.eof();) {
        if (line.starts_with("# ")) {
            table.comments.push_back(line.substr(2));
            continue;
        }
        const bool names = table.columns.empty();
        if (!names) table.rows.emplace_back();
        for (std::size_t begin = 0; begin <= line.size();) {
            const std::size_t end = std::min(line.find(',', begin), line.size());
            if (names) {
                table.columns.push_back(line.substr(begin, end - begin));
            } else {
                double value = 0;
                const auto read = std::from_chars(line.data() + begin, line.data() + end, value);
                if (read.ec != std::errc() || read.ptr != line.data() + end)
                    throw MachineError(fmt::format("{} is not a trajectory file: '{}' is not a number", path,
                                                   line.substr(begin, end - begin)));
                table.rows.back().push_back(value);
            }
            begin = end + 1;
        }
    }
    return table;
}

}  // namespace lobatto

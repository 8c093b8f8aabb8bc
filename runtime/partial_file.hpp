// SPDX-License-Identifier: MIT
// A file that appears under its name only when it is complete.
#pragma once

#include <string>
#include <string_view>

namespace lobatto {

// Until `finish` what is written stands in NAME.partial beside it, so that a killed run leaves a readable NAME.partial
// and an earlier NAME untouched. Two runs cannot write the same file at once. A destination that exists and is no
// regular file (a pipe, a device) is written to directly.
class PartialFile {
public:
    // `what` it holds, for errors: "the trajectory". All functions throw MachineError, which names the path, when the
    // machine refuses.
    PartialFile(const std::string& path, const std::string& what);
    ~PartialFile();  // without `finish`: NAME.partial stays
    PartialFile(const PartialFile&) = delete;
    PartialFile& operator=(const PartialFile&) = delete;

    bool is_regular() const { return partial_ != path_; }
    void write(std::string_view bytes);
    void write_at_begin(std::string_view bytes);  // over what is there; regular files only
    void finish();

private:
    [[noreturn]] void fail(const std::string& path, int error) const;
    int open_locked() const;

    std::string path_;     // the destination
    std::string partial_;  // what is being written; the same as path_ for a pipe or device
    std::string what_;
    int descriptor_ = -1;
};

}  // namespace lobatto

// SPDX-License-Identifier: MIT
// A new temporary folder, removed with its content by the destructor. Its name contains no text of a user.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "runtime/files/partial_file.hpp"

namespace lobatto {

class ScratchFolder {
public:
    // `prefix`: its path but for six letters. Throws as fail_to_write, which says the rest.
    ScratchFolder(const std::string& prefix, const std::string& what, const std::string& path,
                  const std::string& otherwise = elsewhere)
        : path_(prefix + "XXXXXX") {
        if (::mkdtemp(path_.data()) == nullptr) fail_to_write(what, path, errno, otherwise);
    }
    ~ScratchFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;

    const std::string& path() const { return path_; }
    std::string name() const { return std::filesystem::path(path_).filename(); }
    std::string operator/(const std::string& file) const { return path_ + "/" + file; }

private:
    std::string path_;
};

}  // namespace lobatto

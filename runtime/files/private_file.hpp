// SPDX-License-Identifier: MIT
// Files that no stranger can write to: what a program may take for its own.
#pragma once

#include <string>

struct stat;

namespace lobatto {

// A group of one's own is no stranger: with umask 002 it can write what one writes.
enum class Writers { owner, owner_and_own_group };

bool strangers_can_write(const struct stat& status, Writers writers);

struct PrivateFile {
    int error = 0;            // errno, where it cannot be opened or read
    bool is_private = false;  // a regular file that only we can write to
    bool is_whole = false;    // all of it was read
    std::string content;
};
PrivateFile read_private_file(const std::string& path, Writers writers);

}  // namespace lobatto

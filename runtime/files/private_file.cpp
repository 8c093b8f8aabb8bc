// SPDX-License-Identifier: MIT
#include "runtime/files/private_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>

namespace lobatto {

bool strangers_can_write(const struct stat& status, Writers writers) {
    const bool trusts_group = writers == Writers::owner_and_own_group && status.st_gid == ::getegid();
    return (status.st_mode & (trusts_group ? S_IWOTH : S_IWGRP | S_IWOTH)) != 0;
}

PrivateFile read_private_file(const std::string& path, Writers writers) {
    PrivateFile file;
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) {
        file.error = errno;
        return file;
    }
    struct stat status {};
    if (::fstat(descriptor, &status) != 0) {
        file.error = errno;
    } else if (S_ISREG(status.st_mode) && status.st_uid == ::geteuid() && !strangers_can_write(status, writers)) {
        file.is_private = true;
        file.content.resize(static_cast<std::size_t>(status.st_size));
        std::size_t done = 0;
        while (done < file.content.size()) {
            const ssize_t count = ::read(descriptor, file.content.data() + done, file.content.size() - done);
            if (count < 0 && errno == EINTR) continue;
            if (count < 0) file.error = errno;
            if (count <= 0) break;
            done += static_cast<std::size_t>(count);
        }
        file.is_whole = done == file.content.size();
        file.content.resize(done);
    }
    ::close(descriptor);
    return file;
}

}  // namespace lobatto

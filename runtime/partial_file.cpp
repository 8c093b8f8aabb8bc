// SPDX-License-Identifier: MIT
// Writes with write(2), so that nothing waits in a buffer when the process is killed.
#include "runtime/partial_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>

#include "runtime/error.hpp"

namespace lobatto {

PartialFile::PartialFile(const std::string& path, const std::string& what) : path_(path), what_(what) {
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
        descriptor_ = open_locked();
    }
}

PartialFile::~PartialFile() {
    if (descriptor_ >= 0) close(descriptor_);
}

void PartialFile::fail(const std::string& path, int error) const {
    const char* advice = error == ENOSPC || error == EDQUOT ? ". Free some space, or choose another place with -o"
                         : error == ENOENT ? ". Create its folder first, or choose another place with -o"
                         : error == EACCES || error == EROFS || error == EPERM || error == ENOTDIR || error == EISDIR
                             ? ". Choose another place with -o"
                             : "";
    throw MachineError(fmt::format("cannot write {} to {}: {}{}", what_, path, std::strerror(error), advice));
}

// The partial file, ours alone: opened, locked, emptied.
int PartialFile::open_locked() const {
    while (true) {
        const int descriptor = open(partial_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
        if (descriptor < 0) fail(partial_, errno);
        if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
            const int error = errno;
            close(descriptor);
            if (error != EWOULDBLOCK) fail(partial_, error);
            throw MachineError(fmt::format(
                "cannot write {} to {}: another run is writing it. Wait for it, or choose another place with -o", what_,
                partial_));
        }
        struct stat ours {
        }, named{};
        const bool same = fstat(descriptor, &ours) == 0 && stat(partial_.c_str(), &named) == 0 &&
                          ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
        if (same && ftruncate(descriptor, 0) == 0) return descriptor;
        const int error = errno;
        close(descriptor);
        if (same) fail(partial_, error);  // else another run has just finished it under its final name: open a new one
    }
}

void PartialFile::write(std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
        if (written < 0) {
            if (errno == EINTR) continue;
            fail(partial_, errno);
        }
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
}

void PartialFile::write_at_begin(std::string_view bytes) {
    for (std::size_t done = 0; done < bytes.size();) {
        const ssize_t written =
            ::pwrite(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(done));
        if (written < 0 && errno != EINTR) fail(partial_, errno);
        if (written > 0) done += static_cast<std::size_t>(written);
    }
}

void PartialFile::finish() {
    if (partial_ != path_ && std::rename(partial_.c_str(), path_.c_str()) != 0) fail(path_, errno);
    const int descriptor = std::exchange(descriptor_, -1);
    if (close(descriptor) != 0) fail(path_, errno);
}

}  // namespace lobatto

// SPDX-License-Identifier: MIT
// Writes with write(2), so that nothing waits in a buffer when the process is killed.
#include "runtime/files/partial_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "runtime/error.hpp"

namespace lobatto {

namespace {

// While it lives, a pipe whose reader has gone is an error of write(2) and not a signal.
class NoPipeSignal {
public:
    NoPipeSignal() {
        sigemptyset(&signal_);
        sigaddset(&signal_, SIGPIPE);
        pthread_sigmask(SIG_BLOCK, &signal_, &before_);
    }
    ~NoPipeSignal() {
        const timespec at_once{};
        if (sigismember(&before_, SIGPIPE) == 0) sigtimedwait(&signal_, nullptr, &at_once);
        pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    NoPipeSignal(const NoPipeSignal&) = delete;
    NoPipeSignal& operator=(const NoPipeSignal&) = delete;

private:
    sigset_t signal_{}, before_{};
};

// Whether a file holds something else than what a killed run leaves: the beginning of a table, as text or of NumPy's.
bool is_foreign(int descriptor) {
    const std::string_view text = "# lobatto", numpy = "\x93NUMPY";
    char begin[16];
    const ssize_t count = ::pread(descriptor, begin, sizeof begin, 0);
    const std::string_view there(begin, count < 0 ? 0 : static_cast<std::size_t>(count));
    return !there.empty() && !there.starts_with(text) && !there.starts_with(numpy);
}

// Through symbolic links, also to where there is nothing yet.
std::filesystem::path behind_links(std::filesystem::path path) {
    constexpr int most = 40;
    std::error_code none;
    for (int i = 0; i < most && std::filesystem::is_symlink(path, none); ++i)
        path = path.parent_path() / std::filesystem::read_symlink(path, none);
    const std::filesystem::path there = std::filesystem::canonical(path, none);
    return none ? path : there;
}

// A new file may be read by whom the old one could be.
mode_t mode_of(const std::string& path) {
    struct stat status {};
    return stat(path.c_str(), &status) == 0 ? status.st_mode & 0666 : 0666;
}

}  // namespace

bool is_standard_output(const std::string& path) {
    return path == standard_output || path == "/dev/stdout" || path == "/dev/fd/1" || path == "/proc/self/fd/1";
}

std::optional<std::string> read_whole(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) return std::nullopt;
    std::error_code none;
    if (std::filesystem::is_directory(path, none)) {
        errno = EISDIR;
        return std::nullopt;
    }
    std::string content(std::istreambuf_iterator<char>(file), {});
    return file.bad() ? std::nullopt : std::optional(std::move(content));
}

void fail_to_write(const std::string& what, const std::string& path, int error, const std::string& otherwise) {
    std::string only = otherwise;
    only[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(only[0])));
    const std::string advice =
        error == ENOSPC || error == EDQUOT ? ". Free some space, or " + otherwise
        : error == EFBIG  ? ". Files may not be larger than `ulimit -f` says; raise it, or " + otherwise
        : error == EPIPE  ? ". Its reader has gone"
        : error == ENOENT ? ". Create its folder first, or " + otherwise
        : error == EACCES || error == EROFS || error == EPERM || error == ENOTDIR || error == EISDIR ? ". " + only
                                                                                                     : "";
    throw MachineError(fmt::format("cannot write {} to {}: {}{}", what, path, std::strerror(error), advice));
}

void write_whole(const std::string& path, const std::string& what, std::string_view content,
                 const std::string& otherwise) {
    PartialFile file(path, what, 0, otherwise, PartialFile::Place::free);
    try {
        file.write(content);
        if (file.is_regular()) file.sync();
        file.finish();
    } catch (const MachineError&) {
        file.discard();
        throw;
    }
}

PartialFile::PartialFile(const std::string& path, const std::string& what, std::int64_t kept,
                         const std::string& otherwise, Place place)
    : path_(path), what_(what), otherwise_(otherwise) {
    struct stat status {};
    if (is_standard_output(path)) {
        partial_ = path_ = "standard output";
        descriptor_ = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0);
        if (descriptor_ < 0) fail(path_, errno);
    } else if (stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
        partial_ = path_;
        descriptor_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
        if (descriptor_ < 0) fail(path_, errno);
    } else {
        path_ = behind_links(path);
        partial_ = path_ + ".partial";
        descriptor_ = place == Place::free ? open_free() : open_locked();
        keep(kept);
    }
}

PartialFile::~PartialFile() {
    if (descriptor_ >= 0) close(descriptor_);
}

void PartialFile::fail(const std::string& path, int error) const {
    fail_to_write(what_, path, error, otherwise_);
}

// The partial file, ours alone: opened and locked.
int PartialFile::open_locked() const {
    const mode_t mode = mode_of(path_);
    while (true) {
        const int descriptor = open(partial_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, mode);
        if (descriptor < 0) fail(partial_, errno);
        if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
            const int error = errno;
            close(descriptor);
            if (error != EWOULDBLOCK) fail(partial_, error);
            throw MachineError(fmt::format("cannot write {} to {}: another run is writing it. Wait for it, or {}",
                                           what_, partial_, otherwise_));
        }
        struct stat ours {
        }, named{};
        const bool same = fstat(descriptor, &ours) == 0 && stat(partial_.c_str(), &named) == 0 &&
                          ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
        if (same) {
            if (is_foreign(descriptor)) {
                close(descriptor);
                throw MachineError(
                    fmt::format("cannot write {} to {}: {} is there, and Lobatto did not write it. Move it "
                                "away, or {}",
                                what_, path_, partial_, otherwise_));
            }
            return descriptor;
        }
        close(descriptor);  // another run has just finished it under its final name: open a new one
    }
}

int PartialFile::open_free() {
    const mode_t mode = mode_of(path_);
    const std::string first = partial_;
    for (int number = 1;; ++number) {
        const int descriptor = open(partial_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode);
        if (descriptor >= 0) return descriptor;
        if (errno != EEXIST || number > 1000) fail(partial_, errno);
        partial_ = first + "." + std::to_string(number);
    }
}

void PartialFile::fail_as_short(const std::string& path) const {
    throw MachineError(fmt::format(
        "cannot continue with {} in {}: it is shorter than the run had written it. Run without --resume", what_, path));
}

// The first `kept` bytes of the partial file or, when it is new, of the destination; nothing after them.
void PartialFile::keep(std::int64_t kept) {
    struct stat status {};
    if (fstat(descriptor_, &status) != 0) fail(partial_, errno);
    if (status.st_size > 0 && status.st_size < kept) fail_as_short(partial_);
    if (status.st_size < kept) {
        const int source = open(path_.c_str(), O_RDONLY | O_CLOEXEC);
        char block[65536];
        std::int64_t copied = 0;
        while (source >= 0 && copied < kept) {
            const ssize_t count = ::pread(source, block, sizeof block, copied);
            if (count <= 0) break;
            if (::pwrite(descriptor_, block, static_cast<std::size_t>(count), copied) != count) break;
            copied += count;
        }
        if (source >= 0) close(source);
        if (copied < kept) {
            discard();
            fail_as_short(path_);
        }
        is_copy_ = true;
    }
    if (ftruncate(descriptor_, kept) != 0 || lseek(descriptor_, kept, SEEK_SET) != kept) fail(partial_, errno);
    size_ = kept;
}

void PartialFile::write(std::string_view bytes) {
    const NoPipeSignal guard;
    const std::int64_t size = size_ + static_cast<std::int64_t>(bytes.size());
    while (!bytes.empty()) {
        const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
        if (written < 0) {
            if (errno == EINTR) continue;
            const int error = errno;
            if (is_regular() && ftruncate(descriptor_, size_) == 0) lseek(descriptor_, size_, SEEK_SET);
            fail(partial_, error);
        }
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    size_ = size;
}

std::string PartialFile::read(std::int64_t offset, std::size_t count) const {
    std::string bytes(count, '\0');
    const ssize_t done = ::pread(descriptor_, bytes.data(), count, offset);
    bytes.resize(done < 0 ? 0 : static_cast<std::size_t>(done));
    return bytes;
}

void PartialFile::sync() {
    if (fdatasync(descriptor_) != 0) fail(partial_, errno);
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

void PartialFile::discard() {
    if (is_regular()) unlink(partial_.c_str());
}

}  // namespace lobatto

// SPDX-License-Identifier: MIT
#include "runtime/build/cache.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <set>

#include "runtime/build/compile.hpp"
#include "runtime/build/sha256.hpp"
#include "runtime/error.hpp"
#include "runtime/files/private_file.hpp"

namespace lobatto {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& action, const std::string& path, int error) {
    throw MachineError(
        fmt::format("cannot {} {}: {}; make room or give permission there, or name another folder in the "
                    "environment variable LOBATTO_CACHE_DIR",
                    action, path, std::strerror(error)));
}

void rename_file(const std::string& from, const std::string& to) {
    if (::rename(from.c_str(), to.c_str()) != 0) fail("write", to, errno);
}

// The seal of an object, which stands before the key text.
std::string seal_of(const std::string& object) {
    return fmt::format("object: {} bytes, SHA-256 {}\n", object.size(), sha256(object));
}

std::string configured_folder() {
    const auto variable = [](const char* name) {
        const char* value = std::getenv(name);
        return std::string(value == nullptr ? "" : value);
    };
    if (const std::string folder = variable("LOBATTO_CACHE_DIR"); !folder.empty()) return fs::absolute(folder);
    if (const std::string folder = variable("XDG_CACHE_HOME"); folder.starts_with('/')) return folder + "/lobatto";
    std::string home = variable("HOME");
    if (home.empty()) {
        const passwd* user = ::getpwuid(::geteuid());
        if (user == nullptr || user->pw_dir == nullptr) {
            throw MachineError(
                "no folder for compiled kernels: neither LOBATTO_CACHE_DIR, XDG_CACHE_HOME nor HOME is set and the "
                "user has "
                "no home; name a folder in the environment variable LOBATTO_CACHE_DIR");
        }
        home = user->pw_dir;
    }
    return home + "/.cache/lobatto";
}

// An open lock on STEM.lock, or -1 when `wait` is false and another holds it, or it is no file of ours. Locks are
// removed by their holders, so the file that was locked may no longer be the one in the folder: then try again.
int lock_stem(const std::string& stem, bool wait) {
    const std::string path = stem + ".lock";
    while (true) {
        const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
        if (descriptor < 0 && !wait) return -1;  // what cannot be locked is left alone
        if (descriptor < 0) fail("create", path, errno);
        while (::flock(descriptor, wait ? LOCK_EX : LOCK_EX | LOCK_NB) != 0) {
            const int error = errno;
            if (error == EINTR) continue;
            ::close(descriptor);
            if (error == EWOULDBLOCK) return -1;
            fail("lock", path, error);
        }
        struct stat locked, present;
        if (::fstat(descriptor, &locked) == 0 && ::stat(path.c_str(), &present) == 0 &&
            locked.st_ino == present.st_ino) {
            return descriptor;
        }
        ::close(descriptor);
    }
}

// Removes the building folders of an entry, whose lock is held.
void remove_buildings(const fs::path& stem) {
    std::error_code ignored;
    for (const auto& file : fs::directory_iterator(stem.parent_path(), ignored)) {
        if (file.path().extension() == ".building" && file.path().stem().stem() == stem.filename()) {
            fs::remove_all(file.path(), ignored);
        }
    }
}

void unlock_stem(const std::string& stem, int descriptor) {
    remove_buildings(stem);
    ::unlink((stem + ".lock").c_str());
    ::close(descriptor);
}

// Removes what killed builders left: locks that nobody holds, and building folders whose lock nobody holds.
void evict(const fs::path& folder) {
    std::error_code ignored;
    std::set<fs::path> stems;
    for (const auto& file : fs::directory_iterator(folder, ignored)) {
        if (file.path().extension() == ".lock") stems.insert(file.path().stem());
        if (file.path().extension() == ".building") stems.insert(file.path().stem().stem());
    }
    for (const fs::path& stem : stems) {
        const int descriptor = lock_stem(folder / stem, false);
        if (descriptor >= 0) unlock_stem(folder / stem, descriptor);
    }
}

[[noreturn]] void fail_untrusted(const fs::path& folder, const std::string& reason, const std::string& mend) {
    throw MachineError(
        fmt::format("the folder {} cannot be trusted with programs to run: {}; {}, or name another folder in the "
                    "environment variable LOBATTO_CACHE_DIR",
                    folder.string(), reason, mend));
}

// Who may write to a folder may put another in the place of what is in it, unless its sticky bit forbids that.
void check_parent(const fs::path& folder, const fs::path& parent) {
    struct stat link, status;
    if (::lstat(parent.c_str(), &link) != 0 || ::stat(parent.c_str(), &status) != 0) fail("read", parent, errno);
    const auto is_foreign = [](uid_t user) { return user != 0 && user != ::geteuid(); };
    if (is_foreign(link.st_uid) || is_foreign(status.st_uid))
        fail_untrusted(folder, parent.string() + " belongs to another user", "make that yours (chown)");
    if (S_ISDIR(status.st_mode) && strangers_can_write(status, Writers::owner_and_own_group) &&
        (status.st_mode & S_ISVTX) == 0)
        fail_untrusted(folder, "other users may rename what is in " + parent.string(),
                       "take their permission to write there (chmod go-w)");
}

}  // namespace

std::string cache_folder() {
    fs::path folder = configured_folder();
    if (!folder.has_filename()) folder = folder.parent_path();  // a/b/ is a/b
    fs::path part;
    for (const fs::path& name : folder) {
        part /= name;
        if (::mkdir(part.c_str(), 0700) != 0) {
            const int error = errno;
            std::error_code ignored;
            if (error != EEXIST && error != EISDIR && !fs::is_directory(part, ignored))
                fail("create the folder", folder, error);
        }
        if (part != folder) check_parent(folder, part);
    }
    struct stat link, status;
    if (::lstat(folder.c_str(), &link) != 0 || ::stat(folder.c_str(), &status) != 0) fail("read", folder, errno);
    if (!S_ISDIR(status.st_mode)) fail("use", folder, ENOTDIR);
    const char* reason = nullptr;
    if (link.st_uid != ::geteuid() || status.st_uid != ::geteuid())
        reason = "it belongs to another user";
    else if (strangers_can_write(status, Writers::owner))
        reason = "other users may write to it";
    if (reason != nullptr) fail_untrusted(folder, reason, "make it yours alone (chmod 700)");
    // Behind links the folder has other parents than those of its name.
    for (fs::path parent = fs::canonical(folder).parent_path();; parent = parent.parent_path()) {
        check_parent(folder, parent);
        if (parent == parent.root_path()) break;
    }
    if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) ::chmod(folder.c_str(), status.st_mode & S_IRWXU);
    return folder;
}

void write_file(const std::string& path, const std::string& content) {
    const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (descriptor < 0) fail("create", path, errno);
    std::size_t done = 0;
    int error = 0;
    while (done < content.size() && error == 0) {
        const ssize_t count = ::write(descriptor, content.data() + done, content.size() - done);
        if (count >= 0)
            done += std::size_t(count);
        else if (errno != EINTR)
            error = errno;
    }
    if (error == 0 && ::fsync(descriptor) != 0) error = errno;
    ::close(descriptor);
    if (error != 0) fail("write", path, error);
}

CacheEntry::CacheEntry(const std::string& name, std::string key, std::string ending)
    : stem_(fmt::format("{}/{}-{}", cache_folder(), name, sha256(key).substr(0, 32))),
      key_(std::move(key)),
      ending_(std::move(ending)) {}

std::string CacheEntry::building_path() const {
    return fmt::format("{}.{}.building", stem_, ::getpid());
}

bool CacheEntry::is_valid() const {
    return valid_object().has_value();
}

std::optional<std::string> CacheEntry::valid_object() const {
    const PrivateFile sealed_key = read_private_file(stem_ + ".key", Writers::owner);
    PrivateFile object = read_private_file(object_path(), Writers::owner);
    if (!sealed_key.is_private || !object.is_private || sealed_key.content != seal_of(object.content) + key_)
        return std::nullopt;
    return std::move(object.content);
}

bool CacheEntry::is_there() const {
    std::error_code ignored;
    return fs::exists(fs::symlink_status(object_path(), ignored)) &&
           fs::exists(fs::symlink_status(stem_ + ".key", ignored));
}

void CacheEntry::publish(const std::string& file) const {
    const std::string built = building_path() + "/" + file;
    ::chmod(built.c_str(), 0700);  // whatever the umask was
    const PrivateFile object = read_private_file(built, Writers::owner);
    if (!object.is_whole) fail("read", built, object.error != 0 ? object.error : EPERM);
    const int descriptor = ::open(built.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0 || ::fsync(descriptor) != 0) fail("write", built, errno);
    ::close(descriptor);
    // The key last: until it is there, the object is not valid.
    write_file(building_path() + "/key", seal_of(object.content) + key_);
    // A folder in the place of either cannot be replaced by a file.
    std::error_code ignored;
    for (const std::string& path : {object_path(), stem_ + ".key"})
        if (fs::is_directory(fs::symlink_status(path, ignored))) fs::remove_all(path, ignored);
    rename_file(built, object_path());
    rename_file(building_path() + "/key", stem_ + ".key");
    fs::remove_all(failed_path(), ignored);
}

void CacheEntry::keep_failure() const {
    std::error_code ignored;
    fs::remove_all(failed_path(), ignored);
    rename_file(building_path(), failed_path());
}

CacheEntry::Lock::Lock(const CacheEntry& entry) : stem_(entry.stem_), descriptor_(lock_stem(stem_, true)) {
    evict(fs::path(stem_).parent_path());
    remove_buildings(stem_);
    if (::mkdir(entry.building_path().c_str(), 0700) != 0) {
        const int error = errno;
        unlock_stem(stem_, descriptor_);
        fail("create", entry.building_path(), error);
    }
}

CacheEntry::Lock::~Lock() {
    unlock_stem(stem_, descriptor_);
}

}  // namespace lobatto

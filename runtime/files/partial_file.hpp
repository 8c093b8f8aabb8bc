// SPDX-License-Identifier: MIT
// A file that appears under its name only when it is complete.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lobatto {

inline const char* const standard_output = "-";    // as a path
bool is_standard_output(const std::string& path);  // that, and what stands for the same
inline const char* const elsewhere = "choose another place with -o";

// MachineError: "cannot write `what` to PATH: No space left on device. Free some space, or `otherwise`".
[[noreturn]] void fail_to_write(const std::string& what, const std::string& path, int error,
                                const std::string& otherwise = elsewhere);

// A whole file at once: on the disk under its name, or not at all and nothing beside it. Throws as PartialFile.
void write_whole(const std::string& path, const std::string& what, std::string_view content,
                 const std::string& otherwise = elsewhere);

// All of a file; nothing where it cannot be read, and errno says why.
std::optional<std::string> read_whole(const std::string& path);

// Until `finish` what is written stands in NAME.partial beside it, so that a killed run leaves a readable NAME.partial
// and an earlier NAME untouched. Two runs cannot write the same file at once. A destination that exists and is no
// regular file (a pipe, a device), and standard output, "-", is written to directly. A NAME.partial that is not of
// Lobatto's making is never touched: MachineError.
class PartialFile {
public:
    // Whether it goes on with what a killed run left in NAME.partial, or takes the first NAME.partial, NAME.partial.1
    // ... that is free.
    enum class Place { resumable, free };
    // `what` it holds and what one can do `otherwise`, for errors: "the trajectory". `kept`: how many bytes of
    // NAME.partial, or else of NAME, stay, to go on after them. All functions throw MachineError, which names the path,
    // when the machine refuses; what stands in the file then ends where a `write` ended.
    PartialFile(const std::string& path, const std::string& what, std::int64_t kept = 0,
                const std::string& otherwise = elsewhere, Place place = Place::resumable);
    ~PartialFile();  // without `finish` or `discard`: NAME.partial stays
    PartialFile(const PartialFile&) = delete;
    PartialFile& operator=(const PartialFile&) = delete;

    bool is_regular() const { return partial_ != path_; }
    std::int64_t size() const { return size_; }
    bool is_copy() const { return is_copy_; }  // what was kept is that of NAME: there was no NAME.partial
    const std::string& partial() const { return partial_; }
    std::string read(std::int64_t offset, std::size_t count) const;  // shorter where there is less; regular files only
    void write(std::string_view bytes);
    void sync();                                  // to the disk
    void write_at_begin(std::string_view bytes);  // over what is there; regular files only
    void finish();
    void discard();  // NAME.partial goes

private:
    [[noreturn]] void fail(const std::string& path, int error) const;
    [[noreturn]] void fail_as_short(const std::string& path) const;
    int open_locked() const;
    int open_free();
    void keep(std::int64_t kept);

    std::string path_;     // the destination
    std::string partial_;  // what is being written; the same as path_ for a pipe or device
    std::string what_, otherwise_;
    int descriptor_ = -1;
    bool is_copy_ = false;
    std::int64_t size_ = 0;
};

}  // namespace lobatto

// SPDX-License-Identifier: MIT
// A folder of built objects, each found by the text that determines it; safe against crashes and other processes.
// Derivations are kept in it too: analysis/kernel/derived_kernel.hpp.
//
// An entry with stem STEM = NAME-<SHA-256 of the key text, shortened> consists of
//     STEM.so        the object; other things that are built have other endings
//     STEM.key       size and SHA-256 of the object, then the whole key text
// and, while it is being built, of
//     STEM.lock          locked by the builder (flock)
//     STEM.PID.building  the builder's folder, whose files are renamed into place
// and, when its compiler failed, of
//     STEM.failed    source, command and output of the compiler
// A process that is killed leaves at most an unlocked .lock and a .building, which the next builder of any entry
// removes.
#pragma once

#include <optional>
#include <string>

namespace lobatto {

class CacheEntry {
public:
    // In cache_folder(). `name` is for the reader of the folder only.
    CacheEntry(const std::string& name, std::string key, std::string ending = ".so");

    std::string object_path() const { return stem_ + ending_; }
    std::string building_path() const;
    std::string failed_path() const { return stem_ + ".failed"; }

    // Whether the object is there, belongs to exactly this key text, is whole and unaltered, and only we can write to
    // it.
    bool is_valid() const;
    // The object, if it is all that.
    std::optional<std::string> valid_object() const;

    // Whether object and key are there at all. Under the lock, an entry that is there and not valid was altered.
    bool is_there() const;

    // Puts the object, built as `file` in the building folder, into place.
    void publish(const std::string& file) const;

    // Keeps the building folder as failed_path().
    void keep_failure() const;

    // Held by the one who builds the entry: waits for its turn, then provides an empty building folder.
    class Lock {
    public:
        explicit Lock(const CacheEntry& entry);
        ~Lock();
        Lock(const Lock&) = delete;
        Lock& operator=(const Lock&) = delete;

    private:
        std::string stem_;
        int descriptor_ = -1;
    };

private:
    std::string stem_;  // with the folder
    std::string key_, ending_;
};

// Whole files, with MachineErrors that name the path and the reason.
void write_file(const std::string& path, const std::string& content);

}  // namespace lobatto

// SPDX-License-Identifier: MIT
#include "runtime/build/build_id.hpp"

#include <elf.h>
#include <link.h>

#include <cstdint>
#include <cstring>

namespace lobatto {

namespace {

bool holds(const dl_phdr_info& module, std::uintptr_t place) {
    for (int i = 0; i < module.dlpi_phnum; ++i) {
        const ElfW(Phdr)& part = module.dlpi_phdr[i];
        const std::uintptr_t begin = module.dlpi_addr + part.p_vaddr;
        if (part.p_type == PT_LOAD && begin <= place && place < begin + part.p_memsz) return true;
    }
    return false;
}

// The digest among the notes of a module; each is a header, a name and a content, both filled up to 4 bytes.
std::string id_among(const char* notes, std::size_t size) {
    const auto filled = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };
    ElfW(Nhdr) note;
    for (std::size_t at = 0; at + sizeof note <= size;) {
        std::memcpy(&note, notes + at, sizeof note);
        const char* const name = notes + at + sizeof note;
        const char* const content = name + filled(note.n_namesz);
        if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && std::memcmp(name, "GNU", 4) == 0) {
            std::string digits;
            for (std::size_t i = 0; i < note.n_descsz; ++i)
                for (const unsigned digit :
                     {static_cast<unsigned char>(content[i]) / 16u, static_cast<unsigned char>(content[i]) % 16u})
                    digits += "0123456789abcdef"[digit];
            return digits;
        }
        at += sizeof note + filled(note.n_namesz) + filled(note.n_descsz);
    }
    return "";
}

int look_at(dl_phdr_info* module, std::size_t, void* found) {
    if (!holds(*module, reinterpret_cast<std::uintptr_t>(&build_id))) return 0;
    for (int i = 0; i < module->dlpi_phnum; ++i) {
        const ElfW(Phdr)& part = module->dlpi_phdr[i];
        std::string& id = *static_cast<std::string*>(found);
        if (part.p_type != PT_NOTE || !id.empty()) continue;
        // The loader tells addresses as numbers.
        const auto* notes =
            reinterpret_cast<const char*>(module->dlpi_addr + part.p_vaddr);  // NOLINT(performance-no-int-to-ptr)
        id = id_among(notes, part.p_memsz);
    }
    return 1;
}

}  // namespace

std::string build_id() {
    std::string id;
    ::dl_iterate_phdr(look_at, &id);
    return id;
}

}  // namespace lobatto

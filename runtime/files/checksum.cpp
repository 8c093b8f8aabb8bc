// SPDX-License-Identifier: MIT
#include "runtime/files/checksum.hpp"

#include <cstring>

namespace lobatto {

namespace {

using Word = std::uint64_t;

// Can be undone, whatever the word: of two texts that differ in one word alone the checksums always differ.
Word mixed(Word state, Word word) {
    state = (state ^ word) * 0x9e3779b97f4a7c15;  // 2^64 over the golden ratio
    return state ^ state >> 32;
}

Word word_at(const char* bytes) {
    Word word = 0;
    std::memcpy(&word, bytes, sizeof word);
    return word;
}

}  // namespace

void Checksum::add(std::string_view bytes) {
    size_ += static_cast<std::int64_t>(bytes.size());
    rest_ += bytes;
    std::size_t done = 0;
    for (; rest_.size() - done >= sizeof(Word); done += sizeof(Word)) state_ = mixed(state_, word_at(&rest_[done]));
    rest_.erase(0, done);
}

Written Checksum::written() const {
    std::string last = rest_;
    last.resize(sizeof(Word), '\0');
    return {size_, mixed(mixed(state_, word_at(last.data())), static_cast<Word>(size_))};
}

}  // namespace lobatto

// SPDX-License-Identifier: GPL-2.0-or-later
// A place in a text that moves character by character and knows its line and column.
#pragma once

#include <string_view>
#include <vector>

#include "generator/formula/text/source.hpp"

namespace lobatto {

class Cursor {
public:
    explicit Cursor(std::string_view content) : content_(content) {}

    bool at_end() const { return offset_ == content_.size(); }
    std::string_view rest() const { return content_.substr(offset_); }
    char front() const { return at_end() ? '\0' : content_[offset_]; }
    bool is_any_of(std::string_view characters) const {
        return !at_end() && characters.find(front()) != std::string_view::npos;
    }
    Position position() const { return position_; }

    void advance() {
        if (at_end()) return;
        const bool line_end = front() == '\n';
        offset_ += character_length(rest());
        position_ = line_end ? Position{position_.line + 1, 1} : Position{position_.line, position_.column + 1};
        if (line_end && position_.line > static_cast<int>(starts_.size())) starts_.push_back(offset_);
    }
    void advance(std::size_t characters) {
        for (; characters > 0; --characters) advance();
    }
    void skip(std::string_view characters) {
        while (is_any_of(characters)) advance();
    }
    // To a position of the text.
    void move_to(Position target) {
        if (target.line < position_.line || (target.line == position_.line && target.column < position_.column)) {
            offset_ = starts_[static_cast<std::size_t>(target.line - 1)];
            position_ = {target.line, 1};
        }
        while (!at_end() && (position_.line < target.line || position_.column < target.column)) advance();
    }

private:
    std::string_view content_;
    std::vector<std::size_t> starts_{0};  // offsets of the lines seen so far
    std::size_t offset_ = 0;
    Position position_;
};

}  // namespace lobatto

// SPDX-License-Identifier: MIT
// NumPy's format: magic, version, length of a dictionary of Python, the dictionary, the numbers.
#include "runtime/files/npy.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <cstring>
#include <regex>
#include <stdexcept>

namespace lobatto {

namespace {

[[noreturn]] void fail(const std::string& why) {
    throw std::invalid_argument(why);
}

struct Type {
    char kind = 'f';
    std::size_t bytes = 8;
};

Type type_of(const std::string& text) {
    static const std::regex known("[<|=](f[48]|[iu][1248]|b1)");
    if (!std::regex_match(text, known))
        fail(fmt::format("numbers of the type {} are not read; save them as float64, array.astype('<f8')", text));
    return {text[1], static_cast<std::size_t>(text[2] - '0')};
}

double number_at(const char* bytes, const Type& type) {
    if (type.kind == 'f') {
        if (type.bytes == 4) {
            float value = 0;
            std::memcpy(&value, bytes, sizeof value);
            return static_cast<double>(value);
        }
        double value = 0;
        std::memcpy(&value, bytes, sizeof value);
        return value;
    }
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < type.bytes; ++i)
        bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[i])) << (8 * i);
    if (type.kind == 'u' || type.kind == 'b') return static_cast<double>(bits);
    const int unused = 64 - static_cast<int>(8 * type.bytes);
    return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
}

class NpyReader {
public:
    explicit NpyReader(const std::string& bytes) : bytes_(bytes) {}

    NpyArray run() {
        const std::string head = read_head();
        std::smatch found;
        if (!std::regex_search(head, found, std::regex("'shape': *\\(([0-9, ]*)\\)"))) fail("its head has no shape");
        const std::string sizes = found[1];
        static const std::regex whole_number("[0-9]+");
        for (std::sregex_iterator i(sizes.begin(), sizes.end(), whole_number), end; i != end; ++i)
            array_.shape.push_back(size_of(i->str()));
        const bool by_columns = std::regex_search(head, std::regex("'fortran_order': *True"));
        if (std::regex_search(head, found, std::regex("'descr': *'([^']*)'")))
            read_plain(type_of(found[1]), by_columns);
        else
            read_records(head);
        return std::move(array_);
    }

private:
    std::string read_head() {
        const auto byte = [&](std::size_t i) {
            return static_cast<std::size_t>(static_cast<unsigned char>(bytes_[i]));
        };
        if (!bytes_.starts_with("\x93NUMPY") || bytes_.size() < 12) fail("it does not begin as files of NumPy do");
        const bool is_long = bytes_[6] > 1;
        const std::size_t before = is_long ? 12 : 10;
        const std::size_t length =
            is_long ? byte(8) | byte(9) << 8 | byte(10) << 16 | byte(11) << 24 : byte(8) | byte(9) << 8;
        if (bytes_.size() < before + length) fail("it is shorter than its head says");
        constexpr std::size_t longest_head = 60'000;
        if (length > longest_head) fail(fmt::format("its head has {} bytes; at most {}", length, longest_head));
        begin_ = before + length;
        return bytes_.substr(before, length);
    }

    // A number of things in the file, which has as many bytes at least.
    std::size_t size_of(const std::string& digits) const {
        std::size_t size = 0;
        const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), size);
        if (read.ec != std::errc() || read.ptr != digits.data() + digits.size() || size > bytes_.size())
            fail("it is shorter than its head says");
        return size;
    }

    void expect(std::size_t rows, std::size_t row_bytes) const {
        if (row_bytes == 0 || rows > (bytes_.size() - begin_) / row_bytes) fail("it is shorter than its head says");
    }

    void read_plain(const Type& type, bool by_columns) {
        const std::size_t dimensions = array_.shape.size();
        if (dimensions != 1 && dimensions != 2) fail(fmt::format("it has {} dimensions, not one or two", dimensions));
        const std::size_t rows = array_.shape[0], width = dimensions == 1 ? 1 : array_.shape[1];
        expect(rows, width * type.bytes);
        for (std::size_t c = 0; c < width; ++c) {
            std::vector<double>& column = array_.columns.emplace_back(rows);
            for (std::size_t i = 0; i < rows; ++i) {
                const std::size_t place = by_columns ? c * rows + i : i * width + c;
                column[i] = number_at(bytes_.data() + begin_ + place * type.bytes, type);
            }
        }
    }

    void read_records(const std::string& head) {
        if (array_.shape.size() != 1) fail("records must have one dimension");
        static const std::regex field("\\((['\"])(.*?)\\1, *'([^']*)'(, *\\([^)]*\\))?\\)");
        struct Field {
            Type type;
            std::size_t offset;
        };
        std::vector<Field> fields;
        std::size_t row_bytes = 0;
        for (std::sregex_iterator i(head.begin(), head.end(), field), end; i != end; ++i) {
            const std::string name = (*i)[2], type = (*i)[3];
            if ((*i)[4].matched) fail(fmt::format("the column {} has arrays in place of numbers", name));
            if (name.empty() && type.starts_with("|V")) {  // bytes of columns that were left out
                row_bytes += size_of(type.substr(2));
                continue;
            }
            array_.names.push_back(name);
            fields.push_back({type_of(type), row_bytes});
            row_bytes += fields.back().type.bytes;
        }
        if (fields.empty()) fail("its head names no columns");
        const std::size_t rows = array_.shape[0];
        expect(rows, row_bytes);
        for (const Field& each : fields) {
            std::vector<double>& column = array_.columns.emplace_back(rows);
            for (std::size_t i = 0; i < rows; ++i)
                column[i] = number_at(bytes_.data() + begin_ + i * row_bytes + each.offset, each.type);
        }
    }

    const std::string& bytes_;
    NpyArray array_;
    std::size_t begin_ = 0;  // of the numbers
};

}  // namespace

NpyArray read_npy(const std::string& bytes) {
    return NpyReader(bytes).run();
}

}  // namespace lobatto

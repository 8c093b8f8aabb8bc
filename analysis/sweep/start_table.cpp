// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/start_table.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <regex>

#include "analysis/sweep/axis.hpp"
#include "runtime/build/sha256.hpp"

namespace lobatto {

namespace {

std::string whole_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string content;
    if (file) content.assign(std::istreambuf_iterator<char>(file), {});
    if (!file || file.bad()) throw InputError(fmt::format("--starts: cannot read {}: {}", path, std::strerror(errno)));
    return content;
}

std::string without_blanks(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\""), last = text.find_last_not_of(" \t\r\"");
    return first == std::string_view::npos ? "" : std::string(text.substr(first, last + 1 - first));
}

class CsvStarts {
public:
    CsvStarts(const std::string& text, StartTable& table) : text_(text), table_(table) {}

    void read() {
        std::size_t begin = 0;
        while (begin < text_.size()) {
            ++line_;
            const std::size_t end = std::min(text_.find('\n', begin), text_.size());
            const std::string_view line(text_.data() + begin, end - begin);
            begin = end + 1;
            if (line.starts_with('#') || without_blanks(line).empty()) continue;
            if (table_.names.empty())
                read_names(line);
            else
                read_row(line);
        }
        if (table_.names.empty())
            throw InputError(fmt::format("{}: no line with the names of columns, such as q,q',omega", table_.path));
    }

private:
    [[noreturn]] void fail(std::size_t column, const std::string& message) const {
        throw InputError(fmt::format("{}:{}:{}: {}", table_.path, line_, column + 1, message));
    }

    void read_names(std::string_view line) {
        for (std::size_t at = 0; at <= line.size();) {
            const std::size_t end = std::min(line.find(',', at), line.size());
            table_.names.push_back(without_blanks(line.substr(at, end - at)));
            if (table_.names.back().empty()) fail(at, "a column without a name");
            at = end + 1;
        }
        double number = 0;
        const std::string& first = table_.names.front();
        if (std::from_chars(first.data(), first.data() + first.size(), number).ec == std::errc())
            fail(0, fmt::format("'{}' is a number, but the first line names the columns, such as q,q',omega", first));
        table_.columns.resize(table_.names.size());
    }

    void read_row(std::string_view line) {
        std::size_t at = 0, column = 0;
        for (; at <= line.size(); ++column) {
            const std::size_t end = std::min(line.find(',', at), line.size());
            if (column == table_.names.size())
                fail(at, fmt::format("more values than the {} columns that were named", table_.names.size()));
            const std::string value = without_blanks(line.substr(at, end - at));
            const char* const first = value.data() + (value.starts_with('+') ? 1 : 0);
            double number = 0;
            const auto read = std::from_chars(first, value.data() + value.size(), number);
            if (read.ec != std::errc() || read.ptr != value.data() + value.size() || !std::isfinite(number))
                fail(at, fmt::format("'{}' is no finite number, of the column {}", value, table_.names[column]));
            table_.columns[column].push_back(number);
            at = end + 1;
        }
        if (column < table_.names.size())
            fail(line.size(), fmt::format("no value of the column {}", table_.names[column]));
    }

    const std::string& text_;
    StartTable& table_;
    std::size_t line_ = 0;
};

// A type of NumPy's: little-endian or of one byte.
struct NpyType {
    char kind = 'f';
    std::size_t bytes = 8;
};

double number_at(const char* bytes, const NpyType& type) {
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

class NpyStarts {
public:
    NpyStarts(const Scene& scene, const std::string& bytes, StartTable& table)
        : scene_(scene), bytes_(bytes), table_(table) {}

    // NumPy's format: magic, version, length of a dictionary of Python, the dictionary, the numbers.
    void read() {
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
        const std::string head = bytes_.substr(before, length);
        begin_ = before + length;
        std::smatch found;
        if (!std::regex_search(head, found, std::regex("'shape': *\\(([0-9, ]*)\\)"))) fail("its head has no shape");
        std::vector<std::size_t> shape;
        const std::string sizes = found[1];
        static const std::regex whole_number("[0-9]+");
        for (std::sregex_iterator i(sizes.begin(), sizes.end(), whole_number), end; i != end; ++i)
            shape.push_back(size_of(i->str()));
        const bool by_columns = std::regex_search(head, std::regex("'fortran_order': *True"));
        if (std::regex_search(head, found, std::regex("'descr': *'([^']*)'")))
            read_plain(shape, type_of(found[1]), by_columns);
        else
            read_records(shape, head);
    }

private:
    [[noreturn]] void fail(const std::string& why) const {
        throw InputError(fmt::format("--starts: {}: {}", table_.path, why));
    }

    // A number of things in the file, which has as many bytes at least.
    std::size_t size_of(const std::string& digits) const {
        std::size_t size = 0;
        const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), size);
        if (read.ec != std::errc() || read.ptr != digits.data() + digits.size() || size > bytes_.size())
            fail("it is shorter than its head says");
        return size;
    }

    NpyType type_of(const std::string& text) const {
        static const std::regex known("[<|=](f[48]|[iu][1248]|b1)");
        if (!std::regex_match(text, known))
            fail(fmt::format("numbers of the type {} are not read; save them as float64, array.astype('<f8')", text));
        return {text[1], static_cast<std::size_t>(text[2] - '0')};
    }

    void expect(std::size_t rows, std::size_t row_bytes) const {
        if (row_bytes == 0 || rows > (bytes_.size() - begin_) / row_bytes) fail("it is shorter than its head says");
    }

    void read_plain(const std::vector<std::size_t>& shape, const NpyType& type, bool by_columns) {
        const std::size_t n = scene_.coordinates.size();
        if (shape.size() != 2 || (shape[1] != n && shape[1] != 2 * n))
            fail(fmt::format(
                "an array without names has two dimensions and {} or {} columns, positions and then {}; "
                "this one has {}. Records have names: numpy.rec.fromarrays(columns, names='q,...')",
                n, 2 * n, scene_.start == Start::velocity ? "velocities" : "momenta",
                shape.size() == 2 ? fmt::format("{} columns", shape[1]) : fmt::format("{} dimensions", shape.size())));
        expect(shape[0], shape[1] * type.bytes);
        for (std::size_t c = 0; c < shape[1]; ++c) {
            const Coordinate& coordinate = scene_.coordinates[c % n];
            table_.names.push_back(c < n                             ? coordinate.written
                                   : scene_.start == Start::velocity ? coordinate.written + "'"
                                                                     : "p_" + coordinate.name);
            std::vector<double>& column = table_.columns.emplace_back(shape[0]);
            for (std::size_t i = 0; i < shape[0]; ++i) {
                const std::size_t place = by_columns ? c * shape[0] + i : i * shape[1] + c;
                column[i] = number_at(bytes_.data() + begin_ + place * type.bytes, type);
            }
        }
    }

    void read_records(const std::vector<std::size_t>& shape, const std::string& head) {
        if (shape.size() != 1) fail("records must have one dimension");
        static const std::regex field("\\((['\"])(.*?)\\1, *'([^']*)'(, *\\([^)]*\\))?\\)");
        struct Field {
            NpyType type;
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
            table_.names.push_back(name);
            fields.push_back({type_of(type), row_bytes});
            row_bytes += fields.back().type.bytes;
        }
        if (fields.empty()) fail("its head names no columns");
        expect(shape[0], row_bytes);
        for (const Field& each : fields) {
            std::vector<double>& column = table_.columns.emplace_back(shape[0]);
            for (std::size_t i = 0; i < shape[0]; ++i)
                column[i] = number_at(bytes_.data() + begin_ + i * row_bytes + each.offset, each.type);
        }
    }

    const Scene& scene_;
    const std::string& bytes_;
    StartTable& table_;
    std::size_t begin_ = 0;  // of the numbers
};

}  // namespace

StartTable read_starts(const Scene& scene, const std::string& path) {
    StartTable table;
    table.path = path;
    const bool is_csv = path.ends_with(".csv");
    if (!is_csv && !path.ends_with(".npy"))
        throw InputError(
            fmt::format("--starts: {} has an ending that is not known; starts are read from .csv and .npy", path));
    const std::string content = whole_file(path);
    if (is_csv)
        CsvStarts(content, table).read();
    else
        NpyStarts(scene, content, table).read();
    table.rows = std::ssize(table.columns.front());
    if (table.rows == 0) throw InputError(fmt::format("--starts: {} has no row", path));
    for (std::size_t c = 0; c < table.names.size(); ++c) {
        if (table.names[c].ends_with("(0)")) table.names[c].resize(table.names[c].size() - 3);
        for (std::int64_t i = 0; i < table.rows; ++i)
            if (!std::isfinite(table.columns[c][static_cast<std::size_t>(i)]))
                throw InputError(
                    fmt::format("--starts: {}: row {} of the column {} is no finite number", path, i, table.names[c]));
    }
    table.digest = sha256(content).substr(0, 16);
    return table;
}

}  // namespace lobatto

// SPDX-License-Identifier: GPL-2.0-or-later
// Arrays of NumPy, against bytes written down from its format.
#include "runtime/files/npy.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

std::string npy(const std::string& description, const std::string& order, const std::string& shape,
                const std::string& numbers) {
    std::string head = "{'descr': " + description + ", 'fortran_order': " + order + ", 'shape': " + shape + ", }";
    head.resize(117, ' ');
    return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + head + "\n" + numbers;
}

template <class T>
std::string bytes_of(std::initializer_list<T> values) {
    std::string bytes;
    for (const T value : values) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    return bytes;
}

std::string refusal(const std::string& bytes) {
    return test::message_of<std::invalid_argument>([&] { read_npy(bytes); });
}

}  // namespace

TEST_CASE("numbers by rows and by columns, of several types") {
    const NpyArray rows = read_npy(npy("'<f8'", "False", "(2, 2)", bytes_of({1.0, 2.0, 3.0, 4.5})));
    CHECK(rows.names.empty());
    CHECK(rows.columns == std::vector<std::vector<double>>{{1, 3}, {2, 4.5}});
    const NpyArray columns = read_npy(npy("'<f8'", "True", "(2, 2)", bytes_of({1.0, 2.0, 3.0, 4.5})));
    CHECK(columns.columns == std::vector<std::vector<double>>{{1, 2}, {3, 4.5}});
    CHECK(read_npy(npy("'<f4'", "False", "(2,)", bytes_of({1.5F, -2.0F}))).columns.front() ==
          std::vector<double>{1.5, -2});
    CHECK(read_npy(npy("'<i2'", "False", "(2,)", bytes_of<std::int16_t>({-3, 300}))).columns.front() ==
          std::vector<double>{-3, 300});
    CHECK(read_npy(npy("'|u1'", "False", "(1,)", bytes_of<std::uint8_t>({200}))).columns.front() ==
          std::vector<double>{200});
}

TEST_CASE("records have names, and bytes between them are left out") {
    const std::string row = bytes_of({0.5}) + "1234" + bytes_of<std::int64_t>({-7});
    const NpyArray array = read_npy(npy("[('q', '<f8'), ('', '|V4'), (\"q'\", '<i8')]", "False", "(2,)", row + row));
    CHECK(array.names == std::vector<std::string>{"q", "q'"});
    CHECK(array.columns == std::vector<std::vector<double>>{{0.5, 0.5}, {-7, -7}});
}

TEST_CASE("heads that lie, and what is no array of numbers, are refused") {
    const std::string two = bytes_of({1.0, 2.0});
    CHECK(refusal("nothing") == "it does not begin as files of NumPy do");
    for (const char* shape : {"(3,)", "(2305843009213693952,)", "(99999999999999999999999999,)", "(1, 300000000)"})
        CHECK(refusal(npy("'<f8'", "False", shape, two)) == "it is shorter than its head says");
    CHECK(refusal(npy("[('', '|V18446744073709551608'), ('q', '<f8')]", "False", "(2,)", two)) ==
          "it is shorter than its head says");
    CHECK(refusal(npy("'<c16'", "False", "(1,)", two)).find("numbers of the type <c16 are not read") == 0);
    CHECK(refusal(npy("'<f8'", "False", "(1, 1, 2)", two)) == "it has 3 dimensions, not one or two");
    CHECK(refusal(npy("'<f8'", "False", "(2,)", two).substr(0, 60)) == "it is shorter than its head says");
}

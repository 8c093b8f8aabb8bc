// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/table/hdf5_file.hpp"

#include <fmt/format.h>

#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"

#ifdef LOBATTO_HDF5

#include <hdf5.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <map>

#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

constexpr std::size_t rows_at_once = 4096;

// A handle of HDF5 that is closed; a function of HDF5 that refuses is an error of the machine.
class Handle {
public:
    Handle(hid_t id, herr_t (*close)(hid_t), const std::string& path) : id_(id), close_(close) {
        if (id < 0) fail_to_write("the table", path, errno == 0 ? EIO : errno);
    }
    ~Handle() { close_(id_); }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    operator hid_t() const { return id_; }

private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

// HDF5 prints a stack of errors of its own where it is not told otherwise.
void be_quiet() {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    errno = 0;
}

class Hdf5Writer {
public:
    explicit Hdf5Writer(const std::string& path) : path_(path) {}

    void write(const std::string& new_path, const TableHead& head, std::int64_t rows,
               const std::function<std::string(std::int64_t, std::size_t)>& records) {
        const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose, path_),
            access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, path_);
        check(H5Pset_obj_track_times(creation, false));
        check(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
        const hid_t file = H5Fcreate(new_path.c_str(), H5F_ACC_TRUNC, creation, access);
        if (file < 0) fail_to_write("the table", path_, errno == 0 ? EIO : errno);
        try {
            fill(file, head, rows, records);
        } catch (...) {
            H5Fclose(file);
            throw;
        }
        check(H5Fclose(file));
    }

private:
    void check(herr_t result) const {
        if (result < 0) fail_to_write("the table", path_, errno == 0 ? EIO : errno);
    }

    void fill(hid_t file, const TableHead& head, std::int64_t rows,
              const std::function<std::string(std::int64_t, std::size_t)>& records) {
        put(file, "lobatto", {head.version}, true);
        put(file, "kind", {head.kind}, true);
        std::map<std::string, std::vector<std::string>> facts;
        for (const auto& [what, value] : head.facts) facts[what].push_back(value);
        for (const auto& [what, values] : facts) put(file, what, values, values.size() == 1);
        put(file, "scene_text", {head.scene_text}, true);
        put(file, "head", {json_head(head)}, true);
        const Handle record(record_of(head.columns), H5Tclose, path_),
            creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, path_);
        check(H5Pset_obj_track_times(creation, false));
        const auto size = static_cast<hsize_t>(rows);
        const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose, path_);
        const Handle table(H5Dcreate2(file, "table", record, space, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose,
                           path_);
        std::vector<std::string> names, units;
        for (const TableColumn& column : head.columns) {
            names.push_back(column.name);
            units.push_back(column.unit);
        }
        put(table, "columns", names, false);
        put(table, "units", units, false);
        for (hsize_t row = 0; row < size;) {
            const hsize_t count = std::min<hsize_t>(rows_at_once, size - row);
            const std::string bytes = records(static_cast<std::int64_t>(row), count);
            const Handle memory(H5Screate_simple(1, &count, nullptr), H5Sclose, path_);
            check(H5Sselect_hyperslab(space, H5S_SELECT_SET, &row, nullptr, &count, nullptr));
            check(H5Dwrite(table, record, memory, space, H5P_DEFAULT, bytes.data()));
            row += count;
        }
    }

    // Texts, one or a list.
    void put(hid_t object, const std::string& name, const std::vector<std::string>& values, bool is_one) const {
        std::vector<const char*> texts;
        for (const std::string& value : values) texts.push_back(value.c_str());
        const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, path_);
        check(H5Tset_size(type, H5T_VARIABLE));
        check(H5Tset_cset(type, H5T_CSET_UTF8));
        const hsize_t count = texts.size();
        const Handle space(is_one ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr), H5Sclose, path_);
        const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                               path_);
        check(H5Awrite(attribute, type, texts.data()));
    }

public:
    static hid_t record_of(const std::vector<TableColumn>& columns) {
        const hid_t record = H5Tcreate(H5T_COMPOUND, 8 * columns.size());
        for (std::size_t c = 0; c < columns.size() && record >= 0; ++c)
            if (H5Tinsert(record, columns[c].name.c_str(), 8 * c, columns[c].whole ? H5T_STD_I64LE : H5T_IEEE_F64LE) <
                0) {
                H5Tclose(record);
                return -1;
            }
        return record;
    }

private:
    std::string path_;
};

}  // namespace

bool has_hdf5() {
    return true;
}
void require_hdf5(const std::string&) {}

void write_hdf5(const std::string& path, const TableHead& head, std::int64_t rows,
                const std::function<std::string(std::int64_t, std::size_t)>& records) {
    const std::string new_path = path + ".new";
    char begin[4] = {};
    if (std::ifstream there(new_path, std::ios::binary); there.read(begin, 4) && std::string(begin, 4) != "\x89HDF")
        throw MachineError(
            fmt::format("cannot write the table to {}: {} is there, and Lobatto did not write it. Move it "
                        "away, or choose another place with -o",
                        path, new_path));
    be_quiet();
    try {
        Hdf5Writer(path).write(new_path, head, rows, records);
    } catch (...) {
        std::remove(new_path.c_str());
        throw;
    }
    if (std::rename(new_path.c_str(), path.c_str()) != 0) fail_to_write("the table", path, errno);
}

Hdf5Reader::Hdf5Reader(const std::string& path) : path_(path) {
    be_quiet();
    const auto head_text = [&]() -> std::string {
        const hid_t attribute = H5Aopen(file_, "head", H5P_DEFAULT);
        if (attribute < 0) return "";
        const hid_t type = H5Aget_type(attribute);
        char* text = nullptr;
        std::string result;
        if (H5Tis_variable_str(type) > 0 && H5Aread(attribute, type, &text) >= 0 && text != nullptr) {
            result = text;
            H5free_memory(text);
        }
        H5Tclose(type);
        H5Aclose(attribute);
        return result;
    };
    file_ = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    const std::optional<TableHead> head = file_ < 0 ? std::nullopt : read_json_head(head_text());
    if (head) {
        head_ = *head;
        table_ = H5Dopen2(file_, "table", H5P_DEFAULT);
        record_ = Hdf5Writer::record_of(head_.columns);
    }
    if (table_ < 0 || record_ < 0) {
        close();
        throw MachineError(
            fmt::format("cannot read {}: it is no table that Lobatto wrote as HDF5, or is damaged", path));
    }
    const hid_t space = H5Dget_space(table_);
    rows_ = static_cast<std::int64_t>(H5Sget_simple_extent_npoints(space));
    H5Sclose(space);
}

Hdf5Reader::~Hdf5Reader() {
    close();
}

void Hdf5Reader::close() const {
    if (record_ >= 0) H5Tclose(record_);
    if (table_ >= 0) H5Dclose(table_);
    if (file_ >= 0) H5Fclose(file_);
}

void Hdf5Reader::read(std::int64_t row, std::size_t count, TableCell* cells) const {
    const auto from = static_cast<hsize_t>(row), size = static_cast<hsize_t>(count);
    const Handle space(H5Dget_space(table_), H5Sclose, path_),
        memory(H5Screate_simple(1, &size, nullptr), H5Sclose, path_);
    if (H5Sselect_hyperslab(space, H5S_SELECT_SET, &from, nullptr, &size, nullptr) < 0 ||
        H5Dread(table_, record_, memory, space, H5P_DEFAULT, cells) < 0)
        throw MachineError(fmt::format("cannot read {}: it is damaged", path_));
}

}  // namespace lobatto

#else

namespace lobatto {

bool has_hdf5() {
    return false;
}

void require_hdf5(const std::string& path) {
    throw MachineError(fmt::format(
        "{}: this program was built without HDF5. Install libhdf5-dev and build it again, or name a .csv or "
        ".npy",
        path));
}

void write_hdf5(const std::string& path, const TableHead&, std::int64_t,
                const std::function<std::string(std::int64_t, std::size_t)>&) {
    require_hdf5(path);
}

Hdf5Reader::Hdf5Reader(const std::string& path) : path_(path) {
    require_hdf5(path);
}
Hdf5Reader::~Hdf5Reader() = default;
void Hdf5Reader::close() const {}
void Hdf5Reader::read(std::int64_t, std::size_t, TableCell*) const {
    require_hdf5(path_);
}

}  // namespace lobatto

#endif

// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/measurement_store.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "analysis/tradeoff/measurement_json.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

MeasurementStore::MeasurementStore(const std::string& path, const std::string& subject) : path_(path) {
    std::string kept = "# " + subject + '\n';
    std::uintmax_t size = 0;
    {
        std::ifstream file(path);
        std::string line;
        if (std::getline(file, line) && line == "# " + subject) {
            std::error_code unknown;
            size = std::filesystem::file_size(path, unknown);
            while (std::getline(file, line) && !file.eof()) {  // the last line ends with a line's end, or is torn
                try {
                    const Measurement measurement = measurement_of(nlohmann::json::parse(line));
                    measurements_[measurement.candidate.key()] = measurement;
                    kept += line + '\n';
                } catch (const nlohmann::json::exception&) {
                    break;
                } catch (const std::invalid_argument&) {  // a family there is not
                    break;
                }
            }
        }
    }
    found_ = measurements_.size();
    if (kept.size() != size) write_whole(path, "the measurements", kept);  // never half of it
    file_.open(path, std::ios::app);
    if (!file_) throw MachineError(fmt::format("cannot write {}; choose another folder with -o", path));
}

const Measurement* MeasurementStore::find(const Candidate& candidate) const {
    const auto place = measurements_.find(candidate.key());
    return place == measurements_.end() ? nullptr : &place->second;
}

const Measurement& MeasurementStore::add(const Measurement& measurement) {
    if (file_.is_open()) {
        file_ << json_of(measurement).dump() << '\n' << std::flush;
        if (!file_) throw MachineError(fmt::format("cannot write {}; is the disk full?", path_));
    }
    return measurements_[measurement.candidate.key()] = measurement;
}

}  // namespace lobatto

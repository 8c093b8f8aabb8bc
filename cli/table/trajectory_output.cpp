// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/table/trajectory_output.hpp"

#include <fmt/format.h>

namespace lobatto {

namespace {

TableHead head_of_run(const Scene& scene, const TrajectoryHeader& header) {
    TableHead head;
    head.kind = "trajectory";
    head.scene_text = scene.source.content();
    head.add("scene", header.scene);
    head.add("method", header.method);
    head.add("kernel", header.kernel);
    std::vector<std::string> parameters;
    for (const auto& [name, value] : header.parameters) parameters.push_back(name + " = " + value);
    if (!parameters.empty()) head.add("parameters", fmt::format("{}", fmt::join(parameters, ", ")));
    for (const auto& [name, unit] : header.columns) head.columns.push_back({name, unit});
    return head;
}

}  // namespace

TrajectoryOutput::TrajectoryOutput(const std::string& path, TableFormat format, const Scene& scene,
                                   const TrajectoryHeader& header, const Written& kept) {
    if (format == TableFormat::csv) {
        text_.emplace(path, header, kept);
        return;
    }
    const Precision numbers = scene.method.numbers;
    if (numbers != Precision::double_ && numbers != Precision::single)
        throw InputError(fmt::format("-o: a {} holds numbers of 64 bits, but those of the run are \"{}\"; name a .csv",
                                     ending_of(format), precision_name(numbers)));
    beside_ = static_cast<std::size_t>(header.beside);
    energy_ = header.energy;
    columns_ = header.columns.size() - beside_ - (energy_ ? 1 : 0);
    table_.emplace(path, format, head_of_run(scene, header));
}

void TrajectoryOutput::write(const Records& records) {
    if (text_) return text_->write(records);
    cells_.clear();
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* const row = records.rows + i * records.columns;
        for (std::size_t c = 0; c < columns_; ++c) cells_.push_back(cell_of(row[c]));
        for (std::size_t c = 0; c < beside_; ++c)
            cells_.push_back(cell_of(records.beside[static_cast<std::size_t>(i) * beside_ + c]));
        if (energy_) cells_.push_back(cell_of(records.energy[i]));
    }
    table_->add(cells_.data(), static_cast<std::size_t>(records.count));
}

void TrajectoryOutput::finish() {
    if (text_) return text_->finish();
    table_->finish();
}

}  // namespace lobatto

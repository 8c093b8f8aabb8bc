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
    for (const auto& [name, unit] : header.columns)
        for (int part = 0; part < parts_of(scene.method.numbers); ++part)
            head.columns.push_back({name_of_part(name, static_cast<std::size_t>(part)), unit});
    return head;
}

}  // namespace

TrajectoryOutput::TrajectoryOutput(const std::string& path, TableFormat format, const Scene& scene,
                                   const TrajectoryHeader& header, const Written& kept) {
    if (format == TableFormat::csv) {
        text_.emplace(path, header, kept);
        return;
    }
    parts_ = static_cast<std::size_t>(parts_of(scene.method.numbers));
    beside_ = static_cast<std::size_t>(header.beside);
    energy_ = header.energy;
    columns_ = header.columns.size() - beside_ - (energy_ ? 1 : 0);
    table_.emplace(path, format, head_of_run(scene, header));
}

void TrajectoryOutput::write(const Records& records) {
    if (text_) return text_->write(records);
    cells_.clear();
    const auto put = [&](const double* numbers, std::size_t count) {
        for (std::size_t c = 0; c < count * parts_; ++c) cells_.push_back(cell_of(numbers[c]));
    };
    const bool is_whole = records.whole != nullptr;
    const double* const rows = is_whole ? records.whole : records.rows;
    const double* const energy = is_whole ? records.whole_energy : records.energy;
    for (std::size_t i = 0; i < static_cast<std::size_t>(records.count); ++i) {
        put(rows + i * static_cast<std::size_t>(records.columns) * parts_, columns_);
        if (beside_ > 0) put(records.beside + i * beside_ * parts_, beside_);
        if (energy_) put(energy + i * parts_, 1);
    }
    table_->add(cells_.data(), static_cast<std::size_t>(records.count));
}

void TrajectoryOutput::finish() {
    if (text_) return text_->finish();
    table_->finish();
}

}  // namespace lobatto

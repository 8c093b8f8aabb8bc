// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "generator/formula/text/source.hpp"

namespace lobatto {

namespace {

const double not_said = std::numeric_limits<double>::quiet_NaN();

template <class To, class From>
To same_bits(From value) {
    To bits{};
    static_assert(sizeof bits == sizeof value);
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

// A comma would end the column.
std::string name_of_column(std::string text) {
    std::erase(text, '"');
    std::replace(text.begin(), text.end(), ',', ';');
    return text;
}

}  // namespace

TableCell cell_of(std::int64_t value) {
    return same_bits<TableCell>(value);
}
// The sign of what is no number is no information.
TableCell cell_of(double value) {
    return same_bits<TableCell>(std::isnan(value) ? not_said : value);
}
std::int64_t whole_in(TableCell cell) {
    return same_bits<std::int64_t>(cell);
}
double real_in(TableCell cell) {
    return same_bits<double>(cell);
}

std::string name_of_part(const std::string& name, std::size_t part) {
    return part == 0 ? name : name + ".rest" + (part == 1 ? "" : std::to_string(part));
}

std::size_t SweepRows::add(const std::string& name, const std::string& unit) {
    columns_.push_back({name, unit});
    return columns_.size() - 1;
}

// A number that is a sum of doubles has a column for each.
void SweepRows::add_state(const std::string& name, const std::string& unit) {
    for (std::size_t part = 0; part < parts_; ++part) add(name_of_part(name, part), unit);
}

// A name of the scene keeps its column; ours gives way to it, as in steps_.
std::size_t SweepRows::add_own(std::string name, bool whole) {
    const auto taken = [&] {
        const auto is_named = [&](const auto& named) { return named.name == name; };
        return std::any_of(scene_.coordinates.begin(), scene_.coordinates.end(), is_named) ||
               std::any_of(scene_.parameters.begin(), scene_.parameters.end(), is_named);
    };
    while (taken()) name += '_';
    columns_.push_back({name, "", whole});
    return columns_.size() - 1;
}

// Initial values are written q(0), as other columns hold q at the time t.
SweepRows::SweepRows(const Scene& scene, const SweepStarts& starts, std::int64_t every, bool measures)
    : scene_(scene),
      starts_(starts),
      every_(every),
      n_(scene.coordinates.size()),
      parts_(static_cast<std::size_t>(parts_of(scene.method.numbers))) {
    using Role = VariedName::Role;
    add_own("index", true);
    for (const SweepStarts::Column& varied : starts.columns()) {
        const VariedName& of = varied.of;
        if (of.is_setting())
            add_own(of.name, of.role != Role::step && of.role != Role::tolerance);
        else if (of.role == Role::parameter)
            add(of.name, scene.parameters[of.index].unit);
        else
            add(of.name + "(0)", of.role == Role::position ? scene.coordinates[of.index].unit : "");
    }
    status_ = add_own("status", true);
    steps_ = add_own("steps", true);
    if (scene.may_end_early()) stop_ = add_own("stop", true);
    time_ = add("t");
    for (const Reduction& kept : scene.outputs.kept) {
        const std::string name = name_of_column(kept.text);
        if (std::any_of(columns_.begin(), columns_.end(), [&](const TableColumn& one) { return one.name == name; }))
            throw InputError(fmt::format("{}: keep: '{}' is listed twice; keep one", scene.path, kept.text));
        add(name);
    }
    if (scene.outputs.kept.empty()) {
        q_ = columns_.size();
        for (const Coordinate& coordinate : scene.coordinates) add_state(coordinate.name, coordinate.unit);
        if (scene.outputs.momenta) p_ = columns_.size();
        for (std::size_t k = 0; k < n_ && scene.outputs.momenta; ++k) add_state("p_" + scene.coordinates[k].name);
        if (scene.outputs.energy) energy_ = add_own("energy_error", false);
    }
    if (measures) error_ = add_own("error", false);
}

SweepFigures SweepRows::append(std::vector<TableCell>& rows, const EnsembleTrajectory& trajectory,
                               std::int64_t kept_every, const Verdict& verdict, double* state) const {
    const Records& kept = trajectory.kept;
    const auto events = static_cast<std::int64_t>(scene_.outputs.events.size());
    const std::int64_t stop = trajectory.stop >= 0 ? trajectory.stop - events + 1 : 0;
    for (std::int64_t i = 0; i < kept.count; ++i) {
        const bool last = i + 1 == kept.count;
        if (!last && (every_ == 0 || i * kept_every % every_ != 0)) continue;
        const auto put = [&](auto value) { rows.push_back(cell_of(value)); };
        const double* const row = kept.rows + i * kept.columns;
        put(trajectory.index);
        for (std::size_t c = 0; c < starts_.columns().size(); ++c) {
            const double value = starts_.value(trajectory.index, c);
            if (columns_[1 + c].whole)
                put(static_cast<std::int64_t>(value));
            else
                put(value);
        }
        put(static_cast<std::int64_t>(last ? verdict.status : LOBATTO_OK));
        put(last ? trajectory.steps_done : i * kept_every);
        if (stop_ != none) put(last ? stop : std::int64_t(0));
        put(row[0]);
        for (std::size_t k = 0; k < scene_.outputs.kept.size(); ++k)
            put(k < trajectory.reduced->size() ? (*trajectory.reduced)[k] : not_said);
        if (q_ != none)
            for (std::size_t k = 0; k < (p_ == none ? n_ : 2 * n_) * parts_; ++k)
                put(kept.whole == nullptr ? row[1 + k] : kept.whole[i * kept.columns * kept.parts + kept.parts + k]);
        if (energy_ != none) put(trajectory.energy_error(i));
        if (error_ != none) put(last ? verdict.error : not_said);
    }
    const double* const end = kept.rows + (kept.count - 1) * kept.columns;
    std::copy(end + 1, end + 1 + 2 * n_, state);
    return {trajectory.index,
            verdict.status,
            trajectory.steps_done,
            end[0],
            verdict.error,
            trajectory.energy_error_final,
            trajectory.energy_error_largest,
            stop};
}

SweepFigures SweepRows::read(const TableCell* row, double* state) const {
    const auto real = [&](std::size_t column) { return column == none ? not_said : real_in(row[column]); };
    for (std::size_t k = 0; k < n_; ++k) {
        state[k] = real(q_ == none ? none : q_ + k * parts_);
        state[n_ + k] = real(p_ == none ? none : p_ + k * parts_);
    }
    return {whole_in(row[0]),
            whole_in(row[status_]),
            whole_in(row[steps_]),
            real(time_),
            real(error_),
            real(energy_),
            not_said,
            stop_ == none ? 0 : whole_in(row[stop_])};
}

}  // namespace lobatto

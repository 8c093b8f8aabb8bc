// SPDX-License-Identifier: GPL-2.0-or-later
// Where the trajectories of a sweep begin: lists and ranges, columns of a file, random draws, and their combinations.
#pragma once

#include <ginac/ginac.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "analysis/sweep/axis.hpp"
#include "analysis/sweep/draw.hpp"
#include "analysis/sweep/start_table.hpp"
#include "analysis/tape.hpp"
#include "generator/mechanics/system/system.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

// What is asked for.
struct StartsRequest {
    std::vector<std::string> vary;         // as read_axis
    bool zip = false;                      // the lists of `vary` run together, not as a product
    std::string file;                      // as read_starts; empty: none
    std::optional<std::int64_t> random;    // rows of each combination
    std::uint64_t seed = 0;                // of the draws
    std::vector<std::string> draw;         // as read_draw
    std::optional<StartTable> table = {};  // in place of `file`
};

// All combinations, in this order from the slowest to the fastest: settings of the method, rows of the file, lists of
// --vary in their order, repetitions of --random. Trajectories are counted from 0 through all of them; those of one
// setting stand together.
class SweepStarts {
public:
    // `scene` outlives it. `algebra` guards formulas, which are not made for several threads, where others evaluate
    // some at the same time. Throws InputError.
    SweepStarts(const Scene& scene, const StartsRequest& request, std::recursive_mutex& algebra);

    // What varies, in the order of the columns of a table.
    struct Column {
        VariedName of;
        std::string written;  // where its values come from: 0:3:1000, normal(0, 1), starts.csv
    };
    const std::vector<Column>& columns() const { return columns_; }
    std::int64_t count() const { return count_; }
    std::int64_t settings() const { return count_ / of_setting_; }
    std::int64_t count_of_setting() const { return of_setting_; }
    double value(std::int64_t trajectory, std::size_t column) const;
    bool varies(VariedName::Role role, std::size_t index) const;

    // The scene with the settings of this trajectory.
    Scene with_settings(Scene scene, std::int64_t trajectory) const;
    // Parameters, positions and rates of a trajectory; formulas of the scene that hold a varied parameter follow it.
    // A value that does not exist is NaN. If the scene refuses the value of a parameter, the first position is NaN.
    // Thread-safe.
    void start(std::int64_t trajectory, EnsembleStart& start) const;

    // "q = 0.5, omega = 2", or the settings among them
    std::string text_of(std::int64_t trajectory, bool settings_alone = false) const;
    // Why the scene does not allow its parameters, with place; empty: it does. Such a start has no value.
    std::string complaint(std::int64_t trajectory) const;
    // All that the starts depend on beside the scene: {"vary", "q = 0:3:1000"}
    const std::vector<std::pair<std::string, std::string>>& sources() const { return sources_; }

private:
    // Names that run together: a list of --vary, all of them, or a file; without names: repetitions.
    struct Dimension {
        std::int64_t count = 1, stride = 1;
    };
    // Where the values of a column come from: one of three.
    struct Values {
        std::size_t dimension = 0;
        std::optional<AxisValues> axis;
        std::vector<double> listed;
        std::optional<Draw> draw;
    };
    // An initial value that depends on a varied parameter.
    struct Dependent {
        bool position;
        std::size_t coordinate;
    };
    // What the values of parameters must keep (Requirement), of those that vary.
    struct Required {
        Tape value;
        bool may_vanish;
        std::string complaint;
        bool holds(const std::vector<double>& parameters) const {
            const double margin = value(parameters);
            return may_vanish ? margin >= 0 : margin > 0;
        }
    };
    // A start to all digits; what is varied, or follows from it, is replaced.
    struct Exact {
        std::vector<GiNaC::numeric> parameters, q, rate;
    };
    void add_axes(std::vector<Axis>& axes, bool zip, bool settings);
    void add_table(StartTable table);
    void add_draws(const StartsRequest& request);
    void add(const VariedName& name, const std::string& written, Values values);
    void count_all();
    void find_dependents();
    void check_orientations() const;
    std::int64_t place(std::int64_t trajectory, std::size_t column) const;
    GiNaC::numeric exact(std::int64_t trajectory, std::size_t column) const;
    void assemble(const std::vector<GiNaC::ex>& parameters, EnsembleStart& start, Exact& exact) const;

    const Scene& scene_;
    std::vector<Dimension> dimensions_;
    std::vector<Column> columns_;
    std::vector<Values> values_;  // of the columns
    std::vector<std::pair<std::string, std::string>> sources_;
    std::uint64_t seed_ = 0;
    std::int64_t count_ = 1, of_setting_ = 1;
    EnsembleStart base_;
    Exact exact_base_;
    std::size_t parts_ = 1;  // doubles of which a number is the sum
    std::vector<Dependent> dependents_;
    std::vector<Required> required_;
    std::optional<System> assembled_;  // of a scene whose starts are moved onto its constraints
    std::recursive_mutex& algebra_;
};

}  // namespace lobatto

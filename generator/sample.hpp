// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas as numbers: 60 digits, at seeded points near a scene's start.
#pragma once

#include <cln/cln.h>

#include <vector>

#include "generator/graph.hpp"
#include "generator/scene.hpp"

namespace lobatto {

// A value, and what its rounding is measured against: the change of it when each number on the way to it changes by
// its own size. Free of units: for m in c^2*m/c^2 it is m, not c^2.
struct Sized {
    cln::cl_R value, size;
    bool vanishes() const { return cln::abs(value) <= size * cln::expt(cln::cl_RA(10), -45); }
    bool equals(const Sized& other) const {
        return cln::abs(value - other.value) <= cln::max(size, other.size) * cln::expt(cln::cl_RA(10), -45);
    }
};

// The values of some nodes with their sizes. DomainError when one is not real.
std::vector<Sized> sized_values(const Graph& graph, const std::vector<cln::cl_R>& inputs, const std::vector<Id>& roots);

// Formulas evaluated together; their symbols have values that may be changed between evaluations.
class Formulas {
public:
    void set(const GiNaC::ex& symbol, const cln::cl_R& value);
    cln::cl_R get(const GiNaC::ex& symbol) const;
    std::vector<Id> convert(const std::vector<GiNaC::ex>& expressions);
    // DomainError when one is not real.
    std::vector<cln::cl_R> evaluate(const std::vector<Id>& roots) const;
    std::vector<Sized> evaluate_sized(const std::vector<Id>& roots) const {
        return sized_values(graph_, values_, roots);
    }
    std::vector<cln::cl_R> operator()(const std::vector<GiNaC::ex>& expressions) {
        return evaluate(convert(expressions));
    }

private:
    Graph graph_;
    GiNaC::exmap inputs_;
    std::vector<cln::cl_R> values_;
};

// Seeded numbers in (-1, 1), the same on every machine.
class Noise {
public:
    explicit Noise(std::uint64_t seed) : state_(seed * 2654435761u + 12345u) {}
    cln::cl_R next();

private:
    std::uint64_t state_;
};

cln::cl_R float_of(const GiNaC::numeric& value);  // at 60 digits

// Points near the start of a scene, ever nearer with the attempt; from the tenth on the parameters are exactly the
// scene's.
class NearStart {
public:
    NearStart(const Scene& scene, int attempt);

    cln::cl_R parameter(std::size_t index);
    cln::cl_R position(std::size_t coordinate);
    cln::cl_R velocity(std::size_t coordinate);  // near 0 where the scene gives momenta
    cln::cl_R near(const cln::cl_R& value);      // near 1 for 0
    // Sets the scene's symbols: parameters, positions, velocities, time.
    void set_all(Formulas& formulas);

private:
    const Scene& scene_;
    int attempt_;
    Noise noise_;
    cln::cl_R spread_;
};

constexpr int sample_attempts = 40;

}  // namespace lobatto

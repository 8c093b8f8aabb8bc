// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas as numbers: 60 digits, at seeded points near a scene's start and away from it.
#pragma once

#include <cln/cln.h>

#include <set>
#include <unordered_map>
#include <vector>

#include "generator/graph/graph.hpp"
#include "generator/scene/scene.hpp"

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

// The values of all nodes that the roots need, by node, with their sizes. DomainError when one is not real.
std::vector<Sized> all_sized(const Graph& graph, const std::vector<cln::cl_R>& inputs, const std::vector<Id>& roots);

// The values of some nodes with their sizes. DomainError when one is not real.
std::vector<Sized> sized_values(const Graph& graph, const std::vector<cln::cl_R>& inputs, const std::vector<Id>& roots);

// For each root the inputs that it holds where its value does not tell of them: in terms too small beside others though
// they are not zero, as exp(-(t - 40)^2) beside q at t near 0, and in exp and tanh far out, where these are flat. Input
// nodes, each once. `sized`: all_sized.
std::vector<std::set<Id>> hidden_inputs(const Graph& graph, const std::vector<Sized>& sized,
                                        const std::vector<Id>& roots);

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
    std::vector<Sized> evaluate_all_sized(const std::vector<Id>& roots) const {
        return all_sized(graph_, values_, roots);
    }
    // For each root the symbols that hidden_inputs finds. `sized`: evaluate_all_sized.
    std::vector<GiNaC::exset> hidden(const std::vector<Id>& roots, const std::vector<Sized>& sized) const;
    // Whether each root holds one of these symbols.
    std::vector<bool> holding(const std::vector<Id>& roots, const std::vector<GiNaC::symbol>& symbols) const;
    std::vector<cln::cl_R> operator()(const std::vector<GiNaC::ex>& expressions) {
        return evaluate(convert(expressions));
    }

private:
    Graph graph_;
    GiNaC::exmap inputs_;
    std::vector<cln::cl_R> values_;
    std::unordered_map<GiNaC::ex, Id> converted_;
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
    virtual ~NearStart() = default;

    virtual cln::cl_R parameter(std::size_t index);
    virtual cln::cl_R position(std::size_t coordinate);
    virtual cln::cl_R velocity(std::size_t coordinate);  // near 0 where the scene gives momenta
    cln::cl_R near(const cln::cl_R& value);              // within a quarter of its size, or of 1 for 0
    // Sets the scene's symbols: parameters, positions, velocities, time.
    void set_all(Formulas& formulas);

protected:
    cln::cl_R noise() { return noise_.next(); }

private:
    const Scene& scene_;
    int attempt_;
    Noise noise_;
    cln::cl_R spread_;
};

// Points where some of the numbers are not the scene's, which any run may replace: a term that is lost in rounding at
// the start of the scene may be all that matters elsewhere.
class Elsewhere final : public NearStart {
public:
    enum class Way {
        all,
        small,
        large,
        parameters,
        motion
    };  // what is elsewhere; small, large: all, by size of motion
    static constexpr Way ways[] = {Way::all, Way::small, Way::large, Way::parameters, Way::motion};

    Elsewhere(const Scene& scene, Way way, int attempt) : NearStart(scene, attempt), way_(way) {}
    cln::cl_R parameter(std::size_t index) override;
    cln::cl_R position(std::size_t coordinate) override;
    cln::cl_R velocity(std::size_t coordinate) override;

private:
    cln::cl_R motion();
    Way way_;
};

constexpr int sample_attempts = 40, attempts_elsewhere = 3;

// use(point) at two points near the start, and at one elsewhere of each way, where all formulas have values. What
// `use` throws as DomainError asks for another point; thrown on when there is none near the start.
template <class Use>
void at_sample_points(const Scene& scene, const Use& use) {
    for (int attempt = 0, done = 0; done < 2; ++attempt) {
        try {
            NearStart point(scene, attempt);
            use(point);
            ++done;
        } catch (const DomainError&) {
            if (attempt == sample_attempts) throw;
        }
    }
    for (const Elsewhere::Way way : Elsewhere::ways) {
        for (int attempt = 0; attempt < attempts_elsewhere; ++attempt) {
            try {
                Elsewhere point(scene, way, attempt);
                use(point);
                break;
            } catch (const DomainError&) {
            }
        }
    }
}

}  // namespace lobatto

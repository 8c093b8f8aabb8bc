// SPDX-License-Identifier: MIT
#include "runtime/measure/manifold.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "runtime/error.hpp"

namespace lobatto {

namespace {

using Quadruple = __float128;
using Numbers128 = std::vector<Quadruple>;

struct PointOnManifold {
    Numbers128 q, p;
};

Quadruple magnitude(Quadruple x) {
    return x < 0 ? -x : x;
}
Quadruple largest_of(const Numbers128& x) {
    Quadruple most = 0;
    for (const Quadruple value : x) most = std::max(most, magnitude(value));
    return most;
}

// x with A x = b, A positive definite and small.
Numbers128 solved_for_pull(Numbers128 A, Numbers128 b) {
    const std::size_t n = b.size();
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t i = k + 1; i < n; ++i) {
            const Quadruple factor = A[i * n + k] / A[k * n + k];
            for (std::size_t j = k; j < n; ++j) A[i * n + j] -= factor * A[k * n + j];
            b[i] -= factor * b[k];
        }
    for (std::size_t k = n; k-- > 0;) {
        for (std::size_t j = k + 1; j < n; ++j) b[k] -= A[k * n + j] * b[j];
        b[k] /= A[k * n + k];
    }
    return b;
}

class Manifold {
public:
    Manifold(const Kernel& kernel, const Numbers128& parameters, Quadruple step) : stepper_(kernel) {
        if (stepper_.prepare(parameters, step) != LOBATTO_OK) fail();
    }

    // The state after some steps from `start` at time 0.
    PointOnManifold flow(const PointOnManifold& start, std::int64_t steps) {
        if (stepper_.start(Quadruple(0), start.q, start.p) != LOBATTO_OK) fail();
        lobatto_advance call{};
        call.steps = steps;
        if (stepper_.advance(call) != LOBATTO_OK) fail();
        Quadruple time = 0;
        PointOnManifold end;
        stepper_.state(time, end.q, end.p);
        return end;
    }

    // The nearest state on the manifold at time 0, about.
    PointOnManifold nearest(PointOnManifold z) {
        const std::size_t n = z.q.size();
        Numbers128 phi, phi_t, G, v;
        for (int iteration = 0; iteration < 8; ++iteration) {
            stepper_.constraint(Quadruple(0), z.q, phi, phi_t, G);
            const std::size_t count = phi.size();
            Numbers128 square(count * count, Quadruple(0));
            for (std::size_t c = 0; c < count; ++c)
                for (std::size_t d = 0; d < count; ++d)
                    for (std::size_t k = 0; k < n; ++k) square[c * count + d] += G[c * n + k] * G[d * n + k];
            const Numbers128 pull = solved_for_pull(square, phi);
            for (std::size_t c = 0; c < count; ++c)
                for (std::size_t k = 0; k < n; ++k) z.q[k] -= G[c * n + k] * pull[c];
        }
        if (stepper_.velocity(Quadruple(0), z.q, z.p, v) != LOBATTO_OK) fail();
        z.p = stepper_.momentum(Quadruple(0), z.q, v);
        return z;
    }

private:
    [[noreturn]] static void fail() {
        throw ComputationError("the step cannot be looked at: it fails at this state or beside it");
    }
    LoadedStepper<Quadruple> stepper_;
};

// Half the way from one state to the other.
PointOnManifold half_between(const PointOnManifold& from, const PointOnManifold& to) {
    PointOnManifold half = from;
    for (std::size_t k = 0; k < half.q.size(); ++k) {
        half.q[k] = (to.q[k] - from.q[k]) / 2;
        half.p[k] = (to.p[k] - from.p[k]) / 2;
    }
    return half;
}

}  // namespace

double area_defect(const Kernel& kernel, const QuadrupleStart& start, Quadruple step) {
    constexpr int states = 3, pairs = 3, steps_between = 7;
    const Quadruple e = 1e-9;
    Manifold manifold(kernel, start.parameters, step);
    std::mt19937_64 generator(3);
    const auto random = [&] { return static_cast<Quadruple>(static_cast<double>(generator() >> 11) * 0x1p-52 - 1); };
    PointOnManifold z{start.q, start.p};
    Quadruple worst = 0;
    for (int state = 0; state < states; ++state) {
        // Small beside what the step moves, not beside the place, which may be far from 0; above the place's rounding.
        const PointOnManifold next = manifold.flow(z, 1);
        Quadruple moved = 0;
        for (std::size_t k = 0; k < z.q.size(); ++k) moved = std::max(moved, magnitude(next.q[k] - z.q[k]));
        const Quadruple place = std::max(largest_of(z.q), Quadruple(1e-9)),
                        of_q = std::max(moved, Quadruple(1e-6) * place), of_p = std::max(largest_of(z.p), of_q);
        for (int pair = 0; pair < pairs; ++pair) {
            PointOnManifold direction[2], image[2];
            for (int side = 0; side < 2; ++side) {
                PointOnManifold ahead = z, behind = z;
                for (std::size_t k = 0; k < z.q.size(); ++k) {
                    const Quadruple dq = e * of_q * random(), dp = e * of_p * random();
                    ahead.q[k] += dq;
                    behind.q[k] -= dq;
                    ahead.p[k] += dp;
                    behind.p[k] -= dp;
                }
                ahead = manifold.nearest(ahead);
                behind = manifold.nearest(behind);
                direction[side] = half_between(behind, ahead);
                image[side] = half_between(manifold.flow(behind, 1), manifold.flow(ahead, 1));
            }
            Quadruple change = 0, size = 0;
            for (std::size_t k = 0; k < z.q.size(); ++k) {
                const Quadruple terms[] = {image[0].q[k] * image[1].p[k], -image[1].q[k] * image[0].p[k],
                                           -direction[0].q[k] * direction[1].p[k],
                                           direction[1].q[k] * direction[0].p[k]};
                for (const Quadruple term : terms) {
                    change += term;
                    size += magnitude(term);
                }
            }
            worst = std::max(worst, magnitude(change) / size);
        }
        if (kernel->autonomous == 0) break;  // states are looked at as those of time 0
        z = manifold.flow(z, steps_between);
    }
    return static_cast<double>(worst);
}

double return_distance(const Kernel& kernel, const QuadrupleStart& start, Quadruple step, std::int64_t steps) {
    LoadedStepper<Quadruple> stepper(kernel);
    Numbers128 q = start.q, p = start.p;
    Quadruple time = 0, size = largest_of(start.q);
    for (const Quadruple h : {step, -step}) {
        lobatto_advance call{};
        call.steps = steps;
        if (stepper.prepare(start.parameters, h) != LOBATTO_OK || stepper.start(time, q, p) != LOBATTO_OK ||
            stepper.advance(call) != LOBATTO_OK)
            throw ComputationError("a step fails on the way");
        stepper.state(time, q, p);
        size = std::max(size, largest_of(q));
    }
    Quadruple distance = 0;
    for (std::size_t k = 0; k < q.size(); ++k) distance = std::max(distance, magnitude(q[k] - start.q[k]));
    return static_cast<double>(distance / size);
}

}  // namespace lobatto

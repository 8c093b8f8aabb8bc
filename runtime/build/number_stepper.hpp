// SPDX-License-Identifier: MIT
// One trajectory inside a loaded kernel of any number type: numbers are handed over as sums of doubles, `parts` each.
//
// Vectors are number-major: number k is the sum of [k * parts] ... [k * parts + parts - 1], of which the first is its
// rounded value. For a kernel in double they are the numbers themselves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

class NumberStepper {
public:
    using Parts = std::vector<double>;

    explicit NumberStepper(Kernel kernel);

    const Kernel& kernel() const { return kernel_; }
    std::size_t parts() const { return parts_; }
    std::size_t coordinates() const { return n_; }

    lobatto_status prepare(const Parts& parameters, const Parts& step);
    lobatto_status start(const Parts& time, const Parts& q, const Parts& p);
    void state(Parts& time, Parts& q, Parts& p) const;
    lobatto_status energy(const double* time, const double* q, const double* p, double* energy) const;
    Parts momentum(const Parts& time, const Parts& q, const Parts& velocity) const;
    lobatto_status velocity(const Parts& time, const Parts& q, const Parts& p, Parts& velocity) const;
    lobatto_status multipliers(const Parts& time, const Parts& q, const Parts& p, Parts& lambda) const;
    lobatto_status tangent(const Parts& time, const Parts& q, const Parts& p, Parts& T) const;
    // Records and events come as parts; `call` has room for `capacity` and `event_capacity` rows and counts them.
    lobatto_status advance(lobatto_advance& call, Parts& records, Parts& events);

    // Everything it knows, as LoadedStepper.
    std::string memory() const;
    void restore(const std::string& memory);

private:
    using Bytes = std::vector<std::byte>;
    Bytes numbers(const double* values, std::size_t count) const;
    Bytes room(std::size_t count) const { return Bytes(count * bytes_); }
    Parts parts_of(const Bytes& numbers, std::size_t count) const;
    using StateFunction = std::int32_t (*)(const void* stepper, const void* time, const void* q, const void* p,
                                           void* value);
    lobatto_status evaluate(StateFunction function, const double* time, const double* q, const double* p,
                            Bytes& value) const;

    Kernel kernel_;
    std::size_t parts_, n_, bytes_;
    AlignedMemory stepper_;
};

}  // namespace lobatto

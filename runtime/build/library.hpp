// SPDX-License-Identifier: MIT
// A compiled kernel, loaded and checked: shared object to function table.
#pragma once

#include <string>
#include <vector>

#include "runtime/build/aligned_memory.hpp"
#include "runtime/build/compile.hpp"
#include "runtime/build/kernel_object.hpp"
#include "runtime/kernel/abi.h"

namespace lobatto {

struct DoubleDouble;  // runtime/kernel/base/double_double.hpp

template <class real>
constexpr lobatto_real real_kind();
template <>
constexpr lobatto_real real_kind<float>() {
    return LOBATTO_FLOAT;
}
template <>
constexpr lobatto_real real_kind<double>() {
    return LOBATTO_DOUBLE;
}
template <>
constexpr lobatto_real real_kind<long double>() {
    return LOBATTO_LONG_DOUBLE;
}
template <>
constexpr lobatto_real real_kind<__float128>() {
    return LOBATTO_FLOAT128;
}
template <>
constexpr lobatto_real real_kind<DoubleDouble>() {
    return LOBATTO_DOUBLE_DOUBLE;
}

// A loaded kernel; copies share the library, which is unloaded with the last of them. Thread-safe: the table is
// constant.
class Kernel {
public:
    // A kernel of these formulas and of this version of the interface; else throws MachineError.
    static Kernel load(const std::string& path, const std::string& expected_digest);

    const lobatto_kernel& table() const { return *table_; }
    const lobatto_kernel* operator->() const { return table_; }

private:
    KernelObject object_;
    const lobatto_kernel* table_ = nullptr;
};

// One trajectory inside a loaded kernel: the host's side of the Stepper<K> of kernel.hpp. `real` must be the kernel's
// number type. All functions that can fail return lobatto_status; shapes as in abi.h.
template <class real>
class LoadedStepper {
public:
    explicit LoadedStepper(Kernel kernel);  // MachineError when real is not the kernel's number type
    LoadedStepper(const LoadedStepper& other);
    LoadedStepper& operator=(const LoadedStepper& other);
    LoadedStepper(LoadedStepper&&) noexcept = default;
    LoadedStepper& operator=(LoadedStepper&&) noexcept = default;

    lobatto_status prepare(const std::vector<real>& parameters, real step);
    lobatto_status start(real time, const std::vector<real>& q, const std::vector<real>& p);
    // The same, but what `other`, of the same kernel, knows of events is kept.
    lobatto_status go_on(const LoadedStepper& other, real time, const std::vector<real>& q, const std::vector<real>& p);
    lobatto_status advance(lobatto_advance& call);
    lobatto_status set_inputs(const std::vector<real>& parameters);  // of a kernel with inputs: abi.h
    void state(real& time, std::vector<real>& q, std::vector<real>& p) const;

    // Position and velocity as sums of two numbers, of a kernel with clean arithmetic; false for others.
    bool two_fold_state(std::vector<real>& q, std::vector<real>& q_rest, std::vector<real>& velocity,
                        std::vector<real>& velocity_rest) const;

    // Position and velocity at t + theta h inside the last step, on its polynomial.
    lobatto_status dense(real theta, std::vector<real>& q, std::vector<real>& velocity) const;

    lobatto_status energy(real time, const std::vector<real>& q, const std::vector<real>& p, real& energy) const;
    std::vector<real> momentum(real time, const std::vector<real>& q, const std::vector<real>& velocity) const;
    lobatto_status velocity(real time, const std::vector<real>& q, const std::vector<real>& p,
                            std::vector<real>& velocity) const;
    // phi, dphi/dt at fixed q, and dphi/dq, row by row: of kernels with constraints.
    void constraint(real time, const std::vector<real>& q, std::vector<real>& phi, std::vector<real>& phi_t,
                    std::vector<real>& G) const;
    lobatto_status multipliers(real time, const std::vector<real>& q, const std::vector<real>& p,
                               std::vector<real>& lambda) const;
    // Lv = dL/dq' and Lq = dL/dq + forces, n each.
    void slopes(real time, const std::vector<real>& q, const std::vector<real>& velocity, std::vector<real>& Lv,
                std::vector<real>& Lq) const;
    lobatto_status residual(real time, const std::vector<real>& q, const std::vector<real>& p,
                            const std::vector<real>& X, std::vector<real>& F) const;  // N
    lobatto_status jacobian(real time, const std::vector<real>& q, const std::vector<real>& p,
                            const std::vector<real>& X, std::vector<real>& J) const;  // N x N
    // One step from (q, p) at `time` with its tangent map T, 2n x 2n; does not touch the trajectory.
    lobatto_status tangent(real time, const std::vector<real>& q, const std::vector<real>& p, std::vector<real>& q1,
                           std::vector<real>& p1, std::vector<real>& T) const;

    // Everything a stepper knows, for a later process with the same object: stepper_bytes bytes, which hold no address.
    std::string memory() const;
    void restore(const std::string& memory);  // of a stepper of this size, prepared

    const Kernel& kernel() const { return kernel_; }

private:
    Kernel kernel_;
    AlignedMemory stepper_;
};

}  // namespace lobatto

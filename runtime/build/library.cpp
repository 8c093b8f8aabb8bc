// SPDX-License-Identifier: MIT
#include "runtime/build/library.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cstring>

#include "runtime/error.hpp"
#include "runtime/kernel/base/double_double.hpp"

namespace lobatto {
namespace {

const char* name_of(lobatto_real kind) {
    switch (kind) {
        case LOBATTO_FLOAT:
            return "float";
        case LOBATTO_DOUBLE:
            return "double";
        case LOBATTO_LONG_DOUBLE:
            return "long double";
        case LOBATTO_FLOAT128:
            return "__float128";
        case LOBATTO_DOUBLE_DOUBLE:
            return "double-double";
        case LOBATTO_MANY_DIGITS:
            return "many digits";
    }
    return "an unknown number type";
}

}  // namespace

Kernel Kernel::load(const std::string& path, const std::string& expected_digest) {
    Kernel kernel;
    kernel.object_ = KernelObject(path);
    kernel.table_ = kernel.object_.table<lobatto_kernel>("lobatto_kernel_table", expected_digest);
    return kernel;
}

template <class real>
LoadedStepper<real>::LoadedStepper(Kernel kernel)
    : kernel_(std::move(kernel)), stepper_(kernel_->stepper_bytes, kernel_->stepper_alignment) {
    const auto kind = static_cast<lobatto_real>(kernel_->real_kind);
    if (kind != real_kind<real>() || kernel_->real_bytes != static_cast<std::int32_t>(sizeof(real))) {
        throw MachineError(fmt::format("the kernel {} computes in {}, but was asked to compute in {}", kernel_->name,
                                       name_of(kind), name_of(real_kind<real>())));
    }
}

template <class real>
LoadedStepper<real>::LoadedStepper(const LoadedStepper& other) : LoadedStepper(other.kernel_) {
    std::memcpy(stepper_.get(), other.stepper_.get(), static_cast<std::size_t>(kernel_->stepper_bytes));
}

template <class real>
LoadedStepper<real>& LoadedStepper<real>::operator=(const LoadedStepper& other) {
    return *this = LoadedStepper(other);
}

template <class real>
std::string LoadedStepper<real>::memory() const {
    return {static_cast<const char*>(stepper_.get()), static_cast<std::size_t>(kernel_->stepper_bytes)};
}

template <class real>
void LoadedStepper<real>::restore(const std::string& memory) {
    assert(std::ssize(memory) == kernel_->stepper_bytes);
    std::memcpy(stepper_.get(), memory.data(), memory.size());
}

template <class real>
lobatto_status LoadedStepper<real>::prepare(const std::vector<real>& parameters, real step) {
    assert(std::ssize(parameters) == kernel_->parameters);
    return static_cast<lobatto_status>(kernel_->prepare(stepper_.get(), parameters.data(), &step));
}

template <class real>
lobatto_status LoadedStepper<real>::start(real time, const std::vector<real>& q, const std::vector<real>& p) {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(p) == kernel_->coordinates);
    return static_cast<lobatto_status>(kernel_->start(stepper_.get(), &time, q.data(), p.data()));
}

template <class real>
lobatto_status LoadedStepper<real>::go_on(const LoadedStepper& other, real time, const std::vector<real>& q,
                                          const std::vector<real>& p) {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(p) == kernel_->coordinates);
    return static_cast<lobatto_status>(kernel_->go_on(stepper_.get(), other.stepper_.get(), &time, q.data(), p.data()));
}

template <class real>
lobatto_status LoadedStepper<real>::advance(lobatto_advance& call) {
    return static_cast<lobatto_status>(kernel_->advance(stepper_.get(), &call));
}

template <class real>
lobatto_status LoadedStepper<real>::set_inputs(const std::vector<real>& parameters) {
    assert(std::ssize(parameters) == kernel_->parameters);
    return static_cast<lobatto_status>(kernel_->set_inputs(stepper_.get(), parameters.data()));
}

template <class real>
void LoadedStepper<real>::state(real& time, std::vector<real>& q, std::vector<real>& p) const {
    q.resize(kernel_->coordinates);
    p.resize(kernel_->coordinates);
    kernel_->state(stepper_.get(), &time, q.data(), p.data());
}

template <class real>
bool LoadedStepper<real>::two_fold_state(std::vector<real>& q, std::vector<real>& q_rest, std::vector<real>& velocity,
                                         std::vector<real>& velocity_rest) const {
    if (kernel_->two_fold_state == nullptr) return false;
    for (std::vector<real>* values : {&q, &q_rest, &velocity, &velocity_rest}) values->resize(kernel_->coordinates);
    kernel_->two_fold_state(stepper_.get(), q.data(), q_rest.data(), velocity.data(), velocity_rest.data());
    return true;
}

template <class real>
lobatto_status LoadedStepper<real>::dense(real theta, std::vector<real>& q, std::vector<real>& velocity) const {
    q.resize(kernel_->coordinates);
    velocity.resize(kernel_->coordinates);
    return static_cast<lobatto_status>(kernel_->dense(stepper_.get(), &theta, q.data(), velocity.data()));
}

template <class real>
lobatto_status LoadedStepper<real>::energy(real time, const std::vector<real>& q, const std::vector<real>& p,
                                           real& energy) const {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(p) == kernel_->coordinates);
    return static_cast<lobatto_status>(kernel_->energy(stepper_.get(), &time, q.data(), p.data(), &energy));
}

template <class real>
std::vector<real> LoadedStepper<real>::momentum(real time, const std::vector<real>& q,
                                                const std::vector<real>& velocity) const {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(velocity) == kernel_->coordinates);
    std::vector<real> p(kernel_->coordinates);
    kernel_->momentum(stepper_.get(), &time, q.data(), velocity.data(), p.data());
    return p;
}

template <class real>
lobatto_status LoadedStepper<real>::velocity(real time, const std::vector<real>& q, const std::vector<real>& p,
                                             std::vector<real>& velocity) const {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(p) == kernel_->coordinates);
    velocity.resize(kernel_->coordinates);
    return static_cast<lobatto_status>(kernel_->velocity(stepper_.get(), &time, q.data(), p.data(), velocity.data()));
}

template <class real>
void LoadedStepper<real>::constraint(real time, const std::vector<real>& q, std::vector<real>& phi,
                                     std::vector<real>& phi_t, std::vector<real>& G) const {
    const auto count = static_cast<std::size_t>(kernel_->constraints);
    phi.resize(count);
    phi_t.resize(count);
    G.resize(count * q.size());
    if (count > 0) kernel_->constraint(stepper_.get(), &time, q.data(), phi.data(), phi_t.data(), G.data());
}

template <class real>
lobatto_status LoadedStepper<real>::multipliers(real time, const std::vector<real>& q, const std::vector<real>& p,
                                                std::vector<real>& lambda) const {
    lambda.resize(static_cast<std::size_t>(kernel_->constraints));
    return static_cast<lobatto_status>(kernel_->multipliers(stepper_.get(), &time, q.data(), p.data(), lambda.data()));
}

template <class real>
void LoadedStepper<real>::slopes(real time, const std::vector<real>& q, const std::vector<real>& velocity,
                                 std::vector<real>& Lv, std::vector<real>& Lq) const {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(velocity) == kernel_->coordinates);
    Lv.resize(kernel_->coordinates);
    Lq.resize(kernel_->coordinates);
    kernel_->slopes(stepper_.get(), &time, q.data(), velocity.data(), Lv.data(), Lq.data());
}

template <class real>
lobatto_status LoadedStepper<real>::residual(real time, const std::vector<real>& q, const std::vector<real>& p,
                                             const std::vector<real>& X, std::vector<real>& F) const {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(p) == kernel_->coordinates);
    assert(std::ssize(X) == kernel_->unknowns);
    F.resize(kernel_->unknowns);
    return static_cast<lobatto_status>(
        kernel_->residual(stepper_.get(), &time, q.data(), p.data(), X.data(), F.data()));
}

template <class real>
lobatto_status LoadedStepper<real>::jacobian(real time, const std::vector<real>& q, const std::vector<real>& p,
                                             const std::vector<real>& X, std::vector<real>& J) const {
    assert(std::ssize(q) == kernel_->coordinates && std::ssize(p) == kernel_->coordinates);
    assert(std::ssize(X) == kernel_->unknowns);
    J.resize(X.size() * X.size());
    return static_cast<lobatto_status>(
        kernel_->jacobian(stepper_.get(), &time, q.data(), p.data(), X.data(), J.data()));
}

template <class real>
lobatto_status LoadedStepper<real>::tangent(real time, const std::vector<real>& q, const std::vector<real>& p,
                                            std::vector<real>& q1, std::vector<real>& p1, std::vector<real>& T) const {
    const std::size_t n = q.size();
    assert(std::ssize(q) == kernel_->coordinates && p.size() == n);
    q1.resize(n);
    p1.resize(n);
    T.resize(4 * n * n);
    return static_cast<lobatto_status>(
        kernel_->tangent(stepper_.get(), &time, q.data(), p.data(), q1.data(), p1.data(), T.data()));
}

template class LoadedStepper<float>;
template class LoadedStepper<double>;
template class LoadedStepper<long double>;
template class LoadedStepper<__float128>;
template class LoadedStepper<DoubleDouble>;

}  // namespace lobatto

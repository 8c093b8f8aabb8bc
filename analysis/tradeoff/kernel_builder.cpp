// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/kernel_builder.hpp"

#include <algorithm>
#include <system_error>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/mechanics/clock/automatic_clock.hpp"
#include "generator/pipeline.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

// With other values of the parameters where the scene allows no start with its own (derived_kernel.hpp).
Derivation derive_for(const Scene& written, const Scene& with_values) {
    try {
        return derive(written);
    } catch (const InputError&) {
        return derive(with_values);
    }
}

// Nothing where there is none, or it is not positive at the start.
std::optional<Derivation> derive_with_automatic_clock(const Scene& written, const Scene& with_values) {
    if (!has_automatic_clock(written)) return std::nullopt;
    try {
        return derive_for(with_automatic_clock(written), with_automatic_clock(with_values));
    } catch (const InputError&) {
        return std::nullopt;
    }
}

}  // namespace

KernelBuilder::KernelBuilder(const Scene& written, const Scene& with_values, bool tries_clocks) {
    const StepClock own = !written.clock                ? StepClock::none
                          : written.clock->is_automatic ? StepClock::automatic
                                                        : StepClock::of_scene;
    if (own != StepClock::none) derivations_.emplace(own, derive_for(written, with_values));
    const Scene equal = with_equal_steps(written), equal_with_values = with_equal_steps(with_values);
    derivations_.emplace(StepClock::none, derive_for(equal, equal_with_values));
    allowed_ = {own};
    if (tries_clocks) {
        allowed_.insert(StepClock::none);
        if (std::optional<Derivation> automatic;
            own != StepClock::automatic && (automatic = derive_with_automatic_clock(equal, equal_with_values)))
            allowed_.insert(derivations_.emplace(StepClock::automatic, std::move(*automatic)).first->first);
    }
    try {
        for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
            workers_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
        if (workers_.empty()) throw;  // fewer do, too
    }
}

KernelBuilder::~KernelBuilder() {
    cancel();
    abandoned_ = true;
    {
        const std::lock_guard lock(mutex_);
        closing_ = true;
    }
    ordered_.notify_all();
    for (std::thread& worker : workers_) worker.join();
}

void KernelBuilder::cancel() {
    const std::lock_guard lock(mutex_);
    for (Item* item : queue_) item->cancelled = true;
    queue_.clear();
    for (auto item = items_.begin(); item != items_.end();)
        item = item->second.cancelled ? items_.erase(item) : std::next(item);
}

void KernelBuilder::order(const Member& member) {
    if (is_ordered(member)) return;
    EmitOptions options;
    options.precision = member.precision;
    const KernelSource source = emit(with_method(derivation(member.clock), member.method()), options);
    Item item;
    item.digest = source.digest;
    item.translation = translation_of(source, member.precision);
    {
        const std::lock_guard lock(mutex_);
        queue_.push_back(&items_.emplace(member, std::move(item)).first->second);
    }
    ordered_.notify_one();
}

bool KernelBuilder::allows(const Member& member) const {
    if (allowed_.count(member.clock) == 0 || !reason_against_numbers(member.method()).empty()) return false;
    if (member.clock != StepClock::none && member.precision != Precision::double_)
        return false;  // nor does lobatto run
    const Derivation& scene = derivation(member.clock);
    if (!scene.scene.constraints.empty() && member.family != Family::lobatto) return false;
    const bool is_general = member.family != Family::splitting && member.arithmetic == StepArithmetic::plain;
    return is_general || (scene.system.separable && member.clock == StepClock::none && !scene.scene.is_cut());
}

std::vector<StepClock> KernelBuilder::clocks() const {
    std::vector<StepClock> clocks(allowed_.begin(), allowed_.end());
    std::erase(clocks, StepClock::none);
    return clocks;
}

bool KernelBuilder::is_ready(const Member& member) const {
    const auto item = items_.find(member);
    const std::lock_guard lock(mutex_);
    return item != items_.end() && item->second.ready;
}

Kernel KernelBuilder::kernel(const Member& member) {
    order(member);
    Item& item = items_.at(member);
    {
        std::unique_lock lock(mutex_);
        finished_.wait(lock, [&] { return item.ready; });
    }
    if (item.failure) std::rethrow_exception(item.failure);
    if (!item.kernel) item.kernel = Kernel::load(item.compiled->object, item.digest);
    return *item.kernel;
}

double KernelBuilder::compile_seconds(const Member& member) const {
    const std::lock_guard lock(mutex_);
    const Item& item = items_.at(member);
    return item.compiled ? item.compiled->seconds : 0;
}

void KernelBuilder::work() {
    while (true) {
        Item* item = nullptr;
        {
            std::unique_lock lock(mutex_);
            ordered_.wait(lock, [&] { return closing_ || !queue_.empty(); });
            if (queue_.empty()) return;
            item = queue_.front();
            queue_.pop_front();
        }
        std::optional<Compiled> compiled;
        std::exception_ptr failure;
        try {
            compiled = compile(item->translation, &abandoned_);
        } catch (...) {
            failure = std::current_exception();
        }
        {
            const std::lock_guard lock(mutex_);
            item->compiled = std::move(compiled);
            item->failure = failure;
            item->ready = true;
        }
        finished_.notify_all();
    }
}

}  // namespace lobatto

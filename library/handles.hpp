// SPDX-License-Identifier: GPL-2.0-or-later
// What stands behind the handles of lobatto.h: a value of lobatto.hpp, and what went wrong.
#pragma once

#include <new>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "library/include/lobatto/lobatto.h"
#include "library/parts.hpp"

namespace lobatto::api {

// What each handle has.
template <class Value>
struct Handle {
    std::optional<Value> value;
    int status = 0;
    std::string message;

    // Runs the work, whose exceptions become status and message. It may return whether the motion goes on.
    template <class Work>
    int attempt(Work&& work) noexcept {
        status = 0;
        try {
            message.clear();
            if constexpr (std::is_same_v<decltype(work()), bool>) {
                if (!work()) status = stopped;
            } else {
                work();
            }
        } catch (const Error& error) {
            fail(error.exit_code(), error.what());
        } catch (const std::exception& error) {
            fail(4, error.what());
        } catch (...) {
            fail(4, "unknown error");
        }
        return status;
    }

    static constexpr int stopped = 1;

private:
    void fail(int code, const char* text) noexcept {
        status = code;
        try {
            message = text;
        } catch (...) {  // no memory: the status says it
        }
    }
};

inline Settings settings_of(const lobatto_settings* given) {
    Settings settings;
    if (given == nullptr) return settings;
    const auto put = [](std::string& text, const char* word) {
        if (word != nullptr) text = word;
    };
    if (given->points != 0) settings.points = given->points;
    if (given->stages != 0) settings.stages = given->stages;
    if (given->splitting != 0) settings.splitting = given->splitting;
    if (given->tolerance != 0) settings.tolerance = given->tolerance;
    put(settings.arithmetic, given->arithmetic);
    put(settings.numbers, given->numbers);
    put(settings.clock, given->clock);
    put(settings.step, given->step);
    put(settings.until, given->until);
    if (given->every != 0) settings.every = given->every;
    for (const char* const* set = given->set; set != nullptr && *set != nullptr; ++set) {
        const std::string argument = *set;
        settings.set.push_back(guarded([&] { return named_value(argument); }));
    }
    return settings;
}

// Element `index` of a list; null if there is none.
template <class List>
const typename List::value_type* element(const List& list, std::size_t index) {
    return index < list.size() ? &list[index] : nullptr;
}
inline const char* text(const std::vector<std::string>& list, std::size_t index) {
    const std::string* const found = element(list, index);
    return found == nullptr ? nullptr : found->c_str();
}

// Every function of lobatto.h may be given NULL where a handle belongs: its status is 4, as where memory is out.
template <class Made>
int status_of(const Made* handle) {
    return handle == nullptr ? 4 : handle->status;
}
template <class Made>
const char* message_of(const Made* handle) {
    return handle == nullptr ? "there is no handle: NULL was given" : handle->message.c_str();
}

// What `get` reads from the handle's value; `otherwise` if it has none.
template <class Made, class Get>
auto read(const Made* handle, decltype(std::declval<Get>()(*std::declval<Made>().value)) otherwise, Get&& get) {
    return handle != nullptr && handle->value ? get(*handle->value) : otherwise;
}

template <class Number>
const Number* data(const std::vector<Number>& values) {
    return values.empty() ? nullptr : values.data();
}

}  // namespace lobatto::api

struct lobatto_scene : lobatto::api::Handle<lobatto::api::Scene> {};

namespace lobatto::api {

inline const Scene& scene_of(const lobatto_scene* scene) {
    if (scene == nullptr) throw InputError("there is no scene: NULL was given");
    if (!scene->value) throw InputError("the scene was not read: " + scene->message);
    return *scene->value;
}

// A new handle, with what the work makes of it. NULL: memory is out.
template <class Made, class Work>
Made* made(Work&& work) noexcept {
    auto* const handle = new (std::nothrow) Made;
    if (handle != nullptr) handle->attempt([&] { return work(*handle); });
    return handle;
}

}  // namespace lobatto::api

// SPDX-License-Identifier: GPL-2.0-or-later
// Settings of lobatto.hpp as keyword arguments of Python.
#pragma once

#include <pybind11/pybind11.h>

#include <lobatto/lobatto.hpp>

// By the names of the command line; None is as the scene has it. TypeError where a value is of another kind, InputError
// where a number is not finite.
lobatto::api::Settings settings_of(const pybind11::kwargs& given);
pybind11::dict dict_of_settings(const lobatto::api::Settings& settings);

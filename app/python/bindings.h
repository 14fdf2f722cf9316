// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <nlohmann/json.hpp>

/// The parts of the module `lensforge`; each adds its classes and functions.
namespace lensforge::python {

void add_setup(pybind11::module_& module);
void add_lens(pybind11::module_& module);
void add_flux(pybind11::module_& module);
void add_commands(pybind11::module_& module);

/// JSON as Python's own values.
pybind11::object object_from(const nlohmann::json& json);

}  // namespace lensforge::python

// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>

#include <exception>
#include <nlohmann/json.hpp>
#include <string>

#include "app/python/bindings.h"
#include "core/error.h"
#include "core/text/version.h"

namespace lensforge::python {

pybind11::object object_from(const nlohmann::json& json) {
  return pybind11::module_::import("json").attr("loads")(json.dump());
}

namespace {

/// The libraries' three kinds of failure; a bug still ends the process with its values.
void add_errors(pybind11::module_& module) {
  const char* const package = "lensforge";  // Where they are imported from.
  pybind11::register_exception<InputError>(module, "InputError", PyExc_ValueError)
      .attr("__module__") = package;
  pybind11::register_exception<RunError>(module, "RunError", PyExc_RuntimeError)
      .attr("__module__") = package;
  pybind11::register_exception_translator([](std::exception_ptr error) {
    try {
      if (error) std::rethrow_exception(error);
    } catch (const Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    }
  });
}

}  // namespace
}  // namespace lensforge::python

PYBIND11_MODULE(_lensforge, module) {
  module.doc() = "From a picture to the milled lens that projects it.";
  lensforge::python::add_errors(module);
  lensforge::python::add_setup(module);
  lensforge::python::add_lens(module);
  lensforge::python::add_flux(module);
  lensforge::python::add_commands(module);
  module.attr("__version__") = pybind11::str(std::string(lensforge::version()));
}

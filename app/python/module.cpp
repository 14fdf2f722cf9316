// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cerrno>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/frame/command_line.h"
#include "app/python/bindings.h"
#include "core/error.h"
#include "core/schema/description.h"
#include "core/text/version.h"

namespace lensforge::python {

namespace py = pybind11;

py::object object_from(const nlohmann::json& json) {
  return py::module_::import("json").attr("loads")(json.dump());
}

RunControl ProgressRelay::control() {
  if (function_.is_none()) return {stop_.get_token(), {}};
  return {stop_.get_token(), [this](const Progress& progress) {
            const std::lock_guard lock(mutex_);
            latest_ = progress;
          }};
}

void ProgressRelay::call() {
  if (Clock::now() >= next_) end();
}

void ProgressRelay::end() {
  std::optional<Progress> report;
  {
    const std::lock_guard lock(mutex_);
    report.swap(latest_);
  }
  if (!report) return;
  function_(report->stage, report->done, report->total);
  next_ = Clock::now() + kProgressInterval;
}

void check_signals() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

namespace {

/// A Python text. Paths may hold any bytes.
py::object decoded(const std::string& text) {
  return py::reinterpret_steal<py::object>(
      PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<py::ssize_t>(text.size())));
}

/// A message with keywords for options.
py::object text_of(const std::string& message) { return decoded(in_keywords(message)); }

void raise(const char* type, const py::object& arguments) {
  const py::object kind = py::module_::import("lensforge._errors").attr(type);
  PyErr_SetObject(kind.ptr(), arguments.ptr());
}

/// The libraries' kinds of failure; a bug still ends the process with its values.
// NOLINTNEXTLINE(performance-unnecessary-value-param)  pybind11 sets the signature.
void translate(std::exception_ptr error) {
  try {
    if (error) std::rethrow_exception(error);
  } catch (const MissingFile& e) {
    raise("MissingFileError", py::make_tuple(ENOENT, text_of(e.what()), decoded(e.path())));
  } catch (const InputError& e) {
    raise("InputError", text_of(e.what()));
  } catch (const RunError& e) {
    raise("RunError", text_of(e.what()));
  } catch (const Interrupted&) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  }
}

/// The command itself, for a process that does nothing else. @return its exit code.
int run_command_line(std::vector<std::string> words) {
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const py::gil_scoped_release released;
  return app::run_main(static_cast<int>(words.size()), pointers.data());
}

}  // namespace
}  // namespace lensforge::python

PYBIND11_MODULE(_lensforge, module) {
  pybind11::options options;
  options.disable_function_signatures();
  module.doc() = "The compiled part of lensforge.";
  pybind11::register_exception_translator(lensforge::python::translate);
  lensforge::python::add_setup(module);
  lensforge::python::add_lens(module);
  lensforge::python::add_flux(module);
  lensforge::python::add_commands(module);
  module.def("run_command_line", &lensforge::python::run_command_line);
  module.attr("__version__") = pybind11::str(std::string(lensforge::version()));
}

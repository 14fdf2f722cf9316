// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <future>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <utility>

#include "core/error.h"

/// The parts of the module `lensforge`; each adds its classes and functions.

namespace lensforge::python {

void add_setup(pybind11::module_& module);
void add_lens(pybind11::module_& module);
void add_flux(pybind11::module_& module);
void add_commands(pybind11::module_& module);

/// Converts JSON to Python values.
pybind11::object object_from(const nlohmann::json& json);

/// Interval at which Python checks for Ctrl-C during long work, which then ends within a second.
inline constexpr std::chrono::milliseconds kSignalInterval{50};

/// Runs `work(stop_token)` in a thread of its own, without the interpreter's lock, and returns what
/// it returns. Ctrl-C, or any exception of a signal handler, stops the work and is raised when it
/// has ended. @pre `work` touches no Python object. @throw what `work` throws.
template <class Work>
auto run_released(Work&& work) {
  namespace py = pybind11;
  std::stop_source stop;
  auto outcome = std::async(std::launch::async, [&] { return work(stop.get_token()); });
  for (bool done = false; !done;) {
    {
      const py::gil_scoped_release released;
      done = outcome.wait_for(kSignalInterval) == std::future_status::ready;
    }
    if (PyErr_CheckSignals() == 0) continue;
    py::error_already_set raised;
    stop.request_stop();
    {
      const py::gil_scoped_release released;
      outcome.wait();
    }
    throw raised;
  }
  return outcome.get();
}

}  // namespace lensforge::python

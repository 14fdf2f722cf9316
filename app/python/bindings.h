// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <future>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <utility>

#include "core/compute/executor.h"
#include "core/error.h"

/// The parts of the module `lensforge._lensforge`; each adds its classes and functions. The
/// package's Python files give them their names, signatures and texts.

namespace lensforge::python {

void add_setup(pybind11::module_& module);
void add_lens(pybind11::module_& module);
void add_flux(pybind11::module_& module);
void add_commands(pybind11::module_& module);

/// Converts JSON to Python values.
pybind11::object object_from(const nlohmann::json& json);

/// Interval at which Python checks for Ctrl-C during long work, which then ends within a second.
inline constexpr std::chrono::milliseconds kSignalInterval{50};

/// Least time between two calls of a progress function.
inline constexpr std::chrono::milliseconds kProgressInterval{100};

/// Takes reports of work in another thread to a Python function.
class ProgressRelay {
 public:
  /// @param function  called with stage, done and total; or None.
  explicit ProgressRelay(pybind11::object function) : function_(std::move(function)) {}

  /// For the work; any thread may call its sink while this object lives.
  [[nodiscard]] RunControl control();
  /// Calls the function with the latest report if it is new and the last call long enough ago.
  /// @throw error_already_set: what the function raises.
  void call();
  /// Calls it with a report that is left.
  void end();
  void stop() { stop_.request_stop(); }

 private:
  using Clock = std::chrono::steady_clock;

  pybind11::object function_;
  std::stop_source stop_;
  std::mutex mutex_;
  std::optional<Progress> latest_;  ///< None once the function has it.
  Clock::time_point next_ = Clock::now();
};

/// Raises what a signal handler has raised. @throw error_already_set
void check_signals();

/// Runs `work(control)` in a thread of its own, without the interpreter's lock, and returns what it
/// returns. Ctrl-C, or any exception of a signal handler or of `progress`, stops the work and is
/// raised when it has ended.
/// @param progress  None, or a function that is called with stage, done and total.
/// @pre `work` touches no Python object. @throw what `work` throws.
template <class Work>
auto run_released(const pybind11::object& progress, Work&& work) {
  namespace py = pybind11;
  ProgressRelay relay(progress);
  auto outcome =
      std::async(std::launch::async, [&work, control = relay.control()] { return work(control); });
  try {
    for (bool done = false; !done;) {
      {
        const py::gil_scoped_release released;
        done = outcome.wait_for(kSignalInterval) == std::future_status::ready;
      }
      check_signals();
      relay.call();
    }
    relay.end();
  } catch (const py::error_already_set&) {
    relay.stop();
    const py::gil_scoped_release released;
    outcome.wait();
    throw;
  }
  return outcome.get();
}

/// The same without progress.
template <class Work>
auto run_released(Work&& work) {
  return run_released(pybind11::none(), std::forward<Work>(work));
}

}  // namespace lensforge::python

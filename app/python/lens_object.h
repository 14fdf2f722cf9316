// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>

#include "design/design_lens.h"

namespace lensforge::python {

namespace py = pybind11;

/// A lens in Python: what a design gave, or what a folder holds.
struct LensObject {
  DesignResult design;           ///< Without convergence, and `made`, of a lens that was read.
  std::filesystem::path folder;  ///< Where it lies; empty until it is saved.

  [[nodiscard]] const Lens& lens() const { return design.lens; }
};

/// The folder of a Lens or a path. @throw InputError if the lens has none yet.
std::filesystem::path folder_of(const py::object& lens);

/// A Lens itself, or the one in the folder of this path. @throw InputError as read_lens() does.
py::object lens_from(const py::object& lens);

}  // namespace lensforge::python

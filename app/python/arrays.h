// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"

/// Conversion between numpy arrays and the libraries' values. Results and attributes share the
/// libraries' memory; arguments are copied once.
namespace lensforge::python {

namespace py = pybind11;

/// C-contiguous arrays; others, and other numeric types, are converted by a copy.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;

/// A picture in linear light from an (H, W) array of floats. @param name  for messages.
/// @throw InputError if it has another shape or type, or a value that is negative or not finite.
Image image_from(const py::array& array, const std::string& name);

/// A mesh from (V, 3) coordinates, mm, and (F, 3) vertex numbers.
/// @throw InputError if the shapes differ, a coordinate is not finite or a vertex number out of
///        range.
SurfaceMesh mesh_from(const py::array& vertices, const py::array& faces);

/// One number for every pixel of an (H, W) array. @throw InputError for another shape.
std::vector<double> pixels_from(const py::array& array, const std::string& name,
                                const Eigen::Vector2i& pixels);

/// Read-only views, (H, W) float32, (V, 3) float64, (F, 3) int32; `owner` is kept alive by them.
py::array view_of(const Image& image, const py::object& owner);
py::array view_of(const Eigen::Matrix3Xd& columns, const py::object& owner);
py::array view_of(const Eigen::Matrix3Xi& columns, const py::object& owner);

/// Arrays that take over the memory: (H, W) float32, (H, W) float64 and (V, 3) float64.
py::array array_of(Image&& image);
py::array array_of(std::vector<double>&& values, const Eigen::Vector2i& pixels);
py::array array_of(Eigen::Matrix3Xd&& columns);

}  // namespace lensforge::python

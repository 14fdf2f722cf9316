// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "app/frame/option_set.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/mesh/surface_mesh.h"

/// Conversion between Python's values and the libraries'.
namespace lensforge::python {

namespace py = pybind11;

// Numpy arrays. Results and attributes share the libraries' memory; arguments are copied once.

/// C-contiguous arrays; others, and other numeric types, are converted by a copy.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;

/// A picture in linear light from an array (H, W) or (H, W, C), where C is 1 (grey), 2 (grey,
/// alpha), 3 (RGB) or 4 (RGB, alpha). Numbers are read as in files: floats are linear light and 1
/// is white; uint8 and uint16 are sRGB-encoded and their largest value is white. RGB becomes its
/// luminance (Rec. 709) in linear light; alpha is straight, 0 to 1 or to the largest value.
/// @param name        for messages.
/// @param background  what shows through where alpha is below 1.
/// @param kept        a channel in place of the luminance.
/// @throw InputError if it has another shape or type, a value that is negative or not finite, an
///        alpha above 1, or shows nothing in front of the background.
Image image_from(const py::array& array, const std::string& name, const Background& background,
                 KeptLight kept = KeptLight::kAll);

/// The same in colour; an array of grey has three equal channels. @throw as image_from().
LoadedColors colors_from(const py::array& array, const std::string& name,
                         const Background& background);

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

// Keywords.

/// Keyword arguments of a function: the options of the command of the same name, with '_' for '-'
/// and without leading dashes. Limits and defaults are those of the options' descriptions.
class Keywords {
 public:
  enum class Defaults {
    kOwn,      ///< The fields' values.
    kOfALens,  ///< A lens's, which the fields' values are not.
  };

  /// @param fields    the command's options.
  /// @param withheld  options that the function does not take, such as "--out".
  Keywords(std::string function, const Description& fields, const std::set<std::string>& withheld,
           Defaults defaults = Defaults::kOwn);

  /// The values of the options.
  /// @throw TypeError (Python's) naming function and keyword for an unknown keyword or a value of
  ///        the wrong type; InputError naming keyword, value and rule.
  [[nodiscard]] app::OptionValues values(const py::dict& given) const;

  /// Describes the keywords, their values and defaults, for a docstring.
  [[nodiscard]] std::string text() const;

 private:
  [[nodiscard]] const FieldSpec& spec_of(const std::string& keyword) const;

  std::string function_;
  std::vector<FieldSpec> specs_;
  std::map<std::string, std::string> defaults_;  ///< By option; empty texts where there is none.
};

}  // namespace lensforge::python

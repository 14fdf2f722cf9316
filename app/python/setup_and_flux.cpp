// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "app/frame/common_output.h"
#include "app/python/arrays.h"
#include "app/python/bindings.h"
#include "app/python/keywords.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/lens/optical_surface.h"
#include "core/lens/setup_json.h"
#include "core/optics/optical_setup.h"
#include "design/render.h"
#include "design/setup/design_options.h"
#include "design/setup/option_tables.h"

namespace lensforge::python {
namespace {

/// The options of a design that say how its lens is lit and seen.
Description options_of(DesignOptions& design) {
  Description options =
      description_of(design).only({"--width", "--focal", "--ior", "--thickness", "--view"});
  describe(options, design.light);
  return options;
}

/// @throw InputError naming the side.
void require_side(const char* name, int pixels) {
  if (Limits::between(kMinPixels, kMaxImageSide).hold(pixels)) return;
  throw InputError(name + (" " + std::to_string(pixels)) + ": must be " +
                   Limits::between(kMinPixels, kMaxImageSide).rule());
}

OpticalSetup make_setup(int columns, int rows, const app::OptionValues& values) {
  require_side("columns", columns);
  require_side("rows", rows);
  DesignOptions design;
  app::OptionSet options("Setup", "");
  options.add(options_of(design));
  options.take(values);
  design.pixels = std::max(columns, rows);
  validate(design, Image(columns, rows, 1.0F));
  return optical_setup(design, {columns, rows});
}

py::tuple pair_of(const Eigen::Vector2d& size) { return py::make_tuple(size.x(), size.y()); }

}  // namespace

void add_setup(py::module_& module) {
  DesignOptions usual;
  const Keywords keywords("Setup", options_of(usual), {"--threads", "--device"});
  py::class_<OpticalSetup> type(
      module, "Setup",
      "Everything between the lamp and the wall but the surface. It does not change.");
  const std::string text =
      "Setup(columns, rows, **options): light, lens and screen for a picture of so many pixels.\n"
      "The options are those of lensforge design:\n" +
      keywords.text();
  type.def(py::init([keywords](int columns, int rows, const py::kwargs& given) {
             return make_setup(columns, rows, keywords.values(given));
           }),
           py::arg("columns"), py::arg("rows"), text.c_str());
  type.def_property_readonly(
      "pixels", [](const OpticalSetup& s) { return py::make_tuple(s.pixels.x(), s.pixels.y()); },
      "(columns, rows) of the picture.");
  type.def_property_readonly(
      "lens_size", [](const OpticalSetup& s) { return pair_of(s.lens_size); },
      "(width, height) of the lens, mm.");
  type.def_property_readonly(
      "image_size", [](const OpticalSetup& s) { return pair_of(s.image_size); },
      "(width, height) of the picture on the screen, mm.");
  type.def_property_readonly(
      "focal_length", [](const OpticalSetup& s) { return s.focal_length; },
      "z of the picture's centre, mm in the lens frame.");
  type.def(
      "to_dict", [](const OpticalSetup& s) { return object_from(setup_json(s)); },
      "All of it, as lens.json has it.");
  type.def("__repr__", [](const OpticalSetup& s) {
    return "<lensforge.Setup " + app::fixed(s.lens_size.x(), 1) + " x " +
           app::fixed(s.lens_size.y(), 1) + " mm, " + app::size_text(s.pixels.x(), s.pixels.y()) +
           " pixels>";
  });
}

namespace {

constexpr int kMaxThreads = 1024;  // As --threads.

SurfaceModel model_named(const std::string& name) {
  for (const SurfaceModel model : kMeshModels) {
    if (model_name(model) == name) return model;
  }
  throw InputError("model " + name + ": must be facet or smooth");
}

Executor stoppable(int threads, const std::stop_token& stop) {
  if (threads < 0 || threads > kMaxThreads) {
    throw InputError("threads " + std::to_string(threads) + ": must be 0 to " +
                     std::to_string(kMaxThreads));
  }
  return Executor::cpu(threads).with_stop(stop);
}

py::array flux_image(const py::array& vertices, const py::array& faces, const OpticalSetup& setup,
                     const std::string& model, int threads) {
  const SurfaceMesh mesh = mesh_from(vertices, faces);
  const SurfaceModel chosen = model_named(model);
  auto flux = run_released([&](const std::stop_token& stop) {
    require_wall_above(mesh, setup);
    return flux_of_surface(mesh, setup, chosen, stoppable(threads, stop));
  });
  return array_of(std::move(flux), setup.pixels);
}

py::array flux_image_vjp(const py::array& vertices, const py::array& faces,
                         const OpticalSetup& setup, const py::array& cotangent,
                         const std::string& model, int threads) {
  const SurfaceMesh mesh = mesh_from(vertices, faces);
  const SurfaceModel chosen = model_named(model);
  const std::vector<double> pixels = pixels_from(cotangent, "cotangent", setup.pixels);
  auto gradient = run_released([&](const std::stop_token& stop) {
    require_wall_above(mesh, setup);
    return flux_of_surface_adjoint(mesh, setup, chosen, pixels, stoppable(threads, stop));
  });
  return array_of(std::move(gradient));
}

constexpr const char* kFluxText =
    "The flux that a mesh sends to every pixel, as shares of what the lens takes.\n\n"
    "vertices: (V, 3) floats, mm in the lens frame; faces: (F, 3) integers, counter-clockwise "
    "seen\n"
    "from +z; model: \"smooth\", normals at the vertices, or \"facet\".\n"
    "Returns (H, W) float64, row 0 on top; the sum is the share that lands in the picture.\n"
    "Raises InputError for arrays of another shape, or a screen that is not beyond the surface.";

constexpr const char* kAdjointText =
    "The vector-Jacobian product of flux_image().\n\n"
    "cotangent: (H, W), derivatives of a scalar by flux_image()'s pixels.\n"
    "Returns (V, 3) float64, derivatives of that scalar by the vertices, per mm.\n"
    "Raises InputError as flux_image() does, and for a setup with an outline.";

}  // namespace

void add_flux(py::module_& module) {
  module.def("flux_image", &flux_image, py::arg("vertices"), py::arg("faces"), py::arg("setup"),
             py::arg("model") = "smooth", py::arg("threads") = 0, kFluxText);
  module.def("flux_image_vjp", &flux_image_vjp, py::arg("vertices"), py::arg("faces"),
             py::arg("setup"), py::arg("cotangent"), py::arg("model") = "smooth",
             py::arg("threads") = 0, kAdjointText);
}

}  // namespace lensforge::python

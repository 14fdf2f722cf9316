// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>

#include <string>
#include <utility>

#include "app/python/arrays.h"
#include "app/python/bindings.h"
#include "app/python/released_work.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_model.h"
#include "design/flux_of_surface.h"
#include "design/render_setup.h"

namespace lensforge::python {
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

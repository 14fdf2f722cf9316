// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <variant>

#include "app/frame/common_output.h"
#include "app/python/bindings.h"
#include "app/python/conversions.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/image/rasters.h"
#include "core/lens/optical_surface.h"
#include "core/lens/setup_json.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "core/schema/json.h"
#include "design/render.h"
#include "design/setup/design_options.h"

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

/// All of a setup as Python values: lens.json's text, and a height map's columns, rows, samples and
/// size, which are in a file of their own there.
py::tuple state_of(const OpticalSetup& setup) {
  nlohmann::json document = setup_json(setup);
  py::object heights = py::none();
  const auto* const map = setup.front ? std::get_if<HeightFront>(&*setup.front) : nullptr;
  if (map != nullptr) {
    const HeightGrid& grid = map->spline->grid();
    const auto* const bytes = reinterpret_cast<const char*>(grid.heights.data());
    heights = py::make_tuple(grid.columns, grid.rows,
                             py::bytes(bytes, grid.heights.size() * sizeof(float)), map->size.x(),
                             map->size.y());
    document["front"] = {{"type", "flat"}, {"z", 0}};
  }
  return py::make_tuple(document.dump(), heights);
}

HeightFront height_front(const py::tuple& state) {
  HeightGrid grid{state[0].cast<int>(), state[1].cast<int>(), {}};
  const auto bytes = state[2].cast<std::string>();
  grid.heights.resize(bytes.size() / sizeof(float));
  std::memcpy(grid.heights.data(), bytes.data(), grid.heights.size() * sizeof(float));
  return {std::make_shared<HeightSpline>(std::move(grid)),
          {state[3].cast<double>(), state[4].cast<double>()}};
}

/// @throw InputError if the state is none.
OpticalSetup setup_of(const std::string& text, const py::object& heights) {
  const nlohmann::json document = parse_json(text, "setup");
  OpticalSetup setup = read_setup(JsonFields(document, "setup"));
  if (!heights.is_none()) setup.front = height_front(heights.cast<py::tuple>());
  validate(setup);
  return setup;
}

}  // namespace

void add_setup(py::module_& module) {
  DesignOptions usual;
  const Keywords keywords("Setup", options_of(usual), {"--threads", "--device"});
  py::class_<OpticalSetup> type(module, "Setup");
  type.def_property_readonly(
      "pixels", [](const OpticalSetup& s) { return py::make_tuple(s.pixels.x(), s.pixels.y()); });
  type.def_property_readonly("lens_size",
                             [](const OpticalSetup& s) { return pair_of(s.lens_size); });
  type.def_property_readonly("image_size",
                             [](const OpticalSetup& s) { return pair_of(s.image_size); });
  type.def_property_readonly("focal_length", [](const OpticalSetup& s) { return s.focal_length; });
  type.def("to_dict", [](const OpticalSetup& s) { return object_from(setup_json(s)); });
  type.def("state", &state_of);
  type.def("equals", [](const OpticalSetup& a, const OpticalSetup& b) { return a == b; });
  type.def("__repr__", [](const OpticalSetup& s) {
    return "<lensforge.Setup " + app::fixed(s.lens_size.x(), 1) + " x " +
           app::fixed(s.lens_size.y(), 1) + " mm, " + app::size_text(s.pixels.x(), s.pixels.y()) +
           " pixels>";
  });
  module.attr("setup_options") = keywords.text();
  module.def("make_setup", [keywords](int columns, int rows, const py::dict& given) {
    return make_setup(columns, rows, keywords.values(given));
  });
  module.def("setup_of", &setup_of);
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
  auto flux = run_released([&](const RunControl& control) {
    require_wall_above(mesh, setup);
    return flux_of_surface(mesh, setup, chosen, stoppable(threads, control.stop_token()));
  });
  return array_of(std::move(flux), setup.pixels);
}

py::array flux_image_vjp(const py::array& vertices, const py::array& faces,
                         const OpticalSetup& setup, const py::array& cotangent,
                         const std::string& model, int threads) {
  const SurfaceMesh mesh = mesh_from(vertices, faces);
  const SurfaceModel chosen = model_named(model);
  const std::vector<double> pixels = pixels_from(cotangent, "cotangent", setup.pixels);
  auto gradient = run_released([&](const RunControl& control) {
    require_wall_above(mesh, setup);
    return flux_of_surface_adjoint(mesh, setup, chosen, pixels,
                                   stoppable(threads, control.stop_token()));
  });
  return array_of(std::move(gradient));
}

}  // namespace

void add_flux(py::module_& module) {
  module.def("flux_image", &flux_image);
  module.def("flux_image_vjp", &flux_image_vjp);
}

}  // namespace lensforge::python

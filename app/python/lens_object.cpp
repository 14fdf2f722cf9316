// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/python/lens_object.h"

#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "app/commands/design_command.h"
#include "app/commands/overview.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/python/arrays.h"
#include "app/python/bindings.h"
#include "core/error.h"
#include "core/image/image_io.h"

namespace lensforge::python {
namespace {

namespace fs = std::filesystem;

std::shared_ptr<LensObject> read(const fs::path& folder) {
  auto lens = std::make_shared<LensObject>();
  lens->design.lens = run_released([&](const std::stop_token&) { return read_lens(folder); });
  lens->design.status = DesignResult::Status::kDone;
  lens->folder = folder;
  return lens;
}

void save(LensObject& lens, const fs::path& folder, bool force) {
  run_released([&](const std::stop_token&) {
    app::refuse_to_overwrite(folder, app::EarlierDesign::in(folder), false, force);
    const app::OutputFolder output(folder, FolderLock::Kind::kExclusive);
    app::write_design(folder, lens.design, app::Console(false, true));
  });
  lens.folder = folder;
}

/// Grey values 0 … 255 as displayed, three times each.
ColorImage displayed(const Image& image) {
  ColorImage color{image.columns(), image.rows(), {}};
  color.rgb.reserve(3 * image.values().size());
  for (const double value : encoded_values(image)) {
    color.rgb.insert(color.rgb.end(), 3, static_cast<unsigned char>(std::lround(255.0 * value)));
  }
  return color;
}

/// Target, projected picture, that of the part as made if it is known, and the surface.
py::bytes png_of(const LensObject& lens) {
  const std::vector<unsigned char> png = run_released([&](const std::stop_token&) {
    const auto& made = lens.design.made;
    return encode_png(displayed(app::draw_overview(lens.lens(), made ? &made->picture : nullptr)));
  });
  return {reinterpret_cast<const char*>(png.data()), png.size()};
}

std::string repr(const LensObject& object) {
  const Lens& lens = object.lens();
  const Eigen::Vector2d& size = lens.setup.lens_size;
  return "<lensforge.Lens " + app::fixed(size.x(), 1) + " x " + app::fixed(size.y(), 1) + " mm, " +
         app::size_text(lens.setup.pixels.x(), lens.setup.pixels.y()) + " pixels, " +
         model_name(lens.model) + ", " + app::metrics_text(lens.metrics.at(lens.model)) + ">";
}

const LensObject& object_of(const py::object& self) { return self.cast<const LensObject&>(); }

void add_views(py::class_<LensObject, std::shared_ptr<LensObject>>& type) {
  const auto view = [&type](const char* name, auto value, const char* text) {
    type.def_property_readonly(
        name,
        [value](const py::object& self) { return view_of(value(object_of(self).lens()), self); },
        text);
  };
  view(
      "vertices", [](const Lens& lens) -> auto& { return lens.surface.vertices; },
      "(V, 3) float64: the optical surface, mm in the lens frame; a read-only view.");
  view(
      "faces", [](const Lens& lens) -> auto& { return lens.surface.triangles; },
      "(F, 3) int32: vertex numbers, counter-clockwise seen from +z; a read-only view.");
  view(
      "target", [](const Lens& lens) -> auto& { return lens.target; },
      "(H, W) float32: the wanted picture, linear light, 1 is white; a read-only view.");
  view(
      "projected", [](const Lens& lens) -> auto& { return lens.render; },
      "(H, W) float32: the picture that the lens projects, as target; a read-only view.");
}

}  // namespace

fs::path folder_of(const py::object& lens) {
  if (!py::isinstance<LensObject>(lens)) return lens.cast<fs::path>();
  const fs::path& folder = object_of(lens).folder;
  if (folder.empty()) throw InputError("the lens is in no folder yet; save() it first");
  return folder;
}

py::object lens_from(const py::object& lens) {
  if (py::isinstance<LensObject>(lens)) return lens;
  return py::cast(read(lens.cast<fs::path>()));
}

void add_lens(py::module_& module) {
  py::class_<LensObject, std::shared_ptr<LensObject>> type(
      module, "Lens",
      "A designed lens: what design() returns, or what a lens folder holds. It does not change.");
  type.def(py::init(&read), py::arg("folder"), "Reads a lens folder.");
  add_views(type);
  type.def_property_readonly(
      "setup", [](const LensObject& self) { return self.lens().setup; },
      "Setup: light, screen and picture.");
  type.def_property_readonly(
      "model", [](const LensObject& self) { return model_name(self.lens().model); },
      "str: the surface model that it was designed with.");
  type.def_property_readonly(
      "metrics", [](const LensObject& self) { return object_from(app::metrics_json(self.lens())); },
      "dict: for every surface model how close its picture is to the target.");
  type.def_property_readonly(
      "provenance", [](const LensObject& self) { return object_from(self.lens().provenance); },
      "dict: the program, options and outcome that the lens comes from.");
  type.def_property_readonly(
      "folder",
      [](const LensObject& self) {
        return self.folder.empty() ? py::object(py::none()) : py::cast(self.folder);
      },
      "pathlib.Path where the lens lies, None until it is saved.");
  type.def("save", &save, py::arg("folder"), py::arg("force") = false,
           "Writes the lens folder, as the design command does; force replaces an earlier lens.");
  type.def("_repr_png_", &png_of);
  type.def("__repr__", &repr);
}

}  // namespace lensforge::python

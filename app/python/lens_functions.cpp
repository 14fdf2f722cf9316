// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/commands/cam_command.h"
#include "app/commands/design_command.h"
#include "app/commands/export_command.h"
#include "app/commands/overview.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/python/arrays.h"
#include "app/python/bindings.h"
#include "app/python/keywords.h"
#include "cam/cam.h"
#include "cam/job/job_files.h"
#include "cam/report/report_json.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/lens_folder.h"
#include "design/design.h"
#include "design/render.h"
#include "design/setup/option_tables.h"

/// The class Lens, and the commands as functions.
namespace lensforge::python {
namespace {

namespace fs = std::filesystem;

/// A lens in Python: what a design gave, or what a folder holds.
struct LensObject {
  DesignResult design;  ///< Without convergence, and `made`, of a lens that was read.
  fs::path folder;      ///< Its folder; empty until it is saved.

  [[nodiscard]] const Lens& lens() const { return design.lens; }
};

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

/// The folder of a Lens or a path. @throw InputError if the lens has none yet.
fs::path folder_of(const py::object& lens) {
  if (!py::isinstance<LensObject>(lens)) return lens.cast<fs::path>();
  const fs::path& folder = object_of(lens).folder;
  if (folder.empty()) throw InputError("the lens is in no folder yet; save() it first");
  return folder;
}

/// A Lens itself, or the one in the folder of this path. @throw InputError as read_lens() does.
py::object lens_from(const py::object& lens) {
  if (py::isinstance<LensObject>(lens)) return lens;
  return py::cast(read(lens.cast<fs::path>()));
}

}  // namespace

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
      "metrics", [](const LensObject& self) { return object_from(metrics_json(self.lens())); },
      "dict: for every surface model how close its picture is to the target.");
  type.def_property_readonly(
      "provenance",
      [](const LensObject& self) { return object_from(self.lens().provenance.json()); },
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

namespace {

// The commands as functions: the same options, the same library call; what a command prints is
// returned.

/// A function's own argument in messages and in a lens's provenance.
constexpr const char* kArgument = "picture";

RunControl stopping_at(const std::stop_token& stop) { return {stop, {}}; }

// --- design

bool is_path(const py::object& object) {
  return py::isinstance<py::str>(object) || py::hasattr(object, "__fspath__");
}

/// @throw TypeError (Python's) for what numpy makes no array of.
py::array array_from(const py::object& picture) {
  py::array array = py::array::ensure(picture);
  if (!array) throw py::type_error("picture: must be a path or an array");
  return array;
}

py::object design(const py::object& picture, app::OptionValues values) {
  app::DesignSettings settings;
  app::OptionSet options("design", "");
  options.fields(settings);
  values.insert({{"TARGET", kArgument}, {"--out", "."}});
  options.take(values);
  const Image given = is_path(picture) ? Image() : image_from(array_from(picture), kArgument);
  settings.target = is_path(picture) ? picture.cast<fs::path>().string() : kArgument;
  auto made = std::make_shared<LensObject>();
  made->design = run_released([&](const std::stop_token& stop) {
    const RunControl control = stopping_at(stop);
    const Image target = given.empty() ? app::read_target(settings, control).image : given;
    app::settle(options, settings, target, control);
    const app::ChosenDevice device = options.device_executor();
    require_room_for_design(target.columns(), target.rows(), settings.design,
                            device.executor.concurrency(), settings.out);
    DesignResult result = design_lens(target, settings.design, device.executor, control);
    result.lens.provenance = app::design_provenance(options, device, settings.design, result);
    return result;
  });
  return py::cast(std::move(made));
}

// --- render

/// Render options for a lens in one colour.
Description options_of(RenderOptions& render) {
  return description_of(render).except({"--wavelengths", "--abbe"});
}

/// The picture that a lens projects, in its target's light.
Image picture_of(const Lens& lens, const RenderOptions& render, const Executor& executor) {
  const OpticalSetup& setup = render.setup;
  const std::vector<double> flux =
      render.model == SurfaceModel::kSpline
          ? flux_of_lens(lens, setup, executor)
          : flux_of_surface(lens.surface, setup, render.model, executor);
  const double light = lens.target.total() / lens.setup.pixels.prod() * setup.pixels.prod();
  Image image(setup.pixels.x(), setup.pixels.y());
  for (std::size_t i = 0; i < flux.size(); ++i) {
    image.values()[i] = static_cast<float>(light * flux[i]);
  }
  return image;
}

py::array render(const py::object& source, const app::OptionValues& values) {
  const py::object kept = lens_from(source);
  const Lens& lens = kept.cast<const LensObject&>().lens();
  RenderOptions chosen{.model = lens.model, .setup = lens.setup};
  app::OptionSet options("render", "");
  options.add(options_of(chosen));
  options.take(values);
  if (chosen.model == SurfaceModel::kSpline && !lens.spline) {
    throw InputError("model spline: must be facet or smooth: the lens is no spline");
  }
  Image image = run_released([&](const std::stop_token& stop) {
    require_wall_above(lens.surface, chosen.setup);
    return picture_of(lens, chosen, options.device_executor().executor.with_stop(stop));
  });
  return array_of(std::move(image));
}

// --- cam

py::object cam(const py::object& lens, const app::OptionValues& values) {
  app::CamSettings settings;
  app::OptionSet options("cam", "");
  options.fields(settings);
  options.take(values);
  settings.source = folder_of(lens).string();
  const CamResult result = run_released([&](const std::stop_token& stop) {
    const FolderLock reading(settings.source, FolderLock::Kind::kShared);
    const Lens designed = read_lens(settings.source);
    app::settle(options, settings);
    validate(settings.cam, designed.setup);
    const Executor executor = options.executor();
    require_room_for_cut(settings.cam, designed.setup,
                         estimate_cut(settings.cam, designed.setup, executor.concurrency()),
                         settings.folder());
    const app::OutputFolder folder(settings.folder(), FolderLock::Kind::kExclusive);
    folder.remove_partial_files(is_name_of_cut);
    return make_cut(designed, settings.cam, folder.path(), executor, stopping_at(stop));
  });
  const nlohmann::json cut = {{"warnings", result.report.warnings},
                              {"files", app::files_json(result.files)},
                              {"report", report_json(result.report)}};
  return object_from(cut);
}

// --- export

py::object export_file(const py::object& lens, const fs::path& out,
                       const app::OptionValues& values) {
  app::ExportSettings settings;
  app::OptionSet options("export", "");
  options.fields(settings);
  options.take(values);
  const fs::path folder = folder_of(lens);
  const ExportResult result = run_released([&](const std::stop_token& stop) {
    app::require_fitting_options(options, export_format(settings.options, out));
    validate(settings.options, out);
    const ExportSource source = read_export_source(folder, settings.surface);
    const app::OutputFolder into(fs::absolute(out).parent_path(), FolderLock::Kind::kShared);
    return export_lens(source, out, settings.options, options.executor().with_stop(stop),
                       stopping_at(stop));
  });
  nlohmann::json report = app::export_report(result).json;
  report["format"] = result.format;
  report["within_tolerance"] = result.within_tolerance();
  return object_from(report);
}

}  // namespace

void add_commands(py::module_& module) {
  const Keywords of_design("design", description_of(app::DesignSettings()),
                           {"--out", "--live", "--resume", "--force"});
  module.def(
      "design",
      [of_design](const py::object& picture, const py::kwargs& options) {
        return design(picture, of_design.values(options));
      },
      py::arg("picture"),
      ("design(picture, **options) -> Lens: shapes a lens that projects a picture.\n\n"
       "picture: the path of a file, or an (H, W) array of floats, linear light, 1 is white.\n"
       "Raises InputError, RunError. The options are those of lensforge design:\n" +
       of_design.text())
          .c_str());
  RenderOptions usual;
  const Keywords of_render("render", options_of(usual), {});
  module.def(
      "render",
      [of_render](const py::object& lens, const py::kwargs& options) {
        return render(lens, of_render.values(options));
      },
      py::arg("lens"),
      ("render(lens, **options): what a Lens, or the one in a folder, projects.\n\n"
       "Returns (H, W) float32, linear light, 1 is the target's white. The options are those of\n"
       "lensforge render:\n" +
       of_render.text())
          .c_str());
  const Keywords of_cam("cam", description_of(app::CamSettings()),
                        {"--show-workshop", "--compare", "--device"});
  module.def(
      "cam",
      [of_cam](const py::object& lens, const py::kwargs& options) {
        return cam(lens, of_cam.values(options));
      },
      py::arg("lens"),
      ("cam(lens, **options) -> dict: programs, milled surface and report, in the lens folder's\n"
       "cam/.\n\nlens: a saved Lens or a lens folder's path. Returns \"files\", \"warnings\" and\n"
       "\"report\", as report.json has it. The options are those of lensforge cam:\n" +
       of_cam.text())
          .c_str());
  const Keywords of_export("export", description_of(app::ExportSettings()), {"--out"});
  module.def(
      "export",
      [of_export](const py::object& lens, const fs::path& out, const py::kwargs& options) {
        return export_file(lens, out, of_export.values(options));
      },
      py::arg("lens"), py::arg("out"),
      ("export(lens, out, **options) -> dict: writes a solid, mesh or height map.\n\n"
       "lens: a saved Lens or a lens folder's path; out: the file, its ending says the format.\n"
       "Returns what was written. The options are those of lensforge export:\n" +
       of_export.text())
          .c_str());
}

}  // namespace lensforge::python

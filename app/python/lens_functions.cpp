// SPDX-License-Identifier: GPL-3.0-or-later
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/commands/cam_command.h"
#include "app/commands/design_command.h"
#include "app/commands/settings.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/python/bindings.h"
#include "app/python/conversions.h"
#include "cam/cam.h"
#include "cam/job/job_files.h"
#include "cam/report/report_data.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/lens_folder.h"
#include "core/page/drawings.h"
#include "design/design.h"
#include "design/render.h"
#include "design/setup/design_options.h"

/// A lens, and the commands as functions.
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
  lens->design.lens = run_released([&](const RunControl&) { return read_lens(folder); });
  lens->design.status = DesignResult::Status::kDone;
  lens->folder = folder;
  return lens;
}

void save(LensObject& lens, const fs::path& folder, bool force) {
  run_released([&](const RunControl&) {
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
  const std::vector<unsigned char> png = run_released([&](const RunControl&) {
    return encode_png(displayed(draw_overview(lens.design.lens, lens.design.pictures())));
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
  const auto view = [&type](const char* name, auto value) {
    type.def_property_readonly(name, [value](const py::object& self) {
      return view_of(value(object_of(self).lens()), self);
    });
  };
  view(
      "vertices", [](const Lens& lens) -> auto& { return lens.surface.vertices; });
  view(
      "faces", [](const Lens& lens) -> auto& { return lens.surface.triangles; });
  view(
      "target", [](const Lens& lens) -> auto& { return lens.target; });
  view(
      "projected", [](const Lens& lens) -> auto& { return lens.render; });
  const auto second = [&type](const char* name, Image SecondPicture::*picture) {
    type.def_property_readonly(name, [picture](const py::object& self) -> py::object {
      const std::optional<SecondPicture>& held = object_of(self).lens().second;
      return held ? py::object(view_of((*held).*picture, self)) : py::none();
    });
  };
  second("second_target", &SecondPicture::target);
  second("second_projected", &SecondPicture::render);
}

bool same(const SurfaceMesh& a, const SurfaceMesh& b) {
  return a.vertices.cols() == b.vertices.cols() && a.triangles.cols() == b.triangles.cols() &&
         a.vertices == b.vertices && a.triangles == b.triangles;
}

/// True for lenses of the same setup, model, surface and pictures, wherever they come from.
bool equal(const LensObject& first, const LensObject& second) {
  const Lens& a = first.lens();
  const Lens& b = second.lens();
  if (a.second.has_value() != b.second.has_value()) return false;
  if (a.second && (a.second->target != b.second->target || a.second->render != b.second->render)) {
    return false;
  }
  return a.model == b.model && a.setup == b.setup && same(a.surface, b.surface) &&
         a.target == b.target && a.render == b.render;
}

/// Writes the lens alone, which read() reads back.
void write(const LensObject& lens, const fs::path& folder) {
  run_released([&](const RunControl&) { write_lens(lens.lens(), folder); });
}

}  // namespace

void add_lens(py::module_& module) {
  py::class_<LensObject, std::shared_ptr<LensObject>> type(module, "Lens");
  add_views(type);
  type.def_property_readonly("setup", [](const LensObject& self) { return self.lens().setup; });
  type.def_property_readonly("model",
                             [](const LensObject& self) { return model_name(self.lens().model); });
  type.def_property_readonly(
      "metrics", [](const LensObject& self) { return object_from(metrics_json(self.lens())); });
  type.def_property_readonly("provenance", [](const LensObject& self) {
    return object_from(self.lens().provenance.json());
  });
  type.def_property(
      "folder",
      [](const LensObject& self) {
        return self.folder.empty() ? py::object(py::none()) : py::cast(self.folder);
      },
      [](LensObject& self, const fs::path& folder) { self.folder = folder; });
  type.def("save", &save);
  type.def("write", &write);
  type.def("copy", [](const LensObject& self) { return std::make_shared<LensObject>(self); });
  type.def("equals", &equal);
  type.def("png", &png_of);
  type.def("__repr__", &repr);
  module.def("read_lens", &read);
}

namespace {

// The commands as functions: the same options, the same library call; what a command prints is
// returned.

/// A function's own argument in messages and in a lens's provenance.
constexpr const char* kArgument = "picture";

// --- design

std::shared_ptr<LensObject> design(const py::object& picture, app::OptionValues values,
                                   const py::object& progress) {
  const bool is_array = py::isinstance<py::array>(picture);
  app::DesignSettings settings;
  app::OptionSet options("design", "");
  options.fields(settings);
  values.insert({{"TARGET", kArgument}, {"--out", "."}});
  options.take(values);
  const Image given = is_array ? image_from(picture, kArgument, settings.background) : Image();
  settings.target = is_array ? kArgument : picture.cast<fs::path>().string();
  auto made = std::make_shared<LensObject>();
  made->design = run_released(progress, [&](const RunControl& control) {
    const Image target = given.empty() ? app::read_target(settings, control).image : given;
    app::settle(options, settings, target, control);
    const app::ChosenDevice device = options.device_executor();
    require_room_for_design(target.columns(), target.rows(), settings.design,
                            device.executor.concurrency(), settings.out);
    DesignResult result = design_lens(target, settings.design, device.executor, control);
    result.lens.provenance = app::design_provenance(options, device, settings.design, result);
    return result;
  });
  return made;
}

// --- design of three lenses, for a lamp each

/// Reports of one lamp's design by its name.
RunControl control_of_lamp(const RunControl& control, std::size_t lamp) {
  return {control.stop_token(), [control, lamp](Progress progress) {
            progress.stage = std::string(app::kLampNames[lamp]) + " lamp, " + progress.stage;
            control.report(progress);
          }};
}

/// The lenses, red, green and blue, and what they project together.
py::tuple three_lamps(const py::object& picture, app::OptionValues values,
                      const py::object& progress) {
  const bool is_array = py::isinstance<py::array>(picture);
  app::DesignSettings settings;
  app::OptionSet options("three_lamps", "");
  options.fields(settings);
  values.insert({{"TARGET", kArgument}, {"--out", "."}, {"--color", "three-lamps"}});
  options.take(values);
  std::optional<LoadedColors> given;
  if (is_array) given = colors_from(picture, kArgument, settings.background);
  settings.target = is_array ? kArgument : picture.cast<fs::path>().string();
  std::vector<std::shared_ptr<LensObject>> made;
  const nlohmann::json figures = run_released(progress, [&](const RunControl& control) {
    const app::ColorTarget target = app::color_target(
        options, settings,
        given ? *given
              : read_colors(settings.target, control, settings.design.pixels, settings.background),
        control);
    const app::ChosenDevice device = options.device_executor();
    std::array<Lens, 3> lenses;
    for (std::size_t lamp = 0; lamp < lenses.size(); ++lamp) {
      const Image& one = target.split.lamps.pictures[lamp];
      app::settle_lamp(options, settings, target, lamp, control);
      require_room_for_design(one.columns(), one.rows(), settings.design,
                              device.executor.concurrency(), settings.out);
      DesignResult result =
          design_lens(one, settings.design, device.executor, control_of_lamp(control, lamp));
      if (result.status != DesignResult::Status::kDone) throw Interrupted();
      result.lens.provenance = app::design_provenance(options, device, settings.design, result);
      lenses[lamp] = result.lens;
      made.push_back(std::make_shared<LensObject>(LensObject{std::move(result), {}}));
    }
    return app::color_result(settings, target, lenses).figures;
  });
  return py::make_tuple(made[0], made[1], made[2], object_from(figures));
}

// --- render

/// What is rendered.
struct RenderWish {
  RenderOptions render;
  double at = 0.0;  ///< z of another screen, mm; 0: that of `render`.
};

/// Render options for a lens in one colour.
Description options_of(RenderWish& wish) {
  Description options = description_of(wish.render).except({"--wavelengths", "--abbe"});
  app::describe_at(options, wish.at);
  return options;
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

py::array render(const LensObject& source, const app::OptionValues& values) {
  const Lens& lens = source.lens();
  RenderWish wish{{.model = lens.model, .setup = lens.setup}};
  RenderOptions& chosen = wish.render;
  app::OptionSet options("render", "");
  options.add(options_of(wish));
  options.take(values);
  if (wish.at > 0.0) {
    const double height = lens.surface.vertices.row(2).mean();
    chosen.setup = app::setup_at(options, wish.at, height, chosen.setup);
  }
  if (chosen.model == SurfaceModel::kSpline && !lens.spline) {
    throw InputError("model spline: must be facet or smooth: the lens is no spline");
  }
  Image image = run_released([&](const RunControl& control) {
    require_wall_above(lens.surface, chosen.setup);
    const Executor executor = options.device_executor().executor;
    return picture_of(lens, chosen, executor.with_stop(control.stop_token()));
  });
  return array_of(std::move(image));
}

// --- cam

py::object cam(const fs::path& lens, const app::OptionValues& values, const py::object& progress) {
  app::CamSettings settings;
  app::OptionSet options("cam", "");
  options.fields(settings);
  options.take(values);
  settings.source = lens.string();
  const CamResult result = run_released(progress, [&](const RunControl& control) {
    const FolderLock reading(settings.source, FolderLock::Kind::kShared);
    const Lens designed = read_lens(settings.source);
    app::settle(options, settings);
    validate(settings.cam, designed.setup);
    const Executor executor = options.executor();
    require_room_for_cut(settings.cam, designed.setup,
                         estimate_cut(settings.cam, designed, executor.concurrency()),
                         settings.folder());
    const app::OutputFolder folder(settings.folder(), FolderLock::Kind::kExclusive);
    folder.remove_partial_files(is_name_of_cut);
    return make_cut(designed, settings.cam, folder.path(), executor, control);
  });
  const nlohmann::json cut = {{"warnings", result.report.warnings},
                              {"files", app::files_json(result.files)},
                              {"report", report_json(result.report)}};
  return object_from(cut);
}

// --- export

py::object export_file(const fs::path& lens, const fs::path& out, const app::OptionValues& values,
                       const py::object& progress) {
  app::ExportSettings settings;
  app::OptionSet options("export", "");
  options.fields(settings);
  options.take(values);
  const ExportResult result = run_released(progress, [&](const RunControl& control) {
    app::require_fitting_options(options, export_format(settings.options, out));
    validate(settings.options, out);
    const ExportSource source = read_export_source(lens, settings.surface);
    const app::OutputFolder into(fs::absolute(out).parent_path(), FolderLock::Kind::kShared);
    return export_lens(source, out, settings.options,
                       options.executor().with_stop(control.stop_token()), control);
  });
  nlohmann::json report = app::export_report(result).json;
  report["format"] = result.format;
  report["within_tolerance"] = result.within_tolerance();
  return object_from(report);
}

// --- commands that are run as they are

/// Values of arguments, by their names on the command line.
app::OptionValues argument_values(const py::dict& given) {
  app::OptionValues values;
  for (const auto& [name, value] : given) {
    FieldValue& taken = values[name.cast<std::string>()];
    if (py::isinstance<py::list>(value)) {
      std::vector<std::string> texts;
      for (const py::handle text : value) texts.push_back(text.cast<fs::path>().string());
      taken = std::move(texts);
    } else {
      taken = value.cast<fs::path>().string();
    }
  }
  return values;
}

/// What the command prints with --json, without its name, and its warnings.
py::object run_command(const app::CommandCall& call, const app::OptionValues& values,
                       const py::object& progress) {
  const app::CommandResult result =
      run_released(progress, [&](const RunControl& control) { return call.run(values, control); });
  nlohmann::json json = result.json;
  if (!json.contains("warnings") && !result.warnings.empty()) json["warnings"] = result.warnings;
  return object_from(json);
}

/// Adds a function of this name: name(arguments, options, progress).
void add_command(py::module_& module, const char* name, const app::CommandCall& call,
                 const std::set<std::string>& withheld) {
  const Keywords keywords(name, call.options, withheld);
  module.attr((std::string(name) + "_options").c_str()) = keywords.text();
  module.def(name, [call, keywords](const py::dict& given, const py::dict& options,
                                    const py::object& progress) {
    app::OptionValues values = keywords.values(options);
    values.merge(argument_values(given));
    return run_command(call, values, progress);
  });
}

void add_plain_commands(py::module_& module) {
  add_command(module, "reflect", app::reflect_call(), {"--out", "--device"});
  add_command(module, "plan", app::plan_call(), {"--device"});
  add_command(module, "view", app::view_call(), {"--out", "--device"});
  add_command(module, "nest", app::nest_call(), {"--out", "--device"});
  add_command(module, "coupon", app::coupon_call(), {"--out", "--device"});
  add_command(module, "check", app::check_call(), {"--out", "--device"});
  add_command(module, "info", app::info_call(), {"--threads", "--device"});
  // A job runs in a process of its own, since it may crash or use up the memory.
  const auto program = py::module_::import("lensforge._program").attr("WORDS");
  add_command(module, "batch", app::batch_call(program.cast<std::vector<std::string>>()),
              {"--out", "--grid", "--device"});
}

}  // namespace

void add_commands(py::module_& module) {
  const Keywords of_design(
      "design", description_of(app::DesignSettings()),
      {"--out", "--live", "--resume", "--force", "--color", "--lamps", "--lamp-gap"});
  module.attr("design_options") = of_design.text();
  module.def("design", [of_design](const py::object& picture, const py::dict& options,
                                   const py::object& progress) {
    return design(picture, of_design.values(options), progress);
  });
  const Keywords of_lamps("three_lamps", description_of(app::DesignSettings()),
                          {"--out", "--live", "--resume", "--force", "--color", "--second",
                           "--second-focal", "--second-width", "--second-offset", "--second-tilt",
                           "--lamp", "--wavelength", "--wavelengths"});
  module.attr("three_lamps_options") = of_lamps.text();
  module.def("three_lamps", [of_lamps](const py::object& picture, const py::dict& options,
                                       const py::object& progress) {
    return three_lamps(picture, of_lamps.values(options), progress);
  });
  RenderWish usual;
  const Keywords of_render("render", options_of(usual), {}, Keywords::Defaults::kOfALens);
  module.attr("render_options") = of_render.text();
  module.def("render", [of_render](const LensObject& lens, const py::dict& options) {
    return render(lens, of_render.values(options));
  });
  const Keywords of_cam("cam", description_of(app::CamSettings()),
                        {"--show-workshop", "--compare", "--device"});
  module.attr("cam_options") = of_cam.text();
  module.def("cam",
             [of_cam](const fs::path& lens, const py::dict& options, const py::object& progress) {
               return cam(lens, of_cam.values(options), progress);
             });
  const Keywords of_export("export", description_of(app::ExportSettings()), {"--out", "--device"});
  module.attr("export_options") = of_export.text();
  module.def("export", [of_export](const fs::path& lens, const fs::path& out,
                                   const py::dict& options, const py::object& progress) {
    return export_file(lens, out, of_export.values(options), progress);
  });
  add_plain_commands(module);
}

}  // namespace lensforge::python

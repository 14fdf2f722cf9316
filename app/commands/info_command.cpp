// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/lens/lens.h"
#include "core/lens/setup_json.h"
#include "core/mesh/mesh_files.h"
#include "core/optics/light_path.h"
#include "core/text/words.h"
#include "export/files/mesh_formats.h"
#include "export/solid/solid_files.h"
#include "machine/gcode.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// Facts about a G-code program that need no interpretation.
struct GcodeSummary {
  std::vector<std::string> header;  ///< Comments before the first command, brackets taken off.
  std::int64_t lines = 0;
  std::int64_t moves = 0;         ///< Lines with an X, Y or Z word.
  std::int64_t passed_over = 0;   ///< Lines with parameters or expressions.
  std::int64_t first_passed = 0;  ///< The first of them, counted from 1.
  Eigen::AlignedBox3d extent;     ///< Of the X, Y and Z words as written; empty along unused axes.
};

constexpr std::size_t kMaxHeaderLines = 12;
/// Longer than any controller takes by far.
constexpr std::size_t kLongestLine = 4096;

/// Reads up to the next line end, and of a line that is too long only so much that this shows.
bool next_line(std::ifstream& file, std::string& line) {
  line.clear();
  int c = file.get();
  const bool any = c != std::ifstream::traits_type::eof();
  for (; c != std::ifstream::traits_type::eof() && c != '\n'; c = file.get()) {
    line += static_cast<char>(c);
    if (line.size() > kLongestLine) break;
  }
  return any;
}

struct SplitLine {
  std::string code;     ///< Upper case, without spaces and comments.
  std::string comment;  ///< Text of the comments.
};

SplitLine split_line(const std::string& line) {
  SplitLine parts;
  bool in_brackets = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (!in_brackets && c == ';') {
      parts.comment += line.substr(i + 1);
      break;
    }
    if (c == '(' || c == ')') {
      in_brackets = c == '(';
    } else if (in_brackets) {
      parts.comment += c;
    } else if (std::isspace(static_cast<unsigned char>(c)) == 0) {
      parts.code += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  return parts;
}

/// True if a line has expressions: #1, #<name>, [1+2], O<name> CALL. Its letters and numbers then
/// are not plain words.
bool computes(std::string_view code) {
  return code.find_first_of("#[]<>=") != std::string_view::npos;
}

/// Takes the line's X, Y and Z words into `box`. @return whether there was one.
bool take_words(std::string_view code, Eigen::AlignedBox3d& box) {
  bool any = false;
  for (std::size_t i = 0; i + 1 < code.size(); ++i) {
    const std::size_t axis = std::string_view("XYZ").find(code[i]);
    if (axis == std::string_view::npos) continue;
    double value = 0.0;
    const auto [end, error] =
        std::from_chars(code.data() + i + 1, code.data() + code.size(), value);
    if (error != std::errc()) continue;
    const auto k = static_cast<Eigen::Index>(axis);
    box.min()[k] = std::min(box.min()[k], value);
    box.max()[k] = std::max(box.max()[k], value);
    any = true;
  }
  return any;
}

/// @throw InputError if the file cannot be read or holds bytes that no program has.
GcodeSummary summarise_gcode(const fs::path& path) {
  std::ifstream file = open_input(path);
  GcodeSummary summary;
  bool in_header = true;
  for (std::string line; next_line(file, line); ++summary.lines) {
    const bool zero = line.find('\0') != std::string::npos;
    if (zero || line.size() > kLongestLine) {
      throw InputError(path.string() + ": line " + std::to_string(summary.lines + 1) +
                       ": not G-code, it " +
                       (zero ? "holds a zero byte"
                             : "is longer than " + std::to_string(kLongestLine) + " characters"));
    }
    const SplitLine parts = split_line(line);
    in_header = in_header && (parts.code.empty() || parts.code == "%");
    if (in_header && !parts.comment.empty() && summary.header.size() < kMaxHeaderLines) {
      summary.header.push_back(parts.comment);
    }
    if (computes(parts.code)) {
      if (summary.passed_over++ == 0) summary.first_passed = summary.lines + 1;
    } else if (take_words(parts.code, summary.extent)) {
      ++summary.moves;
    }
  }
  return summary;
}

/// What is printed of a file.
struct InfoResult : CommandResult {
  /// Names and values may come from the file.
  void line(const std::string& foreign_name, const std::string& value) {
    const std::string name = printable_line(foreign_name, 60);
    text += "  " + name + std::string(14 - std::min<std::size_t>(name.size(), 13), ' ') +
            printable_line(value) + "\n";
  }
};

/// @param unit  after a space, or empty.
void describe_extent(InfoResult& d, const Eigen::AlignedBox3d& box, const std::string& unit) {
  for (int k = 0; k < 3; ++k) {
    if (!(box.min()[k] <= box.max()[k])) continue;
    const std::string axis(1, "xyz"[k]);
    d.line(axis, fixed(box.min()[k], 4) + " ... " + fixed(box.max()[k], 4) + unit);
    d.json[axis] = {box.min()[k], box.max()[k]};
  }
}

void describe_mesh(InfoResult& d, const SurfaceMesh& mesh) {
  d.line("mesh", std::to_string(mesh.vertex_count()) + " vertices, " +
                     std::to_string(mesh.triangle_count()) + " triangles");
  d.json["vertices"] = mesh.vertex_count();
  d.json["triangles"] = mesh.triangle_count();
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
  describe_extent(d, {low, high}, " mm");
}

std::string place_text(const Eigen::Vector3d& p) {
  return fixed(p.x(), 2) + ", " + fixed(p.y(), 2) + ", " + fixed(p.z(), 2);
}

/// Size of an extended source: ", 3.00 mm wide".
std::string extent_text(const OpticalSetup& setup) {
  if (setup.extent.none()) return "";
  const LampTraits& lamp = traits(setup.lamp);
  return ", " + fixed(setup.extent.width / lamp.unit, 3) + " " + lamp.width_unit + " wide" +
         (setup.extent.shape.is_disc() ? "" : ", its picture given");
}

std::string lamp_text(const ParallelLight& lamp) {
  return "parallel along " + place_text(lamp.direction);
}

std::string lamp_text(const PointSource& lamp) {
  const bool even = lamp.emission == Emission::kIsotropic;
  return std::string(even ? "point" : "flat") + " source at " + place_text(lamp.position) + " mm";
}

std::string light_text(const OpticalSetup& setup) {
  return std::visit([](const auto& lamp) { return lamp_text(lamp); }, setup.lamp) +
         extent_text(setup) +
         (traits(setup.body).transmits ? "" : std::string(" on a ") + traits(setup.body).name);
}

std::string front_text(const SphericalFront& front) {
  return std::string(front.radius > 0.0 ? "bulging" : "hollow") + " sphere of radius " +
         fixed(std::abs(front.radius), 2) + " mm, its apex at " + place_text(front.apex) + " mm";
}

std::string front_text(const HeightFront& front) {
  const HeightSpline& spline = *front.spline;
  return "height map of " + size_text(spline.grid().columns, spline.grid().rows) + " samples, z " +
         fixed(static_cast<double>(spline.lowest()), 3) + " to " +
         fixed(static_cast<double>(spline.highest()), 3) + " mm";
}

/// Describes by how much the front must exceed the lens for the whole surface to be lit.
void describe_overhang(InfoResult& d, const Lens& lens) {
  if (!lens.setup.front) return;
  const double most = overhang(lens.surface, lens.setup);
  d.line("front lit", "to " + fixed(most, 3) + " mm beyond the lens's edges");
  d.json["front_overhang"] = most;
}

void describe_setup(InfoResult& d, const OpticalSetup& setup) {
  d.line("light", light_text(setup));
  const bool clear = traits(setup.body).transmits;
  d.line(traits(setup.body).name,
         fixed(setup.lens_size.x(), 2) + " x " + fixed(setup.lens_size.y(), 2) + " mm" +
             (clear ? ", refractive index " + fixed(setup.ior, 4) : "") +
             (setup.spectrum.none() ? ""
                                    : ", Abbe number " + fixed(setup.spectrum.abbe, 1) +
                                          ", colours " + spectrum_text(setup.spectrum) + " nm") +
             (setup.fresnel ? ", what its faces reflect is counted" : ""));
  if (setup.outline) d.line("outline", outline_words(*setup.outline));
  if (setup.front) {
    d.line("front", std::visit([](const auto& front) { return front_text(front); }, *setup.front));
  }
  d.line("wall", "z = " + fixed(setup.focal_length, 2) + " mm, picture " +
                     fixed(setup.image_size.x(), 2) + " x " + fixed(setup.image_size.y(), 2) +
                     " mm, seen from the " + (setup.view == ViewSide::kFront ? "front" : "rear"));
  if (setup.screen_is_turned()) {
    d.line("screen", "tilted about its centre " + place_text(setup.screen_centre()) +
                         " mm, its normal " + place_text(setup.screen_x.cross(setup.screen_y)));
  }
  if (setup.second) {
    const OpticalSetup second = on_second_screen(setup);
    d.line("second wall", "z = " + fixed(second.focal_length, 2) + " mm, picture " +
                              fixed(second.image_size.x(), 2) + " x " +
                              fixed(second.image_size.y(), 2) + " mm" +
                              (second.screen_is_turned() ? ", tilted" : ""));
    d.json["second"] = setup_json(setup).at("second");
  }
  d.line("picture", size_text(setup.pixels.x(), setup.pixels.y()) + " pixels");
  d.json["lens_size"] = {setup.lens_size.x(), setup.lens_size.y()};
  d.json["image_size"] = {setup.image_size.x(), setup.image_size.y()};
  d.json["pixels"] = {setup.pixels.x(), setup.pixels.y()};
  d.json["focal_length"] = setup.focal_length;
  d.json["ior"] = setup.ior;
  const nlohmann::ordered_json all = setup_json(setup);
  for (const char* key : {"mode", "screen"}) d.json[key] = all.at(key);
  if (clear) d.json["front"] = all.at("front");
  if (setup.outline) d.json["outline"] = all.at("outline");
  if (!setup.spectrum.none()) d.json["spectrum"] = all.at("spectrum");
  d.json["light"] = all.at("source");  // "source" is what was asked about.
}

void describe_provenance(InfoResult& d, const nlohmann::json& provenance) {
  d.json["provenance"] = provenance;
  for (const auto& [name, value] : provenance.items()) {
    if (value.is_object()) continue;
    d.line(name, value.is_string() ? value.get<std::string>() : value.dump());
  }
}

InfoResult describe_lens(const fs::path& folder) {
  const Lens lens = read_lens(folder);
  InfoResult d{{{{"kind", "lens"}, {"model", model_name(lens.model)}}}};
  describe_setup(d, lens.setup);
  describe_overhang(d, lens);
  d.line("model", model_name(lens.model));
  const GridShape grid = lens.surface.grid;
  if (grid.is_grid()) d.line("grid", size_text(grid.columns, grid.rows));
  d.json["grid"] = {grid.columns, grid.rows};
  describe_mesh(d, lens.surface);
  for (const auto& [model, metrics] : lens.metrics)
    d.line(model_name(model), metrics_text(metrics));
  if (lens.second) d.line("second", metrics_text(lens.second->metrics));
  if (lens.source_limit) d.line("limit", metrics_text(*lens.source_limit) + "  of the source");
  d.json["metrics"] = metrics_json(lens);
  describe_provenance(d, lens.provenance.json());
  return d;
}

InfoResult describe_gcode(const fs::path& path) {
  const GcodeSummary summary = summarise_gcode(path);
  InfoResult d{{{{"kind", "gcode"}}}};
  for (const std::string& comment : summary.header) d.line("comment", comment);
  const bool idle = summary.moves == 0 && summary.passed_over == 0;
  d.line("program", std::to_string(summary.lines) + " lines, " + std::to_string(summary.moves) +
                        " with a position" + (idle ? ": moves nothing" : ""));
  if (summary.passed_over > 0) {
    d.line("passed over",
           std::to_string(summary.passed_over) +
               " lines with parameters or expressions (# or [ ]), the first is line " +
               std::to_string(summary.first_passed) + ": where they lead is not counted");
  }
  const std::optional<bool> seal = check_seal(path);
  d.line("seal", seal_words(seal));
  d.json["seal_holds"] = seal_json(seal);
  d.json["header"] = summary.header;
  d.json["lines"] = summary.lines;
  d.json["moves"] = summary.moves;
  d.json["passed_over"] = summary.passed_over;
  // Values as written, in the program's unit and coordinates.
  describe_extent(d, summary.extent, " as written");
  return d;
}

/// A solid as STEP or IGES.
InfoResult describe_solid(const fs::path& path, bool iges, const RunControl& control) {
  const SolidContent content = iges ? inspect_iges(path, control) : inspect_step(path, control);
  InfoResult d{{{{"kind", "solid"}}}};
  d.line("solids", std::to_string(content.solids) + " with " + std::to_string(content.faces) +
                       " faces, " + (content.valid ? "valid" : "not valid") + ", " +
                       (content.closed ? "closed" : "not closed"));
  if (content.entities > 0) d.line("entities", std::to_string(content.entities));
  d.line("volume", fixed(content.volume / 1000.0, 3) + " cm3");
  d.json["solids"] = content.solids;
  d.json["faces"] = content.faces;
  d.json["valid"] = content.valid;
  d.json["closed"] = content.closed;
  d.json["volume_mm3"] = content.volume;
  describe_extent(d, {Eigen::Vector3d(content.low.data()), Eigen::Vector3d(content.high.data())},
                  " mm");
  return d;
}

InfoResult describe_picture(const fs::path& path, const Background& background,
                            const RunControl& control) {
  const LoadedImage loaded = read_image(path, control, kDrawnSide, background);
  const auto values = loaded.image.values();
  const double count = static_cast<double>(values.size());
  const double mean = loaded.image.total() / count;
  const double black = static_cast<double>(std::count(values.begin(), values.end(), 0.0F)) / count;
  InfoResult d{{{{"kind", "picture"}}}};
  d.line("picture", size_text(loaded.image.columns(), loaded.image.rows()) + " pixels");
  d.line("mean", fixed(mean, 4) + " of display white, in linear light");
  d.line("exact black", fixed(100.0 * black, 2) + " % of the pixels");
  for (const std::string& change : loaded.changes) d.line("read as", change);
  d.json["pixels"] = {loaded.image.columns(), loaded.image.rows()};
  d.json["mean"] = mean;
  d.json["share_black"] = black;
  d.json["changes"] = loaded.changes;
  return d;
}

/// A mesh in a package for printers or scenes.
InfoResult describe_package(const MeshContent& content) {
  InfoResult d{{{{"kind", "mesh"}}}};
  d.line("format", content.format);
  if (!content.title.empty()) d.line("title", content.title);
  d.line("mesh",
         std::to_string(content.vertices) + " vertices, " + std::to_string(content.triangles) +
             " triangles" +
             (content.meshes > 1 ? " in " + std::to_string(content.meshes) + " parts" : ""));
  describe_extent(d, content.box, " mm");
  if (content.moved) d.line("placed", "moved or turned, which x, y and z leave out");
  d.json.update({{"format", content.format},
                 {"title", content.title},
                 {"meshes", content.meshes},
                 {"vertices", content.vertices},
                 {"triangles", content.triangles},
                 {"moved", content.moved}});
  return d;
}

/// Describes a file that is no picture by its name; empty for a picture.
std::optional<InfoResult> describe(const fs::path& path, CommandFrame& frame) {
  if (is_folder(path)) return describe_lens(path);
  if (has_extension(path, {".ngc", ".nc", ".gcode", ".tap"})) return describe_gcode(path);
  const bool iges = has_extension(path, {".igs", ".iges"});
  if (iges || is_step_file(path)) {
    frame.begin_file();
    return describe_solid(path, iges, frame.control());
  }
  for (const MeshFormat& format : mesh_formats()) {
    if (format.inspect != nullptr && has_extension(path, {joined({".", format.word}).c_str()})) {
      return describe_package(format.inspect(path));
    }
  }
  if (!has_extension(path, {".ply", ".obj", ".stl", ".off"})) return std::nullopt;
  InfoResult d{{{{"kind", "mesh"}}}};
  describe_mesh(d, read_mesh(path));
  return d;
}

struct InfoSettings {
  std::string source;
  Background background;
};

void describe(Description& d, InfoSettings& settings) {
  d.text("SOURCE", settings.source, "", "lens folder, solid, mesh, picture or G-code program")
      .needed = true;
  describe(d, settings.background);
}

CommandResult run(CommandFrame& frame, InfoSettings& settings) {
  const std::string& source = settings.source;
  std::optional<InfoResult> described = describe(source, frame);
  if (described && frame.options().given("--background")) {
    throw InputError("--background: is for pictures, and " + source + " is none");
  }
  if (!described) {
    frame.begin_file();
    described = describe_picture(source, settings.background, frame.control());
  }
  described->json["source"] = source;
  described->text = printable_line(source) + ": " + described->json["kind"].get<std::string>() +
                    "\n" + described->text;
  return *described;
}

Command<InfoSettings> info_verb() {
  return {"info", "Says what a lens folder, solid, mesh, picture or G-code program is.", run};
}

}  // namespace

int info_command(const Arguments& arguments) { return run_command(info_verb(), arguments); }

CommandCall info_call() { return call_of(info_verb(), InfoSettings()); }

}  // namespace lensforge::app

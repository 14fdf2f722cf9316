// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/export_step.h"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "app/json_output.h"
#include "core/error.h"
#include "core/text/version.h"
#include "design/render_lens.h"
#include "design/wanted_picture.h"
#include "export/closed_solid.h"
#include "export/export_work.h"
#include "export/iges_file.h"
#include "export/normal_bound.h"
#include "machine/stream/job_identity.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

constexpr std::array kStepOptions{"--tolerance", "--normal-tolerance", "--max-points", "--schema",
                                  "--author"};

/// When the surface was made: the same lens then gives the same bytes at any time.
std::string time_of(const fs::path& file) {
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0) return {};
  std::tm utc{};
  ::gmtime_r(&about.st_mtime, &utc);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc)};
}

StepHeader header_of(const fs::path& source, const std::string& author) {
  return {.name = "lensforge lens",
          .description = "optical surface sha256:" + identify_job(source).sha256,
          .author = author,
          .program = program_mark(),
          .time_stamp = time_of(source)};
}

std::string scientific(double value) {
  std::array<char, 32> text{};
  const int length = std::snprintf(text.data(), text.size(), "%.2g", value);
  return {text.data(), static_cast<std::size_t>(length)};
}

std::string place_text(const Eigen::Vector2d& xy) {
  return "x " + fixed(xy.x(), 2) + ", y " + fixed(xy.y(), 2);
}

nlohmann::json certificate(const SplineNet& net) {
  nlohmann::json patches = nlohmann::json::array();
  for (const SplinePatch& patch : net.patches) {
    const auto range = [&](std::size_t k) {
      const Eigen::MatrixXd& part = patch.coefficients[k];
      return nlohmann::json{part.minCoeff(), part.maxCoeff()};
    };
    patches.push_back({{"x", range(0)},
                       {"y", range(1)},
                       {"cells", patch.cells},
                       {"height_error_mm", patch.error.height},
                       {"normal_error_rad", patch.error.normal},
                       {"share_within_tolerance", patch.error.share_within()}});
  }
  return patches;
}

void describe_fit(const SplineNet& net, const FitOptions& fit, StepReport& report) {
  const FitError error = net.error();
  report.within_tolerance = holds(error, fit);
  const auto good =
      std::count_if(net.patches.begin(), net.patches.end(),
                    [&](const SplinePatch& patch) { return holds(patch.error, fit); });
  report.json["height_error_mm"] = error.height;
  report.json["normal_error_rad"] = error.normal;
  report.json["height_rms_mm"] = error.height_rms;
  report.json["normal_rms_rad"] = error.normal_rms;
  report.json["worst_height_at_mm"] = {error.height_at.x(), error.height_at.y()};
  report.json["worst_normal_at_mm"] = {error.normal_at.x(), error.normal_at.y()};
  report.json["share_within_tolerance"] = error.share_within();
  report.json["within_tolerance"] = report.within_tolerance;
  report.json["patches_within_tolerance"] = good;
  report.json["control_points"] = net.control_points();
  report.json["patches"] = certificate(net);
  report.text += "  fit       " + std::to_string(good) + " of " +
                 std::to_string(net.patches.size()) + " patches within tolerance, " +
                 fixed(100.0 * error.share_within(), 1) + " % of the area, " +
                 std::to_string(net.control_points()) + " control points\n" + "  worst     " +
                 scientific(error.height) + " mm at " + place_text(error.height_at) + " (limit " +
                 scientific(fit.tolerance) + "), normal " + scientific(error.normal) + " rad at " +
                 place_text(error.normal_at) + " (limit " + scientific(fit.normal_tolerance) +
                 ")\n" + "  rms       " + scientific(error.height_rms) + " mm, normal " +
                 scientific(error.normal_rms) + " rad\n";
}

void describe_bound(const SmoothSurface& surface, const FitOptions& fit, StepReport& report) {
  const NormalBound bound = normal_bound(surface, fit.normal_tolerance);
  report.json["least_possible_normal_error_rad"] = bound.largest;
  report.json["share_no_surface_can_hold"] = bound.share_above;
  report.text +=
      "  possible  normals of the mesh contradict each other: " + scientific(bound.largest) +
      " rad off at least at " + place_text(bound.at) + "; on " +
      fixed(100.0 * bound.share_above, 1) + " % of the area no surface holds the limit\n";
}

void describe_solid(const SolidContent& content, const Lens& lens, const std::string& name,
                    StepReport& report) {
  const double facets = enclosed_volume(closed_solid(lens.surface, name));
  report.json["faces"] = content.faces;
  report.json["volume_mm3"] = content.volume;
  report.json["mesh_volume_mm3"] = facets;
  report.text += "  solid     " + std::to_string(content.faces) + " faces, " +
                 fixed(content.volume / 1000.0, 3) + " cm3 (facets: " + fixed(facets / 1000.0, 3) +
                 "), read back valid and closed\n";
}

/// Points at which the splines are sampled for their picture, at least; with six a cell of the mesh
/// each way the MAE no longer falls by more than 0.0001.
constexpr double kPicturePoints = 1e6;
constexpr double kPictureDensity = 6.0;
constexpr double kMostPicturePoints = 4e6;

void describe_picture(const SplineNet& net, const Lens& lens, const Executor& executor,
                      StepReport& report) {
  const Eigen::Vector2d size(net.u.back() - net.u.front(), net.v.back() - net.v.front());
  const double cells = 0.5 * static_cast<double>(lens.surface.triangle_count());
  const double points =
      std::clamp(kPictureDensity * kPictureDensity * cells, kPicturePoints, kMostPicturePoints);
  const Eigen::Vector2d count = size / std::sqrt(size.prod() / points);
  const SampledSurface solid =
      sampled(net, {static_cast<int>(count.x()) + 2, static_cast<int>(count.y()) + 2});
  const ImageMetrics metrics =
      evaluate(solid.mesh, solid.normals, lens.setup, lens.target, nullptr, executor);
  report.json["metrics"]["solid"] = metrics_json(metrics);
  report.text += "  solid     " + metrics_text(metrics) + "\n";
}

PictureGoal goal_of(const WantedPicture& wanted) {
  return {.reach = wanted.reach(), .miss = [&wanted](const SampledSurface& solid) {
            WantedPicture::Comparison found = wanted.compare(solid.mesh, solid.normals);
            return PictureMiss{found.excess, std::move(found.missing)};
          }};
}

}  // namespace

void add_step_options(OptionSet& options, StepArguments& arguments) {
  options.length("--tolerance", arguments.fit.tolerance, Limits::between(1e-6, 1.0),
                 "step, iges: farthest of the splines from the smooth surface");
  options.number("--normal-tolerance", arguments.fit.normal_tolerance, Limits::between(1e-6, 0.1),
                 "rad", "step, iges: largest angle to the normals of the vertex-normal model");
  options.integer("--max-points", arguments.max_points, Limits::between(0, 10'000'000),
                  "step, iges: control points at most, about 72 bytes each; 0 takes four a vertex, "
                  "575000 at most");
  options.choice("--schema", arguments.schema,
                 {{"ap214", StepSchema::kAp214}, {"ap242", StepSchema::kAp242}},
                 "step: application protocol");
  options.text("--author", arguments.author, "NAME", "step, iges: author in the header");
}

void require_no_step_options(const OptionSet& options, const std::string& format) {
  for (const char* name : kStepOptions) {
    if (options.given(name)) {
      throw InputError(std::string(name) + ": is for step and iges, not for " + format);
    }
  }
}

namespace {

/// It stands in one field of the file's header.
void require_author(const std::string& author) {
  constexpr std::size_t kMostBytes = 200;
  if (author.size() > kMostBytes) {
    throw InputError("--author: has " + std::to_string(author.size()) + " bytes; at most " +
                     std::to_string(kMostBytes) + " are possible");
  }
  const auto is_control = [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; };
  if (std::any_of(author.begin(), author.end(), is_control)) {
    throw InputError("--author: holds a control character; only printable ones are possible");
  }
}

}  // namespace

StepReport export_step(const Lens& lens, const fs::path& source, const fs::path& out,
                       const StepArguments& arguments, const Executor& executor,
                       InterruptibleJob& job, const Console& console) {
  const std::string name = source.string();
  require_author(arguments.author);
  require_rectangle(lens.surface, height_field_outline(lens.surface, name), name);
  FitOptions fit = arguments.fit;
  fit.max_control_points = arguments.max_points;
  const SmoothSurface surface(lens.surface);
  announce_work(&spline_solid_work, "--max-points",
                static_cast<double>(most_control_points(surface, fit)), out, console);
  job.control().report({"spline knots", 0.0, 0.0, ""});
  const WantedPicture wanted(lens.surface, lens.setup, lens.target, executor);
  fit.picture = goal_of(wanted);
  const SplineNet net = fit_spline_net(surface, fit, executor, job.control());
  StepReport rest;
  describe_fit(net, fit, rest);
  describe_bound(surface, fit, rest);
  describe_picture(net, lens, executor, rest);
  const StepHeader header = header_of(source, arguments.author);
  job.begin_writing();
  const SolidContent content = arguments.iges
                                   ? write_iges(net, header, out, job.control())
                                   : write_step(net, header, arguments.schema, out, job.control());
  StepReport report;
  describe_solid(content, lens, name, report);
  report.json.update(rest.json);
  report.text += rest.text;
  report.within_tolerance = rest.within_tolerance;
  return report;
}

}  // namespace lensforge::app

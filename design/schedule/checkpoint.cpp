// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/checkpoint.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/image/rasters.h"
#include "core/io/checkpoint_file.h"
#include "core/mesh/surface_mesh.h"
#include "core/schema/json.h"
#include "core/spline/control_net.h"
#include "core/text/words.h"
#include "design/setup/design_options.h"

// After the header come, as doubles, the vertices, if the header has scales the reach of their
// steps, and if it has from_planes the samples of the front; if it has shared_front its heights, as
// floats.

namespace lensforge {
namespace {

using nlohmann::json;

constexpr std::string_view kMagic = "lensforge checkpoint 4\n";
/// Key of a design of two faces.
constexpr const char* kFromPlanes = "from_planes";
/// Key of a design behind a shared front: its columns and rows.
constexpr const char* kSharedFront = "shared_front";

template <class Matrix>
std::span<const double> entries(const Matrix& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.size())};
}

/// Appends the light's options that differ from the default, so that designs for the usual light
/// keep their fingerprint.
void append_light(const LightOptions& light, json& description) {
  const Description usual = description_of(LightOptions());
  for (const Field& field : description_of(light)) {
    if (!field.left_out.empty()) continue;
    const FieldValue value = field.fingerprint();
    if (value == usual.at(field.name).fingerprint()) continue;
    description.push_back({field.name, json_of(value)});
  }
  const SourceShape& shape = light.source_shape;
  if (!shape.is_disc()) description.push_back({shape.columns, shape.rows, shape.weights});
  // A shared front follows from the rest.
  if (light.front_heights && !light.both_faces) {
    const HeightGrid& grid = light.front_heights->grid();
    description.push_back({grid.columns, grid.rows, grid.heights});
  }
}

void append_second(const SecondOptions& second, json& description) {
  append_fingerprint(description_of(second), description);
  Fnv1a hash;
  hash.add(bytes_of(second.picture->values()));
  description.push_back(hash.value());
}

void append_outline(const Outline& outline, json& description) {
  json points = json::array();
  for (const Eigen::Vector2d& p : outline.points) points.push_back({p.x(), p.y()});
  description.push_back({static_cast<int>(outline.kind), outline.radius, points});
}

}  // namespace

/// The columns of convergence.csv and of a checkpoint's rows.
void describe(Description& d, ConvergenceRow& row) {
  d.text("stage", row.stage, "", "");
  d.whole("level", row.level, {}, "");
  d.whole("round", row.round, {}, "");
  d.whole("iteration", row.iteration, {}, "");
  EnergyValues& e = row.energy;
  const std::pair<const char*, double*> numbers[] = {
      {"image", &e.image},       {"unlit", &e.unlit},         {"gradient", &e.gradient},
      {"boundary", &e.boundary}, {"barrier", &e.barrier},     {"face", &e.face},
      {"edge", &e.edge},         {"laplacian", &e.laplacian}, {"align", &e.align},
      {"flux", &e.flux},         {"total", &e.total},         {"mass_error", &row.mass_error},
      {"mae", &row.mae},         {"seconds", &row.seconds}};
  for (const auto& [name, value] : numbers) d.number(name, *value, {}, "", "");
}

void describe(Description& d, Checkpoint& checkpoint) {
  d.whole("level", checkpoint.level, {.low = 0}, "").needed = true;
  d.whole("round", checkpoint.round, {.low = 0}, "").needed = true;
  Field& value = d.number("value", checkpoint.value, {}, "", "");
  value.needed = value.infinite_if_null = true;
  d.flag("transporting", checkpoint.transporting, "").needed = true;
  d.number("seconds", checkpoint.seconds, {}, "", "").needed = true;
  d.whole("columns", checkpoint.mesh.grid.columns, {}, "").needed = true;
  d.whole("rows", checkpoint.mesh.grid.rows, {}, "").needed = true;
}

std::uint64_t design_fingerprint(const Image& target, const DesignOptions& options) {
  json weights = json::array();
  append_fingerprint(description_of(with_smoothness_applied(options).weights), weights);
  json description = {target.columns(), target.rows()};
  append_fingerprint(description_of(options), description);
  append_light(options.light, description);
  if (options.outline) append_outline(*options.outline, description);
  description.push_back(weights);
  if (options.second.picture) append_second(options.second, description);
  if (options.made_by) {
    const MadeBy& made = *options.made_by;
    description.push_back(
        {made.pitch, made.rows_along_x, made.polish_sigma, made.rim_depth, made.rim_length});
    if (made.polish_spread > 0.0) description.push_back(made.polish_spread);
    if (made.polish_order != 2 || made.polish_floor > 0.0) {
      description.push_back({made.polish_order, made.polish_floor});
    }
    if (made.roughness > 0.0) description.push_back({made.roughness, made.correlation});
  }
  Fnv1a hash;
  hash.add(description.dump());
  hash.add(bytes_of(target.values()));
  return hash.value();
}

void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& path) {
  ConvergenceRow row;
  const Description columns = description_of(row);
  json rows = json::array();
  for (const ConvergenceRow& each : checkpoint.convergence) {
    row = each;
    rows.push_back(row_of(columns));
  }
  const StepScales& steps = checkpoint.scales;
  json header = json_of(description_of(checkpoint));
  header.update({{"fingerprint", checkpoint.fingerprint},
                 {"scales", steps.known() ? json{steps.xy, steps.z} : json()},
                 {"convergence", rows}});
  if (checkpoint.front.size() > 0) header[kFromPlanes] = checkpoint.from_planes;
  std::string numbers(bytes_of(entries(checkpoint.mesh.vertices)));
  numbers += bytes_of(entries(steps.reach));
  numbers += bytes_of(entries(checkpoint.front));
  if (checkpoint.shared_front) {
    const HeightGrid& front = *checkpoint.shared_front;
    header[kSharedFront] = {front.columns, front.rows};
    numbers += bytes_of(std::span<const float>(front.heights));
  }
  write_checkpoint_file(path, kMagic, {header, numbers});
}

namespace {

/// A front of the size that the header announces, if it does; its heights are still to be read.
std::optional<HeightGrid> shared_front_of(const std::filesystem::path& path, const json& header) {
  if (!header.contains(kSharedFront)) return std::nullopt;
  HeightGrid grid{header.at(kSharedFront).at(0), header.at(kSharedFront).at(1), {}};
  const auto possible = [](int n) { return n >= kMinHeightSamples && n <= kMaxHeightSamples; };
  if (!possible(grid.columns) || !possible(grid.rows)) {
    refuse_checkpoint(path, "holds a front of an impossible size");
  }
  grid.heights.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows));
  return grid;
}

/// Takes the surface and what else the header announces. @pre the header's values were read.
void read_numbers(const std::filesystem::path& path, const CheckpointContent& parts,
                  Checkpoint& checkpoint) {
  const GridShape shape = checkpoint.mesh.grid;
  const json& scales = parts.header.at("scales");
  const bool two_faces = parts.header.contains(kFromPlanes);
  const int least = two_faces ? kSplineDegree + 1 : 2;
  const double vertices = double{1} * shape.columns * shape.rows;
  const GridShape front = two_faces ? front_shape(shape) : GridShape{};
  std::optional<HeightGrid> shared = shared_front_of(path, parts.header);
  const std::size_t shared_bytes = shared ? sizeof(float) * shared->heights.size() : 0;
  const double count =
      (scales.is_null() ? 3.0 : 6.0) * vertices + double{1} * front.columns * front.rows;
  if (shape.columns < least || shape.rows < least ||
      static_cast<double>(parts.numbers.size()) !=
          sizeof(double) * count + static_cast<double>(shared_bytes)) {
    refuse_checkpoint(path, "holds fewer vertices than its header says");
  }
  const char* next = parts.numbers.data();
  const auto take = [&](auto& matrix) {
    const std::size_t bytes = static_cast<std::size_t>(matrix.size()) * sizeof(double);
    std::memcpy(matrix.data(), next, bytes);
    next += bytes;
  };
  checkpoint.mesh = make_grid_mesh(Eigen::Vector2d::Ones(), shape, 0.0);
  take(checkpoint.mesh.vertices);
  if (!scales.is_null()) {
    checkpoint.scales.xy = scales.at(0);
    checkpoint.scales.z = scales.at(1);
    checkpoint.scales.reach.resizeLike(checkpoint.mesh.vertices);
    take(checkpoint.scales.reach);
  }
  if (two_faces) {
    checkpoint.from_planes = parts.header.at(kFromPlanes);
    checkpoint.front.resize(front.columns, front.rows);
    take(checkpoint.front);
  }
  if (shared) std::memcpy(shared->heights.data(), next, shared_bytes);
  checkpoint.shared_front = std::move(shared);
  const auto finite = [](const HeightGrid& grid) {
    return std::ranges::all_of(grid.heights, [](float z) { return std::isfinite(z); });
  };
  if (!checkpoint.mesh.vertices.allFinite() || !checkpoint.front.allFinite() ||
      (checkpoint.shared_front && !finite(*checkpoint.shared_front))) {
    refuse_checkpoint(path, "holds a vertex that is not finite");
  }
}

}  // namespace

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  const CheckpointContent parts = read_checkpoint_file(path, kMagic);
  try {
    Checkpoint checkpoint;
    read_json(description_of(checkpoint), {parts.header, checkpoint_header_name(path)});
    checkpoint.fingerprint = parts.header.at("fingerprint");
    for (const json& row : parts.header.at("convergence")) {
      read_row(description_of(checkpoint.convergence.emplace_back()), row);
    }
    read_numbers(path, parts, checkpoint);
    return checkpoint;
  } catch (const json::exception&) {
    refuse_checkpoint(path, "has a bad header: a field is missing or of another type");
  }
}

namespace {

/// Work of a level: its iterations, weighted by their rays.
double level_work(const DesignTask& task, std::size_t level) {
  const Level& at = task.levels[level];
  const double vertices = double{1} * at.grid.columns * at.grid.rows;
  const double rays = at.spline ? kMeshSamples * kMeshSamples * vertices : vertices;
  return double{1} * at.rounds * at.iterations * rays;
}

/// Work of all levels before this one.
double work_before(const DesignTask& task, std::size_t level) {
  double sum = 0.0;
  for (std::size_t l = 0; l < level; ++l) sum += level_work(task, l);
  return sum;
}

double work_total(const DesignTask& task) { return work_before(task, task.levels.size()); }

}  // namespace

double DesignLog::seconds() const {
  const auto since = std::chrono::steady_clock::now() - start_;
  return spent_before_ + std::chrono::duration<double>(since).count();
}

ConvergenceRow DesignLog::new_row(const char* stage, int iteration) const {
  ConvergenceRow row;
  row.stage = stage;
  row.level = state_.level;
  row.round = state_.round;
  row.iteration = iteration;
  row.seconds = seconds();
  return row;
}

void DesignLog::add(const std::vector<TransportStep>& steps) {
  int number = 0;
  for (const TransportStep& step : steps) {
    ConvergenceRow row = new_row("transport", ++number);
    row.mass_error = step.mass_error;
    state_.convergence.push_back(row);
  }
}

GuidedOptimization::Observer DesignLog::observer(const char* stage) {
  return [this, stage](int iteration, const DesignObjective::Evaluation& e) {
    ConvergenceRow row = new_row(stage, iteration);
    row.energy = e.energy;
    row.mae = e.mae;
    state_.convergence.push_back(row);
    char detail[64];
    std::snprintf(detail, sizeof(detail), "MAE %.4f", e.mae);
    iterated_ = true;
    report(detail, iteration);
    return !task_.control.stop_requested();
  };
}

namespace {

std::string stage_name(const DesignTask& task, const Checkpoint& state) {
  return "design, level " + std::to_string(state.level + 1) + " of " +
         std::to_string(task.levels.size());
}

/// "fitting heights, 43 %", or with the step's own detail in place of the share.
std::string step_words(const std::string& what, const Progress& progress) {
  if (!progress.detail.empty()) return what + ", " + progress.detail;
  if (!(progress.total > 0.0)) return what;
  const double share = std::clamp(progress.done / progress.total, 0.0, 1.0);
  return what + ", " + std::to_string(static_cast<int>(100.0 * share)) + " %";
}

}  // namespace

void DesignLog::report(const std::string& detail, int iteration) const {
  const auto level = static_cast<std::size_t>(state_.level);
  const Level& at = task_.levels[level];
  const double rounds = state_.round + static_cast<double>(iteration) / at.iterations;
  const double done = work_before(task_, level) + level_work(task_, level) * rounds / at.rounds;
  task_.control.report({stage_name(task_, state_), done, work_total(task_), detail});
}

void DesignLog::ended_early(const std::string& step, const std::string& why) {
  remark_ =
      "; " + step + " of round " + std::to_string(state_.round + 1) + " ended early (" + why + ")";
}

void DesignLog::good_enough() { remark_ += ", the wall shows no more (--quality paper goes on)"; }

void DesignLog::report_step(const std::string& what) const {
  if (task_.options.resume && !iterated_) {
    task_.control.report({stage_name(task_, state_), 0.0, 0.0, what});
  } else {
    report(what, 0);
  }
}

RunControl DesignLog::step(const std::string& what) const {
  report_step(what);
  return {task_.control.stop_token(),
          [this, what](const Progress& progress) { report_step(step_words(what, progress)); }};
}

void DesignLog::report_rendering(const std::string& what) const {
  task_.control.report({"design", work_total(task_), work_total(task_), what});
}

RunControl DesignLog::rendering(const std::string& what) const {
  report_rendering(what);
  return {task_.control.stop_token(),
          [this, what](const Progress& progress) { report_rendering(step_words(what, progress)); }};
}

void DesignLog::report_done() const {
  task_.control.report({"design", work_total(task_), work_total(task_), "done"});
}

std::string convergence_csv(const std::vector<ConvergenceRow>& rows) {
  std::ostringstream out;
  out.precision(9);
  ConvergenceRow row;
  const Description columns = description_of(row);
  std::vector<std::string> names;
  for (const Field& column : columns) names.push_back(column.name);
  out << joined(names, ",") << '\n';
  for (const ConvergenceRow& each : rows) {
    row = each;
    out << row.stage;
    for (const Field& column : columns) {
      if (column.is_number()) out << ',' << number_of(column.get());
    }
    out << '\n';
  }
  return out.str();
}

}  // namespace lensforge

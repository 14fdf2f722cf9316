// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/checkpoint.h"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <string>
#include <string_view>

#include "core/io/checkpoint_file.h"
#include "core/mesh/surface_mesh.h"
#include "core/schema/json.h"
#include "core/spline/control_net.h"
#include "design/setup/option_tables.h"

// After the header come the vertices and, if the header has scales, the reach of their steps, as
// doubles.

namespace lensforge {
namespace {

using nlohmann::json;

constexpr std::string_view kMagic = "lensforge checkpoint 4\n";

std::span<const double> entries(const Eigen::Matrix3Xd& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.size())};
}

/// Appends the light's options that differ from the default, so that designs for the usual light
/// keep their fingerprint.
void append_light(const LightOptions& light, json& description) {
  const Description usual = description_of(LightOptions());
  for (const Field& field : description_of(light)) {
    const FieldValue value = field.fingerprint();
    if (value == usual.at(field.name).fingerprint()) continue;
    description.push_back({field.name, json_of(value)});
  }
  const SourceShape& shape = light.source_shape;
  if (!shape.is_disc()) description.push_back({shape.columns, shape.rows, shape.weights});
  if (light.front_heights) {
    const HeightGrid& grid = light.front_heights->grid();
    description.push_back({grid.columns, grid.rows, grid.heights});
  }
}

void append_outline(const Outline& outline, json& description) {
  json points = json::array();
  for (const Eigen::Vector2d& p : outline.points) points.push_back({p.x(), p.y()});
  description.push_back({static_cast<int>(outline.kind), outline.radius, points});
}

json to_json(const ConvergenceRow& row) {
  const EnergyValues& e = row.energy;
  return {row.stage,  row.level,  row.round, row.iteration,  e.image, e.unlit,
          e.gradient, e.boundary, e.barrier, e.face,         e.edge,  e.laplacian,
          e.align,    e.flux,     e.total,   row.mass_error, row.mae, row.seconds};
}

ConvergenceRow row_from_json(const json& j) {
  ConvergenceRow row;
  row.stage = j.at(0);
  row.level = j.at(1);
  row.round = j.at(2);
  row.iteration = j.at(3);
  EnergyValues& e = row.energy;
  int next = 4;
  for (double* value :
       {&e.image, &e.unlit, &e.gradient, &e.boundary, &e.barrier, &e.face, &e.edge, &e.laplacian,
        &e.align, &e.flux, &e.total, &row.mass_error, &row.mae, &row.seconds}) {
    *value = j.at(static_cast<std::size_t>(next++));
  }
  return row;
}

}  // namespace

std::uint64_t design_fingerprint(const Image& target, const DesignOptions& options) {
  json weights = json::array();
  append_fingerprint(description_of(with_smoothness_applied(options).weights), weights);
  json description = {target.columns(), target.rows()};
  append_fingerprint(description_of(options), description);
  append_light(options.light, description);
  if (options.outline) append_outline(*options.outline, description);
  description.push_back(weights);
  if (options.made_by) {
    const MadeBy& made = *options.made_by;
    description.push_back(
        {made.pitch, made.rows_along_x, made.polish_sigma, made.rim_depth, made.rim_length});
    if (made.polish_spread > 0.0) description.push_back(made.polish_spread);
  }
  Fnv1a hash;
  hash.add(description.dump());
  hash.add(bytes_of(target.values()));
  return hash.value();
}

void write_checkpoint(const Checkpoint& checkpoint, const std::filesystem::path& path) {
  json rows = json::array();
  for (const ConvergenceRow& row : checkpoint.convergence) rows.push_back(to_json(row));
  const StepScales& steps = checkpoint.scales;
  const json scales = steps.known() ? json{steps.xy, steps.z} : json();
  const json header = {{"fingerprint", checkpoint.fingerprint},
                       {"level", checkpoint.level},
                       {"round", checkpoint.round},
                       {"value", std::isfinite(checkpoint.value) ? json(checkpoint.value) : json()},
                       {"transporting", checkpoint.transporting},
                       {"seconds", checkpoint.seconds},
                       {"columns", checkpoint.mesh.grid.columns},
                       {"rows", checkpoint.mesh.grid.rows},
                       {"scales", scales},
                       {"convergence", rows}};
  std::string numbers(bytes_of(entries(checkpoint.mesh.vertices)));
  numbers += bytes_of(entries(steps.reach));
  write_checkpoint_file(path, kMagic, {header, numbers});
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  const CheckpointContent parts = read_checkpoint_file(path, kMagic);
  try {
    Checkpoint checkpoint;
    checkpoint.fingerprint = parts.header.at("fingerprint");
    const JsonFields fields(parts.header, checkpoint_header_name(path));
    checkpoint.level = fields.integer("level");
    checkpoint.round = fields.integer("round");
    if (checkpoint.level < 0) fields.refuse("level", "it must be 0 or more");
    if (checkpoint.round < 0) fields.refuse("round", "it must be 0 or more");
    const json& value = parts.header.at("value");
    if (!value.is_null()) checkpoint.value = value;
    checkpoint.transporting = parts.header.at("transporting");
    checkpoint.seconds = parts.header.at("seconds");
    for (const json& row : parts.header.at("convergence")) {
      checkpoint.convergence.push_back(row_from_json(row));
    }
    const GridShape shape{fields.integer("columns"), fields.integer("rows")};
    const json& scales = parts.header.at("scales");
    const std::size_t bytes = parts.numbers.size() / (scales.is_null() ? 1 : 2);
    const std::size_t count = bytes / (3 * sizeof(double));
    if (shape.columns < 2 || shape.rows < 2 ||
        static_cast<std::size_t>(shape.columns) * static_cast<std::size_t>(shape.rows) != count ||
        parts.numbers.size() != count * 3 * sizeof(double) * (scales.is_null() ? 1 : 2)) {
      refuse_checkpoint(path, "holds fewer vertices than its header says");
    }
    checkpoint.mesh = make_grid_mesh(Eigen::Vector2d::Ones(), shape, 0.0);
    std::memcpy(checkpoint.mesh.vertices.data(), parts.numbers.data(), bytes);
    if (!checkpoint.mesh.vertices.allFinite())
      refuse_checkpoint(path, "holds a vertex that is not finite");
    if (!scales.is_null()) {
      checkpoint.scales.xy = scales.at(0);
      checkpoint.scales.z = scales.at(1);
      checkpoint.scales.reach.resizeLike(checkpoint.mesh.vertices);
      std::memcpy(checkpoint.scales.reach.data(), parts.numbers.data() + bytes, bytes);
    }
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
    report(detail, iteration);
    return !task_.control.stop_requested();
  };
}

void DesignLog::report(const std::string& detail, int iteration) const {
  const std::string stage = "design, level " + std::to_string(state_.level + 1) + " of " +
                            std::to_string(task_.levels.size());
  const auto level = static_cast<std::size_t>(state_.level);
  const Level& at = task_.levels[level];
  const double rounds = state_.round + static_cast<double>(iteration) / at.iterations;
  const double done = work_before(task_, level) + level_work(task_, level) * rounds / at.rounds;
  task_.control.report({stage, done, work_total(task_), detail});
}

void DesignLog::ended_early(const std::string& step, const std::string& why) {
  remark_ =
      "; " + step + " of round " + std::to_string(state_.round + 1) + " ended early (" + why + ")";
}

void DesignLog::report_rendering() const {
  task_.control.report({"design", work_total(task_), work_total(task_), "rendering the lens"});
}

void DesignLog::report_done() const {
  task_.control.report({"design", work_total(task_), work_total(task_), "done"});
}

std::string convergence_csv(const std::vector<ConvergenceRow>& rows) {
  std::ostringstream out;
  out.precision(9);
  out << "stage,level,round,iteration,image,unlit,gradient,boundary,barrier,face,edge,laplacian,"
         "align,"
         "flux,total,mass_error,mae,seconds\n";
  for (const ConvergenceRow& r : rows) {
    const EnergyValues& e = r.energy;
    out << r.stage << ',' << r.level << ',' << r.round << ',' << r.iteration;
    for (const double value :
         {e.image, e.unlit, e.gradient, e.boundary, e.barrier, e.face, e.edge, e.laplacian, e.align,
          e.flux, e.total, r.mass_error, r.mae, r.seconds}) {
      out << ',' << value;
    }
    out << '\n';
  }
  return out.str();
}

}  // namespace lensforge

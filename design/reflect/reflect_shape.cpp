// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_shape.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/checkpoint_file.h"
#include "core/io/files.h"
#include "core/schema/json.h"
#include "core/text/number_text.h"
#include "design/reflect/glare.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/light/reflection_energy.h"
#include "design/reflect/mesh/faces.h"
#include "design/reflect/radar.h"
#include "design/reflect/radar_goal.h"
#include "design/reflect/shape/normals.h"
#include "design/reflect/shape/shape_update.h"

namespace lensforge::reflect {
namespace {

/// Maximum tilt of the normals before the first update, up above the middle and down below it, rad:
/// a tenth of the lobe's width. A face that looks straight back at the light has no gradient, by
/// symmetry.
constexpr double kTilt = 0.01;

/// A stage ends when its energy changed by less than this share over kStageWindow updates.
/// Directions turn from update to update, which alone changes an energy by up to 0.5 %.
constexpr double kStageChange = 0.01;
constexpr std::size_t kStageWindow = 3;
/// For stealth the window is longer: where faces hold each other back the targets grow from update
/// to update, and the effect comes late.
constexpr std::size_t kStealthWindow = 8;

/// Strength with which stealth holds normals at the last update's, in units of β. The paper's 8
/// steps of 200/5914 take normals 1.35·β of their way to the reference, and so does one implicit
/// step with this weight. Without it faces that reflect no light are taken all the way, however
/// small β is, and hold their neighbours back: an ellipsoid of 400 faces ends at 0.0124 instead of
/// 0.0075 for the same displacement.
constexpr double kStay = 0.74;

/// Vertices beyond this distance have lost the shape; Embree ends the program for rays from far
/// beyond.
constexpr double kFarthest = 1e6 * kUnitDiagonal;

/// Time between two checkpoints, which a killed run has to repeat.
constexpr double kSaveSeconds = 1.0;

/// Maximum number of steps of the normals per seed.
constexpr std::uint64_t kSeedStride = std::uint64_t{1} << 32U;

/// Message for a run that gained too little.
std::string gain_words(double before, double after) {
  return "the energy went from " + number_text(before, 4) + " to " + number_text(after, 4) +
         ": less than a tenth of it was gained; a smaller --anchor, another number of --faces, "
         "more "
         "updates or fewer constraints may help";
}

struct Stage {
  const char* name;
  ElementKind elements;
  int updates;
};

class Schedule {
 public:
  Schedule(const ReflectInput& input, const ReflectOptions& options, const Executor& executor,
           const RunControl& control)
      : options_(options),
        executor_(executor.with_stop(control.stop_token())),
        control_(control),
        frame_(input.mesh),
        reference_(frame_.to_unit(input.mesh)),
        mesh_(reference_),
        field_(frame_.to_unit(make_light_field(options))),
        keep_(constraint_set(input)) {
    state_.fingerprint = reflect_fingerprint(input, options);
    if (options.goal == GoalKind::kRadar) sector_ = radar_sector(options, input.mesh);
    if (options.resume) resume();
  }

  ReflectResult run() {
    ReflectResult result;
    try {
      if (state_.updates.empty()) state_.before = evaluated();
      for (int stage = state_.stage; stage < stages(); ++stage) run_stage(stage);
      result.after = evaluated();
      result.radar = radar_comparison();
      if (!options_.glare.empty()) {
        result.glare = std::make_shared<GlareComparison>(
            compare_glare(frame_.from_unit(reference_), frame_.from_unit(mesh_),
                          make_glare_setup(options_), executor_));
      }
    } catch (const Interrupted&) {
      result.status = ReflectResult::Status::kInterrupted;
      save();
    }
    result.fingerprint = state_.fingerprint;
    result.before = state_.before;
    result.unmet = Constraints(reference_, keep_, Executor::serial()).broken(mesh_.vertices);
    if (result.done() && !gained_enough(options_.goal, result.before.total, result.after.total)) {
      result.unmet.push_back(gain_words(result.before.total, result.after.total));
    }
    result.reference = frame_.from_unit(reference_);
    result.mesh = frame_.from_unit(mesh_);
    result.updates = state_.updates;
    result.mean_displacement = displacements().mean();
    result.max_displacement = displacements().maxCoeff();
    result.seconds = seconds();
    return result;
  }

 private:
  [[nodiscard]] ConstraintSet constraint_set(const ReflectInput& input) const {
    ConstraintSet set;
    set.fixed = input.fixed;
    set.partner = input.partner;
    set.axis = std::max(0, static_cast<int>(options_.symmetry));
    set.planar = input.planar;
    set.volume = options_.keep_volume;
    set.box = options_.keep_box;
    set.max_displacement = frame_.to_unit(options_.max_displacement);
    set.min_thickness = frame_.to_unit(options_.min_thickness);
    return set;
  }

  [[nodiscard]] Energies evaluated() const {
    if (sector_) {
      return radar_energies(frame_.from_unit(mesh_), *sector_, options_.polarization, executor_);
    }
    return evaluate(mesh_, field_.goal, field_.evaluation_directions(), executor_);
  }

  [[nodiscard]] std::optional<RadarComparison> radar_comparison() const {
    const SurfaceMesh before = frame_.from_unit(reference_);
    const SurfaceMesh after = frame_.from_unit(mesh_);
    if (sector_) return compare_radar(before, after, *sector_, options_.polarization, executor_);
    if (options_.radar_ghz > 0.0) return compare_radar(before, after, options_, executor_);
    return {};
  }

  [[nodiscard]] int stages() const {
    if (sector_) return 1;
    return options_.split && options_.face_updates > 0 ? 3 : 2;
  }

  [[nodiscard]] Stage stage_of(int number) const {
    if (number == 0) return {"rim-spoke", ElementKind::kRimSpoke, options_.rim_updates};
    return {number == 1 ? "face" : "split", ElementKind::kFace, options_.face_updates};
  }

  /// Takes over the state of a checkpoint. @throw InputError
  void resume() {
    state_ = read_checkpoint(options_.checkpoint, state_.fingerprint);
    if (!state_.split.empty()) {
      const int edges = make_edges(reference_).count();
      const auto is_edge = [&](int e) { return e >= 0 && e < edges; };
      if (!std::all_of(state_.split.begin(), state_.split.end(), is_edge)) {
        refuse_checkpoint(options_.checkpoint, "splits an edge that the mesh does not have");
      }
      split(state_.split);
    }
    if (state_.vertices.cols() != mesh_.vertex_count() ||
        state_.unmet.cols() != mesh_.triangle_count()) {
      refuse_checkpoint(options_.checkpoint, "has other vertices or faces than the mesh");
    }
    if (!is_near(state_.vertices)) {
      refuse_checkpoint(options_.checkpoint, "has a vertex out of all bounds");
    }
    mesh_.vertices = state_.vertices;
    spent_ = state_.seconds;
  }

  void save() {
    if (options_.checkpoint.empty() || state_.updates.empty()) return;
    state_.seconds = seconds();
    state_.vertices = mesh_.vertices;
    write_checkpoint(state_, options_.checkpoint);
    saved_ = std::chrono::steady_clock::now();
    ++saves_;
  }

  /// Begins a stage, or continues the checkpoint's.
  void begin_stage(int number) {
    const bool goes_on = state_.stage == number && state_.unmet.cols() > 0;
    if (goes_on) return;
    if (number == 2) split(hampering_edges());
    state_.stage = number;
    state_.first = this->number();
    state_.unmet = Eigen::Matrix3Xd::Zero(3, reference_.triangle_count());
  }

  void run_stage(int number) {
    begin_stage(number);
    if (sector_) {
      run_radar_stage();
      return;
    }
    UnmetTurns unmet(state_.unmet);
    const Stage stage = stage_of(number);
    if (stage.updates == 0) return;
    ShapeUpdateOptions options;
    options.elements = stage.elements;
    options.normal_weight = options_.normal_weight;
    const ShapeUpdate shape(reference_, keep_.fixed, options);
    const Constraints constraints(reference_, keep_, executor_);
    std::optional<TvDenoiser> denoiser;
    if (options_.denoise > 0.0) denoiser.emplace(reference_, options_.denoise);
    anchor_ = {measure_faces(reference_).normal, options_.anchor};
    while (this->number() - state_.first < stage.updates && !settled()) {
      const LightPaths paths(mesh_, field_.goal, field_.directions(this->number()),
                             kGatherDirections, executor_);
      const ReflectionEnergy energy(paths, loss_for(field_.goal), executor_);
      ReflectUpdate row;
      row.stage = stage.name;
      row.energy = std::abs(energy.value(paths.faces().normal));
      Eigen::Matrix3Xd targets = targets_for(paths, energy);
      if (denoiser) targets = denoiser->denoise(targets);
      const Eigen::Matrix3Xd asked = pursues() ? unmet.added_to(targets) : targets;
      const Eigen::Matrix3Xd moved =
          constraints.enforced(shape.moved(mesh_.vertices, asked, executor_));
      require_near(moved);
      mesh_.vertices = moved;
      if (pursues()) unmet.record(targets, measure_faces(mesh_).normal);
      state_.unmet = unmet.sum();
      record(row);
    }
  }

  [[nodiscard]] RadarEchoes echoes_of(const SurfaceMesh& mesh) const {
    return {frame_.from_unit(mesh), *sector_, options_.polarization, executor_};
  }

  void run_radar_stage() {
    const SurfaceMesh reference = frame_.from_unit(reference_);
    const RadarDescent descent(
        reference, keep_.fixed,
        {radar_wavelength(sector_->ghz.front()), options_.anchor, state_.before.total});
    const Constraints constraints(reference_, keep_, executor_);
    RadarEchoes echoes = echoes_of(mesh_);
    while (number() < options_.radar_updates && !settled()) {
      ReflectUpdate row;
      row.stage = "radar";
      row.energy = echoes.mean();
      const Eigen::Matrix3Xd vertices = frame_.from_unit(mesh_).vertices;
      const Eigen::Matrix3Xd step = descent.moved(vertices, echoes, executor_) - vertices;
      if (!take_lower(frame_.to_unit(1.0) * step, constraints, echoes)) break;
      record(row);
    }
  }

  /// Moves the vertices by a step, or half or a quarter of it, so that the whole computation of
  /// edges and bounces confirms the gain. @return false if none of the three does.
  bool take_lower(const Eigen::Matrix3Xd& step, const Constraints& constraints,
                  RadarEchoes& echoes) {
    for (const double share : {1.0, 0.5, 0.25}) {
      SurfaceMesh trial = mesh_;
      trial.vertices = constraints.enforced(mesh_.vertices + share * step);
      RadarEchoes looked = echoes_of(trial);
      if (!(looked.mean() < echoes.mean())) continue;
      mesh_ = std::move(trial);
      echoes = std::move(looked);
      return true;
    }
    return false;
  }

  static bool is_near(const Eigen::Matrix3Xd& vertices) {
    return vertices.allFinite() && vertices.cwiseAbs().maxCoeff() < kFarthest;
  }

  /// Without denoiser and anchor the published steps may lose a shape altogether.
  void require_near(const Eigen::Matrix3Xd& vertices) const {
    if (is_near(vertices)) return;
    throw RunError("update " + std::to_string(number() + 1) +
                   " moved vertices out of all bounds; another --anchor or --seed may help");
  }

  /// True if normals go a part of the way in each update, and farther where faces did not follow.
  [[nodiscard]] bool pursues() const {
    return options_.method == Method::kExact && options_.goal == GoalKind::kStealth;
  }

  /// The anchor of one update: the positions held by β and by kStay, combined into one square.
  [[nodiscard]] NormalAnchor held(const Faces& faces) const {
    if (!pursues()) return anchor_;
    const double strength = anchor_.strength + kStay;
    return {(anchor_.strength * anchor_.reference + kStay * faces.normal) / strength, strength};
  }

  [[nodiscard]] int number() const { return static_cast<int>(state_.updates.size()); }

  void record(ReflectUpdate row) {
    row.number = number() + 1;
    row.mean_displacement = displacements().mean();
    row.max_displacement = displacements().maxCoeff();
    row.seconds = seconds();
    state_.updates.push_back(row);
    const std::chrono::duration<double> unsaved = std::chrono::steady_clock::now() - saved_;
    if (saves_ == 0 || unsaved.count() >= kSaveSeconds) save();
    const int most = sector_ ? options_.radar_updates
                             : options_.rim_updates + (stages() - 1) * options_.face_updates;
    control_.report({"reflect, " + row.stage, static_cast<double>(row.number),
                     static_cast<double>(most),
                     sector_ ? decimal_text(mean_dbsm({row.energy}), 1) + " dBsm"
                             : "energy " + number_text(row.energy, 4)});
  }

  /// True if the stage no longer gains.
  [[nodiscard]] bool settled() const {
    if (options_.method == Method::kPaper) return false;
    const std::vector<ReflectUpdate>& updates = state_.updates;
    const std::size_t window = pursues() ? kStealthWindow : kStageWindow;
    if (updates.size() < static_cast<std::size_t>(state_.first) + window + 1) return false;
    const double now = updates.back().energy;
    const double before = updates[updates.size() - 1 - window].energy;
    return std::abs(now - before) < kStageChange * before;
  }

  [[nodiscard]] Eigen::Matrix3Xd targets_for(const LightPaths& paths,
                                             const ReflectionEnergy& energy) const {
    return options_.method == Method::kPaper ? estimated_targets(paths.faces())
                                             : exact_targets(paths, energy);
  }

  [[nodiscard]] Eigen::Matrix3Xd exact_targets(const LightPaths& paths,
                                               const ReflectionEnergy& energy) const {
    const Eigen::VectorXd share = paths.faces().area_share();
    const NormalAnchor anchor = held(paths.faces());
    const NormalObjective objective(energy, anchor, share);
    const Eigen::Matrix3Xd start = number() == 0 ? tilted(paths.faces()) : paths.faces().normal;
    const Eigen::Matrix3Xd first = turned_by_face(objective, paths, field_.goal, start);
    const Eigen::Matrix3Xd near =
        descended_by_face(objective, first, options_.normal_steps, executor_);
    return optimized_normals(objective, near, (options_.normal_steps + 1) / 2, executor_);
  }

  [[nodiscard]] Eigen::Matrix3Xd estimated_targets(const Faces& faces) const {
    const Loss loss = field_.goal.maximizes() ? Loss::kInverse : Loss::kSquare;
    const PathEstimator estimator(mesh_, field_, loss, executor_);
    const std::uint64_t seed =
        kSeedStride * static_cast<std::uint64_t>(options_.seed) +
        static_cast<std::uint64_t>(options_.normal_steps) * static_cast<std::uint64_t>(number());
    return stepped_normals(estimator, anchor_, faces.area_share(), faces.normal,
                           options_.normal_steps, seed);
  }

  [[nodiscard]] static Eigen::Matrix3Xd tilted(const Faces& faces) {
    const double half = faces.centroid.row(2).cwiseAbs().maxCoeff();
    Eigen::Matrix3Xd normal = faces.normal;
    if (half > 0.0) normal.row(2) += (kTilt / half) * faces.centroid.row(2);
    return normal.colwise().normalized();
  }

  [[nodiscard]] std::vector<int> hampering_edges() const {
    const LightPaths paths(mesh_, field_.goal, field_.directions(number()), kGatherDirections,
                           executor_);
    const Eigen::VectorXd energy =
        ReflectionEnergy(paths, Loss::kSquare, executor_).by_face(paths.faces().normal);
    const Eigen::VectorXd criterion = split_criterion(mesh_, energy);
    const auto count = static_cast<int>(kSplitShare * static_cast<double>(criterion.size()));
    return chosen_edges(mesh_, criterion, count, keep_.partner);
  }

  /// Cuts edges on both meshes.
  void split(const std::vector<int>& edges) {
    const SplitMesh cut = split_at_middles(reference_, edges);
    extend_constraints(cut, edges);
    mesh_ = split_at_middles(mesh_, edges).mesh;
    reference_ = cut.mesh;
    state_.split = edges;
  }

  /// New vertices between fixed ones are fixed; halves of planar faces stay planar.
  void extend_constraints(const SplitMesh& cut, const std::vector<int>& edges) {
    const EdgeTable table = make_edges(reference_);
    for (const int e : edges) {
      if (keep_.fixed.empty()) break;
      const Edge& edge = table.edges[static_cast<std::size_t>(e)];
      keep_.fixed.push_back(keep_.fixed[static_cast<std::size_t>(edge.from)] != 0 &&
                            keep_.fixed[static_cast<std::size_t>(edge.to)] != 0);
    }
    const auto old = static_cast<int>(reference_.triangle_count());
    for (std::vector<int>& group : keep_.planar) {
      const std::vector<int> faces = group;
      for (std::size_t i = 0; i < cut.parent.size(); ++i) {
        const bool inside = std::find(faces.begin(), faces.end(), cut.parent[i]) != faces.end();
        if (inside) group.push_back(old + static_cast<int>(i));
      }
    }
    if (!keep_.partner.empty()) keep_.partner = mirror_partners(cut.mesh, keep_.axis);
  }

  /// Displacements of the vertices, as shares of the diagonal.
  [[nodiscard]] Eigen::RowVectorXd displacements() const {
    return (mesh_.vertices - reference_.vertices).colwise().norm() / kUnitDiagonal;
  }

  [[nodiscard]] double seconds() const {
    return spent_ +
           std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  const ReflectOptions& options_;
  Executor executor_;
  const RunControl& control_;
  UnitFrame frame_;
  SurfaceMesh reference_;
  SurfaceMesh mesh_;
  LightField field_;
  std::optional<RadarSector> sector_;  ///< Of --goal radar.
  ConstraintSet keep_;
  NormalAnchor anchor_;
  ReflectCheckpoint state_;  ///< Its vertices are in `mesh_` until it is saved.
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point saved_ = start_;
  int saves_ = 0;
  double spent_ = 0.0;  ///< Seconds before the run was resumed.
};

}  // namespace

bool gained_enough(GoalKind goal, double before, double after) {
  if (goal == GoalKind::kRadar) return after <= (1.0 - kMinGain) * before;
  if (Goal{.kind = goal}.maximizes()) return after > 0.0 && after >= (1.0 + kMinGain) * before;
  return before <= kLittleEnergy ? after <= kLittleEnergy : after <= (1.0 - kMinGain) * before;
}

ReflectResult reflect_shape(const ReflectInput& input, const ReflectOptions& options,
                            const Executor& executor, const RunControl& control) {
  validate(options);
  return Schedule(input, options, executor, control).run();
}

Energies evaluate(const SurfaceMesh& mesh, const ReflectOptions& options,
                  const Executor& executor) {
  validate(options);
  if (options.goal == GoalKind::kRadar) {
    return radar_energies(mesh, radar_sector(options, mesh), options.polarization, executor);
  }
  const UnitFrame frame(mesh);
  const LightField field = frame.to_unit(make_light_field(options));
  return evaluate(frame.to_unit(mesh), field.goal, field.evaluation_directions(), executor);
}

namespace {

/// After the header come the vertices and the unmet turns, as doubles.
constexpr std::string_view kMagic = "lensforge reflect checkpoint 1\n";

/// Stages of a run: rim-spoke, face, split.
constexpr int kStages = 3;

template <class Matrix>
auto entries(const Matrix& matrix) {
  using Scalar = typename Matrix::Scalar;
  return std::span<const Scalar>(matrix.data(), static_cast<std::size_t>(matrix.size()));
}

/// Takes a matrix of three rows from the front of the numbers.
Eigen::Matrix3Xd taken(std::string_view& numbers, int columns, const std::filesystem::path& path) {
  constexpr std::size_t kBytes = 3 * sizeof(double);
  if (columns < 0 || static_cast<std::size_t>(columns) > numbers.size() / kBytes) {
    refuse_checkpoint(path, "holds fewer numbers than its header says");
  }
  Eigen::Matrix3Xd matrix(3, columns);
  const std::size_t bytes = kBytes * static_cast<std::size_t>(columns);
  if (bytes > 0) std::memcpy(matrix.data(), numbers.data(), bytes);
  numbers.remove_prefix(bytes);
  if (!matrix.allFinite()) refuse_checkpoint(path, "holds a number that is not finite");
  return matrix;
}

}  // namespace

void describe(Description& d, ReflectUpdate& update) {
  d.whole("update", update.number, {}, "");
  d.text("stage", update.stage, "", "");
  d.number("energy", update.energy, {}, "", "");
  d.number("mean_displacement", update.mean_displacement, {}, "", "");
  d.number("max_displacement", update.max_displacement, {}, "", "");
  d.number("seconds", update.seconds, {}, "", "");
}

void describe(Description& d, ReflectCheckpoint& checkpoint) {
  d.whole("stage", checkpoint.stage, Limits::between(0, kStages - 1), "").needed = true;
  d.whole("first", checkpoint.first, {}, "").needed = true;
  d.number("direct", checkpoint.before.direct, {}, "", "").needed = true;
  d.number("total", checkpoint.before.total, {}, "", "").needed = true;
  d.number("seconds", checkpoint.seconds, {}, "", "").needed = true;
}

std::uint64_t reflect_fingerprint(const ReflectInput& input, const ReflectOptions& options) {
  nlohmann::json description = {input.fixed, input.planar, input.partner};
  append_fingerprint(description_of(options), description);
  Fnv1a hash;
  hash.add(description.dump());
  hash.add(bytes_of(entries(input.mesh.vertices)));
  hash.add(bytes_of(entries(input.mesh.triangles)));
  std::error_code ignored;
  if (std::filesystem::is_regular_file(options.place, ignored)) {
    hash.add(read_whole_file(options.place, kMaxPlaceBytes));
  }
  return hash.value();
}

void write_checkpoint(const ReflectCheckpoint& checkpoint, const std::filesystem::path& path) {
  nlohmann::json rows = nlohmann::json::array();
  for (const ReflectUpdate& row : checkpoint.updates) rows.push_back(row_of(description_of(row)));
  nlohmann::json header = json_of(description_of(checkpoint));
  header.update({{"fingerprint", checkpoint.fingerprint},
                 {"split", checkpoint.split},
                 {"updates", rows},
                 {"vertices", checkpoint.vertices.cols()},
                 {"faces", checkpoint.unmet.cols()}});
  std::string numbers(bytes_of(entries(checkpoint.vertices)));
  numbers += bytes_of(entries(checkpoint.unmet));
  write_checkpoint_file(path, kMagic, {header, numbers});
}

ReflectCheckpoint read_checkpoint(const std::filesystem::path& path,
                                  std::optional<std::uint64_t> fingerprint) {
  const CheckpointContent content = read_checkpoint_file(path, kMagic);
  try {
    const JsonFields fields(content.header, checkpoint_header_name(path));
    ReflectCheckpoint checkpoint;
    read_json(description_of(checkpoint), fields);
    checkpoint.fingerprint = content.header.at("fingerprint");
    checkpoint.split = content.header.at("split").get<std::vector<int>>();
    for (const nlohmann::json& row : content.header.at("updates")) {
      read_row(description_of(checkpoint.updates.emplace_back()), row);
    }
    if (checkpoint.first < 0 || checkpoint.first > static_cast<int>(checkpoint.updates.size())) {
      fields.refuse("first", "it must be 0 to the number of updates");
    }
    if (fingerprint && checkpoint.fingerprint != *fingerprint) {
      refuse_checkpoint(path,
                        "is of another mesh or other options: run the command that began it, or "
                        "start anew with --force");
    }
    std::string_view numbers = content.numbers;
    checkpoint.vertices = taken(numbers, fields.integer("vertices"), path);
    checkpoint.unmet = taken(numbers, fields.integer("faces"), path);
    if (!numbers.empty()) refuse_checkpoint(path, "holds more numbers than its header says");
    return checkpoint;
  } catch (const nlohmann::json::exception&) {
    refuse_checkpoint(path, "has a bad header: a field is missing or of another type");
  }
}

}  // namespace lensforge::reflect

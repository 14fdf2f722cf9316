// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_shape.h"

#include <chrono>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/text/number_text.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/light/reflection_energy.h"
#include "design/reflect/mesh/unit_frame.h"
#include "design/reflect/normals/face_descent.h"
#include "design/reflect/normals/normal_objective.h"
#include "design/reflect/normals/tv_denoise.h"
#include "design/reflect/shape/shape_update.h"

namespace lensforge::reflect {
namespace {

/// A face that looks straight back at the light has no gradient by symmetry: before the first
/// update normals are tilted up above the middle and down below it by this at most, rad. A tenth
/// of the lobe's width.
constexpr double kTilt = 0.01;

/// A stage ends when its energy fell by less than this share over so many updates. Directions turn
/// from update to update, which alone changes an energy by up to 0.5 %.
constexpr double kStageDecrease = 0.01;
constexpr std::size_t kStageWindow = 3;

class Schedule {
 public:
  Schedule(const SurfaceMesh& mesh, const ReflectOptions& options, const Executor& executor,
           const RunControl& control)
      : options_(options),
        executor_(executor.with_stop(control.stop_token())),
        control_(control),
        frame_(mesh),
        reference_(frame_.to_unit(mesh)),
        mesh_(reference_),
        field_(frame_.to_unit(make_light_field(options))),
        total_(options.rim_updates + options.face_updates) {}

  ReflectResult run() {
    ReflectResult result;
    try {
      result.before = evaluate(mesh_, field_.goal, field_.evaluation_directions(), executor_);
      run_stage(ElementKind::kRimSpoke, options_.rim_updates);
      run_stage(ElementKind::kFace, options_.face_updates);
      result.after = evaluate(mesh_, field_.goal, field_.evaluation_directions(), executor_);
    } catch (const Interrupted&) {
      result.status = ReflectResult::Status::kInterrupted;
    }
    result.reference = frame_.from_unit(reference_);
    result.mesh = frame_.from_unit(mesh_);
    result.updates = updates_;
    result.mean_displacement = mean_displacement();
    result.max_displacement = max_displacement();
    result.seconds = seconds();
    return result;
  }

 private:
  void run_stage(ElementKind elements, int updates) {
    if (updates == 0) return;
    ShapeUpdateOptions options;
    options.elements = elements;
    options.normal_weight = options_.normal_weight;
    const ShapeUpdate shape(reference_, {}, options);
    std::optional<TvDenoiser> denoiser;
    if (options_.denoise > 0.0) denoiser.emplace(reference_, options_.denoise);
    anchor_ = {measure_faces(reference_).normal, options_.anchor};
    const std::size_t first = updates_.size();
    for (int i = 0; i < updates && !settled(first); ++i) update(elements, shape, denoiser);
  }

  /// Whether the stage that began with update `first` no longer gains.
  [[nodiscard]] bool settled(std::size_t first) const {
    if (updates_.size() < first + kStageWindow + 1) return false;
    const double now = updates_.back().energy;
    const double before = updates_[updates_.size() - 1 - kStageWindow].energy;
    return std::abs(now - before) < kStageDecrease * before;
  }

  void update(ElementKind elements, const ShapeUpdate& shape,
              const std::optional<TvDenoiser>& denoiser) {
    const auto number = static_cast<int>(updates_.size());
    const LightPaths paths(mesh_, field_.goal, field_.directions(number), kGatherDirections,
                           executor_);
    const Eigen::Matrix3Xd& now = paths.faces().normal;
    ReflectUpdate row;
    row.number = number + 1;
    row.stage = elements == ElementKind::kFace ? "face" : "rim-spoke";
    row.energy = ReflectionEnergy(paths, Loss::kSquare, executor_).value(now);
    Eigen::Matrix3Xd targets = targets_for(paths, number == 0 ? tilted(paths.faces()) : now);
    if (denoiser) targets = denoiser->denoise(targets);
    mesh_.vertices = shape.moved(mesh_.vertices, targets, executor_);
    row.mean_displacement = mean_displacement();
    row.max_displacement = max_displacement();
    row.seconds = seconds();
    updates_.push_back(row);
    control_.report({"reflect, " + row.stage, static_cast<double>(row.number),
                     static_cast<double>(total_), "energy " + number_text(row.energy, 4)});
  }

  [[nodiscard]] Eigen::Matrix3Xd targets_for(const LightPaths& paths,
                                             const Eigen::Matrix3Xd& start) const {
    const ReflectionEnergy energy(paths, loss_for(field_.goal), executor_);
    const Eigen::VectorXd share = paths.faces().area_share();
    const NormalObjective objective(energy, anchor_, share);
    const Eigen::Matrix3Xd first = tilted_by_face(objective, start);
    const Eigen::Matrix3Xd near =
        descended_by_face(objective, first, options_.normal_steps, executor_);
    return optimized_normals(objective, near, (options_.normal_steps + 1) / 2, executor_);
  }

  [[nodiscard]] static Eigen::Matrix3Xd tilted(const Faces& faces) {
    const double half = faces.centroid.row(2).cwiseAbs().maxCoeff();
    Eigen::Matrix3Xd normal = faces.normal;
    if (half > 0.0) normal.row(2) += (kTilt / half) * faces.centroid.row(2);
    return normal.colwise().normalized();
  }

  /// Distances from where the vertices were, as shares of the diagonal.
  [[nodiscard]] Eigen::RowVectorXd displacements() const {
    return (mesh_.vertices - reference_.vertices).colwise().norm() / kUnitDiagonal;
  }
  [[nodiscard]] double mean_displacement() const { return displacements().mean(); }
  [[nodiscard]] double max_displacement() const { return displacements().maxCoeff(); }

  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  const ReflectOptions& options_;
  Executor executor_;
  const RunControl& control_;
  UnitFrame frame_;
  SurfaceMesh reference_;
  SurfaceMesh mesh_;
  LightField field_;
  int total_;
  NormalAnchor anchor_;
  std::vector<ReflectUpdate> updates_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace

ReflectResult reflect_shape(const SurfaceMesh& mesh, const ReflectOptions& options,
                            const Executor& executor, const RunControl& control) {
  validate(options);
  return Schedule(mesh, options, executor, control).run();
}

Energies evaluate(const SurfaceMesh& mesh, const ReflectOptions& options,
                  const Executor& executor) {
  validate(options);
  const UnitFrame frame(mesh);
  const LightField field = frame.to_unit(make_light_field(options));
  return evaluate(frame.to_unit(mesh), field.goal, field.evaluation_directions(), executor);
}

}  // namespace lensforge::reflect

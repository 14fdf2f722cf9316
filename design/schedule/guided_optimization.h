// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <numbers>

#include "core/compute/executor.h"
#include "core/compute/scalar.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "design/energy/objective.h"
#include "design/energy/objective_options.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/optimize/lbfgs.h"

namespace lensforge {

/// The numerical half of a GuidedOptimization: objective, preconditioner and minimiser on one
/// device. Vectors are transferred before and after a minimisation, not during it.
class GuidedStage {
 public:
  using Observer = std::function<bool(int iteration, const ObjectiveEvaluation&)>;

  GuidedStage() = default;
  virtual ~GuidedStage() = default;
  GuidedStage(const GuidedStage&) = delete;
  GuidedStage& operator=(const GuidedStage&) = delete;

  /// See DesignObjective.
  [[nodiscard]] virtual const Eigen::Matrix3Xd& movable() const = 0;
  virtual void relinearize(const Eigen::Matrix3Xd& vertices) = 0;
  virtual ObjectiveEvaluation evaluate(const Eigen::Matrix3Xd& vertices,
                                       Eigen::Matrix3Xd& gradient) = 0;

  /// See GridPreconditionerOn.
  virtual void set_symbols(const GridSymbol& xy, const GridSymbol& z) = 0;
  virtual void set_reach(const Eigen::Matrix3Xd& reach) = 0;
  virtual Eigen::Matrix3Xd apply_root(const Eigen::Matrix3Xd& g) = 0;

  /// Moves `vertices` to the best surface found, also where an exception ends the run.
  virtual LbfgsSummary minimize(const LbfgsOptions& options, const Observer& observe,
                                Eigen::Matrix3Xd& vertices) = 0;
};

/// The stage on all ranks, used by rank 0 while the others run serve_rank(); parameters as in
/// GuidedStageOn. Null if one process is enough: without other ranks, for a spline, for a grid with
/// too few rows for the ranks, and in a build without MPI.
/// @param executor  gives each rank's number of threads; its stop token ends all ranks' kernels.
std::unique_ptr<GuidedStage> make_stage_on_ranks(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                                 double aspect, const DesignGoal& goal,
                                                 const ObjectiveOptions& options,
                                                 const Executor& executor);

#if defined(LENSFORGE_CUDA)
/// The stage on the GPU; parameters as in GuidedStageOn. @throw RunError if the GPU's memory is too
/// small.
std::unique_ptr<GuidedStage> make_cuda_stage(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                             double aspect, const DesignGoal& goal,
                                             const ObjectiveOptions& options,
                                             const Executor& executor);
#endif

// How steps are measured.

/// Image motion, in pixels, of the finite difference that measures curvature.
inline constexpr double kProbePixels = 0.02;

/// Maximum number of halvings of it if a barrier refuses the step.
inline constexpr int kMaxHalvings = 20;

/// Lower bound of the height preconditioner, as a share of the grid Laplacian's lowest eigenvalue:
/// below it the lens tilts and bends as a whole.
inline constexpr double kHeightFloor = 0.5;

/// Brightness is a second derivative of height, so its squared error is a biharmonic form. The
/// landing point is a first derivative, so its squared error is the Laplacian's form.
inline constexpr double kPictureHeightPower = 2.0;
inline constexpr double kCorrespondenceHeightPower = 1.0;

/// Smoothing of the x and y steps: shifts longer than two cells are favoured.
inline constexpr double kShiftFloor = 0.25;
inline constexpr double kShiftPower = 1.0;

/// Of a grid's Laplacian, in cells.
inline double lowest_eigenvalue(const GridShape& shape) {
  const double longest = std::max(shape.columns, shape.rows) - 1.0;
  return std::numbers::pi * std::numbers::pi / (longest * longest);
}

/// A fixed sequence of ±1 that has no preferred frequency (SplitMix64).
inline double sign_at(std::uint64_t i) {
  return (mixed_bits((i + 1) * kGoldenGamma) & 1U) != 0 ? 1.0 : -1.0;
}

/// Cell height ÷ cell width.
inline double cell_aspect(const OpticalSetup& setup, const GridShape& shape) {
  return setup.lens_size.y() / (shape.rows - 1) / (setup.lens_size.x() / (shape.columns - 1));
}

/// Step lengths of the vertices, measured on one surface; see GuidedOptimization::run(). Further
/// rounds keep them, because a surface that fits already has little curvature to measure. MAE in
/// thousandths after six rounds, measured anew and kept: 256 × 128 calligraphy 3.4 and 2.9, 128²
/// portrait 2.7 and 2.5.
struct StepScales {
  Eigen::Matrix3Xd reach;  ///< 3 × V, factors of the preconditioner's x, y and z; empty: unknown.
  double xy = 1.0;         ///< Scales of its x, y and z parts.
  double z = 1.0;

  [[nodiscard]] bool known() const { return reach.cols() > 0; }
};

/// Optimisation of a grid mesh at one resolution: rendering-guided if the goal is a picture (Sun et
/// al., section 3.3), correspondence-guided if it is a correspondence (section 3.4). L-BFGS with a
/// preconditioner whose scales are measured, not guessed. Works on the executor's device.
class GuidedOptimization {
 public:
  /// @param mesh  a grid mesh; defines connectivity and which coordinates are held.
  GuidedOptimization(const SurfaceMesh& mesh, const OpticalSetup& setup, const DesignGoal& goal,
                     const ObjectiveOptions& options, const Executor& executor);

  /// Called after every iteration; false ends the run.
  using Observer = GuidedStage::Observer;

  /// Improves `mesh` by at most `options.max_iterations` steps. Unknown scales are measured on the
  /// mesh first. The result depends on mesh and scales alone, so a resumed run takes the same
  /// steps.
  /// @param control  takes reports until the first iteration.
  /// @throw Interrupted if the executor is stopped; `mesh` then holds the best surface so far.
  LbfgsSummary run(const LbfgsOptions& options, const Observer& observe, StepScales& scales,
                   SurfaceMesh& mesh, const RunControl& control = {});
  LbfgsSummary run(const LbfgsOptions& options, const Observer& observe, SurfaceMesh& mesh) {
    StepScales scales;
    return run(options, observe, scales, mesh);
  }

  /// Step lengths measured on the mesh. @param control  takes reports.
  [[nodiscard]] StepScales measured_scales(const SurfaceMesh& mesh, const RunControl& control);

  /// The objective of the mesh, with Welsch weights taken from it; infinite if a barrier refuses
  /// it.
  [[nodiscard]] double value(const SurfaceMesh& mesh);

 private:
  /// Reports the pictures from which curvatures are measured.
  class Probes;

  void calibrate(const Eigen::Matrix3Xd& vertices, Probes& probes);
  void begin_preconditioner(const SurfaceMesh& mesh, Eigen::Matrix3Xd& reach);
  void level_shifts(const Eigen::Matrix3Xd& vertices, Probes& probes, Eigen::Matrix3Xd& reach);
  [[nodiscard]] Eigen::VectorXd squared_curvatures(const Eigen::Matrix3Xd& vertices, bool heights,
                                                   std::uint64_t number, Probes& probes);
  [[nodiscard]] Eigen::Matrix3Xd probe(bool heights, std::uint64_t number);

  OpticalSetup setup_;
  GridShape grid_;
  double cell_;  ///< Width of a grid cell, mm.
  GridSymbol xy_;
  GridSymbol z_;
  std::unique_ptr<GuidedStage> stage_;
};

}  // namespace lensforge

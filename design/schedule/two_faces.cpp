// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/two_faces.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/io/checkpoint_file.h"
#include "core/lens/surface_check.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/spline/control_net.h"
#include "design/energy/objective.h"
#include "design/energy/objective_options.h"
#include "design/energy/two_face_objective.h"
#include "design/optimize/grid_preconditioner.h"
#include "design/optimize/lbfgs.h"
#include "design/render.h"
#include "design/schedule/checkpoint.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/rounds.h"

namespace lensforge {
namespace {

/// Curvature, as a share of the heights', below which shifts along the surface move no light: the
/// surface is flat, and they are held.
constexpr double kLeastBend = 1e-4;

/// Linear interpolation between `samples` even samples at the Greville points of a spline.
Eigen::MatrixXd at_greville_points(int coefficients, int samples) {
  const int cells = coefficients - kSplineDegree;
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(coefficients, samples);
  for (int i = 0; i < coefficients; ++i) {
    const double t = greville_point(i, cells) * (samples - 1) / cells;
    const int first = std::clamp(static_cast<int>(t), 0, samples - 2);
    weights(i, first) = 1.0 - (t - first);
    weights(i, first + 1) = t - first;
  }
  return weights;
}

/// Even control points over the lens, for what of them may move.
Eigen::Matrix3Xd even_points(const GridShape& net, const Eigen::Vector2d& size) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, Eigen::Index{net.columns} * net.rows);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const auto i = static_cast<int>(k % net.columns);
    const auto j = static_cast<int>(k / net.columns);
    points(0, k) = size.x() * greville_point(i, net.columns - 3) / (net.columns - 3);
    points(1, k) = size.y() * greville_point(j, net.rows - 3) / (net.rows - 3);
  }
  return points;
}

/// Of a front only heights move.
Eigen::Matrix3Xd heights_alone(const GridShape& front) {
  Eigen::Matrix3Xd movable = Eigen::Matrix3Xd::Zero(3, Eigen::Index{front.columns} * front.rows);
  movable.row(2).setOnes();
  return movable;
}

/// Optimisation of both faces of a lens at one resolution: L-BFGS on a TwoFaceObjective.
///
/// The exit face's heights are counted from the front's: bending both faces alike moves light only
/// across the lens's thickness, bending one alone moves it across the distance of a screen, some
/// hundred times as far. In these variables the two are scaled apart, each by its measured
/// curvature.
class TwoFaceStage {
 public:
  /// @param net, front  shapes of LensFaces.
  TwoFaceStage(const GridShape& net, const GridShape& front, const std::vector<ScreenGoal>& goals,
               const ObjectiveOptions& options, const FaceLimits& limits, const Executor& executor);

  /// Improves both faces by at most `options.max_iterations` steps.
  /// @throw Interrupted if the executor is stopped; `faces` are then the best so far.
  LbfgsSummary run(const LbfgsOptions& options, const GuidedStage::Observer& observe,
                   LensFaces& faces);

  /// MAE of every screen.
  [[nodiscard]] std::vector<double> errors(const LensFaces& faces);

 private:
  /// Variables that are scaled together.
  enum class Part { kShifts, kHeights, kFront };
  using Vector = std::vector<double>;

  [[nodiscard]] Vector variables_of(const LensFaces& faces) const;
  void set_faces(std::span<const double> x, LensFaces& faces) const;
  double evaluate(std::span<const double> x, std::span<double> gradient);
  void precondition(std::span<const double> g, double exponent, std::span<double> r);
  void calibrate(const Vector& x);
  [[nodiscard]] double curvature(const Vector& x, Part part);
  [[nodiscard]] Vector signs(Part part) const;
  [[nodiscard]] double& scale(Part part);

  Executor executor_;
  OpticalSetup setup_;  ///< Of the first screen.
  double thickness_;
  GridShape net_;
  GridShape front_;
  Eigen::Index exit_size_;  ///< Variables of the exit face, which come first.
  Eigen::MatrixXd lift_x_;  ///< The front's heights at the control points' even places.
  Eigen::MatrixXd lift_y_;
  TwoFaceObjective objective_;
  GridPreconditionerOn<Executor> exit_preconditioner_;
  GridPreconditionerOn<Executor> front_preconditioner_;
  LensFaces faces_;
  LensFaces gradient_;
  ObjectiveEvaluation last_;
};

TwoFaceStage::TwoFaceStage(const GridShape& net, const GridShape& front,
                           const std::vector<ScreenGoal>& goals, const ObjectiveOptions& options,
                           const FaceLimits& limits, const Executor& executor)
    : executor_(executor),
      setup_(goals.front().setup),
      thickness_(limits.thickness),
      net_(net),
      front_(front),
      exit_size_(Eigen::Index{3} * net.columns * net.rows),
      lift_x_(at_greville_points(net.columns, front.columns)),
      lift_y_(at_greville_points(net.rows, front.rows)),
      objective_(net, front, goals, options, limits, executor),
      exit_preconditioner_(net, cell_aspect(setup_, net),
                           objective_detail::movable_coordinates(even_points(net, setup_.lens_size),
                                                                 setup_.lens_size),
                           executor),
      front_preconditioner_(front, cell_aspect(setup_, front), heights_alone(front), executor) {
  exit_preconditioner_.xy = {1.0, kShiftFloor, kShiftPower, 0.0};
  exit_preconditioner_.z = {1.0, kHeightFloor * lowest_eigenvalue(net), kPictureHeightPower, 0.0};
  front_preconditioner_.xy = {1.0, 1.0, 0.0, 0.0};
  front_preconditioner_.z = {1.0, kHeightFloor * lowest_eigenvalue(front), kPictureHeightPower,
                             0.0};
}

TwoFaceStage::Vector TwoFaceStage::variables_of(const LensFaces& faces) const {
  Vector x(static_cast<std::size_t>(exit_size_ + 3 * faces.front.size()), 0.0);
  Eigen::Map<Eigen::Matrix3Xd> exit(x.data(), 3, exit_size_ / 3);
  Eigen::Map<Eigen::Matrix3Xd> front(x.data() + exit_size_, 3, faces.front.size());
  exit = faces.exit;
  exit.row(2) -= (lift_x_ * faces.front * lift_y_.transpose()).reshaped().transpose();
  front.row(2) = faces.front.reshaped().transpose();
  return x;
}

void TwoFaceStage::set_faces(std::span<const double> x, LensFaces& faces) const {
  const Eigen::Map<const Eigen::Matrix3Xd> exit(x.data(), 3, exit_size_ / 3);
  const Eigen::Map<const Eigen::Matrix3Xd> front(x.data() + exit_size_, 3,
                                                 Eigen::Index{front_.columns} * front_.rows);
  faces.front = front.row(2).reshaped(front_.columns, front_.rows);
  faces.exit = exit;
  faces.exit.row(2) += (lift_x_ * faces.front * lift_y_.transpose()).reshaped().transpose();
}

double TwoFaceStage::evaluate(std::span<const double> x, std::span<double> gradient) {
  set_faces(x, faces_);
  last_ = objective_.evaluate(faces_, gradient_);
  if (!last_.feasible) return kInfinity;
  Eigen::Map<Eigen::Matrix3Xd> exit(gradient.data(), 3, exit_size_ / 3);
  Eigen::Map<Eigen::Matrix3Xd> front(gradient.data() + exit_size_, 3, gradient_.front.size());
  exit = gradient_.exit;
  const Eigen::MatrixXd heights = gradient_.exit.row(2).reshaped(net_.columns, net_.rows);
  front.setZero();
  front.row(2) = (gradient_.front + lift_x_.transpose() * heights * lift_y_).reshaped().transpose();
  return last_.energy.total;
}

void TwoFaceStage::precondition(std::span<const double> g, double exponent, std::span<double> r) {
  const auto exit = static_cast<std::size_t>(exit_size_);
  exit_preconditioner_.apply(g.first(exit), exponent, r.first(exit));
  front_preconditioner_.apply(g.subspan(exit), exponent, r.subspan(exit));
}

double& TwoFaceStage::scale(Part part) {
  if (part == Part::kFront) return front_preconditioner_.z.scale;
  return (part == Part::kHeights ? exit_preconditioner_.z : exit_preconditioner_.xy).scale;
}

/// Random signs in the variables of one part.
TwoFaceStage::Vector TwoFaceStage::signs(Part part) const {
  Vector signs(
      static_cast<std::size_t>(exit_size_ + Eigen::Index{3} * front_.columns * front_.rows), 0.0);
  for (std::size_t i = 0; i < signs.size(); ++i) {
    const bool front = i >= static_cast<std::size_t>(exit_size_);
    const Part own = front ? Part::kFront : (i % 3 == 2 ? Part::kHeights : Part::kShifts);
    if (own == part) signs[i] = sign_at(i);
  }
  return signs;
}

/// Root mean square of P^½ H P^½ applied to random signs, H by a central difference of the
/// gradient; 0 if the barriers refuse every step.
double TwoFaceStage::curvature(const Vector& x, Part part) {
  Vector direction(x.size());
  precondition(signs(part), 0.5, direction);
  const auto count = static_cast<double>(part == Part::kFront ? front_.columns * front_.rows
                                                              : net_.columns * net_.rows);
  const auto vector = [](const Vector& v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  const double rms = vector(direction).norm() / std::sqrt(count);
  const double cell = setup_.lens_size.x() / (part == Part::kFront ? front_.columns : net_.columns);
  double motion = rms;
  if (part == Part::kHeights) motion = LightPath(setup_).reach(rms / cell);
  if (part == Part::kFront) motion = thickness_ * rms / cell;
  double step = kProbePixels * setup_.image_size.x() / setup_.pixels.x() / motion;
  Vector there(x.size());
  Vector forward(x.size());
  Vector backward(x.size());
  const auto look = [&](double along, Vector& gradient) {
    for (std::size_t i = 0; i < x.size(); ++i) there[i] = x[i] + along * direction[i];
    return std::isfinite(evaluate(there, gradient));
  };
  for (int halvings = 0; !look(step, forward) || !look(-step, backward); step *= 0.5) {
    if (++halvings == kMaxHalvings) return 0.0;
  }
  for (std::size_t i = 0; i < x.size(); ++i) there[i] = (forward[i] - backward[i]) / (2.0 * step);
  precondition(there, 0.5, direction);
  // Only the part's own variables: the others have scales of their own.
  const Vector own = signs(part);
  double squares = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (own[i] != 0.0) squares += direction[i] * direction[i];
  }
  return std::sqrt(squares / count);
}

/// Scales every part to a preconditioned curvature of one along random directions.
void TwoFaceStage::calibrate(const Vector& x) {
  for (const Part part : {Part::kHeights, Part::kFront, Part::kShifts}) scale(part) = 1.0;
  double heights = 0.0;
  for (const Part part : {Part::kHeights, Part::kFront, Part::kShifts}) {
    const double bend = curvature(x, part);
    if (part == Part::kHeights) heights = bend;
    scale(part) = bend > kLeastBend * heights ? 1.0 / bend : 0.0;
  }
}

LbfgsSummary TwoFaceStage::run(const LbfgsOptions& options, const GuidedStage::Observer& observe,
                               LensFaces& faces) {
  Vector x = variables_of(faces);
  calibrate(x);
  const RawObjective function = [&](std::span<const double> at, std::span<double> gradient) {
    return evaluate(at, gradient);
  };
  const RawPreconditioner preconditioner = [&](std::span<const double> g, std::span<double> r) {
    precondition(g, 1.0, r);
  };
  LbfgsOn<Executor> minimizer(function, preconditioner, options, executor_);
  try {
    LbfgsSummary summary =
        minimizer.run([&](int iteration, double) { return observe(iteration, last_); }, x);
    set_faces(x, faces);
    return summary;
  } catch (...) {
    set_faces(x, faces);
    throw;
  }
}

std::vector<double> TwoFaceStage::errors(const LensFaces& faces) {
  if (!objective_.evaluate(faces, gradient_).feasible) return {};
  return objective_.errors();
}

/// Longer side of the coarsest pictures, about.
constexpr double kCoarsestSide = 16.0;

/// Steps of the coarsest pictures' contrast.
constexpr int kContrastSteps = 6;

/// How the faces of a stage are shaped.
struct Shaping {
  double cells;    ///< Knot cells of the exit face and samples of the front, per pixel side.
  int samples;     ///< Rays per knot cell each way.
  int iterations;  ///< Of a round, about. Each measures its steps anew.
};

/// From plane faces; with two rays, a 16² picture's error rises by half when more are looked at.
/// They ask for many steps, and long rounds keep what L-BFGS has learnt: lake and portrait of 32²
/// end at 0.045 and 0.023, in rounds of 100 at 0.062 and 0.023.
constexpr Shaping kFromPlanes{1.0, 3, 400};
/// From transport, with as many rays per pixel: with one cell, the second picture starts more than
/// twice as far from its target. Rounds of 100 end as near as rounds of 400: relief and rings of
/// 32² at 0.0007 and 0.0067, for 0.0008 and 0.0070.
constexpr Shaping kFromTransport{1.5, 2, 100};

/// Rays of the transport per pixel side: with one and a half, both pictures start farther from
/// their targets.
constexpr int kRaysPerPixel = 2;

/// Iterations of all rounds of a stage, in DesignOptions::iterations: its pictures are small, and
/// it starts without transport.
constexpr int kStageIterations = 8;
constexpr int kLeastRounds = 2;
constexpr int kPairs = 20;

/// Room beyond the thickness for the relief of either face, as a share of it, and height up to
/// which the light behind the front must not fold.
constexpr double kRoom = 0.12;
constexpr double kUnfolded = 1.4;

/// FaceLimits::weight: light enters within a hundredth of a pixel of the lens's edges.
constexpr double kLimitWeight = 100.0;

/// Steps in which faces that a finer stage's barriers refuse are flattened.
constexpr int kFlatteningSteps = 50;

/// Coefficients of a spline with `from` knot cells as those of one with `to`, exact if the knots
/// are nested.
Eigen::MatrixXd refinement(int from, int to) {
  std::vector<double> fine;
  std::vector<double> coarse;
  for (int i = 0; i < to + kSplineDegree; ++i) {
    fine.push_back(greville_point(i, to));
    coarse.push_back(fine.back() * from / to);
  }
  const Eigen::MatrixXd values(basis_matrix(fine, to, false));
  return values.partialPivLu().solve(Eigen::MatrixXd(basis_matrix(coarse, from, false)));
}

/// Values of a front of `from` samples at `to` samples.
Eigen::MatrixXd resampling(int from, int to) {
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(to, from + 2 * HeightSpline::kBeyond);
  for (int k = 0; k < to; ++k) {
    const SplineWeights weights((from - 1.0) * k / (to - 1.0), from);
    for (int i = 0; i < 4; ++i) values(k, weights.first + i) += weights.value[i];
  }
  return values * HeightSpline::coefficient_matrix(from);
}

/// One picture size and contrast.
struct Stage {
  Eigen::Vector2i pixels;
  double contrast;  ///< Share of the targets; the rest is the plane lens's light.
  Shaping shaping = kFromPlanes;
};

std::vector<Stage> plan_stages(const Eigen::Vector2i& pixels) {
  const int halvings =
      std::max(0, static_cast<int>(std::lround(std::log2(pixels.maxCoeff() / kCoarsestSide))));
  const auto at = [&](int l) -> Eigen::Vector2i {
    const double scale = std::ldexp(1.0, l - halvings);
    return (scale * pixels.cast<double>()).array().round().max(kMinPixels).cast<int>();
  };
  std::vector<Stage> stages;
  for (int k = 1; k < kContrastSteps; ++k) {
    stages.push_back({at(0), static_cast<double>(k) / kContrastSteps});
  }
  for (int l = 0; l <= halvings; ++l) stages.push_back({at(l), 1.0});
  return stages;
}

/// The faces and their shapes.
struct Shaped {
  LensFaces faces;
  GridShape net;
  GridShape front;
};

class TwoFaceDesign {
 public:
  TwoFaceDesign(const DesignTask& task, const Image& second)
      : task_(task), second_(second), state_(state_at_start()), log_(task, state_) {}

  TwoFaceResult run() {
    TwoFaceResult result;
    try {
      if (state_.transporting) begin();
      stages_ = stages();
      if (task_.options.resume) require_faces();
      while (state_.level < static_cast<int>(stages_.size())) run_stage();
      result.done = true;
    } catch (const Interrupted&) {
    }
    result.net = here_.net;
    result.faces = rested(std::move(here_));
    result.fingerprint = state_.fingerprint;
    result.convergence = std::move(state_.convergence);
    return result;
  }

 private:
  /// The state in the checkpoint, or that before transport.
  [[nodiscard]] Checkpoint state_at_start() {
    if (!task_.options.resume) {
      Checkpoint state;
      state.fingerprint = design_fingerprint(task_.target, task_.options);
      return state;
    }
    Checkpoint state = saved_state(task_);
    if (state.front.size() == 0) refuse_checkpoint(task_.options.checkpoint, "holds no front");
    const GridShape net = state.mesh.grid;
    here_ = {{std::move(state.mesh.vertices), std::move(state.front)}, net, front_shape(net)};
    return state;
  }

  /// @throw InputError if no stage can have left a checkpoint's faces: its bytes were changed.
  void require_faces() const {
    std::optional<std::string> fault = spline_fault({here_.net, here_.faces.exit}, task_.setup);
    const bool within = state_.level < static_cast<int>(stages_.size()) && state_.round > 0;
    if (!fault && within && descent_for(stage()).errors(here_.faces).empty()) {
      fault = "the barriers refuse its faces";
    }
    if (fault) {
      refuse_checkpoint(task_.options.checkpoint, "holds faces of no lens: " + *fault);
    }
  }

  void save() {
    state_.mesh = {here_.faces.exit, {}, here_.net};
    state_.front = here_.faces.front;
    save_state(task_, log_, state_);
  }

  [[nodiscard]] Stage whole() const { return {task_.setup.pixels, 1.0, kFromTransport}; }
  [[nodiscard]] std::vector<Stage> stages() const {
    return state_.from_planes ? plan_stages(task_.setup.pixels) : std::vector<Stage>{whole()};
  }
  /// @pre the design is not done.
  [[nodiscard]] const Stage& stage() const {
    return stages_[static_cast<std::size_t>(state_.level)];
  }

  /// Makes the faces of the first stage.
  void begin() {
    stages_ = {whole()};
    refine(whole());
    if (!task_.options.resume) save();
    if (!begin_with_transport()) {
      state_.from_planes = true;
      here_ = {};
      refine(plan_stages(task_.setup.pixels).front());
    }
    state_.transporting = false;
    save();
  }

  /// Takes the faces that transport finds for the whole pictures; false if it does not converge or
  /// barriers refuse them. @pre the faces have the stage's shapes.
  bool begin_with_transport() {
    const Stage stage = whole();
    task_.control.report({"design, transport of both pictures", 0.0, work(1), ""});
    const std::vector<ScreenGoal> goals = goals_of(stage);
    const double room = kRoom * task_.options.thickness;
    const RunControl silent(task_.control.stop_token(), {});
    const RayBundle bundle =
        two_plane_map({goals[0].setup, goals[0].target}, {goals[1].setup, goals[1].target},
                      {kRaysPerPixel * stage.pixels.x(), kRaysPerPixel * stage.pixels.y()},
                      task_.options.thickness + room, task_.executor, silent);
    if (!bundle.converged) return false;
    here_.faces = faces_along(bundle, goals[0].setup,
                              {here_.net, here_.front, task_.options.thickness, room}, silent);
    return !descent_for(stage).errors(here_.faces).empty();
  }

  /// The optimisation of faces of the present shapes.
  [[nodiscard]] TwoFaceStage descent_for(const Stage& stage) const {
    const std::vector<ScreenGoal> goals = goals_of(stage);
    ObjectiveOptions options;
    options.weights = task_.options.weights;
    options.model = SurfaceModel::kSpline;
    options.samples = stage.shaping.samples;
    options.weights.smooth = 0.0;
    const double cells = (here_.net.columns - 3.0) * (here_.net.rows - 3.0);
    options.area = default_area_barrier(
        goals.front().setup,
        static_cast<std::int64_t>(2.0 * options.samples * options.samples * cells));
    const double thickness = task_.options.thickness;
    return {here_.net,
            here_.front,
            goals,
            options,
            {thickness, kLimitWeight, kUnfolded * thickness},
            task_.executor};
  }

  void run_stage() {
    refine(stage());
    while (state_.round < rounds()) {
      run_round();
      if (++state_.round < rounds()) save();
    }
    state_.round = 0;
    ++state_.level;
    save();
  }

  /// Of the faces alone, so that a resumed round is the same to the bit: an objective that was used
  /// before looks for rays from where it found the last ones.
  void run_round() {
    TwoFaceStage descent = descent_for(stage());
    if (state_.round == 0) flatten_if_refused(descent);
    LbfgsOptions optimizer;
    optimizer.max_iterations = round_iterations();
    optimizer.history = kPairs;
    const LbfgsSummary summary = descent.run(
        optimizer, [&](int iteration, const ObjectiveEvaluation& e) { return note(iteration, e); },
        here_.faces);
    if (summary.status == LbfgsSummary::Status::kStopped) throw Interrupted();
  }

  [[nodiscard]] int rounds() const {
    return std::max(kLeastRounds, stage_iterations() / stage().shaping.iterations);
  }
  [[nodiscard]] int round_iterations() const { return stage_iterations() / rounds(); }
  [[nodiscard]] int stage_iterations() const { return kStageIterations * task_.options.iterations; }

  /// Takes the faces to the shapes of a stage; at first they are planes.
  void refine(const Stage& stage) {
    const Eigen::Vector2d cells =
        (stage.shaping.cells * stage.pixels.cast<double>()).array().round();
    const auto columns = static_cast<int>(cells.x());
    const auto rows = static_cast<int>(cells.y());
    const GridShape net{columns + kSplineDegree, rows + kSplineDegree};
    const GridShape front = front_shape(net);
    if (here_.net == net) return;
    LensFaces finer;
    if (!here_.net.is_grid()) {
      finer = plane_faces(net, front);
    } else {
      const Eigen::MatrixXd u = refinement(here_.net.columns - 3, columns);
      const Eigen::MatrixXd v = refinement(here_.net.rows - 3, rows);
      finer.exit.resize(3, Eigen::Index{net.columns} * net.rows);
      for (int k = 0; k < 3; ++k) {
        const Eigen::MatrixXd table =
            here_.faces.exit.row(k).reshaped(here_.net.columns, here_.net.rows);
        finer.exit.row(k) = (u * table * v.transpose()).reshaped().transpose();
      }
      finer.front = resampling(here_.front.columns, front.columns) * here_.faces.front *
                    resampling(here_.front.rows, front.rows).transpose();
    }
    here_ = {std::move(finer), net, front};
    hold_rim();
  }

  [[nodiscard]] LensFaces plane_faces(const GridShape& net, const GridShape& front) const {
    const Eigen::Vector2d& size = task_.setup.lens_size;
    const double room = kRoom * task_.options.thickness;
    LensFaces planes{Eigen::Matrix3Xd(3, Eigen::Index{net.columns} * net.rows),
                     Eigen::MatrixXd::Constant(front.columns, front.rows, -room)};
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        planes.exit.col(Eigen::Index{j} * net.columns + i)
            << size.x() * greville_point(i, net.columns - 3) / (net.columns - 3),
            size.y() * greville_point(j, net.rows - 3) / (net.rows - 3),
            task_.options.thickness + room;
      }
    }
    return planes;
  }

  /// Puts the exit face's rim exactly on the lens's rectangle.
  void hold_rim() {
    const LensFaces planes = plane_faces(here_.net, here_.front);
    for (int k = 0; k < 2; ++k) {
      const double far = task_.setup.lens_size[k];
      for (Eigen::Index i = 0; i < planes.exit.cols(); ++i) {
        const double even = planes.exit(k, i);
        if (even == 0.0 || even == far) here_.faces.exit(k, i) = even;
      }
    }
  }

  [[nodiscard]] std::vector<ScreenGoal> goals_of(const Stage& stage) const {
    std::vector<ScreenGoal> goals{{task_.setup, task_.target},
                                  {on_second_screen(task_.setup), second_}};
    for (ScreenGoal& goal : goals) {
      goal.setup.second.reset();
      goal.setup.pixels = stage.pixels;
      goal.target = resample(goal.target, stage.pixels.x(), stage.pixels.y());
      if (stage.contrast < 1.0) mix_with_plane(stage.contrast, goal);
    }
    return goals;
  }

  /// Mixes a target with the light of a lens of plane faces.
  void mix_with_plane(double contrast, ScreenGoal& goal) const {
    const SurfaceMesh plane =
        make_grid_mesh(goal.setup.lens_size, {goal.setup.pixels.x() + 1, goal.setup.pixels.y() + 1},
                       (1.0 + kRoom) * task_.options.thickness);
    const std::vector<double> light =
        flux_of_surface(plane, goal.setup, SurfaceModel::kSmooth, task_.executor);
    const double total = goal.target.total();
    for (std::size_t i = 0; i < light.size(); ++i) {
      float& value = goal.target.values()[i];
      value = static_cast<float>(contrast * static_cast<double>(value) +
                                 (1.0 - contrast) * total * light[i]);
    }
  }

  /// Moves faces that a stage refuses towards planes.
  void flatten_if_refused(TwoFaceStage& descent) {
    const LensFaces planes = plane_faces(here_.net, here_.front);
    const LensFaces refused = here_.faces;
    for (int step = 0; step <= kFlatteningSteps; ++step) {
      const double share = static_cast<double>(step) / kFlatteningSteps;
      here_.faces.exit = (1.0 - share) * refused.exit + share * planes.exit;
      here_.faces.front = (1.0 - share) * refused.front + share * planes.front;
      if (!descent.errors(here_.faces).empty()) return;
    }
    throw InputError(
        "--second: the light of a lens with plane faces misses a screen; "
        "--second-tilt 0,0 works");
  }

  /// Records an iteration; false if the design is to stop.
  bool note(int iteration, const ObjectiveEvaluation& e) {
    ConvergenceRow row = log_.new_row("spline", iteration);
    row.energy = e.energy;
    row.mae = e.mae;
    state_.convergence.push_back(row);
    char detail[64];
    std::snprintf(detail, sizeof(detail), "MAE %.4f", e.mae);
    const auto index = static_cast<std::size_t>(state_.level);
    const double share = (state_.round + double{1} * iteration / round_iterations()) / rounds();
    task_.control.report(
        {"design, stage " + std::to_string(index + 1) + " of " + std::to_string(stages_.size()),
         work(index) + share * (work(index + 1) - work(index)), work(stages_.size()), detail});
    return !task_.control.stop_requested();
  }

  /// Pixels of all stages before this one.
  [[nodiscard]] double work(std::size_t stage) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < stage; ++k) sum += stages_[k].pixels.cast<double>().prod();
    return sum;
  }

  /// The faces within their limits, which the descent's penalties keep to a few micrometres.
  [[nodiscard]] LensFaces rested(Shaped shaped) const {
    LensFaces faces = std::move(shaped.faces);
    const ControlNet net{shaped.net, faces.exit};
    const double lowest = spline_nodes(net, kMeshSamples).mesh.vertices.row(2).minCoeff();
    faces.exit = settled(net, std::max(lowest, task_.options.thickness)).points;
    const double high = std::max(0.0, faces.front.maxCoeff());
    faces.front.array() -= high;
    return faces;
  }

  const DesignTask& task_;
  const Image& second_;
  Shaped here_;
  Checkpoint state_;  ///< Its faces are those after the last round.
  DesignLog log_;
  std::vector<Stage> stages_;
};

}  // namespace

TwoFaceResult shape_two_faces(const DesignTask& task, const Image& second) {
  return TwoFaceDesign(task, second).run();
}

}  // namespace lensforge

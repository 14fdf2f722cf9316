// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/design_lens.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/text/number_text.h"
#include "design/checkpoint.h"
#include "design/crease_alignment.h"
#include "design/face_transport.h"
#include "design/grid_mesh.h"
#include "design/guided_optimization.h"
#include "design/level_plan.h"
#include "design/reach.h"
#include "design/render_lens.h"
#include "design/transport/vertex_spread.h"

namespace lensforge {

namespace {

/// A round that lowers the objective by less than this share has brought nothing: if it began with
/// transport, the level's further rounds do without; if its steps were scaled for an earlier
/// surface, the next one measures them anew; if neither, the level ends.
constexpr double kIdleRound = 1e-3;

/// Mass error that ends a transport, and the Newton steps after which it goes as far as it came:
/// what is left is below the error of taking a face's light for a point.
constexpr double kTransportTolerance = 1e-2;
constexpr int kMostNewtonSteps = 150;

/// On a mesh that has been spread: Newton steps under one blur and floor after which its own
/// transport ends, the share of the light that may be in the wrong place then (cells that hold
/// next to no light hold up all others), and the share of black pixels above which it is not tried
/// (logo, 69 % black, spread over dark and bright: 43 and 59 steps in two stages, and no end).
constexpr int kMostStageSteps = 25;
constexpr double kMostMisplaced = 0.05;
constexpr double kMostBlack = 0.3;

/// Faces of the even mesh whose transport shapes the mesh: a finer one is not worth it. On the
/// 512² logo, 942,080 sites were not done after 11 processor minutes, 235,520 in 80 s at most.
constexpr double kMostEvenFaces = 250000.0;

/// Steps in which a mesh that a new level's barriers refuse is drawn back to the even grid.
constexpr int kRelaxSteps = 10;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

OpticalSetup make_setup(const DesignOptions& options, const Eigen::Vector2i& pixels) {
  OpticalSetup setup;
  setup.ior = options.ior;
  setup.focal_length = options.focal_length;
  setup.lens_size = {options.width, options.width * pixels.y() / pixels.x()};
  setup.image_size = setup.lens_size;
  setup.pixels = pixels;
  setup.view = options.view;
  return setup;
}

/// Lowers or lifts the surface so that its thinnest place is `thickness` above the entry face.
void rest_on_thickness(SurfaceMesh& mesh, double thickness) {
  mesh.vertices.row(2).array() += thickness - mesh.vertices.row(2).minCoeff();
}

Image working_picture(const Image& target, const DesignOptions& options, const RunControl& run) {
  const Eigen::Vector2i pixels = working_size(target.columns(), target.rows(), options.pixels);
  return resample(target, pixels.x(), pixels.y(), run);
}

/// Share of the pixels that are black (kBlack).
double black_share(const Image& picture) {
  const auto pixels = static_cast<double>(picture.values().size());
  const double black = kBlack * picture.total() / pixels;
  const auto dark = [&](float value) { return static_cast<double>(value) <= black; };
  return static_cast<double>(
             std::count_if(picture.values().begin(), picture.values().end(), dark)) /
         pixels;
}

/// The coarse-to-fine schedule of one design, level by level and round by round.
class Schedule {
 public:
  Schedule(const Image& target, const DesignOptions& options, const Executor& executor,
           const RunControl& control)
      : options_(options), executor_(executor), control_(control) {
    // Nothing is reported before all input has been accepted.
    target_ = working_picture(target, options, {control.stop_token(), {}});
    const Eigen::Vector2i pixels(target_.columns(), target_.rows());
    setup_ = make_setup(options, pixels);
    levels_ = plan_levels(pixels, options);
    state_.fingerprint = design_fingerprint(target_, options);
    state_.mesh = make_grid_mesh(setup_.lens_size, levels_.front().grid, options.thickness);
    if (options.resume) resume();
    spent_before_ = state_.seconds;
  }

  DesignResult run() {
    if (!options_.resume) save();
    try {
      run_levels();
    } catch (const InputError&) {
      // Resumed, it could only fail again, and it would be in the way of better options.
      std::error_code ignored;
      if (!options_.resume) std::filesystem::remove(options_.checkpoint, ignored);
      throw;
    }
    return finish();
  }

 private:
  void run_levels() {
    while (state_.level < static_cast<int>(levels_.size()) && !ended()) run_level_unless_stopped();
  }

  void resume() {
    Checkpoint saved = read_checkpoint(options_.checkpoint);
    if (saved.fingerprint != state_.fingerprint) {
      throw InputError("checkpoint '" + options_.checkpoint.string() +
                       "' belongs to another picture or other options");
    }
    state_ = std::move(saved);
  }

  /// True once the schedule is not to go on: asked to stop, or a start that no step can leave.
  [[nodiscard]] bool ended() const { return stopped_ || !failure_.empty(); }

  [[nodiscard]] double seconds() const { return spent_before_ + seconds_since(start_); }

  void run_level_unless_stopped() {
    try {
      run_level();
    } catch (const Interrupted&) {
      stopped_ = true;
    }
  }

  /// What is to be solved at one resolution.
  struct Problem {
    OpticalSetup setup;
    Image target;
    ObjectiveOptions objective;
  };

  [[nodiscard]] Problem make_problem(const Level& level) const {
    Problem problem;
    problem.setup = setup_;
    problem.setup.pixels = level.pixels;
    problem.target = resample(target_, level.pixels.x(), level.pixels.y());
    problem.objective.weights = options_.weights;
    problem.objective.model = options_.model;
    problem.objective.nu = level.nu;
    problem.objective.area = default_area_barrier(problem.setup, state_.mesh.triangle_count());
    return problem;
  }

  void run_level() {
    const Level& level = levels_[static_cast<std::size_t>(state_.level)];
    if (state_.mesh.grid != level.grid) {
      state_.mesh = regrid(state_.mesh, setup_.lens_size, level.grid);
    }
    const Problem problem = make_problem(level);
    GuidedOptimization stage(state_.mesh, problem.setup, problem.target, problem.objective,
                             stoppable_);
    while (state_.round < options_.rounds && !ended()) run_round(problem, stage);
    if (ended()) return;
    state_.round = 0;
    state_.value = kInfinity;
    state_.transporting = true;
    state_.scales = {};
    ++state_.level;
    save();
  }

  /// One alternation of Sun et al., section 3.4.
  void run_round(const Problem& problem, GuidedOptimization& stage) {
    const SurfaceMesh before = state_.mesh;
    const bool transports = state_.transporting && state_.round < options_.transport_rounds;
    const std::optional<Correspondence> wanted = transports ? transport(problem) : std::nullopt;
    const bool first = wanted && state_.level == 0 && state_.round == 0;
    const SurfaceMesh aimed = first ? state_.mesh : SurfaceMesh();
    relax(stage);
    if (first && !std::isfinite(stage.value(state_.mesh))) {
      refuse_unreachable(problem, *wanted, aimed);
    }
    const bool rescaled = !state_.scales.known();
    if (options_.rendering_guided) follow_picture(stage);
    if (ended()) return;
    const double value = stage.value(state_.mesh);
    const bool idle = value >= (1.0 - kIdleRound) * state_.value;
    if (value <= state_.value) {
      state_.value = value;
    } else {
      state_.mesh = before;
    }
    if (idle) {
      state_.transporting = false;
      state_.scales = {};
    }
    const bool exhausted = idle && rescaled && !transports;
    state_.round = exhausted ? options_.rounds : state_.round + 1;
    if (state_.round < options_.rounds) save();
  }

  /// The correspondence-guided half of a round: where the light is to land. The mesh stays as it is
  /// where transport finds nothing. Works on a copy: a mesh that an interruption left between two
  /// steps would be of no use.
  std::optional<Correspondence> transport(const Problem& problem) {
    SurfaceMesh mesh = state_.mesh;
    TransportOptions options;
    options.tolerance = kTransportTolerance;
    options.max_newton_steps = kMostNewtonSteps;
    const bool begins = state_.level == 0 && state_.round == 0 && options_.spread > 0.0;
    const SurfaceMesh even = begins ? coarse_mesh(mesh.grid) : mesh;
    Matching matching = match(problem, even, options);
    if (matching.result.centroids.cols() == 0) {
      state_.transporting = false;
      return std::nullopt;
    }
    if (!matching.result.converged()) {
      remark_ = "; transport of round " + std::to_string(state_.round + 1) + " ended early (" +
                matching.result.message + ")";
    }
    if (begins) matching = fit_mesh(problem, even, matching, mesh);
    Correspondence wanted{std::move(matching.result.centroids), std::move(matching.light.flux)};
    aim_surface(wanted, problem.setup, options_.thickness, stoppable_, mesh);
    if (options_.update_iterations > 0) follow_correspondence(problem, wanted, mesh);
    state_.mesh = std::move(mesh);
    return wanted;
  }

  /// @param aimed  the first surface, before its mesh was relaxed.
  [[noreturn]] void refuse_unreachable(const Problem& problem, const Correspondence& wanted,
                                       const SurfaceMesh& aimed) const {
    report("looking for a focal length that would do", 0);
    const std::optional<double> focal_length = reachable_focal_length(
        {aimed, wanted, problem.setup, problem.target, problem.objective, options_.thickness},
        stoppable_);
    const std::string advice =
        focal_length ? "--focal " + number_text(*focal_length) + "mm would do"
                     : "no focal length up to " + number_text(kMaxFocalLength) + " mm would do";
    throw InputError("--focal " + number_text(options_.focal_length) +
                     ": no lens of this width and index bends the light so far in so short a "
                     "distance; " +
                     advice);
  }

  /// An even mesh of the same proportions, fine enough for the transport that shapes the mesh.
  [[nodiscard]] SurfaceMesh coarse_mesh(GridShape shape) const {
    const auto faces = [&] { return 2.0 * (shape.columns - 1) * (shape.rows - 1); };
    while (faces() > kMostEvenFaces) {
      shape = {(shape.columns - 1) / 2 + 1, (shape.rows - 1) / 2 + 1};
    }
    return make_grid_mesh(setup_.lens_size, shape, options_.thickness);
  }

  /// A mesh's light and its transport to the picture.
  struct Matching {
    FaceLight light;
    TransportResult result;
  };

  [[nodiscard]] Matching match(const Problem& problem, const SurfaceMesh& mesh,
                               const TransportOptions& options) {
    const auto pass_on = [this](const Progress& p) { report(p.detail, 0); };
    Matching matching;
    matching.light = face_light(mesh, problem.setup, options_.model, stoppable_);
    matching.result = transport_faces(matching.light, problem.target, options, stoppable_,
                                      RunControl(control_.stop_token(), pass_on));
    if (matching.result.status == TransportResult::Status::kStopped) throw Interrupted();
    int number = 0;
    for (const TransportStep& step : matching.result.steps) {
      ConvergenceRow row;
      row.stage = "transport";
      row.level = state_.level;
      row.round = state_.round;
      row.iteration = ++number;
      row.mass_error = step.mass_error;
      row.seconds = seconds();
      state_.convergence.push_back(row);
    }
    return matching;
  }

  /// Spreads the mesh, aligns it to the creases of an even mesh's transport, and finds its own
  /// transport. Solved anew, that brings out detail in the dark that the even mesh has no facets
  /// for; where black leaves cells too thin for Newton steps, the even mesh's map has to do.
  [[nodiscard]] Matching fit_mesh(const Problem& problem, const SurfaceMesh& even_mesh,
                                  const Matching& even, SurfaceMesh& mesh) {
    // Facets are needed where there is light. A smooth surface also needs narrow triangles at its
    // creases, which send their light into the black between; there it is that cells own the black.
    const bool facet = options_.model == SurfaceModel::kFacet;
    const Eigen::VectorXd areas =
        facet ? favour_dark({even_mesh, even.result.lit_areas}) : even.result.areas;
    const ServedAreas served{even_mesh, areas};
    if (!spread_vertices(served, options_.spread, problem.setup, stoppable_,
                         RunControl(control_.stop_token(), {}), mesh)) {
      throw Interrupted();
    }
    const BrenierMap map(even.light.landing, even.result, problem.target);
    align_to_creases(map, problem.setup, mesh);
    if (black_share(problem.target) <= kMostBlack) {
      TransportOptions options;
      options.tolerance = kTransportTolerance;
      options.max_stage_steps = kMostStageSteps;
      Matching fine = match(problem, mesh, options);
      if (fine.result.misplaced <= kMostMisplaced) return fine;
    }
    Matching mapped;
    mapped.light = face_light(mesh, problem.setup, options_.model, stoppable_);
    mapped.result.centroids = map_faces(mapped.light, map, stoppable_);
    return mapped;
  }

  void follow_correspondence(const Problem& problem, const Correspondence& wanted,
                             SurfaceMesh& mesh) {
    GuidedOptimization update(mesh, problem.setup, wanted, problem.objective, stoppable_);
    if (!std::isfinite(update.value(mesh))) return;
    LbfgsOptions optimizer;
    optimizer.max_iterations = options_.update_iterations;
    const LbfgsSummary summary = update.run(optimizer, observer("update"), mesh);
    if (summary.status == LbfgsSummary::Status::kStopped) throw Interrupted();
  }

  /// Draws the mesh's x and y back towards the even grid until no barrier refuses it.
  void relax(GuidedOptimization& stage) {
    const SurfaceMesh flat = make_grid_mesh(setup_.lens_size, state_.mesh.grid, 0.0);
    const SurfaceMesh fine = state_.mesh;
    for (int step = 1; !std::isfinite(stage.value(state_.mesh)) && step <= kRelaxSteps; ++step) {
      const double share = static_cast<double>(step) / kRelaxSteps;
      state_.mesh.vertices.topRows<2>() =
          (1.0 - share) * fine.vertices.topRows<2>() + share * flat.vertices.topRows<2>();
    }
  }

  /// The rendering-guided half of a round.
  void follow_picture(GuidedOptimization& stage) {
    LbfgsOptions optimizer;
    optimizer.max_iterations = options_.iterations;
    const LbfgsSummary summary =
        stage.run(optimizer, observer("render"), state_.scales, state_.mesh);
    stopped_ = summary.status == LbfgsSummary::Status::kStopped;
    if (summary.status == LbfgsSummary::Status::kInfeasibleStart) failure_ = summary.message;
  }

  GuidedOptimization::Observer observer(const char* stage) {
    return [this, stage](int iteration, const DesignObjective::Evaluation& e) {
      ConvergenceRow row;
      row.stage = stage;
      row.level = state_.level;
      row.round = state_.round;
      row.iteration = iteration;
      row.energy = e.energy;
      row.mae = e.mae;
      row.seconds = seconds();
      state_.convergence.push_back(row);
      char detail[64];
      std::snprintf(detail, sizeof(detail), "MAE %.4f", e.mae);
      report(detail, iteration);
      return !control_.stop_requested();
    };
  }

  void report(const std::string& detail, int iteration) const {
    const std::string stage = "design, level " + std::to_string(state_.level + 1) + " of " +
                              std::to_string(levels_.size());
    control_.report({stage, work_done(iteration), work_total(), detail});
  }

  /// Iterations weighted by their picture's size.
  [[nodiscard]] double level_work(std::size_t level) const {
    return static_cast<double>(options_.rounds) * options_.iterations *
           levels_[level].pixels.cast<double>().prod();
  }
  [[nodiscard]] double work_total() const {
    double sum = 0.0;
    for (std::size_t l = 0; l < levels_.size(); ++l) sum += level_work(l);
    return sum;
  }
  [[nodiscard]] double work_done(int iteration) const {
    const auto level = static_cast<std::size_t>(state_.level);
    double sum = 0.0;
    for (std::size_t l = 0; l < level; ++l) sum += level_work(l);
    const double rounds = state_.round + static_cast<double>(iteration) / options_.iterations;
    return sum + level_work(level) * rounds / options_.rounds;
  }

  void save() {
    state_.seconds = seconds();
    if (!options_.checkpoint.empty()) write_checkpoint(state_, options_.checkpoint);
  }

  DesignResult finish() {
    DesignResult result;
    using Status = DesignResult::Status;
    result.status = stopped_ ? Status::kInterrupted : Status::kDone;
    result.message = stopped_ ? "interrupted" : "all levels done" + remark_;
    if (!failure_.empty()) {
      result.status = Status::kFailed;
      result.message = failure_;
    }
    rest_on_thickness(state_.mesh, options_.thickness);
    Lens& lens = result.lens;
    lens.surface = std::move(state_.mesh);
    lens.setup = setup_;
    lens.model = options_.model;
    lens.target = target_;
    const bool facet = options_.model == SurfaceModel::kFacet;
    lens.facet_metrics = evaluate(lens.surface, setup_, SurfaceModel::kFacet, target_,
                                  facet ? &lens.render : nullptr, executor_);
    lens.smooth_metrics = evaluate(lens.surface, setup_, SurfaceModel::kSmooth, target_,
                                   facet ? nullptr : &lens.render, executor_);
    result.fingerprint = state_.fingerprint;
    result.convergence = std::move(state_.convergence);
    // Rounds that ended early have left a rest.
    if (result.status == Status::kDone) {
      control_.report({"design", work_total(), work_total(), "done"});
    }
    return result;
  }

  const DesignOptions& options_;
  const Executor& executor_;
  const RunControl& control_;
  Executor stoppable_ = executor_.with_stop(control_.stop_token());
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double spent_before_ = 0.0;
  Image target_;
  OpticalSetup setup_;
  std::vector<Level> levels_;
  Checkpoint state_;
  bool stopped_ = false;
  std::string failure_;
  std::string remark_;  ///< What the user should know of a design that got done.
};

}  // namespace

DesignResult design_lens(const Image& target, const DesignOptions& options,
                         const Executor& executor, const RunControl& control) {
  validate(options, target);
  const DesignOptions settled = with_smoothness_applied(options);
  return Schedule(target, settled, executor, control).run();
}

std::uint64_t design_identity(const Image& target, const DesignOptions& options) {
  return design_fingerprint(working_picture(target, options, {}), options);
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

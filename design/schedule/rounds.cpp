// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/rounds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/spline/control_net.h"
#include "core/text/number_text.h"
#include "design/render.h"
#include "design/render/render_flux.h"
#include "design/render/source_picture.h"
#include "design/schedule/face_transport.h"
#include "design/schedule/guided_optimization.h"
#include "design/schedule/levels.h"
#include "design/transport/mesh_fit.h"

namespace lensforge {
namespace {

/// A mesh whose heights send its light as near as they can to where transport wants it.
struct AimedMesh {
  SurfaceMesh mesh;
  Correspondence wanted;
};

/// Changes to a mesh's x and y before transport assigns places to its light.
enum class MeshShaping {
  kNone,     ///< None; the light starts where the surface sends it.
  kCreases,  ///< For a mesh that follows the picture: align_to_creases(); heights start flat.
  kSpread    ///< For an even mesh: spread_vertices(), then as kCreases.
};

/// Mass error that ends a transport, and maximum number of its Newton steps: the remaining error is
/// below the error of taking a face's light for a point.
constexpr double kTransportTolerance = 1e-2;
constexpr int kMaxNewtonSteps = 150;

/// For the transport of a spread mesh: maximum number of Newton steps under one blur and floor;
/// maximum share of light in the wrong place (cells that hold almost no light hold up all others);
/// share of black pixels above which it is not tried, because there it does not converge (logo, 69
/// % black).
constexpr int kMaxStageSteps = 25;
constexpr double kMaxMisplaced = 0.05;
constexpr double kMaxBlack = 0.3;

/// Share of black pixels (kBlack).
double black_share(const Image& picture) {
  const auto pixels = static_cast<double>(picture.values().size());
  const double black = kBlack * picture.total() / pixels;
  const auto dark = [&](float value) { return static_cast<double>(value) <= black; };
  return static_cast<double>(
             std::count_if(picture.values().begin(), picture.values().end(), dark)) /
         pixels;
}

/// An even mesh of the same proportions, fine enough for the transport that shapes the mesh.
SurfaceMesh coarse_mesh(const DesignTask& task, const LevelProblem& problem, GridShape shape) {
  const auto faces = [&] { return 2.0 * (shape.columns - 1) * (shape.rows - 1); };
  const bool dark =
      task.options.model != SurfaceModel::kFacet && black_share(problem.aim) > kMaxBlack;
  while (faces() > (dark ? kMaxDarkFaces : kMaxEvenFaces)) {
    shape = {(shape.columns - 1) / 2 + 1, (shape.rows - 1) / 2 + 1};
  }
  return start_surface(task.setup, shape, task.options.thickness, task.executor);
}

/// A mesh's light and its transport to the picture.
struct Matching {
  FaceLight light;
  TransportResult result;
};

/// Input of a transport step.
struct StepSite {
  const DesignTask& task;
  const LevelProblem& problem;
  DesignLog& log;
};

Matching match(const StepSite& site, const SurfaceMesh& mesh, const TransportOptions& options) {
  const DesignTask& task = site.task;
  const auto pass_on = [&](const Progress& p) { site.log.report(p.detail, 0); };
  Matching matching;
  matching.light = face_light(mesh, site.problem.setup, task.options.model, task.executor);
  matching.result = transport_faces(matching.light, site.problem.aim, options, task.executor,
                                    RunControl(task.control.stop_token(), pass_on));
  if (matching.result.status == TransportResult::Status::kStopped) throw Interrupted();
  site.log.add(matching.result.steps);
  return matching;
}

Matching match_all(const StepSite& site, const SurfaceMesh& mesh) {
  TransportOptions options;
  options.tolerance = kTransportTolerance;
  options.max_newton_steps = kMaxNewtonSteps;
  return match(site, mesh, options);
}

/// Transport of a spread mesh; nothing if it cannot be found.
std::optional<Matching> match_spread(const StepSite& site, const SurfaceMesh& mesh) {
  if (black_share(site.problem.aim) > kMaxBlack) return std::nullopt;
  TransportOptions options;
  options.tolerance = kTransportTolerance;
  options.max_stage_steps = kMaxStageSteps;
  Matching matching = match(site, mesh, options);
  if (!(matching.result.misplaced <= kMaxMisplaced)) return std::nullopt;
  return matching;
}

/// Spreads the vertices. Facets are needed where there is light. A smooth surface also needs narrow
/// triangles at its creases, which send their light into the black between, so there cells own
/// black pixels too.
void spread(const StepSite& site, const SurfaceMesh& even_mesh, const Matching& even,
            SurfaceMesh& mesh) {
  const DesignTask& task = site.task;
  const bool facet = task.options.model == SurfaceModel::kFacet;
  const Eigen::VectorXd areas =
      facet ? favour_dark({even_mesh, even.result.lit_areas}, site.problem.setup)
            : even.result.areas;
  const ServedAreas served{even_mesh, areas};
  if (!spread_vertices(served, task.options.spread, site.problem.setup, task.executor,
                       site.log.step("spreading the mesh"), mesh)) {
    throw Interrupted();
  }
}

/// Shapes the mesh by an even mesh's transport and finds the places for the light of the flat
/// surface through it. Facets get a transport of their own, which brings out detail in the dark
/// that the even mesh has no facets for. A smooth surface uses the even mesh's map: more iterations
/// are worth more than the time of another transport. MAE in thousandths at 128² with a transport
/// of its own and without it in the same time: portrait 0.74 and 0.72, lake 1.81 and 1.61.
Matching fit_mesh(const StepSite& site, MeshShaping shaping, const SurfaceMesh& even_mesh,
                  const Matching& even, SurfaceMesh& mesh) {
  const DesignTask& task = site.task;
  if (shaping == MeshShaping::kSpread) {
    spread(site, even_mesh, even, mesh);
  } else {
    mesh.vertices.row(2).setConstant(task.options.thickness);
  }
  site.log.report_step("aligning the mesh with creases");
  const BrenierMap map(even.light.sites, even.result, site.problem.aim);
  align_to_creases(map, site.problem.setup, mesh);
  shape_start(task.setup, task.options.thickness, task.executor, mesh);
  if (task.options.model == SurfaceModel::kFacet) {
    if (std::optional<Matching> own = match_spread(site, mesh)) return *std::move(own);
  }
  Matching mapped;
  mapped.light = face_light(mesh, site.problem.setup, task.options.model, task.executor);
  mapped.result.centroids = map_faces(mapped.light, map, task.executor);
  return mapped;
}

/// The correspondence-guided update (Sun et al., Eq. 20).
void follow_correspondence(const StepSite& site, const Correspondence& wanted, SurfaceMesh& mesh) {
  const LevelProblem& problem = site.problem;
  GuidedOptimization update(mesh, problem.setup, wanted, problem.objective, site.task.executor);
  if (!std::isfinite(update.value(mesh))) return;
  LbfgsOptions optimizer;
  optimizer.max_iterations = site.task.options.update_iterations;
  const LbfgsSummary summary = update.run(optimizer, site.log.observer("update"), mesh);
  if (summary.status == LbfgsSummary::Status::kStopped) throw Interrupted();
}

/// The correspondence-guided half of a round (Sun et al., section 3.4).
/// @return nothing if transport finds no place for the light. @throw Interrupted
std::optional<AimedMesh> transport_step(const DesignTask& task, const LevelProblem& problem,
                                        const SurfaceMesh& mesh, MeshShaping shaping,
                                        DesignLog& log) {
  const StepSite site{task, problem, log};
  const bool shapes = shaping != MeshShaping::kNone;
  const SurfaceMesh even = shapes ? coarse_mesh(task, problem, mesh.grid) : mesh;
  Matching matching = match_all(site, even);
  if (matching.result.centroids.cols() == 0) return std::nullopt;
  if (!matching.result.converged()) log.ended_early("transport", matching.result.message);
  AimedMesh aimed{mesh, {}};
  if (shapes) matching = fit_mesh(site, shaping, even, matching, aimed.mesh);
  aimed.wanted = {std::move(matching.result.centroids), std::move(matching.light.flux)};
  aim_surface(aimed.wanted, problem.setup, task.options.thickness, task.executor, aimed.mesh,
              log.step("fitting heights"));
  if (task.options.update_iterations > 0) follow_correspondence(site, aimed.wanted, aimed.mesh);
  return aimed;
}

/// The same for a round by waves, which takes minutes; it lowers the objective by a third to two
/// thirds at first.
constexpr double kIdleWaves = 0.1;

/// Number of pairs that L-BFGS keeps. MAE in thousandths of the 128² logo as facets after 6 × 100
/// iterations: 0.222 with 8, 0.195 with 20; 40 are no better, 3 are worse.
constexpr int kHistory = 20;

/// Moves the first `coordinates` of x, y and z back towards the start surface until no barrier
/// refuses the mesh. @return false if one still does.
bool relax(const LevelSite& site, int coordinates, SurfaceMesh& mesh) {
  if (std::isfinite(site.stage.value(mesh))) return true;
  const DesignTask& task = site.task;
  const SurfaceMesh start =
      start_surface(task.setup, mesh.grid, task.options.thickness, task.executor);
  return draw_towards(start, coordinates, site.stage, mesh);
}

/// Refuses a setup whose first surface sends light too far. @param aimed  the surface before its
/// mesh was relaxed.
[[noreturn]] void refuse_unreachable(const LevelSite& site, const AimedMesh& aimed) {
  site.log.report("searching for a focal length that works", 0);
  const DesignOptions& options = site.task.options;
  const LevelProblem& problem = site.problem;
  const std::optional<double> focal_length =
      reachable_focal_length({aimed.mesh, aimed.wanted, problem.setup, problem.target,
                              problem.objective, options.thickness},
                             site.task.executor);
  const std::string advice =
      focal_length ? "--focal " + number_text(*focal_length) + "mm works"
                   : "no focal length up to " + number_text(kMaxFocalLength) + " mm works";
  throw InputError("--focal " + number_text(options.focal_length) +
                   ": no lens of this width and index bends the light so far in so short a "
                   "distance; " +
                   advice);
}

/// Refuses a setup whose start surface is not allowed. An untilted screen receives the light of any
/// source behind a flat front.
[[noreturn]] void refuse_start(const DesignTask& task) {
  const Eigen::Vector2d& tilt = task.options.light.screen_tilt;
  const bool front = task.setup.front.has_value();
  const std::string given =
      front ? "--front" : "--screen-tilt " + number_text(tilt.x()) + "," + number_text(tilt.y());
  throw InputError(
      given +
      ": light of the surface that designs start from is totally reflected or misses the "
      "screen; " +
      (front ? "--front flat" : "--screen-tilt 0,0") + " works");
}

/// Returns what transport does to the mesh's x and y. Later rounds keep what optimisation has made
/// of them.
MeshShaping shaping_of(const DesignOptions& options, const Checkpoint& state) {
  if (options.spread == 0.0 || state.round > 0) return MeshShaping::kNone;
  return state.level == 0 ? MeshShaping::kSpread : MeshShaping::kCreases;
}

/// The first half of a round: takes the mesh that transport aims, or keeps the mesh if transport
/// finds none that the barriers allow.
void start_from_transport(const LevelSite& site, Checkpoint& state) {
  const std::optional<AimedMesh> aimed = transport_step(
      site.task, site.problem, state.mesh, shaping_of(site.task.options, state), site.log);
  if (aimed) {
    SurfaceMesh mesh = aimed->mesh;
    if (relax(site, 2, mesh)) {
      state.mesh = std::move(mesh);
      return;
    }
    if (state.level == 0 && state.round == 0) refuse_unreachable(site, *aimed);
  }
  state.transporting = false;
  site.log.ended_early("transport", aimed ? "no surface sends the light as far as it asks for"
                                          : "it found no place for the light");
}

/// The log of a round's iterations, which ends them when the picture is good enough.
class Watch {
 public:
  explicit Watch(const LevelSite& site)
      : site_(site),
        log_(site.log.observer(site.level.waves    ? "waves"
                               : site.level.spline ? "spline"
                                                   : "render")) {}

  bool operator()(int iteration, const ObjectiveEvaluation& step) {
    reached_ = step.energy.total;
    errors_.push_back(step.mae);
    if (!log_(iteration, step)) return false;
    const bool good = step.mae <= site_.problem.enough;
    // An extended source is approximated, and the next round measures by how much.
    enough_ = good && (site_.problem.setup.extent.none() || iteration == 1);
    over_ = good || idle();
    return !over_;
  }

  [[nodiscard]] double reached() const { return reached_; }  ///< Objective of the last step.
  [[nodiscard]] bool over() const { return over_; }          ///< It has ended the round,
  [[nodiscard]] bool enough() const { return enough_; }      ///< and the level.

 private:
  /// Rounds by waves have a rule of their own.
  [[nodiscard]] bool idle() const { return !site_.level.waves && site_.task.finish.idle(errors_); }

  const LevelSite& site_;
  GuidedOptimization::Observer log_;
  std::vector<double> errors_;
  double reached_ = kInfinity;
  bool over_ = false;
  bool enough_ = false;
};

/// The rendering-guided half. @return false if it was asked to stop.
bool follow_picture(const LevelSite& site, Watch& watch, Checkpoint& state) {
  LbfgsOptions optimizer;
  optimizer.max_iterations = site.level.iterations;
  optimizer.history = kHistory;
  const LbfgsSummary summary = site.stage.run(optimizer, std::ref(watch), state.scales, state.mesh,
                                              site.log.step("starting iterations"));
  using Status = LbfgsSummary::Status;
  if (summary.status == Status::kInfeasibleStart) refuse_start(site.task);
  return summary.status != Status::kStopped || watch.over();
}

/// Runs both halves and conclude_round(). @return false if it was asked to stop.
bool alternate(const LevelSite& site, const SurfaceMesh& before, Watch& watch, Checkpoint& state) {
  const DesignOptions& options = site.task.options;
  const bool transports =
      !site.level.spline && state.transporting && state.round < options.transport_rounds;
  if (transports) start_from_transport(site, state);
  if (!site.level.spline && !relax(site, 2, state.mesh)) relax(site, 3, state.mesh);
  // Steps for waves are not measured anew: an idle round by waves is the last.
  const bool rescaled = !state.scales.known() || site.level.waves;
  if (options.rendering_guided && !follow_picture(site, watch, state)) return false;
  if (watch.enough() && &site.level == &site.task.levels.back()) site.log.good_enough();
  const double idle = site.level.waves ? kIdleWaves : kIdleRound;
  conclude_round({before, site.stage.value(state.mesh), transports, rescaled, watch.enough(), idle},
                 site.level.rounds, state);
  return true;
}

}  // namespace

bool run_round(const LevelSite& site, Checkpoint& state) {
  const SurfaceMesh before = state.mesh;
  Watch watch(site);
  // A newly aimed mesh is often worse than the one before until it is optimised.
  const auto keep_the_better = [&] {
    if (!(watch.reached() <= state.value)) state.mesh = before;
  };
  try {
    const bool finished = alternate(site, before, watch, state);
    if (!finished) keep_the_better();
    return finished;
  } catch (const Interrupted&) {
    keep_the_better();
    throw;
  }
}

void conclude_round(const RoundOutcome& outcome, int rounds, Checkpoint& state) {
  const bool idle = outcome.value >= (1.0 - outcome.idle) * state.value;
  if (outcome.value <= state.value) {
    state.value = outcome.value;
  } else {
    state.mesh = outcome.before;
  }
  if (idle) {
    state.transporting = false;
    state.scales = {};
  }
  const bool exhausted = idle && outcome.rescaled && !outcome.transported;
  state.round = exhausted || outcome.enough ? rounds : state.round + 1;
}

namespace {

/// Describes the design that a checkpoint belongs to: names its model if only the model differs,
/// for example after a change of the default.
std::string owner_of(const Checkpoint& saved, const DesignTask& task) {
  for (const SurfaceModel model : kSurfaceModels) {
    DesignOptions options = task.options;
    options.model = model;
    if (design_fingerprint(task.target, options) != saved.fingerprint) continue;
    return "a design of --model " + model_name(model) + ": give that option with --resume";
  }
  return "another picture or other options";
}

}  // namespace

Checkpoint saved_state(const DesignTask& task) {
  Checkpoint saved = read_checkpoint(task.options.checkpoint);
  if (saved.fingerprint != design_fingerprint(task.target, task.options)) {
    throw InputError("checkpoint '" + task.options.checkpoint.string() + "' belongs to " +
                     owner_of(saved, task));
  }
  // A checkpoint does not hold triangles; those of control points are not those of a mesh.
  const auto level = static_cast<std::size_t>(saved.level);
  if (level < task.levels.size() && task.levels[level].spline &&
      saved.mesh.grid == task.levels[level].grid) {
    saved.mesh = net_mesh({saved.mesh.grid, std::move(saved.mesh.vertices)});
  }
  return saved;
}

void save_state(const DesignTask& task, const DesignLog& log, Checkpoint& state) {
  state.seconds = log.seconds();
  if (!task.options.checkpoint.empty()) write_checkpoint(state, task.options.checkpoint);
}

namespace {

void begin_next_level(Checkpoint& state) {
  state.round = 0;
  state.value = kInfinity;
  state.transporting = true;
  state.scales = {};
  ++state.level;
}

/// Step lengths for waves: those for rays, since measuring takes eight pictures.
StepScales ray_scales(const DesignTask& task, const DesignLog& log, LevelProblem problem,
                      const SurfaceMesh& mesh) {
  problem.objective.waves.reset();
  GuidedOptimization stage(mesh, problem.setup, problem.target, problem.objective, task.executor);
  return stage.measured_scales(mesh, log.step("measuring steps"));
}

/// True if the surface is so close to its picture that the optimiser's approximations matter: the
/// convolution with a source, and the few rays of a spline. A process blurs its part by more than
/// either, so it is not corrected.
bool needs_correction(const LevelProblem& problem, const Level& level, const Checkpoint& state) {
  if (problem.objective.made_by || level.waves) return false;
  return level.spline || (!problem.setup.extent.none() && state.round > 0);
}

/// Nodes per knot cell each way of the picture that a spline is corrected to. The error falls with
/// the square of the number: with 6 it is a ninth of that with 2.
constexpr int kCorrectionSamples = 6;

/// Returns the picture to aim at so that the surface makes `target`.
Image corrected_target(const DesignTask& task, const DesignLog& log, const LevelProblem& problem,
                       const Level& level, const SurfaceMesh& mesh, const Image& target) {
  const ControlNet net{mesh.grid, mesh.vertices};
  int views = 0;
  const auto picture = [&](int samples) {
    return [&, samples](const OpticalSetup& light) {
      log.report_step("correcting the picture, view " + std::to_string(++views));
      if (level.spline) return render_spline(net, samples, light, task.executor);
      return flux_of_surface(mesh, light, problem.objective.model, task.executor);
    };
  };
  const PointPicture seen = picture(kMeshSamples);
  if (problem.setup.extent.none()) {
    return corrected(target, picture_under(problem.setup, 1, picture(kCorrectionSamples)),
                     picture_under(problem.setup, 1, seen));
  }
  const double z = mesh.vertices.row(2).mean();
  const std::vector<double> convolved =
      picture_by_convolution(problem.setup, z, seen, task.executor);
  const int points = source_point_count(problem.setup, z);
  const std::vector<double> exact =
      level.spline ? picture_under_few_rays(problem.setup, z, points,
                                            {seen, picture(kCorrectionSamples)}, task.executor)
                   : picture_under(problem.setup, points, seen);
  return corrected(target, exact, convolved);
}

/// @return false if it was asked to stop.
bool run_level(const DesignTask& task, DesignLog& log, Checkpoint& state) {
  const Level& level = task.levels[static_cast<std::size_t>(state.level)];
  if (state.mesh.grid != level.grid) {
    state.mesh = level_start(task, level, state.mesh,
                             log.step(level.spline ? "fitting a spline" : "refining the mesh"));
  }
  LevelProblem problem = make_problem(task, level, state.mesh.triangle_count());
  const Image target = problem.target;
  if (level.waves && !state.scales.known()) {
    state.scales = ray_scales(task, log, problem, state.mesh);
  }
  std::unique_ptr<GuidedOptimization> stage;
  while (state.round < level.rounds) {
    const bool corrects = needs_correction(problem, level, state);
    if (corrects) problem.target = corrected_target(task, log, problem, level, state.mesh, target);
    if (corrects || level.waves || !stage) {
      log.report_step("preparing iterations");
      stage.reset();  // There is not always room for two.
      stage = std::make_unique<GuidedOptimization>(state.mesh, problem.setup, problem.target,
                                                   problem.objective, task.executor);
    }
    if (corrects || level.waves) {
      log.report_step("evaluating the surface");
      state.value = stage->value(state.mesh);
    }
    if (!run_round({task, level, problem, *stage, log}, state)) return false;
    if (state.round < level.rounds) save_state(task, log, state);
  }
  begin_next_level(state);
  save_state(task, log, state);
  return true;
}

}  // namespace

Checkpoint first_state(const DesignTask& task) {
  if (task.options.resume) return saved_state(task);
  Checkpoint state;
  state.fingerprint = design_fingerprint(task.target, task.options);
  const LightOptions& light = task.options.light;
  if (light.both_faces) state.shared_front = light.front_heights->grid();
  state.mesh =
      start_surface(task.setup, task.levels.front().grid, task.options.thickness, task.executor);
  return state;
}

bool run_levels(const DesignTask& task, DesignLog& log, Checkpoint& state) try {
  if (!task.options.resume) save_state(task, log, state);
  while (state.level < static_cast<int>(task.levels.size())) {
    if (!run_level(task, log, state)) return false;
  }
  return true;
} catch (const Interrupted&) {
  return false;
}

}  // namespace lensforge

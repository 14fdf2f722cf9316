// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

#include "cam/job/cut_job.h"
#include "cam/job/job_files.h"
#include "cam/leakage/render_field.h"
#include "cam/plan/cut_plan.h"
#include "cam/plan/finishing.h"
#include "cam/predict/prediction.h"
#include "cam/tolerance/part_model.h"
#include "cam/tolerance/tolerance_forecast.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/optics/front.h"
#include "core/optics/picture_blur.h"
#include "core/text/number_text.h"
#include "design/waves/wave_picture.h"

namespace lensforge {

namespace fs = std::filesystem;

void remove_cut(const fs::path& folder) {
  remove_prediction(folder);
  std::error_code ignored;
  for (const fs::path& program : other_programs(folder, {}).earlier) fs::remove(program, ignored);
}

CamResult make_cut(const Lens& lens, const CamOptions& options, const fs::path& folder,
                   const Executor& executor, const RunControl& control) {
  validate(options, lens.setup);
  const CutJob job{options, {{&lens, options, folder}}, std::nullopt, cut_file_names(options)};
  try {
    WrittenJob written = write_job(job, folder, executor, control);
    remove_prediction(folder);
    CamResult result;
    result.files = publish(written);
    result.report = std::move(written.reports.front());
    const Verdict& verdict = result.report.verdict;
    result.message = verdict_words(verdict.missed(), verdict.advice());
    return result;
  } catch (const Interrupted&) {
    CamResult result;
    result.interrupt();
    return result;
  }
}

namespace {

// Fitted to a portrait of 100 mm with the default tools, 6e-5 rad: 2.4 moves and 0.2 ms per
// millimetre of row. The powers were fitted to slope tolerances from 1e-3 to 5e-5 rad on a portrait
// of 25 mm.

/// Moves per millimetre of row at the default tolerances, and powers of their growth with coarser
/// and with finer slopes, and with heights: chords of arcs shorten with the root of their height.
constexpr double kMovesPerMm = 2.4;
constexpr double kCoarserPower = 0.6;
constexpr double kFinerPower = 1.3;
constexpr double kTolerancePower = 0.5;

constexpr double kBytesPerMove = 40.0;     ///< "G3 X12.345678 Z-1.234567 I-1.234567 K-12.345678"
constexpr double kMemoryPerMove = 1000.0;  ///< Bytes: exact, fitted and written path of the ball.
/// Bytes: the path of a machine with a pitch error, 617 instead of 534 MB for a lens of 100 x 67 mm
/// at a pitch of 0.08 mm.
constexpr double kStretchedMemoryPerMove = 400.0;
constexpr double kMemory = 1.5e8;         ///< Bytes of everything else.
constexpr double kMemoryPerNode = 200.0;  ///< Bytes of milled.ply and of its sources.
/// Bytes of a spline's facets for the ball's reach; portraits of 128² and 256² as designed for
/// them.
constexpr double kMemoryPerSplinePixel = 1.8e4;
constexpr double kDiskPerNode = 50.0;      ///< Bytes of a vertex and two triangles.
constexpr double kSecondsPerMm = 2e-4;     ///< Of a finishing row: drop curve, fit, reading back.
constexpr double kMinSecondsPerMm = 1e-4;  ///< With any tolerance.
constexpr double kFinerSeconds = 2.75;  ///< Exponent of finer slopes in the time: moves are tried
                                        ///< often.
constexpr double kTraced = 3.0;         ///< Time factor where the part is rendered.
constexpr double kSecondsPerPoint = 1e-5;       ///< Of a roughing or semi-finishing pass.
constexpr double kMovesPerPoint = 0.1;          ///< Most of them lie on straight passes.
constexpr double kSecondsPerSample = 2.5e-7;    ///< Of a surface, milled, polished and rendered.
constexpr double kSecondsPerPartNode = 1.9e-7;  ///< Of a part with errors (docs/performance.md).
/// Pictures behind a front, those of twice as many samples each way counted four times.
constexpr double kFrontPictures = 16.0;
constexpr double kSecondPictures = 2.0;       ///< Of them again, on a second screen.
constexpr double kSecondsPerFrontRay = 2e-6;  ///< A lens of 6 mm, two screens: 4 s of 2.2e6 rays.
constexpr double kMemoryPerFrontRay = 16.0;   ///< Bytes: its height maps, the finer ones alone.
constexpr double kMemoryPerPartNode = 24.0;   ///< Bytes: three heights while they are sampled.
constexpr double kSurfaces = 8.0;             ///< Number rendered.

constexpr double kWaveSurfaces = 4.0;  ///< Number whose waves are computed.
/// Of such a surface, beside wave_seconds(): it has finer nodes than a design's (portrait of 256²
/// on 100 mm: 116 processor seconds for all four, 80 by wave_seconds()), and places are tried.
constexpr double kSecondsPerWaveSample = 6e-7;
/// Bytes of the fields of two tiles and of the samples of a batch.
constexpr double kMemoryOfWaves = 6e8;

/// Reserve left free by the advised value.
constexpr double kSpare = 1.5;

double finish_length(const CamOptions& options, const OpticalSetup& setup) {
  const FinishProcess& finish = options.workshop.process.finish;
  const Eigen::Vector2d size = size_to_cut(options, setup);
  const double pitch = finish_pitch(options, unknown_ground(options, setup));
  const auto rows_of = [&](const Tool& ball, double apart) {
    const double beyond = 2.0 * apron_to_cut(options) + ball.diameter;
    return (size + Eigen::Vector2d::Constant(beyond)).prod() / apart;
  };
  double length = rows_of(finishing_ball(options), pitch) * (finish.cross ? 2.0 : 1.0);
  // The larger ball's remainder is not known yet: at most all of it.
  if (const Tool* const large = larger_ball(options)) {
    length += rows_of(*large, finish.large_every * pitch);
  }
  return length;
}

/// Factor by which slope errors are smaller than by default; finer heights take as many moves as
/// slopes.
double fineness(const FinishProcess& finish) {
  const FinishProcess usual;
  const double height = std::pow(usual.tolerance / finish.tolerance, kTolerancePower);
  return std::max(usual.slope_tolerance / finish.slope_tolerance, 0.1 * height);
}

double moves_per_mm(const FinishProcess& finish) {
  const double fine = fineness(finish);
  return kMovesPerMm * std::pow(fine, fine > 1.0 ? kFinerPower : kCoarserPower);
}

double seconds_per_mm(const CamOptions& options) {
  const double fine = fineness(options.workshop.process.finish);
  const double seconds = kSecondsPerMm * std::pow(fine, kFinerSeconds);
  return std::max(seconds, kMinSecondsPerMm) * (options.render ? kTraced : 1.0);
}

/// Points of a pass that follows the surface, on one level.
template <class Level>
double points_of(const Level& level, const Eigen::Vector2d& size) {
  return level.enabled ? size.prod() / (level.stepover * level.spacing) : 0.0;
}

double rough_points(const CamOptions& options, const Eigen::Vector2d& size) {
  const Workshop& shop = options.workshop;
  const double levels = std::ceil((shop.stock.allowance + 1.0) / shop.process.rough.stepdown);
  return levels * points_of(shop.process.rough, size) + points_of(shop.process.semi, size);
}

Passes planned_passes(const CamOptions& options, const OpticalSetup& setup) {
  return passes_on_lens(options, unknown_ground(options, setup));
}

double samples_of(const CamOptions& options, const OpticalSetup& setup) {
  if (!options.render) return 0.0;
  const Eigen::Vector2d spacings = sample_spacings(options, setup, planned_passes(options, setup));
  return kSurfaces * setup.lens_size.prod() / spacings.prod();
}

double wavelength_of(const CamOptions& options, const OpticalSetup& setup) {
  return middle_wavelength(setup, kMmPerNm * options.wavelength_nm);
}

/// True if waves are computed, as far as that can be told without the lens's surface.
bool may_take_waves(const CamOptions& options, const OpticalSetup& setup) {
  const bool creased =
      leaves_creases(options.surface.value_or(SurfaceModel::kSmooth), options.workshop.polish);
  return options.render && options.face == CutFace::kBack &&
         light_choice({setup, {}}, options.light, creased, middle_wavelength(setup)).waves;
}

double seconds_by_waves(const CamOptions& options, const OpticalSetup& setup) {
  if (!may_take_waves(options, setup)) return 0.0;
  return kWaveSurfaces * (wave_seconds(setup, wavelength_of(options, setup)) +
                          samples_of(options, setup) / kSurfaces * kSecondsPerWaveSample);
}

double memory_per_move(const FinishProcess& finish) {
  return kMemoryPerMove + (finish.pitch_error != 0.0 ? kStretchedMemoryPerMove : 0.0);
}

double nodes_of(const Eigen::Vector2d& size) { return size.prod() / (kMeshSpacing * kMeshSpacing); }

/// Nodes of a part with errors; 0 if none is drawn.
double part_nodes(const CamOptions& options, const OpticalSetup& setup) {
  if (part_draws(options, setup).parts == 0) return 0.0;
  PartPlan plan;
  plan.optics = setup;
  plan.passes = planned_passes(options, setup);
  plan.polish = options.workshop.polish;
  plan.apron = apron_to_cut(options);
  return static_cast<double>(part_nodes(plan));
}

/// Rays of the pictures behind a front that is cut.
double front_rays(const CamOptions& options, const OpticalSetup& setup) {
  if (options.face == CutFace::kBack) return 0.0;
  const double pictures = kFrontPictures + (setup.second ? kSecondPictures : 0.0);
  return pictures * samples_of(options, setup) / kSurfaces;
}

/// Nodes of all pictures of parts with errors.
double drawn_nodes(const CamOptions& options, const OpticalSetup& setup) {
  return static_cast<double>(part_draws(options, setup).pictures()) * part_nodes(options, setup);
}

/// Knot cells of the spline that is cut, about: a lens's has as many as its picture has pixels.
double spline_cells(const CamOptions& options, const OpticalSetup& setup) {
  if (options.face == CutFace::kBack) return setup.pixels.cast<double>().prod();
  const HeightGrid& grid = std::get<HeightFront>(setup.front.value()).spline->grid();
  return (grid.columns - 1.0) * (grid.rows - 1.0);
}

/// Comparisons are written so that NaN is refused too.
void require_bearable(const WorkEstimate& on_one_core, const std::string& what,
                      const std::string& advice) {
  if (on_one_core.seconds <= kMaxCutSeconds && on_one_core.disk_bytes <= kMaxCutBytes) return;
  throw InputError(what + ": takes " + estimate_words(on_one_core) +
                   " on one core; no more than 1000 h and 100 GB are begun; " + advice);
}

/// The next larger number of one digit.
double rounded_up(double value) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)));
  return unit * std::ceil(value / unit);
}

}  // namespace

WorkEstimate estimate_cut(const CamOptions& options, const OpticalSetup& setup, int threads) {
  const Eigen::Vector2d size = size_to_cut(options, setup);
  const double length = finish_length(options, setup);
  const double moves = length * moves_per_mm(options.workshop.process.finish);
  const double points = rough_points(options, size);
  WorkEstimate estimate;
  estimate.seconds =
      (length * seconds_per_mm(options) + points * kSecondsPerPoint +
       samples_of(options, setup) * kSecondsPerSample + seconds_by_waves(options, setup) +
       front_rays(options, setup) * kSecondsPerFrontRay +
       drawn_nodes(options, setup) * kSecondsPerPartNode) /
      threads;
  estimate.disk_bytes = (moves + kMovesPerPoint * points) * kBytesPerMove;
  estimate.memory_bytes = kMemory;
  if (options.render) {
    estimate.memory_bytes += moves * memory_per_move(options.workshop.process.finish) +
                             nodes_of(size) * kMemoryPerNode +
                             part_nodes(options, setup) * kMemoryPerPartNode +
                             front_rays(options, setup) * kMemoryPerFrontRay;
    if (may_take_waves(options, setup)) estimate.memory_bytes += kMemoryOfWaves;
    if (options.surface == SurfaceModel::kSpline || options.face == CutFace::kFront) {
      estimate.memory_bytes += spline_cells(options, setup) * kMemoryPerSplinePixel;
    }
    estimate.disk_bytes += nodes_of(size) * kDiskPerNode;
  }
  return estimate;
}

WorkEstimate estimate_cut(CamOptions options, const Lens& lens, int threads) {
  options.surface = options.surface.value_or(lens.model);
  return estimate_cut(options, lens.setup, threads);
}

void require_room_for_cut(const CamOptions& options, const OpticalSetup& setup,
                          const WorkEstimate& estimate, const fs::path& folder) {
  const Eigen::Vector2d size = size_to_cut(options, setup);
  const FinishProcess& finish = options.workshop.process.finish;
  WorkEstimate on_one_core = estimate;
  on_one_core.seconds = estimate_cut(options, setup, 1).seconds;
  const double share = std::max(
      {estimate.disk_bytes / free_disk_bytes(folder), estimate.memory_bytes / free_memory_bytes(),
       estimate.disk_bytes / kMaxCutBytes, on_one_core.seconds / kMaxCutSeconds});
  const double moves = finish_length(options, setup) * moves_per_mm(finish);
  const auto require = [&](const std::string& what, const std::string& advice) {
    require_room(estimate, folder, what, advice);
    require_bearable(on_one_core, what, advice);
  };
  if (kMovesPerPoint * rough_points(options, size) > moves) {
    return require("the roughing and semi-finishing passes",
                   "use larger steps and spacings in the workshop");
  }
  if (options.render && nodes_of(size) * kMemoryPerNode > moves * memory_per_move(finish)) {
    return require("the milled surface of so large a lens", "--no-render needs less");
  }
  if (drawn_nodes(options, setup) * kSecondsPerPartNode > 0.5 * on_one_core.seconds) {
    return require("--tolerances " + std::to_string(options.tolerances),
                   "fewer parts, --tolerances 200, would fit");
  }
  if (samples_of(options, setup) * kSecondsPerSample > 0.5 * on_one_core.seconds) {
    const double spacing = sample_spacing(options, planned_passes(options, setup));
    return require("--sample-spacing " + shortest_text(spacing) + "mm",
                   "a larger --sample-spacing would fit");
  }
  const double radius = finishing_ball(options).radius();
  const double pitch = max_pitch(finish, radius, kUnknownSlope);
  const double fitting = rounded_up(pitch * share * kSpare);
  if (fineness(finish) > 1.0 && fitting > radius) {
    return require("tolerances this fine", "a larger --slope-tolerance or --tolerance would fit");
  }
  const std::string stated = "--pitch " + shortest_text(pitch) + "mm";
  if (fitting > 2.0 * radius) {
    return require(stated, std::string("a larger tool") +
                               (options.render ? " or --no-render" : "") + " needs less");
  }
  require(stated, "--pitch " + shortest_text(fitting) + "mm would fit");
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/wall_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>
#include <vector>

#include "cam/leakage/render_field.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/polished_field.h"
#include "cam/plan/finishing.h"
#include "core/error.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "core/optics/polish_transfer.h"
#include "design/render.h"

namespace lensforge {
namespace {

/// Beyond each side of the picture: light of a wall that is 15 % off, and some of the haze's.
constexpr double kMargin = 0.12;

/// Greatest polish that is looked for, in multiples of the workshop's.
constexpr double kMostPolish = 2.5;

double mean_height(const Lens& lens) { return lens.surface.vertices.row(2).mean(); }

OpticalSetup widened(OpticalSetup setup, int fine, int margin) {
  const Eigen::Vector2d pixel = setup.image_size.cwiseQuotient(setup.pixels.cast<double>());
  const Eigen::Vector2d more = margin * pixel;
  setup.image_origin -= more;
  setup.image_size += 2.0 * more;
  setup.pixels = fine * (setup.pixels.array() + 2 * margin).matrix();
  return setup;
}

Eigen::Vector3d lens_centre(const OpticalSetup& setup) {
  return {0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0};
}

/// The lamp with another vergence: the lamp's direction from the lens is kept.
void move_lamp(OpticalSetup& setup, double vergence) {
  const Eigen::Vector3d centre = lens_centre(setup);
  if (auto* const point = std::get_if<PointSource>(&setup.lamp)) {
    const Eigen::Vector3d away = point->position - centre;
    point->position = centre + away.normalized() / (1.0 / away.norm() + vergence);
    return;
  }
  const Eigen::Vector3d direction = std::get<ParallelLight>(setup.lamp).direction;
  const double angle = setup.extent.width;
  setup.lamp = PointSource{centre - direction / vergence, Emission::kIsotropic};
  setup.extent.width = angle / vergence;
}

}  // namespace

Deviations deviation_steps(const OpticalSetup& setup) {
  const double pixel = setup.image_size.x() / setup.pixels.x() / setup.focal_length;
  Deviations steps;
  steps[index_of(Deviation::kDistance)] = 0.01;
  steps[index_of(Deviation::kTiltX)] = 0.02;
  steps[index_of(Deviation::kTiltY)] = 0.02;
  steps[index_of(Deviation::kLampSize)] = pixel * pixel;
  steps[index_of(Deviation::kLampDistance)] = 0.01;
  steps[index_of(Deviation::kIndex)] = 0.01;
  steps[index_of(Deviation::kPolish)] = 0.1;
  steps[index_of(Deviation::kBall)] = 0.05;
  steps[index_of(Deviation::kPitch)] = 0.003;
  steps[index_of(Deviation::kHaze)] = 0.05;
  return steps;
}

DeviationLimits deviation_limits(const OpticalSetup& setup) {
  const double pixel = setup.image_size.x() / setup.pixels.x() / setup.focal_length;
  DeviationLimits limits;
  limits.most << 0.25, 0.3, 0.3, 100.0 * pixel * pixel, 0.3, 0.1, std::log(kMostPolish), 0.5, 0.02,
      0.6;
  limits.least = -limits.most;
  limits.least[index_of(Deviation::kHaze)] = 0.0;
  // No lamp is farther than that of parallel light.
  if (!lamp_distance(setup)) limits.least[index_of(Deviation::kLampDistance)] = 0.0;
  return limits;
}

double wall_distance(const OpticalSetup& setup) {
  return (setup.screen_centre() - lens_centre(setup)).norm();
}

std::optional<double> lamp_distance(const OpticalSetup& setup) {
  const auto place = lamp_place(setup.lamp);
  if (!place) return std::nullopt;
  return (*place - lens_centre(setup)).norm();
}

double lamp_angle(const OpticalSetup& setup) {
  return setup.extent.width / lamp_distance(setup).value_or(1.0);
}

namespace {

/// Parts and pictures that are kept: a fit comes back to those around it.
constexpr std::size_t kKeptParts = 3;
constexpr std::size_t kKeptPictures = 24;

/// Nodes of a part that are kept: 0.5 GB. Larger parts are polished anew for every picture.
constexpr std::int64_t kMostNodes = 20'000'000;

}  // namespace

struct WallModel::Part {
  Part(const PolishModel& polish, double ball_share, double pitch_error,
       std::vector<BallPath> paths, const WallModel& model)
      : sigma(polish.sigma),
        ball(ball_share),
        pitch(pitch_error),
        milled(std::move(paths), model.blank_top_),
        polished(milled, {Eigen::Vector2d(0.0, 0.0), model.wide_.lens_size}, polish),
        held(polished) {}

  double sigma, ball, pitch;
  MilledField milled;
  PolishedField polished;
  HeldField held;
};

WallModel::~WallModel() = default;

WallModel::WallModel(const Lens& lens, const CamOptions& options, int fine,
                     const Executor& executor, const RunControl& control)
    : lens_(lens),
      options_(options),
      fine_(fine),
      margin_(static_cast<int>(std::lround(kMargin * lens.setup.pixels.maxCoeff()))),
      wide_(widened(lens.setup, fine, margin_)),
      height_(mean_height(lens)),
      fault_(tolerance_fault(options, lens.setup)),
      executor_(executor) {
  if (!fault_.empty()) return;
  if (options.surface.value_or(lens.model) == SurfaceModel::kFacet) {
    fault_ = "draws parts of surfaces without creases only";
    return;
  }
  plan_rows(cut_setup(lens, options), control);
}

/// The path's decimals are left out: they move light by less than the fit of its moves.
void WallModel::plan_rows(const CutSetup& setup, const RunControl& control) {
  blank_top_ = setup.blank.max().z();
  passes_ = setup.passes();
  const CutPasses passes = cut_passes(setup, executor_);
  for (const FinishPass& pass : passes.finish) {
    BallRows& ball = rows_.emplace_back(BallRows{pass.tool.radius(), {}});
    const auto keep = [&](const RasterRow& row) {
      if (control.stop_requested()) throw Interrupted();
      ball.rows.push_back(row);
    };
    if (!cut_raster(*pass.surface, pass.plan, executor_, keep, control).complete) {
      throw Interrupted();
    }
  }
}

const WallModel::Part& WallModel::part(const Deviations& deviations) const {
  PolishModel polish = options_.workshop.polish;
  polish.sigma *= std::exp(deviations[index_of(Deviation::kPolish)]);
  FinishProcess finish = options_.workshop.process.finish;
  finish.pitch_error += deviations[index_of(Deviation::kPitch)];
  const double ball = deviations[index_of(Deviation::kBall)];
  for (const auto& part : parts_) {
    if (part->sigma == polish.sigma && part->ball == ball && part->pitch == finish.pitch_error) {
      return *part;
    }
  }
  std::vector<BallPath> paths;
  for (const BallRows& rows : rows_) {
    BallPath& path = paths.emplace_back(rows.radius * (1.0 + ball), 0.0);
    for (const RasterRow& row : rows.rows) add_way(row, AxisStretch::of(finish), path);
  }
  // The first is the forecast's, to which fits come back most often.
  if (parts_.size() == kKeptParts) parts_.erase(parts_.begin() + 1);
  parts_.push_back(
      std::make_unique<const Part>(polish, ball, finish.pitch_error, std::move(paths), *this));
  return *parts_.back();
}

std::vector<double> WallModel::light_of(const Part& part, const OpticalSetup& optics) const {
  FieldRenderSetup render{
      optics, lens_grid(optics.lens_size, sample_spacings(options_, lens_.setup, passes_))};
  render.surface_height = height_;
  for (const LightColor& color : light_colors(optics)) {
    const LightPath path(color.setup);
    if (!path.intake_is_plan_area()) render.whole.push_back(intake_of(lens_.surface, path));
  }
  if (render.grid.size() <= kMostNodes) {
    render.tile = std::max(render.grid.columns, render.grid.rows);
  }
  return render_field(part.held, render, executor_, {}).flux;
}

bool WallModel::shows(Deviation deviation) const {
  switch (deviation) {
    case Deviation::kPolish:
    case Deviation::kBall:
    case Deviation::kPitch:
      return has_part();
    case Deviation::kIndex:
    case Deviation::kHaze:
      return traits(lens_.setup.body).transmits;
    case Deviation::kLampSize:
      return lens_.setup.extent.shape.is_disc();
    default:
      return true;
  }
}

/// Light and screen; the rest is the part's.
OpticalSetup WallModel::optics_of(const Deviations& deviations) const {
  const auto of = [&](Deviation d) { return deviations[index_of(d)]; };
  OpticalSetup optics = wide_;
  const double away = wall_distance(lens_.setup);
  const double angle = lamp_angle(lens_.setup);
  optics.extent.width = std::sqrt(std::max(angle * angle + of(Deviation::kLampSize), 0.0)) *
                        lamp_distance(lens_.setup).value_or(1.0);
  if (of(Deviation::kLampDistance) != 0.0) {
    move_lamp(optics, of(Deviation::kLampDistance) / away);
  }
  optics.ior = 1.0 + (optics.ior - 1.0) * (1.0 + of(Deviation::kIndex));
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(of(Deviation::kTiltY), optics.screen_y) *
                                Eigen::AngleAxisd(of(Deviation::kTiltX), optics.screen_x))
                                   .toRotationMatrix();
  const Eigen::Vector3d by =
      of(Deviation::kDistance) * away * optics.screen_x.cross(optics.screen_y);
  optics.image_origin += by.head<2>();
  optics.focal_length += by.z();
  if (of(Deviation::kTiltX) != 0.0 || of(Deviation::kTiltY) != 0.0) {
    optics.screen_x = turn * optics.screen_x;
    optics.screen_y = turn * optics.screen_y;
  }
  return optics;
}

Haze WallModel::haze_at(const OpticalSetup& optics, double more) const {
  if (!traits(optics.body).transmits) return {};
  const PolishModel& polish = options_.workshop.polish;
  // Any roughness has the width that follows from the correlation length.
  Haze haze = haze_of({std::max(polish.roughness, 1.0), polish.correlation}, optics, height_,
                      kMmPerNm * options_.wavelength_nm);
  if (polish.roughness == 0.0) haze.share = 0.0;
  haze.share += more;
  return haze;
}

std::vector<double> WallModel::flux(const Deviations& deviations) const {
  const OpticalSetup optics = optics_of(deviations);
  const std::vector<double> light =
      has_part() ? light_of(part(deviations), optics) : flux_of_lens(lens_, optics, executor_);
  return hazed(haze_at(optics, deviations[index_of(Deviation::kHaze)]), light, optics.pixels,
               executor_);
}

Image WallModel::picture(const Deviations& deviations) const {
  const DeviationLimits limits = deviation_limits(lens_.setup);
  const Deviations within = deviations.cwiseMax(limits.least).cwiseMin(limits.most);
  for (const auto& [at, image] : pictures_) {
    if (at == within) return image;
  }
  const std::vector<double> light = flux(within);
  const double even = lens_.setup.pixels.cast<double>().prod() * fine_ * fine_;
  Image image(wide_.pixels.x(), wide_.pixels.y());
  std::transform(light.begin(), light.end(), image.values().begin(),
                 [&](double value) { return static_cast<float>(even * std::max(value, 0.0)); });
  if (pictures_.size() == kKeptPictures) pictures_.erase(pictures_.begin() + 1);
  pictures_.emplace_back(within, image);
  return image;
}

}  // namespace lensforge

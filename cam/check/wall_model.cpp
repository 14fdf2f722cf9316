// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/wall_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <variant>
#include <vector>

#include "cam/leakage/render_field.h"
#include "cam/milled/creases.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/polished_field.h"
#include "cam/plan/finishing.h"
#include "cam/predict/prediction.h"
#include "cam/tolerance/part_light.h"
#include "core/error.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "core/optics/picture_blur.h"
#include "core/optics/polish_transfer.h"
#include "design/render.h"
#include "design/render/source_picture.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

/// Beyond each side of the picture: light of a wall that is 15 % off, and some of the haze's.
constexpr double kMargin = 0.12;

/// WaveOptions::stray of a wall or a part that is tilted: a tilt is found by less than what a
/// picture shows of it.
constexpr double kStray = 0.002;

constexpr std::array<Deviation, 4> kTilts{Deviation::kTiltX, Deviation::kTiltY,
                                          Deviation::kPartTiltX, Deviation::kPartTiltY};

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

/// Where the light of the lens's middle lands if the surface is level there: mm on the screen from
/// the picture's middle.
Eigen::Vector2d middle_landing(const OpticalSetup& setup, double height) {
  const LightPath path(setup);
  const Eigen::Vector3d middle = lens_centre(setup) + height * Eigen::Vector3d::UnitZ();
  const Eigen::Vector2d pixel = path.land(middle, path.beam(middle, Eigen::Vector3d::UnitZ()).m);
  return path.plane().to_mm(pixel) - setup.screen_centre().head<2>();
}

/// The light through a tilted part. Its surface lies above the place that it is turned about, which
/// moves all light sideways by some pixels; no photograph shows that. The picture's window goes
/// with it, so that details keep their places.
OpticalSetup with_part_tilt(const OpticalSetup& straight, const Eigen::Vector2d& tilt,
                            double height) {
  OpticalSetup seen = seen_by_turned_part(straight, tilt);
  const Eigen::Vector2d moved = middle_landing(seen, height) - middle_landing(straight, height);
  const Eigen::Vector3d by = moved.x() * seen.screen_x + moved.y() * seen.screen_y;
  seen.image_origin += by.head<2>();
  seen.focal_length += by.z();
  return seen;
}

}  // namespace

Deviations deviation_steps(const OpticalSetup& setup) {
  const double pixel = setup.image_size.x() / setup.pixels.x() / setup.focal_length;
  Deviations steps;
  steps[index_of(Deviation::kDistance)] = 0.01;
  steps[index_of(Deviation::kTiltX)] = 0.02;
  steps[index_of(Deviation::kTiltY)] = 0.02;
  steps[index_of(Deviation::kPartTiltX)] = 0.02;
  steps[index_of(Deviation::kPartTiltY)] = 0.02;
  steps[index_of(Deviation::kLampSize)] = pixel * pixel;
  steps[index_of(Deviation::kLampDistance)] = 0.01;
  steps[index_of(Deviation::kIndex)] = 0.01;
  steps[index_of(Deviation::kPolish)] = 0.1;
  steps[index_of(Deviation::kBall)] = 0.05;
  steps[index_of(Deviation::kPitch)] = 0.003;
  steps[index_of(Deviation::kBacklash)] = 0.005;
  steps[index_of(Deviation::kHaze)] = 0.05;
  return steps;
}

DeviationLimits deviation_limits(const OpticalSetup& setup) {
  const double pixel = setup.image_size.x() / setup.pixels.x() / setup.focal_length;
  DeviationLimits limits;
  limits.most << 0.25, 0.3, 0.3, 0.3, 0.3, 100.0 * pixel * pixel, 0.3, 0.1, std::log(kMostPolish),
      0.5, 0.02, 0.2, 0.6;
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

/// Nodes of a part that are kept: 0.5 GB. Larger parts are cut and polished anew for every picture.
constexpr std::int64_t kMostNodes = 20'000'000;

/// Nodes of all parts that are kept, and as many of cuts; and pixels of all pictures, with as many
/// of their light: a fit comes back to those around it.
constexpr std::int64_t kKeptNodes = 20'000'000;
constexpr std::int64_t kKeptPixels = 30'000'000;
constexpr std::int64_t kMostKept = 1000;

/// How many of this size are kept.
std::size_t kept(std::int64_t all, std::int64_t size, std::int64_t least) {
  return static_cast<std::size_t>(
      std::clamp(all / std::max<std::int64_t>(size, 1), least, kMostKept));
}

/// The nodes around a grid on which the widest polish of it depends.
GridWindow within_polish(GridWindow grid, const PolishModel& polish) {
  const auto reach = [&](double spacing) {
    const double nodes = kMostPolish * polish_reach(polish) * polish.sigma / spacing;
    return static_cast<std::int64_t>(std::ceil(nodes)) + 2 * kCreaseHalo;
  };
  const std::int64_t columns = reach(grid.spacing.x());
  const std::int64_t rows = reach(grid.spacing.y());
  grid.first_column -= columns;
  grid.columns += 2 * columns;
  grid.first_row -= rows;
  grid.rows += 2 * rows;
  return grid;
}

}  // namespace

struct WallModel::Cut {
  Cut(std::vector<BallPath> paths, double blank_top)
      : milled(std::move(paths), blank_top), held(milled) {}

  MilledField milled;
  HeldField held;
};

struct WallModel::Part {
  Part(std::shared_ptr<const Cut> as_cut, const PolishModel& polish, const WallModel& model)
      : cut(std::move(as_cut)),
        polished(cut->held, {Eigen::Vector2d(0.0, 0.0), model.wide_.lens_size}, polish),
        held(polished) {}

  std::shared_ptr<const Cut> cut;
  PolishedField polished;
  HeldField held;
};

WallModel::~WallModel() = default;

namespace {

/// Why there are no parts.
std::string fault_of(const Lens& lens, const CamOptions& options) {
  std::string fault = tolerance_fault(options, lens.setup);
  const bool creased = options.surface.value_or(lens.model) == SurfaceModel::kFacet;
  if (fault.empty() && creased) fault = "draws parts of surfaces without creases only";
  return fault;
}

}  // namespace

WallModel::WallModel(const Lens& lens, const CamOptions& options, int fine,
                     const Executor& executor, const RunControl& control)
    : lens_(lens),
      options_(options),
      fine_(fine),
      margin_(static_cast<int>(std::lround(kMargin * lens.setup.pixels.maxCoeff()))),
      wide_(widened(lens.setup, fine, margin_)),
      height_(mean_height(lens)),
      fault_(fault_of(lens, options)),
      executor_(executor),
      silent_(control.stop_token(), {}) {
  const std::int64_t pixels = wide_.pixels.cast<std::int64_t>().prod();
  lights_.most = kept(kKeptPixels / 2, pixels, 2);
  pictures_.most = kept(kKeptPixels, pixels, 4);
  diffractions_.most = kept(kKeptPixels / 4, pixels, 2);
  if (!fault_.empty()) {
    if (options.light != LightModel::kWaves) return;
    throw InputError("--light-model waves: check " + fault_ +
                     ", and the light of other lenses goes by rays; use auto or rays");
  }
  plan_rows(cut_setup(lens, options), control);
  grid_ = lens_grid(wide_.lens_size, sample_spacings(options_, lens_.setup, passes_));
  cuts_.most = kept(kKeptNodes, grid_.size(), 2);
  parts_.most = kept(kKeptNodes, grid_.size(), 2);
  choose_light();
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

bool WallModel::is_kept_whole() const { return grid_.size() <= kMostNodes; }

namespace {

/// A way as a slide with a backlash goes it, half of that behind in the direction of the way: ways
/// to and fro lie as far apart as the backlash.
RasterWay lagging(RasterWay way, double backlash) {
  if (backlash == 0.0 || way.moves.empty()) return way;
  const Eigen::Vector2d run = (way.moves.back().end - way.start).head<2>();
  const int axis = std::abs(run.x()) > std::abs(run.y()) ? 0 : 1;
  const double lag = 0.5 * std::copysign(1.0, run[axis]) * backlash;
  way.start[axis] -= lag;
  for (PathMove& move : way.moves) {
    move.end[axis] -= lag;
    move.centre[axis] -= lag;
  }
  return way;
}

}  // namespace

std::shared_ptr<const WallModel::Cut> WallModel::cut(const CutKey& made_with) const {
  const auto [ball, pitch_error, backlash] = made_with;
  return cuts_.of(made_with, [&, ball = ball, pitch_error = pitch_error, backlash = backlash] {
    FinishProcess finish = options_.workshop.process.finish;
    finish.pitch_error = pitch_error;
    std::vector<BallPath> paths;
    for (const BallRows& rows : rows_) {
      BallPath& path = paths.emplace_back(rows.radius * (1.0 + ball), 0.0);
      for (const RasterRow& row : rows.rows) {
        add_way(lagging(row, backlash), AxisStretch::of(finish), path);
      }
    }
    auto made = std::make_shared<const Cut>(std::move(paths), blank_top_);
    // At once as far as any polish of it reaches, so that it is not cut again for a wider one.
    SurfacePatch patch;
    if (is_kept_whole()) {
      made->held.sample(within_polish(grid_, options_.workshop.polish), executor_, patch);
    }
    return made;
  });
}

std::shared_ptr<const WallModel::Part> WallModel::part(const Deviations& deviations) const {
  PolishModel polish = options_.workshop.polish;
  polish.sigma *= std::exp(deviations[index_of(Deviation::kPolish)]);
  const CutKey made{
      deviations[index_of(Deviation::kBall)],
      options_.workshop.process.finish.pitch_error + deviations[index_of(Deviation::kPitch)],
      deviations[index_of(Deviation::kBacklash)]};
  return parts_.of({polish.sigma, made},
                   [&] { return std::make_shared<const Part>(cut(made), polish, *this); });
}

std::vector<double> WallModel::light_of(const Part& part, const OpticalSetup& optics) const {
  FieldRenderSetup render{optics, grid_};
  render.surface_height = height_;
  for (const LightColor& color : light_colors(optics)) {
    const LightPath path(color.setup);
    if (!path.intake_is_plan_area()) render.whole.push_back(intake_of(lens_.surface, path));
  }
  if (is_kept_whole()) render.tile = std::max(grid_.columns, grid_.rows);
  return render_field(part.held, render, executor_, silent_).flux;
}

namespace {

std::vector<double> softened(const std::vector<double>& light, const Eigen::Vector2i& pixels,
                             const std::vector<double>& shares) {
  Image image(pixels.x(), pixels.y());
  std::transform(light.begin(), light.end(), image.values().begin(),
                 [](double value) { return static_cast<float>(value); });
  image = blurred(image, shares, Beyond::kDark);
  return {image.values().begin(), image.values().end()};
}

std::vector<double> difference(std::vector<double> a, const std::vector<double>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] -= b[i];
  return a;
}

}  // namespace

void WallModel::choose_light() {
  const double wavelength = middle_wavelength(lens_.setup, kMmPerNm * options_.wavelength_nm);
  FieldRenderSetup planned{lens_.setup, grid_};
  planned.surface_height = height_;
  if (!light_choice(planned, options_.light, false, wavelength).waves) return;
  waves_.emplace();
  waves_->wavelength = wavelength;
  waves_->scatter = order_angles(wavelength, passes_);
  waves_->stray *= fine_;  // Of the lens's pixels.
  const OpticalSetup point = lit_from(wide_, Eigen::Vector2d::Zero());
  const std::shared_ptr<const Part> made = part(Deviations::Zero());
  const std::vector<double> rays = light_of(*made, point);
  const std::vector<double> waves = waves_of(*made, point, *waves_);
  const double pixel = wide_.image_size.x() / wide_.pixels.x();
  const double width = diffraction_width(wide_, height_, wavelength) / pixel;
  constexpr int kBlurs = 12;
  constexpr double kStep = 0.05;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kBlurs; ++k) {
    const std::vector<double> shares = gaussian_shares(kStep * k * width);
    const std::vector<double> rest = difference(waves, softened(rays, wide_.pixels, shares));
    const double square = std::inner_product(rest.begin(), rest.end(), rest.begin(), 0.0);
    if (square >= least) continue;
    least = square;
    diffraction_blur_ = shares;
  }
}

std::vector<double> WallModel::waves_of(const Part& part, const OpticalSetup& optics,
                                        const WaveOptions& waves) const {
  const SurfaceField* const surface = &part.held;
  return wave_flux(optics, grid_, {&surface, 1}, waves, executor_, silent_).front();
}

const std::vector<double>& WallModel::diffraction(Deviations at, bool for_tilts) const {
  at[index_of(Deviation::kLampSize)] = 0.0;
  at[index_of(Deviation::kHaze)] = 0.0;
  for (const Deviation d : kTilts) for_tilts = for_tilts || at[index_of(d)] != 0.0;
  return diffractions_.of({at, for_tilts}, [&] {
    const OpticalSetup point = lit_from(optics_of(at), Eigen::Vector2d::Zero());
    const std::shared_ptr<const Part> made = part(at);
    WaveOptions waves = *waves_;
    if (for_tilts) waves.stray = kStray;
    return difference(waves_of(*made, point, waves),
                      softened(light_of(*made, point), wide_.pixels, diffraction_blur_));
  });
}

const std::vector<double>& WallModel::diffraction_change(Deviation deviation) const {
  std::vector<double>& change = diffraction_changes_[static_cast<std::size_t>(deviation)];
  if (change.empty()) {
    const Eigen::Index i = index_of(deviation);
    Deviations moved = Deviations::Zero();
    moved[i] = deviation_steps(lens_.setup)[i];
    const bool tilts = std::find(kTilts.begin(), kTilts.end(), deviation) != kTilts.end();
    const std::vector<double> planned = diffraction(Deviations::Zero(), tilts);
    change = difference(diffraction(moved, tilts), planned);
  }
  return change;
}

std::vector<double> WallModel::diffraction(const Deviations& at, const Deviations& near) const {
  std::vector<double> rest = diffraction(near, false);
  const Deviations by = (at - near).cwiseQuotient(deviation_steps(lens_.setup));
  for (std::size_t k = 0; k < kDeviations; ++k) {
    const auto d = static_cast<Deviation>(k);
    if (by[index_of(d)] == 0.0 || d == Deviation::kLampSize || d == Deviation::kHaze) continue;
    const std::vector<double>& change = diffraction_change(d);
    for (std::size_t i = 0; i < rest.size(); ++i) rest[i] += by[index_of(d)] * change[i];
  }
  return rest;
}

bool WallModel::shows(Deviation deviation) const {
  switch (deviation) {
    case Deviation::kPolish:
    case Deviation::kBall:
    case Deviation::kPitch:
      return has_part();
    case Deviation::kBacklash:
      return has_part() && options_.workshop.process.finish.style == PassStyle::kZigzag;
    // A mirror that is turned sends its picture elsewhere.
    case Deviation::kPartTiltX:
    case Deviation::kPartTiltY:
    case Deviation::kIndex:
    case Deviation::kHaze:
      return traits(lens_.setup.body).transmits;
    case Deviation::kLampSize:
      return lens_.setup.extent.shape.is_disc();
    default:
      return true;
  }
}

Deviations WallModel::within_limits(const Deviations& deviations) const {
  const DeviationLimits limits = deviation_limits(lens_.setup);
  return deviations.cwiseMax(limits.least).cwiseMin(limits.most);
}

double WallModel::log_size(const Deviations& deviations) const {
  const double share = std::sqrt(lens_.setup.lens_size.prod() / lens_.setup.image_size.prod());
  return std::log1p(share * within_limits(deviations)[index_of(Deviation::kLampDistance)]);
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
    const double size = std::exp(log_size(deviations));
    optics.image_origin += 0.5 * (1.0 - size) * optics.image_size;
    optics.image_size *= size;
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
  const Eigen::Vector2d tilt(of(Deviation::kPartTiltX), of(Deviation::kPartTiltY));
  return tilt.isZero() ? optics : with_part_tilt(optics, tilt, height_);
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

namespace {

/// Columns as `parts` each, of the parabola with the means of a column and of its neighbours.
Eigen::ArrayXXd columns_in_parts(const Eigen::ArrayXXd& light, int parts) {
  Eigen::ArrayXXd result(light.rows(), parts * light.cols());
  for (Eigen::Index c = 0; c < light.cols(); ++c) {
    const auto mean = light.col(c);
    const auto before = light.col(std::max<Eigen::Index>(c - 1, 0));
    const auto after = light.col(std::min(c + 1, light.cols() - 1));
    const Eigen::ArrayXd slope = 0.5 * (after - before);
    const Eigen::ArrayXd bend = after - 2.0 * mean + before;
    for (int k = 0; k < parts; ++k) {
      const double from = double{1} * k / parts - 0.5;
      const double to = from + 1.0 / parts;
      const double square = (from * from + from * to + to * to) / 3.0;
      result.col(parts * c + k) =
          (mean + 0.5 * (from + to) * slope + (0.5 * square - 1.0 / 24.0) * bend) / parts;
    }
  }
  return result;
}

/// Every pixel as parts × parts. Even ones would blur the light once more, by their width.
std::vector<double> in_parts(const std::vector<double>& light, const Eigen::Vector2i& pixels,
                             int parts) {
  const Eigen::Map<const Eigen::ArrayXXd> columns(light.data(), pixels.x(), pixels.y());
  const Eigen::ArrayXXd split = columns_in_parts(columns, parts).transpose();
  const Eigen::ArrayXXd all = columns_in_parts(split, parts).transpose();
  return {all.data(), all.data() + all.size()};
}

}  // namespace

std::vector<double> WallModel::clear_flux(const Deviations& deviations,
                                          const Deviations& near) const {
  const OpticalSetup optics = optics_of(deviations);
  if (!has_part()) return flux_of_lens(lens_, optics, executor_);
  if (!by_waves()) return light_of(*part(deviations), optics);
  const OpticalSetup point = lit_from(optics, Eigen::Vector2d::Zero());
  std::vector<double> light =
      softened(light_of(*part(deviations), point), wide_.pixels, diffraction_blur_);
  const std::vector<double> rest = diffraction(deviations, near);
  for (std::size_t i = 0; i < light.size(); ++i) light[i] += rest[i];
  const auto in_detail = [&](const OpticalSetup& sharp) {
    return in_parts(light, wide_.pixels, sharp.pixels.x() / wide_.pixels.x());
  };
  return picture_by_convolution(optics, height_, in_detail, executor_);
}

Image WallModel::picture(const Deviations& deviations, const Deviations& near) const {
  const Deviations within = within_limits(deviations);
  const Deviations anchor = by_waves() ? within_limits(near) : Deviations::Zero();
  return pictures_.of({within, anchor}, [&] {
    Deviations clear = within;
    clear[index_of(Deviation::kHaze)] = 0.0;
    const OpticalSetup optics = optics_of(within);
    const std::vector<double> light =
        hazed(haze_at(optics, within[index_of(Deviation::kHaze)]),
              lights_.of({clear, anchor}, [&] { return clear_flux(clear, anchor); }), optics.pixels,
              executor_);
    const double even = lens_.setup.pixels.cast<double>().prod() * fine_ * fine_;
    Image image(wide_.pixels.x(), wide_.pixels.y());
    std::transform(light.begin(), light.end(), image.values().begin(),
                   [&](double value) { return static_cast<float>(even * std::max(value, 0.0)); });
    return image;
  });
}

}  // namespace lensforge

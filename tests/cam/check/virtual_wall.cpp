// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/virtual_wall.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <variant>

#include "cam/cam_meshes.h"
#include "cam/leakage/render_field.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/polished_field.h"
#include "cam/plan/finishing.h"
#include "cam/predict/prediction.h"
#include "core/image/color.h"
#include "core/image/svg_drawing.h"
#include "core/lens/surface_field.h"
#include "design/waves/wave_picture.h"

namespace lensforge::virtual_wall {
namespace {

constexpr double kMargin = 0.25;  ///< Of the wall beyond each side.

/// Standard deviation along an axis of the Gaussian that each point stands for: that of an even
/// part of the disc. Bare points would leave as many sharp pictures.
constexpr double kPointWidth = 0.05;

/// The same lamp, but one of its points.
OpticalSetup at_point(OpticalSetup setup, const Eigen::Vector2d& point) {
  setup.extent = {};
  if (auto* const place = std::get_if<PointSource>(&setup.lamp)) {
    place->position.head<2>() += point;
    return setup;
  }
  auto& light = std::get<ParallelLight>(setup.lamp);
  light.direction.head<2>() -= point;  // Light from the right goes to the left.
  light.direction.normalize();
  return setup;
}

/// The part stays in its frame: lamp and wall turn about the lens's middle, in the opposite sense.
/// The window goes with the surface, which lies this much above that.
void tilt_part(OpticalSetup& setup, const Fault& fault, double height) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(-fault.part_tilt_x, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(-fault.part_tilt_y, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), 0.0);
  if (auto* const point = std::get_if<PointSource>(&setup.lamp)) {
    point->position = middle + turn * (point->position - middle);
  } else {
    auto& light = std::get<ParallelLight>(setup.lamp);
    light.direction = turn * light.direction;
  }
  Eigen::Vector3d screen;
  screen << setup.image_origin + 0.5 * setup.image_size, setup.focal_length;
  screen = middle + turn * (screen - middle);
  const Eigen::Vector3d way = turn * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d moved = height * Eigen::Vector3d::UnitZ();
  screen += moved - moved.dot(way) * way;
  setup.image_origin = screen.head<2>() - 0.5 * setup.image_size;
  setup.focal_length = screen.z();
  setup.screen_x = turn * setup.screen_x;
  setup.screen_y = turn * setup.screen_y;
}

/// The light on a wall that is farther and turned, wider than the picture.
OpticalSetup seen_wall(const Lens& of, const Fault& fault) {
  const OpticalSetup& lens = of.setup;
  OpticalSetup setup = lens;
  const Eigen::Vector2i more = (kMargin * setup.pixels.cast<double>()).array().round().cast<int>();
  const Eigen::Vector2d margin =
      setup.image_size.cwiseQuotient(setup.pixels.cast<double>()).cwiseProduct(more.cast<double>());
  setup.image_origin -= margin;
  setup.image_size += 2.0 * margin;
  setup.pixels = kFine * (setup.pixels + 2 * more);
  setup.focal_length *= 1.0 + fault.distance;
  if (fault.vergence != 0.0) {
    const double away = lens.focal_length / fault.vergence;
    const Eigen::Vector2d middle = 0.5 * setup.lens_size;
    const Eigen::Vector3d direction = std::get<ParallelLight>(setup.lamp).direction.normalized();
    setup.lamp = PointSource{Eigen::Vector3d(middle.x(), middle.y(), 0.0) - away * direction,
                             Emission::kIsotropic};
    setup.extent.width *= away;
  }
  setup.ior += fault.index;
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(fault.tilt_y, Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(fault.tilt_x, Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  setup.screen_x = turn * setup.screen_x;
  setup.screen_y = turn * setup.screen_y;
  if (fault.part_tilt_x != 0.0 || fault.part_tilt_y != 0.0)
    tilt_part(setup, fault, of.surface.vertices.row(2).mean());
  return setup;
}

/// A Gaussian of this standard deviation (pixels) over rows and columns; light beyond is lost.
std::vector<double> gaussian(const std::vector<double>& light, int columns, int rows,
                             double deviation) {
  const int reach = static_cast<int>(3.5 * deviation) + 1;
  std::vector<double> weights;
  double sum = 0.0;
  for (int k = -reach; k <= reach; ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (deviation * deviation)));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  std::vector<double> half(light.size(), 0.0);
  std::vector<double> all(light.size(), 0.0);
  const auto at = [&](int c, int r) {
    const int pixel = r * columns + c;
    return static_cast<std::size_t>(pixel);
  };
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      for (int k = std::max(-reach, -c); k <= std::min(reach, columns - 1 - c); ++k) {
        const int tap = k + reach;
        half[at(c, r)] += weights[static_cast<std::size_t>(tap)] * light[at(c + k, r)];
      }
    }
  }
  for (int r = 0; r < rows; ++r) {
    for (int k = std::max(-reach, -r); k <= std::min(reach, rows - 1 - r); ++k) {
      const int tap = k + reach;
      const double weight = weights[static_cast<std::size_t>(tap)];
      for (int c = 0; c < columns; ++c) all[at(c, r)] += weight * half[at(c, r + k)];
    }
  }
  return all;
}

}  // namespace

Lens wavy_lens() {
  constexpr double kTwoPi = 2.0 * std::numbers::pi;
  Lens lens;
  lens.model = SurfaceModel::kSmooth;
  lens.setup.lens_size = {4.0, 4.0};
  lens.setup.image_size = {4.0, 4.0};
  lens.setup.pixels = {32, 32};
  lens.setup.focal_length = 16.0;
  lens.setup.extent.width = 5e-3;
  lens.surface = lensforge::testing::grid_mesh(81, 81, 4.0, 4.0, [](double x, double y) {
    return 2.0 + 0.0035 * std::sin(kTwoPi * x / 1.7 + 0.3) * std::cos(kTwoPi * y / 2.3) +
           0.0025 * std::sin(kTwoPi * (x + 0.7 * y) / 1.5) +
           0.0015 * std::cos(kTwoPi * (0.4 * x - y) / 1.1 + 1.0);
  });
  lens.target = Image(32, 32, 1.0F);
  return lens;
}

CamOptions light_by(LightModel model) {
  CamOptions options;
  options.light = model;
  return options;
}

Workshop::Workshop(const Lens& lens, const CamOptions& options, const Executor& executor)
    : lens_(lens), options_(options), executor_(executor), setup_(cut_setup(lens, options)) {
  const CutPasses passes = cut_passes(setup_, executor);
  for (const FinishPass& pass : passes.finish) {
    auto& [radius, rows] = rows_.emplace_back(pass.tool.radius(), std::vector<RasterRow>());
    const auto keep = [&rows = rows](const RasterRow& row) { rows.push_back(row); };
    cut_raster(*pass.surface, pass.plan, executor, keep, {});
  }
}

std::vector<BallPath> Workshop::paths(const Fault& fault) const {
  FinishProcess finish = options_.workshop.process.finish;
  finish.pitch_error += fault.pitch_error;
  std::vector<BallPath> paths;
  for (const auto& [radius, rows] : rows_) {
    BallPath& path = paths.emplace_back(radius * (1.0 + fault.ball), 0.0);
    const MoveSink sink = path_sink(path, AxisStretch::of(finish));
    // Every other row comes back.
    Eigen::Vector3d lag = Eigen::Vector3d::Zero();
    lag[finish.along == PassAxis::kX ? 0 : 1] = -0.5 * fault.backlash;
    for (const RasterRow& row : rows) {
      const PathMove start{MoveKind::kRapid, row.start + lag};
      sink({&start, 1});
      std::vector<PathMove> moves = row.moves;
      for (PathMove& move : moves) {
        move.end += lag;
        move.centre += lag;
      }
      sink(moves);
      lag = -lag;
    }
  }
  return paths;
}

/// An evenly lit disc: three rings at Gauss's places for r², whose moments with the points' width
/// are the disc's.
std::vector<Workshop::LampPoint> Workshop::disc_points(double diameter) {
  constexpr int kAround = 8;
  constexpr std::array<std::pair<double, double>, 3> kRings = {
      {{0.11270166537925831, 5.0 / 18.0}, {0.5, 8.0 / 18.0}, {0.8872983346207417, 5.0 / 18.0}}};
  const double narrower = std::sqrt(1.0 - 16.0 * kPointWidth * kPointWidth);
  std::vector<LampPoint> points;
  for (std::size_t ring = 0; ring < kRings.size(); ++ring) {
    const auto& [square, share] = kRings[ring];
    const double r = 0.5 * diameter * narrower * std::sqrt(square);
    for (int k = 0; k < kAround; ++k) {
      const double t = (k + 0.5 * static_cast<double>(ring % 2)) * 2.0 * std::numbers::pi / kAround;
      points.push_back({{r * std::cos(t), r * std::sin(t)}, share / kAround});
    }
  }
  return points;
}

WallLight Workshop::lit_by(const std::vector<LampPoint>& points, double spread,
                           const Fault& fault) const {
  const OpticalSetup wall = seen_wall(lens_, fault);
  PolishModel polish = options_.workshop.polish;
  polish.sigma *= 1.0 + fault.sigma;
  const MilledField milled(paths(fault), setup_.blank.max().z());
  const PolishedField polished(milled, {Eigen::Vector2d(0.0, 0.0), wall.lens_size}, polish);
  const HeldField part(polished);
  FieldRenderSetup setup;
  setup.grid = lens_grid(wall.lens_size, sample_spacings(options_, lens_.setup, setup_.passes()));
  setup.tile = 100000;
  std::vector<double> sum(static_cast<std::size_t>(wall.pixels.prod()), 0.0);
  WaveOptions waves;
  waves.scatter = order_angles(waves.wavelength, setup_.passes());
  waves.stray *= kFine;
  // A tilt shows by less than what a picture shows of it.
  if (wall.screen_is_turned()) waves.stray = 0.002;
  const SurfaceField* const surface = &part;
  for (const LampPoint& point : points) {
    setup.optics = at_point(wall, point.at);
    const std::vector<double> flux =
        options_.light == LightModel::kWaves
            ? wave_flux(setup.optics, setup.grid, {&surface, 1}, waves, executor_, {}).front()
            : render_field(part, setup, executor_, {}).flux;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += point.share * flux[i];
  }
  const double pixel = wall.image_size.x() / wall.pixels.x();
  if (spread > 0.0) {
    const auto place = lamp_place(wall.lamp);
    const double angle = spread / (place ? place->norm() : 1.0);
    sum = gaussian(sum, wall.pixels.x(), wall.pixels.y(), angle * wall.focal_length / pixel);
  }
  if (fault.haze > 0.0) {
    const std::vector<double> wide =
        gaussian(sum, wall.pixels.x(), wall.pixels.y(), 0.02476 * wall.focal_length / pixel);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += fault.haze * (wide[i] - sum[i]);
  }
  WallLight light{Image(wall.pixels.x(), wall.pixels.y()), wall.image_size};
  const double even = lens_.setup.pixels.cast<double>().prod() * kFine * kFine;
  std::transform(sum.begin(), sum.end(), light.light.values().begin(),
                 [&](double value) { return static_cast<float>(even * value); });
  return light;
}

WallLight Workshop::light(const Fault& fault) const {
  const double width = seen_wall(lens_, fault).extent.width * (1.0 + fault.lamp);
  if (width == 0.0) return lit_by({{{0.0, 0.0}, 1.0}}, 0.0, fault);
  return lit_by(disc_points(width), kPointWidth * width, fault);
}

WallLight Workshop::light(const Fault& fault, const DrawnLamp& lamp) const {
  const double cell = lamp.width / lamp.light.columns();
  const double total = lamp.light.total();
  std::vector<LampPoint> points;
  for (int r = 0; r < lamp.light.rows(); ++r) {
    for (int c = 0; c < lamp.light.columns(); ++c) {
      const double light = lamp.light.at(c, r);
      if (light == 0.0) continue;
      points.push_back({cell * Eigen::Vector2d(c + 0.5 - 0.5 * lamp.light.columns(),
                                               0.5 * lamp.light.rows() - r - 0.5),
                        light / total});
    }
  }
  return lit_by(points, cell / std::sqrt(12.0), fault);
}

WallLight pinhole_light(const DrawnLamp& lamp, double distance, double diameter) {
  constexpr int kSide = 400;
  constexpr int kRings = 8;
  const double width = 2.0 * lamp.width * distance;
  WallLight wall{Image(kSide, kSide), {width, width}};
  const auto seen = [&](const Eigen::Vector2d& slope) {
    // The viewer has the lamp behind: its right is on the right, its top below.
    const Eigen::Vector2d share = slope / lamp.width;
    const double c = (share.x() + 0.5) * lamp.light.columns();
    const double r = (share.y() + 0.5) * lamp.light.rows();
    const int row = lamp.light.rows() - 1 - static_cast<int>(std::floor(r));
    const int column = static_cast<int>(std::floor(c));
    const bool beside =
        column < 0 || row < 0 || column >= lamp.light.columns() || row >= lamp.light.rows();
    return beside ? 0.0 : static_cast<double>(lamp.light.at(column, row));
  };
  for (int r = 0; r < kSide; ++r) {
    for (int c = 0; c < kSide; ++c) {
      const Eigen::Vector2d at(width * ((c + 0.5) / kSide - 0.5),
                               width * ((r + 0.5) / kSide - 0.5));
      double sum = 0.0;
      for (int k = 0; k < kRings * kRings; ++k) {
        const double radius = 0.5 * diameter * std::sqrt((k + 0.5) / (kRings * kRings));
        const double turn = 2.4 * k;  // The golden angle.
        sum += seen((at + radius * Eigen::Vector2d(std::cos(turn), std::sin(turn))) / distance);
      }
      wall.light.at(c, r) = static_cast<float>(sum / (kRings * kRings));
    }
  }
  return wall;
}

namespace {

/// What JPEG's quantisation of brightness leaves of 8-bit values (ITU T.81, annex K.1).
void compress(Image& values, int quality) {
  constexpr std::array<int, 64> kTable = {
      16, 11, 10, 16, 24,  40,  51,  61,  12, 12, 14, 19, 26,  58,  60,  55,
      14, 13, 16, 24, 40,  57,  69,  56,  14, 17, 22, 29, 51,  87,  80,  62,
      18, 22, 37, 56, 68,  109, 103, 77,  24, 35, 55, 64, 81,  104, 113, 92,
      49, 64, 78, 87, 103, 121, 120, 101, 72, 92, 95, 98, 112, 100, 103, 99};
  const double scale = quality < 50 ? 50.0 / quality : 2.0 - quality / 50.0;
  std::array<std::array<double, 8>, 8> basis{};
  for (std::size_t k = 0; k < 8; ++k) {
    for (std::size_t n = 0; n < 8; ++n) {
      basis[k][n] =
          (k == 0 ? std::sqrt(0.125) : 0.5) * std::cos(std::numbers::pi * static_cast<double>(k) *
                                                       (static_cast<double>(n) + 0.5) / 8.0);
    }
  }
  for (int r0 = 0; r0 + 8 <= values.rows(); r0 += 8) {
    for (int c0 = 0; c0 + 8 <= values.columns(); c0 += 8) {
      Eigen::Matrix<double, 8, 8> block;
      Eigen::Matrix<double, 8, 8> dct;
      for (int i = 0; i < 64; ++i) {
        block(i / 8, i % 8) = values.at(c0 + i % 8, r0 + i / 8) - 128.0;
        dct(i / 8, i % 8) = basis[static_cast<std::size_t>(i / 8)][static_cast<std::size_t>(i % 8)];
      }
      Eigen::Matrix<double, 8, 8> waves = dct * block * dct.transpose();
      for (int i = 0; i < 64; ++i) {
        const double step =
            std::max(1.0, std::floor(kTable[static_cast<std::size_t>(i)] * scale + 0.5));
        waves(i / 8, i % 8) = std::round(waves(i / 8, i % 8) / step) * step;
      }
      block = dct.transpose() * waves * dct;
      for (int i = 0; i < 64; ++i) {
        values.at(c0 + i % 8, r0 + i / 8) =
            static_cast<float>(std::clamp(std::round(block(i / 8, i % 8) + 128.0), 0.0, 255.0));
      }
    }
  }
}

/// Light of the wall, x to the right and y down from the picture's middle, mm; 0 beyond.
double light_at(const WallLight& wall, const Eigen::Vector2d& at) {
  const Eigen::Vector2d pixels(wall.light.columns(), wall.light.rows());
  const Eigen::Vector2d p =
      (at.cwiseQuotient(wall.size).array() + 0.5).matrix().cwiseProduct(pixels);
  if (p.minCoeff() < 0.0 || p.x() > pixels.x() || p.y() > pixels.y()) return 0.0;
  // Cubic convolution; the outermost pixels hold no light.
  const int c = std::clamp(static_cast<int>(p.x() - 0.5), 1, wall.light.columns() - 3);
  const int r = std::clamp(static_cast<int>(p.y() - 0.5), 1, wall.light.rows() - 3);
  const auto weights = [](double t) {
    return std::array<double, 4>{((-t + 2.0) * t - 1.0) * t / 2.0,
                                 ((3.0 * t - 5.0) * t * t + 2.0) / 2.0,
                                 ((-3.0 * t + 4.0) * t + 1.0) * t / 2.0, (t - 1.0) * t * t / 2.0};
  };
  const auto x = weights(p.x() - 0.5 - c);
  const auto y = weights(p.y() - 0.5 - r);
  double sum = 0.0;
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 4; ++i) {
      sum += x[static_cast<std::size_t>(i)] * y[static_cast<std::size_t>(j)] *
             wall.light.at(c + i - 1, r + j - 1);
    }
  }
  return std::max(sum, 0.0);
}

/// Light that the wall, or the last sheet there, reflects.
double reflectance_at(const WallLight& wall, const Eigen::Vector2d& at) {
  double share = 1.0;
  for (const WallLight::Sheet& sheet : wall.sheets) {
    const Eigen::Vector2d own = Eigen::Rotation2Dd(-sheet.turn) * (at - sheet.middle);
    const Eigen::Vector2d place = (own.cwiseQuotient(sheet.size).array() + 0.5).matrix();
    if (place.minCoeff() < 0.0 || place.maxCoeff() > 1.0) continue;
    const Eigen::Vector2d pixels(sheet.light.columns(), sheet.light.rows());
    share = bilinear(sheet.light, Eigen::Vector2d(place.cwiseProduct(pixels)));
  }
  return share;
}

/// A camera's rays: pixel → place on the wall.
class Pinhole {
 public:
  Pinhole(const Camera& camera, double width) : camera_(camera) {
    // The wall is the plane z = 0, the viewer at z < 0, y is down.
    const Eigen::Vector3d towards(std::sin(camera.yaw) * std::cos(camera.pitch),
                                  std::sin(camera.pitch),
                                  std::cos(camera.yaw) * std::cos(camera.pitch));
    from_ = -camera.away * width * towards;
    from_.head<2>() += width * camera.aim;
    const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(towards).normalized();
    const Eigen::Vector3d down = towards.cross(right);
    right_ = std::cos(camera.roll) * right + std::sin(camera.roll) * down;
    down_ = std::cos(camera.roll) * down - std::sin(camera.roll) * right;
    ahead_ = towards;
  }

  /// From the middle of the photograph, in its half widths.
  [[nodiscard]] Eigen::Vector2d wall(const Eigen::Vector2d& distorted) const {
    Eigen::Vector2d p = distorted;  // Brown: distorted = p (1 + k₁ r² + k₂ r⁴).
    for (int k = 0; k < 20; ++k) {
      const double r = p.squaredNorm();
      p = distorted / (1.0 + r * (camera_.k1 + r * camera_.k2));
    }
    const Eigen::Vector3d ray = ahead_ + 0.5 / camera_.focal * (p.x() * right_ + p.y() * down_);
    const Eigen::Vector3d hit = from_ - from_.z() / ray.z() * ray;
    return hit.head<2>();
  }

 private:
  Camera camera_;
  Eigen::Vector3d from_, right_, down_, ahead_;
};

}  // namespace

Image photograph(const WallLight& wall, const Eigen::Vector2d& picture, const Camera& camera,
                 bool lit) {
  constexpr int kParts = 4;
  const Pinhole pinhole(camera, picture.x());
  std::vector<float> sorted(wall.light.values().begin(), wall.light.values().end());
  std::sort(sorted.begin(), sorted.end());
  const double bright =
      sorted[static_cast<std::size_t>(0.995 * static_cast<double>(sorted.size()))];
  const double exposure = (decode(camera.white) - camera.ambient) / bright;
  std::mt19937_64 random(camera.seed);
  std::normal_distribution<double> normal;
  Image photo(camera.columns, camera.rows);
  const double half = 0.5 * camera.columns;
  const double corner = 1.0 + std::pow(1.0 * camera.rows / camera.columns, 2);
  for (int r = 0; r < camera.rows; ++r) {
    for (int c = 0; c < camera.columns; ++c) {
      double sum = 0.0;
      double reflected = 0.0;
      for (int k = 0; k < kParts * kParts; ++k) {
        const int across = k % kParts;
        const int down = k / kParts;
        const Eigen::Vector2d at(c + (across + 0.5) / kParts - half,
                                 r + (down + 0.5) / kParts - 0.5 * camera.rows);
        const Eigen::Vector2d place = pinhole.wall(at / half);
        const double share = reflectance_at(wall, place) / (kParts * kParts);
        reflected += share;
        if (lit) sum += share * light_at(wall, place);
      }
      const Eigen::Vector2d middle((c + 0.5) / half - 1.0, (r + 0.5 - 0.5 * camera.rows) / half);
      const double falloff = 1.0 - camera.vignetting * middle.squaredNorm() / corner;
      const double room = camera.ambient * (1.0 + camera.slope * middle.x()) * reflected;
      const double photons = camera.well * falloff * (exposure * sum + room);
      const double light = (photons + std::sqrt(photons + 25.0) * normal(random)) / camera.well;
      photo.at(c, r) = static_cast<float>(
          std::round(255.0 * std::clamp(encode(std::max(light, 0.0)), 0.0, 1.0)));
    }
  }
  if (camera.jpeg > 0) compress(photo, camera.jpeg);
  for (float& value : photo.values()) value = static_cast<float>(decode(value / 255.0));
  return photo;
}

WallLight::Sheet printed_chart(const std::filesystem::path& drawing, double bar,
                               const Eigen::Vector2d& middle, double turn) {
  constexpr int kPixels = 840;
  constexpr float kInk = 0.06F;
  constexpr float kPaper = 1.1F;
  Image light = draw_svg(drawing, kPixels).light;
  for (float& value : light.values()) value = kInk + (kPaper - kInk) * value;
  return {std::move(light), bar * Eigen::Vector2d(1.48, 2.1), middle, turn};
}

Camera any_camera(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> even(-1.0, 1.0);
  Camera camera;
  camera.seed = seed;
  camera.yaw = 30.0 * std::numbers::pi / 180.0 * even(random);
  camera.pitch = 15.0 * std::numbers::pi / 180.0 * even(random);
  camera.roll = 0.05 * even(random);
  camera.away = 2.2 + 0.2 * even(random);
  camera.k1 = 0.05 * even(random);
  camera.k2 = 0.01 * even(random);
  camera.vignetting = 0.15 + 0.15 * even(random);
  camera.white = 0.93 + 0.1 * even(random);
  camera.ambient = 0.02 + 0.02 * even(random);
  camera.slope = 0.3 * even(random);
  return camera;
}

}  // namespace lensforge::virtual_wall

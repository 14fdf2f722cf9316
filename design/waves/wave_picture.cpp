// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/waves/wave_picture.h"

#include <fftw3.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <mutex>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "core/error.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "core/optics/screen.h"
#include "core/spline/control_net.h"
#include "design/flux/flux_image.h"

// Notation: q a ray's place on the starting plane, W its optical path up to there, p its direction
// cosines along x and y, m = p / √(1 − |p|²) its slope; p0 and m0 those of the tile's mean ray.

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// FFTW plans one transform at a time.
std::mutex& planning() {
  static std::mutex mutex;
  return mutex;
}

fftw_complex* as_fftw(std::complex<double>* values) {
  // std::complex has the layout of two doubles ([complex.numbers.general]).
  return reinterpret_cast<fftw_complex*>(values);  // NOLINT(*-reinterpret-cast)
}

void transform(std::vector<std::complex<double>>& values, int columns, int rows, int sign) {
  fftw_complex* const data = as_fftw(values.data());
  fftw_plan plan = nullptr;
  {
    const std::lock_guard lock(planning());
    plan = fftw_plan_dft_2d(rows, columns, data, data, sign, FFTW_ESTIMATE);
  }
  fftw_execute(plan);
  const std::lock_guard lock(planning());
  fftw_destroy_plan(plan);
}

/// Square of the least cosine of a direction that goes on: a degree from the plane.
constexpr double kGrazing = 3e-4;

/// Vertices are moved to this part of a step, so that sides are found without rounding.
constexpr double kParts = 1024.0;

using Whole = Eigen::Matrix<std::int64_t, 2, 1>;

/// A triangle's side in whole numbers: ≥ 0 inside, and nodes on it belong to it if it is a lower
/// or a left one.
struct Side {
  std::int64_t a = 0, b = 0, c = 0;

  Side() = default;
  Side(const Whole& from, const Whole& to)
      : a(from.y() - to.y()), b(to.x() - from.x()), c(-(a * from.x() + b * from.y())) {
    if (!(a > 0 || (a == 0 && b > 0))) --c;
  }
  [[nodiscard]] std::int64_t at(const Whole& p) const { return a * p.x() + b * p.y() + c; }
};

/// A triangle of rays on the nodes of a field.
class LaidTriangle {
 public:
  LaidTriangle(const FieldPlan& plan, const std::array<PlaneField::Vertex, 3>& vertices)
      : plan_(plan), vertices_(vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      at_[k] = (vertices[k].place - plan.centre).cwiseQuotient(plan.step) + plan.middle();
      whole_[k] = (kParts * at_[k]).array().round().matrix().cast<std::int64_t>();
    }
    const Whole u = whole_[1] - whole_[0];
    const Whole v = whole_[2] - whole_[0];
    doubled_ = u.x() * v.y() - u.y() * v.x();
    if (doubled_ < 0) {
      std::swap(vertices_[1], vertices_[2]);
      std::swap(at_[1], at_[2]);
      std::swap(whole_[1], whole_[2]);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      sides_[k] = Side(whole_[(k + 1) % 3], whole_[(k + 2) % 3]);
    }
  }

  [[nodiscard]] bool is_empty() const { return doubled_ == 0; }
  /// Its box along an axis, in parts of a step.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range(int axis) const {
    return std::minmax({whole_[0][axis], whole_[1][axis], whole_[2][axis]});
  }
  [[nodiscard]] bool contains(const Whole& p) const {
    return sides_[0].at(p) >= 0 && sides_[1].at(p) >= 0 && sides_[2].at(p) >= 0;
  }

  /// The field at a node, inside or near it.
  [[nodiscard]] std::complex<double> field(std::int64_t column, std::int64_t row) const {
    constexpr auto kWholeParts = static_cast<std::int64_t>(kParts);
    const Eigen::Vector2d node(static_cast<double>(column), static_cast<double>(row));
    double path = 0.0;
    double amplitude = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      // Linear interpolation errs by as much to one side as the mean of the vertices' tangent
      // planes does to the other.
      const double share =
          static_cast<double>(sides_[k].at({column * kWholeParts, row * kWholeParts})) /
          static_cast<double>(std::abs(doubled_));
      const Eigen::Vector2d away = (node - at_[k]).cwiseProduct(plan_.step);
      path += share * (vertices_[k].path + 0.5 * vertices_[k].cosine.dot(away));
      amplitude += share * vertices_[k].amplitude;
    }
    const Eigen::Vector2d from_centre = (node - plan_.middle()).cwiseProduct(plan_.step);
    const double beyond_fold = doubled_ < 0 ? 0.5 * std::numbers::pi : 0.0;
    const double phase =
        kTwoPi / plan_.wavelength * (path - plan_.cosine.dot(from_centre)) - beyond_fold;
    return std::polar(std::max(amplitude, 0.0), phase);
  }

 private:
  const FieldPlan& plan_;
  std::array<PlaneField::Vertex, 3> vertices_;  ///< Counter-clockwise.
  std::array<Eigen::Vector2d, 3> at_;           ///< In steps from the first node.
  std::array<Whole, 3> whole_;                  ///< In parts of steps.
  std::array<Side, 3> sides_;                   ///< Opposite to the vertices.
  std::int64_t doubled_ = 0;                    ///< Twice the area; < 0 if it is turned over.
};

}  // namespace

int transform_size(double least) {
  for (int size = 2 * static_cast<int>(std::ceil(0.5 * std::max(least, 8.0)));; size += 2) {
    int rest = size;
    for (const int factor : {2, 3, 5, 7}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return size;
  }
}

PlaneField::PlaneField(const FieldPlan& plan)
    : plan_(plan),
      values_(static_cast<std::size_t>(plan.columns) * static_cast<std::size_t>(plan.rows)) {}

void PlaneField::add(const std::array<Vertex, 3>& vertices) {
  const LaidTriangle triangle(plan_, vertices);
  if (triangle.is_empty()) return;
  // Point n of an axis lies at apart · n + first, in parts of a step.
  constexpr auto kWholeParts = static_cast<std::int64_t>(kParts);
  const Whole apart(kWholeParts / plan_.points.x(), kWholeParts / plan_.points.y());
  const Whole first = (apart.array() - kWholeParts) / 2;
  const auto points = [&](int axis, int count) {
    const auto [low, high] = triangle.range(axis);
    const std::int64_t last = std::int64_t{count} * plan_.points[axis] - 1;
    const auto point = [&](std::int64_t place) { return (place - first[axis]) / apart[axis]; };
    return std::pair(std::clamp<std::int64_t>(point(low), 0, last),
                     std::clamp<std::int64_t>(point(high), -1, last));
  };
  const auto columns = points(0, plan_.columns);
  const auto rows = points(1, plan_.rows);
  const double weight = 1.0 / plan_.points.prod();
  for (std::int64_t j = rows.first; j <= rows.second; ++j) {
    for (std::int64_t i = columns.first; i <= columns.second; ++i) {
      if (!triangle.contains({apart.x() * i + first.x(), apart.y() * j + first.y()})) continue;
      const std::int64_t column = i / plan_.points.x();
      const std::int64_t row = j / plan_.points.y();
      at(static_cast<int>(column), static_cast<int>(row)) += weight * triangle.field(column, row);
    }
  }
}

/// A component of the spectrum with the direction p turns by k D √(1 − |p|²), without what the mean
/// ray's turns by and without the shift of the nodes to far_centre().
void PlaneField::propagate() {
  transform(values_, plan_.columns, plan_.rows, FFTW_FORWARD);
  const double wave_number = kTwoPi / plan_.wavelength;
  const Eigen::Vector2d slope = plan_.slope();
  const double root = std::sqrt(1.0 - plan_.cosine.squaredNorm());
  const auto direction = [&](int n, int count, int axis) {
    const int frequency = n < (count + 1) / 2 ? n : n - count;
    return plan_.wavelength * frequency / (count * plan_.step[axis]);
  };
  const double scale = 1.0 / static_cast<double>(values_.size());
  for (int j = 0; j < plan_.rows; ++j) {
    const double q_y = direction(j, plan_.rows, 1);
    for (int i = 0; i < plan_.columns; ++i) {
      const Eigen::Vector2d more(direction(i, plan_.columns, 0), q_y);
      const double square = 1.0 - (plan_.cosine + more).squaredNorm();
      std::complex<double>& value = at(i, j);
      const double far = plan_.distance / std::sqrt(std::max(square, kGrazing));
      const Eigen::Vector2d aside = far * (plan_.cosine + more) - plan_.distance * slope;
      if (square <= kGrazing || (aside.cwiseAbs().array() > plan_.reach.array()).any()) {
        value = 0.0;
        continue;
      }
      // √s − √s0 without cancellation.
      const double longer = (square - root * root) / (std::sqrt(square) + root);
      value *= std::polar(scale, wave_number * plan_.distance * (longer + slope.dot(more)));
    }
  }
  transform(values_, plan_.columns, plan_.rows, FFTW_BACKWARD);
}

PixelLight PlaneField::spread(const Eigen::Vector2d& centre, const Eigen::Matrix2d& by_mm,
                              const Eigen::Vector2i& pixels) const {
  const Eigen::Matrix2d by_node = by_mm * plan_.step.asDiagonal();
  const Eigen::Vector2d cell = by_node.cwiseAbs().rowwise().sum();
  const Eigen::Vector2d half =
      0.5 * by_node.cwiseAbs() * Eigen::Vector2d(plan_.columns, plan_.rows) + cell;
  PixelLight result;
  const Eigen::Vector2i low = (centre - half).array().floor().cast<int>().max(0);
  const Eigen::Vector2i high = (centre + half).array().ceil().cast<int>().min(pixels.array());
  if (low.x() >= high.x() || low.y() >= high.y()) return result;
  result.first = low;
  result.columns = high.x() - low.x();
  result.rows = high.y() - low.y();
  result.light.assign(
      static_cast<std::size_t>(result.columns) * static_cast<std::size_t>(result.rows), 0.0);
  const double area = plan_.step.prod();
  /// Pixels that a cell touches along one axis, and its share in each.
  const auto touched = [&](int axis, double at, const auto& take) {
    const double from = at - 0.5 * cell[axis];
    const double to = at + 0.5 * cell[axis];
    for (int pixel = std::max(low[axis], static_cast<int>(std::floor(from)));
         pixel < high[axis] && pixel < to; ++pixel) {
      const double share = (std::min(to, pixel + 1.0) - std::max(from, double(pixel))) / cell[axis];
      if (share > 0.0) take(pixel - low[axis], share);
    }
  };
  for (int j = 0; j < plan_.rows; ++j) {
    for (int i = 0; i < plan_.columns; ++i) {
      const double light = std::norm(at(i, j)) * area;
      if (light == 0.0) continue;
      const Eigen::Vector2d place = centre + by_node * (Eigen::Vector2d(i, j) - plan_.middle());
      touched(1, place.y(), [&](int row, double of_row) {
        touched(0, place.x(), [&](int column, double of_column) {
          result.light[static_cast<std::size_t>(row) * static_cast<std::size_t>(result.columns) +
                       static_cast<std::size_t>(column)] += light * of_row * of_column;
        });
      });
    }
  }
  return result;
}

namespace {

/// Fields are sampled this much finer than the steepest ray asks for.
constexpr double kFiner = 1.15;

/// Room around the light of a tile, in √(λ f): what a window's edge scatters farther is lost.
constexpr double kRoom = 8.0;

/// Directions beyond those of the rays, in √(λ / f); more where the lens's rim cuts the light off.
/// With 4 everywhere a lens of 48² pixels is 5e-4 off (MAE), with 11 at the rim 1e-4.
constexpr double kSpread = 4.0;
constexpr double kEdgeSpread = 11.0;

/// Points across a node's cell at a hard edge.
constexpr int kEdgePoints = 8;

/// Larger fields are not made: what is steepest in them goes as rays if it is little, or if
/// quarters of the tile would overlap too little; else the tile is divided.
constexpr double kMostNodes = 4e6;
constexpr double kLittle = 0.02;    ///< Share of a tile's light.
constexpr double kLeastRamp = 1.0;  ///< In √(λ f).

/// From this share of the steepest direction kept on, waves fade into rays.
constexpr double kFade = 0.8;

/// Tiles whose light is held at the same time.
constexpr std::int64_t kBatch = 16;

/// A stretch of one axis with a window that rises at its begin and falls at its end.
struct Stretch {
  double begin, end;  ///< mm
  double rise, fall;  ///< Widths of the ramps, mm; 0 at the lens's rim.

  [[nodiscard]] double length() const { return end - begin; }
  /// Squares of neighbours' windows sum to 1.
  [[nodiscard]] double window(double at) const {
    constexpr double kQuarter = 0.5 * std::numbers::pi;
    double value = 1.0;
    if (rise > 0.0 && at < begin + rise) value *= std::sin(kQuarter * (at - begin) / rise);
    if (fall > 0.0 && at > end - fall) value *= std::sin(kQuarter * (end - at) / fall);
    return value;
  }
  /// Width of the ramps between its halves, mm.
  [[nodiscard]] double middle_ramp() const {
    const double middle = 0.5 * (begin + end);
    return 0.5 * std::min(middle - begin - rise, end - fall - middle);
  }
  /// Both halves; their windows' squares sum to that of the whole. @pre middle_ramp() > 0.
  [[nodiscard]] std::array<Stretch, 2> halves() const {
    const double middle = 0.5 * (begin + end);
    const double ramp = middle_ramp();
    return {Stretch{begin, middle + 0.5 * ramp, rise, ramp},
            Stretch{middle - 0.5 * ramp, end, ramp, fall}};
  }
};

/// @param tile, overlap  mm; 0: one stretch.
std::vector<Stretch> stretches(double length, double tile, double overlap) {
  const double count = tile > 0.0 ? std::max(1.0, std::round(length / tile)) : 1.0;
  const double ramp = std::min(overlap, length / count);
  std::vector<Stretch> all;
  for (double k = 0.0; k < count; k += 1.0) {
    Stretch one{length * k / count, length * (k + 1.0) / count, 0.0, 0.0};
    if (k > 0.0) {
      one.begin -= 0.5 * ramp;
      one.rise = ramp;
    }
    if (k + 1.0 < count) {
      one.end += 0.5 * ramp;
      one.fall = ramp;
    }
    all.push_back(one);
  }
  return all;
}

struct Tile {
  Stretch x, y;
};

/// Optical path from the lamp to points of the surface, but for a constant of parallel light, mm.
class LampPath {
 public:
  explicit LampPath(const OpticalSetup& setup)
      : index_(traits(setup.body).transmits ? setup.ior : 1.0), place_(lamp_place(setup.lamp)) {
    const auto* const parallel = std::get_if<ParallelLight>(&setup.lamp);
    if (parallel == nullptr) return;
    before_ = parallel->direction;
    inside_ = before_;
    if (index_ == 1.0) return;
    inside_.head<2>() /= index_;
    inside_.z() = std::sqrt(1.0 - inside_.head<2>().squaredNorm());
  }

  /// @param ray  to the point; null for parallel light that enters through a plane.
  [[nodiscard]] double to(const Eigen::Vector3d& p, const IncidentRay* ray) const {
    if (ray == nullptr) return index_ * inside_.dot(p);
    const Eigen::Vector3d entry = ray->entry();
    const double before = place_ ? (entry - *place_).norm() : before_.dot(entry);
    return before + index_ * (p - entry).norm();
  }

 private:
  double index_;
  std::optional<Eigen::Vector3d> place_;
  Eigen::Vector3d before_ = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d inside_ = Eigen::Vector3d::UnitZ();  ///< Behind a flat front.
};

/// Common inputs of the tiles.
struct WaveScene {
  const OpticalSetup& setup;  ///< With pixels as the source's blur requires.
  const WaveSurface& surface;
  const WaveOptions& options;
  const RunControl& control;
  LightPath light;
  std::optional<OutlineIndex> edge;  ///< Of a lens with an outline.
};

/// One tile's way from the surface to the screen.
class WaveTile {
 public:
  WaveTile(const WaveScene& scene, const Tile& tile)
      : light_(scene.light),
        path_(scene.setup),
        screen_(scene.setup),
        options_(scene.options),
        edge_(scene.edge ? &*scene.edge : nullptr),
        tile_(tile) {
    trace(scene.surface);
  }

  /// True if no light leaves.
  [[nodiscard]] bool is_dark() const { return whole_ <= 0.0; }
  /// True if its quarters would show it better.
  [[nodiscard]] bool should_be_divided() const {
    const double least = kLeastRamp * std::sqrt(options_.wavelength * plan_.distance);
    return as_rays_ > kLittle * whole_ &&
           std::min(tile_.x.middle_ramp(), tile_.y.middle_ramp()) > least;
  }

  [[nodiscard]] PixelLight light() const {
    PlaneField field(plan_);
    lay(field);
    field.propagate();
    PixelLight light = on_pixels(field);
    if (as_rays_ > 0.0) add_rays(light);
    return light;
  }

 private:
  /// A ray where it leaves the surface.
  struct Node {
    bool lit = false;
    Eigen::Vector2d q;       ///< mm
    Eigen::Vector2d cosine;  ///< p
    Eigen::Vector2d slope;   ///< m
    double path = 0.0;       ///< W, mm
    double window = 0.0;
  };

  void trace(const WaveSurface& surface) {
    const double apart = 0.25 * options_.detail;
    const auto count = [&](double length) {
      return std::max(4, static_cast<int>(std::ceil(length / apart)));
    };
    grid_ = {
        {tile_.x.begin, tile_.y.begin},
        {tile_.x.length() / count(tile_.x.length()), tile_.y.length() / count(tile_.y.length())},
        count(tile_.x.length()) + 1,
        count(tile_.y.length()) + 1};
    WaveSamples samples;
    surface(grid_, samples);
    double sum = 0.0;
    for (const double z : samples.z) sum += z;
    const double level = sum / static_cast<double>(samples.z.size());
    nodes_.resize(samples.z.size());
    corners_.resize(samples.z.size());
    for (int j = 0; j < grid_.rows; ++j) {
      for (int i = 0; i < grid_.columns; ++i) trace_node(i, j, samples, level);
    }
    weigh_triangles();
    if (!is_dark()) make_plan(level);
  }

  void trace_node(int i, int j, const WaveSamples& samples, double level) {
    const std::size_t k = index({i, j});
    const Eigen::Vector2d xy = grid_.place(i, j);
    const Eigen::Vector3d p(xy.x(), xy.y(), samples.z[k]);
    const Eigen::Vector3d n =
        Eigen::Vector3d(-samples.slope_x[k], -samples.slope_y[k], 1.0).normalized();
    std::optional<IncidentRay> ray;
    if (light_.varies()) ray = light_.ray_to(p);
    const IncidentRay* const known = ray ? &*ray : nullptr;
    corners_[k] = p;
    Node& node = nodes_[k];
    node.lit = light_.transmits(p, n, known);
    if (!node.lit) return;
    node.slope = light_.beam(p, n, known).m;
    const double secant = std::sqrt(1.0 + node.slope.squaredNorm());
    node.cosine = node.slope / secant;
    node.q = xy + (level - p.z()) * node.slope;
    node.path = path_.to(p, known) + (level - p.z()) * secant;
    // An outline's edge fades over one step of the rays, far below √(λ f).
    const bool in = edge_ == nullptr || edge_->contains(xy);
    node.window = in ? tile_.x.window(xy.x()) * tile_.y.window(xy.y()) : 0.0;
  }

  /// A triangle of nodes.
  using Corner = std::array<int, 2>;
  using Three = std::array<Corner, 3>;

  template <class Action>
  void for_each_triangle(const Action& action) const {
    for (int j = 0; j + 1 < grid_.rows; ++j) {
      for (int i = 0; i + 1 < grid_.columns; ++i) {
        action(Three{Corner{i, j}, Corner{i + 1, j}, Corner{i + 1, j + 1}});
        action(Three{Corner{i, j}, Corner{i + 1, j + 1}, Corner{i, j + 1}});
      }
    }
  }

  [[nodiscard]] std::size_t index(const Corner& c) const {
    return static_cast<std::size_t>(c[1]) * static_cast<std::size_t>(grid_.columns) +
           static_cast<std::size_t>(c[0]);
  }
  [[nodiscard]] bool is_lit(const Three& t) const {
    return nodes_[index(t[0])].lit && nodes_[index(t[1])].lit && nodes_[index(t[2])].lit;
  }
  /// Twice the area on the starting plane, negative beyond a fold, mm².
  [[nodiscard]] double doubled_area(const Three& t) const {
    const Eigen::Vector2d& a = nodes_[index(t[0])].q;
    return cross(nodes_[index(t[1])].q - a, nodes_[index(t[2])].q - a);
  }

  /// Amplitudes at the nodes, from the light and the area of the triangles around them; the
  /// tile's mean ray and all its light.
  void weigh_triangles() {
    amplitude_.assign(nodes_.size(), 0.0);
    std::vector<double> area(nodes_.size(), 0.0);
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for_each_triangle([&](const Three& t) {
      if (!is_lit(t)) return;
      const Corners corners{corners_[index(t[0])], corners_[index(t[1])], corners_[index(t[2])]};
      const double flux = flux_of(corners);
      const double on_plane = 0.5 * std::abs(doubled_area(t));
      double windows = 0.0;
      for (const Corner& c : t) {
        const Node& node = nodes_[index(c)];
        amplitude_[index(c)] += flux;
        area[index(c)] += on_plane;
        windows += node.window * node.window / 3.0;
        mean += flux * node.window * node.window / 3.0 * node.cosine;
      }
      whole_ += flux * windows;
    });
    if (is_dark()) return;
    mean_ = mean / whole_;
    for (std::size_t k = 0; k < amplitude_.size(); ++k) {
      // At a caustic of the starting plane itself the area vanishes, but not the light around it.
      const double least = 1e-3 * grid_.step.prod();
      amplitude_[k] = area[k] > 0.0 ? std::sqrt(amplitude_[k] / std::max(area[k], least)) : 0.0;
    }
  }

  [[nodiscard]] double flux_of(const Corners& t) const {
    if (!light_.varies()) return light_.flux(t);
    const IncidentRay a = light_.ray_to(t.v0);
    const IncidentRay b = light_.ray_to(t.v1);
    const IncidentRay c = light_.ray_to(t.v2);
    return light_.flux(t, {&a, &b, &c});
  }

  /// Share of a node's light that goes as a wave.
  [[nodiscard]] double as_wave(const Node& node) const {
    const Eigen::Vector2d off = (node.cosine - mean_).cwiseAbs().cwiseQuotient(steepest_);
    const double share = (1.0 - off.maxCoeff()) / (1.0 - kFade);
    if (!limited_ || share >= 1.0) return 1.0;
    return share <= 0.0 ? 0.0 : share * share * (3.0 - 2.0 * share);
  }

  /// Light of the triangles that goes as rays.
  template <class Action>
  void for_each_ray(const Action& action) const {
    for_each_triangle([&](const Three& t) {
      if (!is_lit(t)) return;
      double share = 0.0;
      for (const Corner& c : t) {
        const Node& node = nodes_[index(c)];
        share += node.window * node.window * (1.0 - as_wave(node)) / 3.0;
      }
      if (share <= 0.0) return;
      const Corners corners{corners_[index(t[0])], corners_[index(t[1])], corners_[index(t[2])]};
      action(t, share * flux_of(corners));
    });
  }

  void add_rays(PixelLight& light) const {
    for_each_ray([&](const Three& t, double flux) {
      std::array<Eigen::Vector2d, 3> places;
      for (std::size_t k = 0; k < 3; ++k) {
        places[k] = light_.land(corners_[index(t[k])], nodes_[index(t[k])].slope);
      }
      add_ray(places, flux, light);
    });
  }

  /// Divides a triangle on the picture until it is smaller than half a pixel.
  void add_ray(const std::array<Eigen::Vector2d, 3>& t, double flux, PixelLight& light) const {
    const Eigen::Vector2d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]);
    const Eigen::Vector2d high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    const Eigen::Vector2i pixels(screen_.plane().columns(), screen_.plane().rows());
    if ((high.array() <= 0.0).any() || (low.array() >= pixels.cast<double>().array()).any()) return;
    if ((high - low).maxCoeff() > 0.5) {
      const std::array<Eigen::Vector2d, 3> m{0.5 * (t[0] + t[1]), 0.5 * (t[1] + t[2]),
                                             0.5 * (t[2] + t[0])};
      add_ray({t[0], m[0], m[2]}, 0.25 * flux, light);
      add_ray({m[0], t[1], m[1]}, 0.25 * flux, light);
      add_ray({m[2], m[1], t[2]}, 0.25 * flux, light);
      add_ray(m, 0.25 * flux, light);
      return;
    }
    const Eigen::Vector2i at = ((t[0] + t[1] + t[2]) / 3.0).array().floor().cast<int>();
    if ((at.array() < 0).any() || (at.array() >= pixels.array()).any()) return;
    light.rays.emplace_back(at.y() * pixels.x() + at.x(), flux);
  }

  /// Size of the field: as wide as the light on the starting plane and as that on the screen, each
  /// around the mean ray.
  void make_plan(double level) {
    const Eigen::Vector2d slope = mean_ / std::sqrt(1.0 - mean_.squaredNorm());
    Eigen::AlignedBox2d start;
    for (const Node& node : nodes_) {
      if (node.lit) start.extend(node.q);
    }
    const Eigen::Vector2d centre = start.center();
    const Eigen::Vector2d landing = light_.land({centre.x(), centre.y(), level}, slope);
    far_level_ = screen_.at(landing).z();
    const double distance = far_level_ - level;
    const double unit = std::sqrt(options_.wavelength / distance);
    const auto spread_of = [&](const Stretch& axis) {
      return std::max((is_cut(axis) ? kEdgeSpread : kSpread) * unit, options_.scatter);
    };
    spread_ = {spread_of(tile_.x), spread_of(tile_.y)};
    plan_.wavelength = options_.wavelength;
    plan_.distance = distance;
    plan_.centre = centre;
    plan_.cosine = mean_;
    plan_.points = {is_cut(tile_.x) ? kEdgePoints : 1, is_cut(tile_.y) ? kEdgePoints : 1};
    steepest_.setConstant(1e-9);
    for (const Node& node : nodes_) {
      if (node.lit) steepest_ = steepest_.cwiseMax((node.cosine - mean_).cwiseAbs());
    }
    plan_nodes(start);
    // Below the spread of the waves, giving up more rays would save little.
    while (nodes() > kMostNodes && options_.tile > 0.0 &&
           (steepest_.array() > spread_.array()).any()) {
      limited_ = true;
      steepest_ *= 0.9;
      plan_nodes(start);
    }
    if (limited_) for_each_ray([&](const Three&, double flux) { as_rays_ += flux; });
  }

  [[nodiscard]] double nodes() const {
    return static_cast<double>(plan_.columns) * static_cast<double>(plan_.rows);
  }

  /// @param start  box of the light on the starting plane.
  void plan_nodes(const Eigen::AlignedBox2d& start) {
    Eigen::AlignedBox2d beyond;  // On the screen, seen from the mean ray.
    const Eigen::Vector2d slope = plan_.slope();
    for (const Node& node : nodes_) {
      if (!node.lit || as_wave(node) <= 0.0) continue;
      beyond.extend(node.q - plan_.centre + plan_.distance * (node.slope - slope));
    }
    const double unit = std::sqrt(options_.wavelength / plan_.distance);
    const Eigen::Vector2d room =
        (2.0 * plan_.distance * spread_).cwiseMax(kRoom * unit * plan_.distance);
    const Eigen::Vector2d farthest = beyond.min().cwiseAbs().cwiseMax(beyond.max().cwiseAbs());
    const Eigen::Vector2d size = 2.0 * (0.5 * start.sizes()).cwiseMax(farthest) + room;
    plan_.step = options_.wavelength / (2.0 * kFiner) * (steepest_ + spread_).cwiseInverse();
    plan_.reach = farthest + 0.5 * start.sizes() + room;
    plan_.columns = transform_size(size.x() / plan_.step.x());
    plan_.rows = transform_size(size.y() / plan_.step.y());
  }

  /// True if it ends at the lens's rim, where no window fades the light.
  static bool is_cut(const Stretch& axis) { return axis.rise == 0.0 || axis.fall == 0.0; }

  /// Lays the field of every triangle on the starting plane.
  void lay(PlaneField& field) const {
    const double reference = nodes_[index({grid_.columns / 2, grid_.rows / 2})].path;
    for_each_triangle([&](const Three& t) {
      if (!is_lit(t)) return;
      std::array<PlaneField::Vertex, 3> vertices;
      for (std::size_t k = 0; k < 3; ++k) {
        const Node& node = nodes_[index(t[k])];
        vertices[k] = {node.q, node.cosine, node.path - reference,
                       amplitude_[index(t[k])] * node.window * std::sqrt(as_wave(node))};
      }
      field.add(vertices);
    });
  }

  /// Light that reaches the pixels: each node's is spread over its cell, along the mean ray.
  [[nodiscard]] PixelLight on_pixels(const PlaneField& field) const {
    const Eigen::Vector2d slope = plan_.slope();
    const auto land = [&](const Eigen::Vector2d& xy) {
      return light_.land({xy.x(), xy.y(), far_level_}, slope);
    };
    const Eigen::Vector2d centre = plan_.far_centre();
    const Eigen::Vector2d at = land(centre);
    Eigen::Matrix2d by_mm;
    by_mm << land(centre + Eigen::Vector2d::UnitX()) - at,
        land(centre + Eigen::Vector2d::UnitY()) - at;
    PixelLight light = field.spread(at, by_mm, {screen_.plane().columns(), screen_.plane().rows()});
    light.whole = whole_;
    return light;
  }

  const LightPath& light_;
  LampPath path_;
  Screen screen_;
  const WaveOptions& options_;
  const OutlineIndex* edge_;
  Tile tile_;
  WaveGrid grid_;
  std::vector<Node> nodes_;
  std::vector<Eigen::Vector3d> corners_;
  std::vector<double> amplitude_;
  Eigen::Vector2d mean_{0.0, 0.0};
  double whole_ = 0.0;
  Eigen::Vector2d steepest_{0.0, 0.0};  ///< Directions from the mean that go as waves.
  Eigen::Vector2d spread_{0.0, 0.0};    ///< Directions to which they are scattered besides.
  bool limited_ = false;                ///< Steeper ones go as rays.
  double as_rays_ = 0.0;                ///< Their light.
  double far_level_ = 0.0;              ///< z of the plane on which the field ends, mm.
  FieldPlan plan_;
};

/// A tile's light, of its quarters if its field would be too large.
void add_light(const WaveScene& scene, const Tile& tile, std::vector<PixelLight>& parts) {
  if (scene.control.stop_requested()) return;
  const WaveTile whole(scene, tile);
  if (whole.is_dark()) return;
  if (!whole.should_be_divided()) {
    parts.push_back(whole.light());
    return;
  }
  for (const Stretch& y : tile.y.halves()) {
    for (const Stretch& x : tile.x.halves()) {
      add_light(scene, {x, y}, parts);
    }
  }
}

void add_to(const PixelLight& part, const Eigen::Vector2i& pixels, std::vector<double>& flux) {
  for (const auto& [pixel, light] : part.rays) flux[static_cast<std::size_t>(pixel)] += light;
  for (int row = 0; row < part.rows; ++row) {
    for (int column = 0; column < part.columns; ++column) {
      const int to = (part.first.y() + row) * pixels.x() + part.first.x() + column;
      flux[static_cast<std::size_t>(to)] +=
          part.light[static_cast<std::size_t>(row) * static_cast<std::size_t>(part.columns) +
                     static_cast<std::size_t>(column)];
    }
  }
}

/// Light of a lamp's middle.
std::vector<double> light_of_point(const WaveScene& scene, const std::vector<Tile>& tiles,
                                   const Executor& executor) {
  const RunControl& control = scene.control;
  const Eigen::Vector2i& pixels = scene.setup.pixels;
  std::vector<double> flux(static_cast<std::size_t>(pixels.prod()), 0.0);
  double whole = 0.0;
  const auto count = static_cast<std::int64_t>(tiles.size());
  for (std::int64_t first = 0; first < count; first += kBatch) {
    if (control.stop_requested()) throw Interrupted();
    const std::int64_t size = std::min(kBatch, count - first);
    std::vector<std::vector<PixelLight>> lights(static_cast<std::size_t>(size));
    const auto work = [&](std::int64_t k) {
      add_light(scene, tiles[static_cast<std::size_t>(first + k)],
                lights[static_cast<std::size_t>(k)]);
    };
    parallel_for(executor, "waves", size, work, 1);
    for (const std::vector<PixelLight>& parts : lights) {
      for (const PixelLight& part : parts) {
        add_to(part, pixels, flux);
        whole += part.whole;
      }
    }
    control.report(
        {"waves", static_cast<double>(first + size), static_cast<double>(count), "tiles"});
  }
  if (control.stop_requested()) throw Interrupted();
  // What a lens takes in depends on its surface, but for light along z.
  if (scene.light.intake_is_plan_area() || whole == 0.0) return flux;
  for (double& value : flux) value /= whole;
  return flux;
}

/// Height of a surface in the middle of its lens, mm.
double middle_height(const OpticalSetup& setup, const WaveSurface& surface) {
  WaveSamples middle;
  surface({0.5 * setup.lens_size, {1.0, 1.0}, 1, 1}, middle);
  return middle.z.front();
}

/// Distance on the lens up to which waves interfere in a pixel's mean, λ f / pixel, and at least
/// √(λ f), to which diffraction reaches, mm.
double coherence_length(const OpticalSetup& setup, double height, double wavelength) {
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), height);
  const double spot = wavelength * LightPath(setup).clearance(middle);
  const double pixel = setup.image_size.cwiseQuotient(setup.pixels.cast<double>()).minCoeff();
  return std::max(std::sqrt(spot), spot / pixel);
}

}  // namespace

std::vector<double> wave_flux(const OpticalSetup& setup, const WaveSurface& surface,
                              const WaveOptions& options, const Executor& executor,
                              const RunControl& control) {
  const double height = middle_height(setup, surface);
  const SourceKernel kernel = source_kernel(setup, height);
  OpticalSetup in_parts = setup;
  in_parts.pixels *= kernel.parts;
  WaveScene scene{in_parts, surface, options, control, LightPath(in_parts), {}};
  if (setup.outline) scene.edge.emplace(*setup.outline);
  const double length = coherence_length(setup, height, options.wavelength);
  const auto along = [&](int axis) {
    return stretches(setup.lens_size[axis], options.tile * length, options.overlap * length);
  };
  std::vector<Tile> tiles;
  for (const Stretch& y : along(1)) {
    for (const Stretch& x : along(0)) tiles.push_back({x, y});
  }
  const std::vector<double> parts = light_of_point(scene, tiles, executor);
  SourceBlurOn<Executor> blur(kernel, setup.pixels.x(), setup.pixels.y(), executor);
  const std::span<const double> flux = blur.apply(executor, parts);
  return {flux.begin(), flux.end()};
}

namespace {

/// Follows a spline row by row: each search begins where the last one ended.
void sample_spline(const ControlNet& net, const WaveGrid& grid, WaveSamples& samples) {
  const Eigen::Vector2d cells = net.cells().cast<double>();
  const Eigen::Vector2d size(net.points.row(0).maxCoeff(), net.points.row(1).maxCoeff());
  Eigen::Vector2d first = grid.origin.cwiseQuotient(size).cwiseProduct(cells);
  for (int j = 0; j < grid.rows; ++j) {
    first = net.parameters_of(grid.place(0, j), first);
    Eigen::Vector2d uv = first;
    for (int i = 0; i < grid.columns; ++i) {
      uv = net.parameters_of(grid.place(i, j), uv);
      const SurfaceShape shape = net.at(uv).shape();
      samples.z.push_back(shape.z);
      samples.slope_x.push_back(shape.slope.x());
      samples.slope_y.push_back(shape.slope.y());
    }
  }
}

}  // namespace

WaveSurface wave_surface(const OpticalSurface& surface) {
  const auto* const spline = dynamic_cast<const SplineSurface*>(&surface);
  return [&surface, spline](const WaveGrid& grid, WaveSamples& samples) {
    samples = {};
    if (spline != nullptr) return sample_spline(spline->net(), grid, samples);
    for (int j = 0; j < grid.rows; ++j) {
      for (int i = 0; i < grid.columns; ++i) {
        const auto point = surface.at(nearest_inside(surface.box(), grid.place(i, j)));
        samples.z.push_back(point ? point->z : 0.0);
        samples.slope_x.push_back(point ? point->slope.x() : 0.0);
        samples.slope_y.push_back(point ? point->slope.y() : 0.0);
      }
    }
  };
}

double wave_detail(const OpticalSurface& surface) {
  const auto* const spline = dynamic_cast<const SplineSurface*>(&surface);
  const double pieces = spline != nullptr
                            ? static_cast<double>(spline->net().cell_count())
                            : 0.5 * static_cast<double>(surface.mesh().triangle_count());
  return std::sqrt(surface.box().volume() / pieces);
}

}  // namespace lensforge

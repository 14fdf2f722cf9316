// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/waves/wave_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
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
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/flux/flux_image.h"

// Notation: q a ray's place on the starting plane, W its optical path up to there, p its direction
// cosines along x and y, m = p / √(1 − |p|²) its slope; p0 and m0 those of the tile's mean ray.

namespace lensforge {
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
/// quarters of the tile would overlap too little; else the tile is divided. A steep 128² portrait
/// is 0.0009 (MAE) from its picture with fields of 4e7 nodes and a spread of 11 everywhere, in two
/// thirds of the time; with 4e6 nodes and 2 % it is 0.002 off, with 1.6e7 0.0005.
constexpr double kMostNodes = 8e6;
constexpr double kLittle = 0.005;   ///< Share of a tile's light.
constexpr double kLeastRamp = 1.0;  ///< In √(λ f).

/// From this share of the steepest direction kept on, waves fade into rays.
constexpr double kFade = 0.8;

/// Tiles whose light is held at the same time.
constexpr std::int64_t kBatch = 16;

/// A stretch of one axis of the grid, in cells, with a window that rises at its begin and falls at
/// its end.
struct Stretch {
  std::int64_t begin, end;
  std::int64_t rise, fall;  ///< Widths of the ramps; 0 at the lens's rim.

  [[nodiscard]] std::int64_t nodes() const { return end - begin + 1; }
  /// Squares of neighbours' windows sum to 1.
  [[nodiscard]] double window(std::int64_t node) const {
    const auto ramp = [](std::int64_t from_end, std::int64_t width) {
      if (from_end >= width) return 1.0;
      return std::sin(0.5 * std::numbers::pi * static_cast<double>(from_end) /
                      static_cast<double>(width));
    };
    return ramp(node - begin, rise) * ramp(end - node, fall);
  }
  /// Width of the ramps between its halves.
  [[nodiscard]] std::int64_t middle_ramp() const {
    const std::int64_t middle = (begin + end) / 2;
    return std::min(middle - begin - rise, end - fall - middle) / 2;
  }
  /// Both halves; their windows' squares sum to that of the whole. @pre middle_ramp() > 0.
  [[nodiscard]] std::array<Stretch, 2> halves() const {
    const std::int64_t ramp = middle_ramp();
    const std::int64_t second = (begin + end) / 2 - ramp / 2;
    return {Stretch{begin, second + ramp, rise, ramp}, Stretch{second, end, ramp, fall}};
  }
};

/// @param tile, overlap  cells; 0: one stretch.
std::vector<Stretch> stretches(std::int64_t cells, double tile, double overlap) {
  const auto all = static_cast<double>(cells);
  const std::int64_t count =
      tile > 0.0 ? std::max<std::int64_t>(1, std::llround(std::min(all, all / tile))) : 1;
  const std::int64_t ramp =
      std::llround(std::min(overlap, std::floor(all / static_cast<double>(count))));
  std::vector<Stretch> parts;
  for (std::int64_t k = 0; k < count; ++k) {
    Stretch one{cells * k / count, cells * (k + 1) / count, 0, 0};
    if (k > 0) {
      one.begin -= ramp / 2;
      one.rise = ramp;
    }
    if (k + 1 < count) {
      one.end += ramp - ramp / 2;
      one.fall = ramp;
    }
    parts.push_back(one);
  }
  return parts;
}

struct Tile {
  Stretch x, y;

  [[nodiscard]] CellRange cells() const {
    return {x.begin, y.begin, x.end - x.begin, y.end - y.begin};
  }
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

/// Light of one wavelength.
struct WaveColor {
  WaveColor(const OpticalSetup& with_pixels, double wavelength_mm, double share_of_light)
      : setup(with_pixels),
        light(setup),
        path(setup),
        screen(setup),
        wavelength(wavelength_mm),
        share(share_of_light) {}

  OpticalSetup setup;  ///< With pixels as the source's blur requires.
  LightPath light;
  LampPath path;
  Screen screen;
  double wavelength;  ///< mm
  double share;       ///< Of the brightness.
};

/// Common inputs of the tiles.
struct WaveScene {
  const WaveOptions& options;
  const RunControl& control;
  std::vector<WaveColor> colors;
  std::optional<OutlineIndex> edge;  ///< Of a lens with an outline.
};

/// One tile's way from the surface to the screen.
class WaveTile {
 public:
  /// @param patch  the surface's nodes, of the tile and around.
  WaveTile(const WaveScene& scene, const WaveColor& color, const SurfacePatch& patch,
           const Tile& tile)
      : color_(color),
        options_(scene.options),
        edge_(scene.edge ? &*scene.edge : nullptr),
        patch_(patch),
        tile_(tile),
        columns_(static_cast<int>(tile.x.nodes())),
        rows_(static_cast<int>(tile.y.nodes())) {
    trace();
  }

  /// True if no light leaves.
  [[nodiscard]] bool is_dark() const { return whole_ <= 0.0; }
  /// True if its quarters would show it better.
  [[nodiscard]] bool should_be_divided() const {
    const double least = kLeastRamp * std::sqrt(color_.wavelength * plan_.distance);
    const Eigen::Vector2d ramps(static_cast<double>(tile_.x.middle_ramp()),
                                static_cast<double>(tile_.y.middle_ramp()));
    return as_rays_ > kLittle * whole_ &&
           ramps.cwiseProduct(patch_.window.spacing).minCoeff() > least;
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

  /// Number of a node of the tile in its patch.
  [[nodiscard]] std::size_t in_patch(int i, int j) const {
    const GridWindow& window = patch_.window;
    return static_cast<std::size_t>((tile_.y.begin - window.first_row + j) * window.columns +
                                    tile_.x.begin - window.first_column + i);
  }

  void trace() {
    double sum = 0.0;
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) sum += patch_.z[in_patch(i, j)];
    }
    const std::size_t count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    const double level = sum / static_cast<double>(count);
    nodes_.resize(count);
    corners_.resize(count);
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) trace_node(i, j, level);
    }
    weigh_triangles();
    if (!is_dark()) make_plan(level);
  }

  void trace_node(int i, int j, double level) {
    const std::size_t k = index({i, j});
    const std::size_t n = in_patch(i, j);
    const LightPath& light = color_.light;
    const Eigen::Vector2d xy = patch_.window.node(tile_.x.begin - patch_.window.first_column + i,
                                                  tile_.y.begin - patch_.window.first_row + j);
    const Eigen::Vector3d p(xy.x(), xy.y(), patch_.z[n]);
    const Eigen::Vector3d normal =
        Eigen::Vector3d(-patch_.slope_x[n], -patch_.slope_y[n], 1.0).normalized();
    std::optional<IncidentRay> ray;
    if (light.varies()) ray = light.ray_to(p);
    const IncidentRay* const known = ray ? &*ray : nullptr;
    corners_[k] = p;
    Node& node = nodes_[k];
    node.lit = light.transmits(p, normal, known);
    if (!node.lit) return;
    node.slope = light.beam(p, normal, known).m;
    const double secant = std::sqrt(1.0 + node.slope.squaredNorm());
    node.cosine = node.slope / secant;
    node.q = xy + (level - p.z()) * node.slope;
    node.path = color_.path.to(p, known) + (level - p.z()) * secant;
    // An outline's edge fades over one step of the rays, far below √(λ f).
    const bool in = edge_ == nullptr || edge_->contains(xy);
    node.window = in ? tile_.x.window(tile_.x.begin + i) * tile_.y.window(tile_.y.begin + j) : 0.0;
  }

  /// A triangle of nodes.
  using Corner = std::array<int, 2>;
  using Three = std::array<Corner, 3>;

  template <class Action>
  void for_each_triangle(const Action& action) const {
    for (int j = 0; j + 1 < rows_; ++j) {
      for (int i = 0; i + 1 < columns_; ++i) {
        action(Three{Corner{i, j}, Corner{i + 1, j}, Corner{i + 1, j + 1}});
        action(Three{Corner{i, j}, Corner{i + 1, j + 1}, Corner{i, j + 1}});
      }
    }
  }

  [[nodiscard]] std::size_t index(const Corner& c) const {
    return static_cast<std::size_t>(c[1]) * static_cast<std::size_t>(columns_) +
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
      const double least = 1e-3 * patch_.window.spacing.prod();
      amplitude_[k] = area[k] > 0.0 ? std::sqrt(amplitude_[k] / std::max(area[k], least)) : 0.0;
    }
  }

  [[nodiscard]] double flux_of(const Corners& t) const {
    if (!color_.light.varies()) return color_.light.flux(t);
    const IncidentRay a = color_.light.ray_to(t.v0);
    const IncidentRay b = color_.light.ray_to(t.v1);
    const IncidentRay c = color_.light.ray_to(t.v2);
    return color_.light.flux(t, {&a, &b, &c});
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
        places[k] = color_.light.land(corners_[index(t[k])], nodes_[index(t[k])].slope);
      }
      add_ray(places, flux, light);
    });
  }

  /// Divides a triangle on the picture until it is smaller than half a pixel.
  void add_ray(const std::array<Eigen::Vector2d, 3>& t, double flux, PixelLight& light) const {
    const Eigen::Vector2d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]);
    const Eigen::Vector2d high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    const Eigen::Vector2i pixels(color_.screen.plane().columns(), color_.screen.plane().rows());
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
    const Eigen::Vector2d landing = color_.light.land({centre.x(), centre.y(), level}, slope);
    far_level_ = color_.screen.at(landing).z();
    const double distance = far_level_ - level;
    const double unit = std::sqrt(color_.wavelength / distance);
    const auto spread_of = [&](const Stretch& axis) {
      return std::max((is_cut(axis) ? kEdgeSpread : kSpread) * unit, options_.scatter);
    };
    spread_ = {spread_of(tile_.x), spread_of(tile_.y)};
    plan_.wavelength = color_.wavelength;
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
    const double unit = std::sqrt(color_.wavelength / plan_.distance);
    const Eigen::Vector2d room =
        (2.0 * plan_.distance * spread_).cwiseMax(kRoom * unit * plan_.distance);
    const Eigen::Vector2d farthest = beyond.min().cwiseAbs().cwiseMax(beyond.max().cwiseAbs());
    const Eigen::Vector2d size = 2.0 * (0.5 * start.sizes()).cwiseMax(farthest) + room;
    plan_.step = color_.wavelength / (2.0 * kFiner) * (steepest_ + spread_).cwiseInverse();
    plan_.reach = farthest + 0.5 * start.sizes() + room;
    plan_.columns = transform_size(size.x() / plan_.step.x());
    plan_.rows = transform_size(size.y() / plan_.step.y());
  }

  /// True if it ends at the lens's rim, where no window fades the light.
  static bool is_cut(const Stretch& axis) { return axis.rise == 0 || axis.fall == 0; }

  /// Lays the field of every triangle on the starting plane.
  void lay(PlaneField& field) const {
    const double reference = nodes_[index({columns_ / 2, rows_ / 2})].path;
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
      return color_.light.land({xy.x(), xy.y(), far_level_}, slope);
    };
    const Eigen::Vector2d centre = plan_.far_centre();
    const Eigen::Vector2d at = land(centre);
    Eigen::Matrix2d by_mm;
    by_mm << land(centre + Eigen::Vector2d::UnitX()) - at,
        land(centre + Eigen::Vector2d::UnitY()) - at;
    PixelLight light =
        field.spread(at, by_mm, {color_.screen.plane().columns(), color_.screen.plane().rows()});
    light.whole = whole_;
    return light;
  }

  const WaveColor& color_;
  const WaveOptions& options_;
  const OutlineIndex* edge_;
  const SurfacePatch& patch_;
  Tile tile_;
  int columns_, rows_;
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
void add_light(const WaveScene& scene, const WaveColor& color, const SurfacePatch& patch,
               const Tile& tile, std::vector<PixelLight>& parts) {
  if (scene.control.stop_requested()) return;
  const WaveTile whole(scene, color, patch, tile);
  if (whole.is_dark()) return;
  if (!whole.should_be_divided()) {
    parts.push_back(whole.light());
    return;
  }
  for (const Stretch& y : tile.y.halves()) {
    for (const Stretch& x : tile.x.halves()) {
      add_light(scene, color, patch, {x, y}, parts);
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

/// A surface's picture in one wavelength, of a lamp's middle, as far as it was summed.
struct PointPicture {
  std::vector<double> flux;
  double whole = 0.0;

  /// Adds its share of the brightness to a picture.
  void add_to(const WaveColor& color, std::vector<double>& sum) const {
    // What a lens takes in depends on its surface, but for light along z.
    const bool all = color.light.intake_is_plan_area() || whole == 0.0;
    const double scale = color.share / (all ? 1.0 : whole);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += scale * flux[i];
  }
};

/// Light of a lamp's middle from several surfaces.
class PointLightOf {
 public:
  PointLightOf(const WaveScene& scene, const GridWindow& grid,
               std::span<const SurfaceField* const> surfaces)
      : scene_(scene),
        grid_(grid),
        surfaces_(surfaces),
        pixels_(scene.colors.front().setup.pixels),
        pictures_(surfaces.size() * scene.colors.size(),
                  {std::vector<double>(static_cast<std::size_t>(pixels_.prod()), 0.0)}) {}

  void add(const std::vector<Tile>& tiles, const Executor& executor) {
    const auto jobs = static_cast<std::int64_t>(pictures_.size());
    const std::int64_t batch = std::max<std::int64_t>(1, kBatch / jobs);
    const auto count = static_cast<std::int64_t>(tiles.size());
    for (std::int64_t first = 0; first < count; first += batch) {
      const std::int64_t size = std::min(batch, count - first);
      add_batch(
          std::span(tiles).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(size)),
          executor);
      scene_.control.report(
          {"waves", static_cast<double>(first + size), static_cast<double>(count), "tiles"});
    }
  }

  /// A surface's light in all wavelengths.
  [[nodiscard]] std::vector<double> of(std::size_t surface) const {
    std::vector<double> sum(static_cast<std::size_t>(pixels_.prod()), 0.0);
    for (std::size_t c = 0; c < scene_.colors.size(); ++c) {
      pictures_[surface * scene_.colors.size() + c].add_to(scene_.colors[c], sum);
    }
    return sum;
  }

 private:
  void add_batch(std::span<const Tile> tiles, const Executor& executor) {
    const std::size_t colors = scene_.colors.size();
    std::vector<SurfacePatch> patches(tiles.size() * surfaces_.size());
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      for (std::size_t s = 0; s < surfaces_.size(); ++s) {
        if (scene_.control.stop_requested()) throw Interrupted();
        surfaces_[s]->sample(window_of(grid_, tiles[t].cells(), 0), executor,
                             patches[t * surfaces_.size() + s]);
      }
    }
    const std::vector<std::size_t> first = first_equal(patches);
    std::vector<std::vector<PixelLight>> lights(patches.size() * colors);
    const auto work = [&](std::int64_t job) {
      const auto k = static_cast<std::size_t>(job);
      if (first[k / colors] != k / colors) return;
      add_light(scene_, scene_.colors[k % colors], patches[k / colors],
                tiles[k / colors / surfaces_.size()], lights[k]);
    };
    parallel_for(executor, "waves", static_cast<std::int64_t>(lights.size()), work, 1);
    if (scene_.control.stop_requested()) throw Interrupted();
    for (std::size_t k = 0; k < lights.size(); ++k) {
      PointPicture& picture = pictures_[k % pictures_.size()];
      for (const PixelLight& part : lights[first[k / colors] * colors + k % colors]) {
        add_to(part, pixels_, picture.flux);
        picture.whole += part.whole;
      }
    }
  }

  /// For every patch of a tile the first that has the same nodes: a ball changes nothing where it
  /// reaches the surface.
  [[nodiscard]] std::vector<std::size_t> first_equal(
      const std::vector<SurfacePatch>& patches) const {
    std::vector<std::size_t> first(patches.size());
    for (std::size_t k = 0; k < patches.size(); ++k) {
      first[k] = k - k % surfaces_.size();
      while (first[k] < k && !same_nodes(patches[first[k]], patches[k])) ++first[k];
    }
    return first;
  }
  static bool same_nodes(const SurfacePatch& a, const SurfacePatch& b) {
    return a.z == b.z && a.slope_x == b.slope_x && a.slope_y == b.slope_y;
  }

  const WaveScene& scene_;
  const GridWindow& grid_;
  std::span<const SurfaceField* const> surfaces_;
  Eigen::Vector2i pixels_;
  std::vector<PointPicture> pictures_;  ///< By surface, then wavelength.
};

/// Height of a surface in the middle of its lens, mm.
double middle_height(const GridWindow& grid, const SurfaceField& surface) {
  GridWindow one = grid;
  one.first_column += grid.columns / 2;
  one.first_row += grid.rows / 2;
  one.columns = 1;
  one.rows = 1;
  SurfacePatch patch;
  surface.sample(one, Executor::serial(), patch);
  return patch.z.front();
}

/// λ f: wavelength × distance from the middle of the lens to the wall, mm².
double spot_area(const OpticalSetup& setup, double height, double wavelength) {
  const Eigen::Vector3d middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), height);
  return wavelength * LightPath(setup).clearance(middle);
}

/// mm on the wall.
double pixel_width(const OpticalSetup& setup) {
  return setup.image_size.cwiseQuotient(setup.pixels.cast<double>()).minCoeff();
}

/// Distance on the lens up to which waves interfere in a pixel's mean, λ f / pixel, and at least
/// √(λ f), to which diffraction reaches, mm.
double coherence_length(const OpticalSetup& setup, double height, double wavelength) {
  const double spot = spot_area(setup, height, wavelength);
  return std::max(std::sqrt(spot), spot / pixel_width(setup));
}

constexpr double kMmPerNm = 1e-6;

/// The wavelengths of a setup's light, shortest first.
std::vector<WaveColor> wave_colors(const OpticalSetup& setup, double wavelength) {
  std::vector<WaveColor> colors;
  for (const LightColor& color : light_colors(setup)) {
    const std::size_t k = colors.size();
    const bool one = setup.spectrum.none();
    colors.emplace_back(color.setup, one ? wavelength : kMmPerNm * setup.spectrum.wavelengths[k],
                        color.share);
  }
  return colors;
}

}  // namespace

double middle_wavelength(const OpticalSetup& setup, double otherwise) {
  const std::vector<double>& all = setup.spectrum.wavelengths;
  return all.empty() ? otherwise : kMmPerNm * all[all.size() / 2];
}

double diffraction_width(const OpticalSetup& setup, double z, double wavelength) {
  return std::sqrt(spot_area(setup, z, wavelength));
}

std::vector<PictureBlur> light_blurs(const OpticalSetup& setup, double z, double wavelength) {
  const double diffraction = diffraction_width(setup, z, wavelength) / pixel_width(setup);
  return {{"lamp", source_blur(setup, z)}, {"diffraction", diffraction}};
}

const PictureBlur& widest(const std::vector<PictureBlur>& blurs) {
  return *std::max_element(
      blurs.begin(), blurs.end(),
      [](const PictureBlur& a, const PictureBlur& b) { return a.pixels < b.pixels; });
}

std::string blur_words(const std::vector<PictureBlur>& blurs) {
  std::string text;
  for (const PictureBlur& blur : blurs) {
    if (blur.pixels < kNoBlur) continue;
    const std::string width = decimal_text(blur.pixels, 1);
    text += joined({text.empty() ? "" : ", ", blur.cause, text.empty() ? " blurs " : " ", width,
                    text.empty() ? " pixels" : ""});
  }
  return text.empty() ? "nothing blurs the picture" : text;
}

const char* blur_remedy(const std::string& cause) {
  if (cause == "lamp") return "a smaller or farther lamp, or a nearer wall";
  if (cause == "diffraction") return "a nearer wall";
  if (cause == "polish") return "less polish, or a larger lens";
  return "closer rows, or a larger ball";
}

std::vector<std::vector<double>> wave_flux(const OpticalSetup& setup, const GridWindow& grid,
                                           std::span<const SurfaceField* const> surfaces,
                                           const WaveOptions& options, const Executor& executor,
                                           const RunControl& control) {
  const double height = middle_height(grid, *surfaces.front());
  const SourceKernel kernel = source_kernel(setup, height);
  OpticalSetup in_parts = setup;
  in_parts.pixels *= kernel.parts;
  WaveScene scene{options, control, wave_colors(in_parts, options.wavelength), {}};
  if (setup.outline) scene.edge.emplace(*setup.outline);
  const double length = coherence_length(setup, height, scene.colors.back().wavelength);
  const CellRange all = all_cells(grid);
  const auto along = [&](std::int64_t cells, int axis) {
    const double unit = length / grid.spacing[axis];
    return stretches(cells, options.tile * unit, options.overlap * unit);
  };
  std::vector<Tile> tiles;
  for (const Stretch& y : along(all.rows, 1)) {
    for (const Stretch& x : along(all.columns, 0)) tiles.push_back({x, y});
  }
  PointLightOf light(scene, grid, surfaces);
  light.add(tiles, executor);
  SourceBlurOn<Executor> blur(kernel, setup.pixels.x(), setup.pixels.y(), executor);
  std::vector<std::vector<double>> pictures;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const std::vector<double> parts = light.of(s);
    const std::span<const double> flux = blur.apply(executor, parts);
    pictures.emplace_back(flux.begin(), flux.end());
  }
  return pictures;
}

GridWindow wave_grid(const OpticalSetup& setup, const OpticalSurface& surface) {
  const auto* const spline = dynamic_cast<const SplineSurface*>(&surface);
  const double pieces = spline != nullptr
                            ? static_cast<double>(spline->net().cell_count())
                            : 0.5 * static_cast<double>(surface.mesh().triangle_count());
  return lens_grid(setup.lens_size, 0.25 * std::sqrt(surface.box().volume() / pieces));
}

}  // namespace lensforge

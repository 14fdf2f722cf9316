// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/waves/wave_tile.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/compute/scalar.h"

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

/// One tile's way from the surface to the screen.
class WaveTile {
 public:
  /// @param plan  of an earlier look; null: a new one is made.
  WaveTile(const WaveScene& scene, const WaveColor& color, const SurfaceNodes& surface,
           const Tile& tile, const TilePlan* plan)
      : color_(color),
        options_(scene.options),
        edge_(scene.edge ? &*scene.edge : nullptr),
        surface_(surface),
        tile_(tile),
        columns_(static_cast<int>(tile.x.nodes())),
        rows_(static_cast<int>(tile.y.nodes())) {
    trace(plan);
  }

  [[nodiscard]] const TilePlan& plan() const { return plan_; }

  /// True if no light leaves.
  [[nodiscard]] bool is_dark() const { return whole_ <= 0.0; }

  /// The tile's field on the screen.
  [[nodiscard]] PlaneField on_screen() const {
    PlaneField field(plan_.field);
    for_each_laid([&](const auto& vertices, const auto& /*indices*/) { field.add(vertices); });
    field.propagate();
    return field;
  }

  /// Each node's light is spread over its cell, along the mean ray.
  /// @param field  on_screen()
  [[nodiscard]] PixelLight light(const PlaneField& field) const {
    const OnPicture to = on_picture();
    PixelLight light = field.spread(to.centre, to.by_mm, to.pixels);
    light.whole = whole_;
    if (as_rays_ > 0.0) add_rays(light);
    return light;
  }

  /// Calls `take(column, row, derivative)` for all nodes: tile_heights_bar().
  /// @param field  on_screen()
  template <class Take>
  void heights_bar(PlaneField field, std::span<const double> by_pixel, const Take& take) const {
    const OnPicture to = on_picture();
    field.pull(to.centre, to.by_mm, to.pixels, by_pixel);
    field.return_back();
    std::vector<double> by_path(nodes_.size(), 0.0);
    for_each_laid([&](const auto& vertices, const auto& indices) {
      field.gather(vertices, indices, by_path);
    });
    field.gather_rest(by_path);
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) {
        const std::size_t k = index({i, j});
        take(tile_.x.begin + i, tile_.y.begin + j, by_path[k] * nodes_[k].rise);
      }
    }
  }

 private:
  /// True if its quarters would show it better.
  [[nodiscard]] bool should_be_divided() const {
    const double least = kLeastRamp * std::sqrt(color_.wavelength * plan_.field.distance);
    const Eigen::Vector2d ramps(static_cast<double>(tile_.x.middle_ramp()),
                                static_cast<double>(tile_.y.middle_ramp()));
    return as_rays_ > kLittle * whole_ && ramps.cwiseProduct(surface_.spacing).minCoeff() > least;
  }

  /// A ray where it leaves the surface.
  struct Node {
    bool lit = false;
    Eigen::Vector2d q;       ///< mm
    Eigen::Vector2d cosine;  ///< p
    Eigen::Vector2d slope;   ///< m
    double path = 0.0;       ///< W, mm
    double rise = 0.0;       ///< ∂W/∂z of the surface, where the ray meets the starting plane.
    double window = 0.0;
  };

  /// Number of a node of the tile on the surface.
  [[nodiscard]] std::size_t on_surface(int i, int j) const {
    return surface_.at(tile_.x.begin + i, tile_.y.begin + j);
  }

  void trace(const TilePlan* plan) {
    if (plan != nullptr) {
      plan_ = *plan;
    } else {
      plan_.level = mean_height();
    }
    const std::size_t count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    nodes_.resize(count);
    corners_.resize(count);
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) trace_node(i, j, plan_.level);
    }
    weigh_triangles();
    if (is_dark()) return;
    if (plan == nullptr) make_plan();
    if (plan_.limited) for_each_ray([&](const Three&, double flux) { as_rays_ += flux; });
    if (plan == nullptr) plan_.divided = should_be_divided();
  }

  [[nodiscard]] double mean_height() const {
    double sum = 0.0;
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) sum += surface_.place[on_surface(i, j)].z();
    }
    const std::size_t count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    return sum / static_cast<double>(count);
  }

  void trace_node(int i, int j, double level) {
    const std::size_t k = index({i, j});
    const std::size_t n = on_surface(i, j);
    const LightPath& light = color_.light;
    const Eigen::Vector3d& p = surface_.place[n];
    const Eigen::Vector2d xy = p.head<2>();
    const Eigen::Vector2d& slope = surface_.slope[n];
    const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
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
    node.rise = color_.path.rise(p, known) - 1.0 / secant;
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
    if (plan_.field.columns == 0) plan_.field.cosine = mean / whole_;
    for (std::size_t k = 0; k < amplitude_.size(); ++k) {
      // At a caustic of the starting plane itself the area vanishes, but not the light around it.
      const double least = 1e-3 * surface_.spacing.prod();
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
    const Eigen::Vector2d off =
        (node.cosine - plan_.field.cosine).cwiseAbs().cwiseQuotient(plan_.steepest);
    const double share = (1.0 - off.maxCoeff()) / (1.0 - kFade);
    if (!plan_.limited || share >= 1.0) return 1.0;
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
  void make_plan() {
    const double level = plan_.level;
    const Eigen::Vector2d slope = plan_.field.slope();
    Eigen::AlignedBox2d start;
    for (const Node& node : nodes_) {
      if (node.lit) start.extend(node.q);
    }
    const Eigen::Vector2d centre = start.center();
    const Eigen::Vector2d landing = color_.light.land({centre.x(), centre.y(), level}, slope);
    plan_.far_level = color_.screen.at(landing).z();
    const double distance = plan_.far_level - level;
    const double unit = std::sqrt(color_.wavelength / distance);
    const auto spread_of = [&](const Stretch& axis) {
      return std::max((is_cut(axis) ? kEdgeSpread : kSpread) * unit, options_.scatter);
    };
    plan_.spread = {spread_of(tile_.x), spread_of(tile_.y)};
    plan_.field.wavelength = color_.wavelength;
    plan_.field.distance = distance;
    plan_.field.centre = centre;
    plan_.field.points = {is_cut(tile_.x) ? kEdgePoints : 1, is_cut(tile_.y) ? kEdgePoints : 1};
    plan_.steepest.setConstant(1e-9);
    for (const Node& node : nodes_) {
      if (node.lit)
        plan_.steepest = plan_.steepest.cwiseMax((node.cosine - plan_.field.cosine).cwiseAbs());
    }
    plan_nodes(start);
    // Below the spread of the waves, giving up more rays would save little.
    while (nodes() > kMostNodes && options_.tile > 0.0 &&
           (plan_.steepest.array() > plan_.spread.array()).any()) {
      plan_.limited = true;
      plan_.steepest *= 0.9;
      plan_nodes(start);
    }
  }

  [[nodiscard]] double nodes() const {
    return static_cast<double>(plan_.field.columns) * static_cast<double>(plan_.field.rows);
  }

  /// @param start  box of the light on the starting plane.
  void plan_nodes(const Eigen::AlignedBox2d& start) {
    Eigen::AlignedBox2d beyond;  // On the screen, seen from the mean ray.
    const Eigen::Vector2d slope = plan_.field.slope();
    for (const Node& node : nodes_) {
      if (!node.lit || as_wave(node) <= 0.0) continue;
      beyond.extend(node.q - plan_.field.centre + plan_.field.distance * (node.slope - slope));
    }
    const double unit = std::sqrt(color_.wavelength / plan_.field.distance);
    const Eigen::Vector2d room =
        (2.0 * plan_.field.distance * plan_.spread).cwiseMax(kRoom * unit * plan_.field.distance);
    const Eigen::Vector2d farthest = beyond.min().cwiseAbs().cwiseMax(beyond.max().cwiseAbs());
    const Eigen::Vector2d size = 2.0 * (0.5 * start.sizes()).cwiseMax(farthest) + room;
    plan_.field.step =
        color_.wavelength / (2.0 * kFiner) * (plan_.steepest + plan_.spread).cwiseInverse();
    plan_.field.reach = farthest + 0.5 * start.sizes() + room;
    plan_.field.columns = transform_size(size.x() / plan_.field.step.x());
    plan_.field.rows = transform_size(size.y() / plan_.field.step.y());
  }

  /// True if it ends at the lens's rim, where no window fades the light.
  static bool is_cut(const Stretch& axis) { return axis.rise == 0 || axis.fall == 0; }

  /// Calls `take(vertices, indices)` for the lit triangles on the starting plane.
  template <class Take>
  void for_each_laid(const Take& take) const {
    const double reference = nodes_[index({columns_ / 2, rows_ / 2})].path;
    for_each_triangle([&](const Three& t) {
      if (!is_lit(t)) return;
      std::array<PlaneField::Vertex, 3> vertices;
      std::array<std::size_t, 3> indices{};
      for (std::size_t k = 0; k < 3; ++k) {
        indices[k] = index(t[k]);
        const Node& node = nodes_[indices[k]];
        vertices[k] = {node.q, node.cosine, node.path - reference,
                       amplitude_[indices[k]] * node.window * std::sqrt(as_wave(node))};
      }
      take(vertices, indices);
    });
  }

  /// Where the field's nodes are on the picture.
  struct OnPicture {
    Eigen::Vector2d centre;  ///< Of the field, pixel coordinates.
    Eigen::Matrix2d by_mm;
    Eigen::Vector2i pixels;
  };
  [[nodiscard]] OnPicture on_picture() const {
    const Eigen::Vector2d slope = plan_.field.slope();
    const auto land = [&](const Eigen::Vector2d& xy) {
      return color_.light.land({xy.x(), xy.y(), plan_.far_level}, slope);
    };
    const Eigen::Vector2d centre = plan_.field.far_centre();
    const Eigen::Vector2d at = land(centre);
    Eigen::Matrix2d by_mm;
    by_mm << land(centre + Eigen::Vector2d::UnitX()) - at,
        land(centre + Eigen::Vector2d::UnitY()) - at;
    return {at, by_mm, {color_.screen.plane().columns(), color_.screen.plane().rows()}};
  }

  const WaveColor& color_;
  const WaveOptions& options_;
  const OutlineIndex* edge_;
  const SurfaceNodes& surface_;
  Tile tile_;
  int columns_, rows_;
  std::vector<Node> nodes_;
  std::vector<Eigen::Vector3d> corners_;
  std::vector<double> amplitude_;
  double whole_ = 0.0;
  double as_rays_ = 0.0;  ///< Light of directions that are too steep for the field.
  TilePlan plan_;
};

/// Calls `take(part)` for a tile that is lit, or for its quarters if its field would be too large.
/// @param plans  of the tile and its parts in turn; empty ones are made.
class TileParts {
 public:
  TileParts(const WaveScene& scene, const WaveColor& color, const SurfaceNodes& nodes,
            std::vector<TilePlan>& plans)
      : scene_(scene), color_(color), nodes_(nodes), plans_(plans), planned_(!plans.empty()) {}

  template <class Take>
  void for_each(const Tile& tile, const Take& take) {
    if (scene_.control.stop_requested()) return;
    const TilePlan* const plan = planned_ ? &plans_[next_++] : nullptr;
    // A tile that was dark has no field: what little reaches it since then waits for new plans.
    if (plan != nullptr && plan->field.columns == 0) return;
    const WaveTile whole(scene_, color_, nodes_, tile, plan);
    if (!planned_) plans_.push_back(whole.plan());
    if (!whole.plan().divided) {
      if (!whole.is_dark()) take(whole);
      return;
    }
    for (const Stretch& y : tile.y.halves()) {
      for (const Stretch& x : tile.x.halves()) for_each({x, y}, take);
    }
  }

 private:
  const WaveScene& scene_;
  const WaveColor& color_;
  const SurfaceNodes& nodes_;
  std::vector<TilePlan>& plans_;
  bool planned_;
  std::size_t next_ = 0;
};

}  // namespace

std::vector<PixelLight> tile_light(const WaveScene& scene, const WaveColor& color,
                                   const SurfaceNodes& nodes, const Tile& tile,
                                   TileMemory* memory) {
  std::vector<PixelLight> parts;
  std::vector<TilePlan> plans;
  TileParts all(scene, color, nodes, memory != nullptr ? memory->plans : plans);
  all.for_each(tile, [&](const WaveTile& part) {
    PlaneField field = part.on_screen();
    parts.push_back(part.light(field));
    if (memory != nullptr && memory->keeps_fields) memory->fields.push_back(std::move(field));
  });
  return parts;
}

std::vector<double> tile_heights_bar(const WaveScene& scene, const WaveColor& color,
                                     const SurfaceNodes& nodes, const Tile& tile,
                                     std::span<const double> by_pixel, TileMemory& memory) {
  const auto columns = static_cast<std::size_t>(tile.x.nodes());
  std::vector<double> bars(columns * static_cast<std::size_t>(tile.y.nodes()), 0.0);
  const auto add = [&](std::int64_t column, std::int64_t row, double bar) {
    bars[static_cast<std::size_t>(row - tile.y.begin) * columns +
         static_cast<std::size_t>(column - tile.x.begin)] += bar;
  };
  std::vector<PlaneField> kept = std::exchange(memory.fields, {});
  std::size_t next = 0;
  TileParts(scene, color, nodes, memory.plans).for_each(tile, [&](const WaveTile& part) {
    PlaneField field = kept.empty() ? part.on_screen() : std::move(kept[next++]);
    part.heights_bar(std::move(field), by_pixel, add);
  });
  return bars;
}

}  // namespace lensforge

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
/// quarters of the tile would overlap too little; else the tile is divided. A 128² portrait that
/// was designed by waves, 0.0021 to 0.0029 (MAE) by fields of this size, has 0.0042 with half of it
/// and 0.0078 with a fifth, in two thirds of the time.
constexpr double kMostNodes = 4e7;
constexpr double kLittle = 0.005;   ///< Share of a tile's light.
constexpr double kLeastRamp = 1.0;  ///< In √(λ f).

/// The same for patches, which are not divided: 8 bytes each. As many are in 150 mm of lens before
/// a wall at 75 mm, if all its light goes to one patch.
constexpr double kMostPatchNodes = 4e8;

/// Room in a patch's plan for its rays to change, as a factor.
constexpr double kSlack = 1.05;

/// From this share of the steepest direction kept on, waves fade into rays.
constexpr double kFade = 0.8;

/// The ray that comes to a point, where it is not the same for all.
std::optional<IncidentRay> incident_ray(const LightPath& light, const Eigen::Vector3d& p) {
  if (!light.varies()) return std::nullopt;
  return light.ray_to(p);
}

/// One tile's way from the surface to the screen.
class WaveTile {
 public:
  /// @param plan  of an earlier look, to be used if it fits; null: a new one is made.
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
    PixelLight light = field.spread(to);
    light.whole = whole_;
    if (as_rays_ > 0.0) add_rays(to.pixels, light);
    return light;
  }

  /// Calls `take(column, row, derivative)` for all nodes: tile_heights_bar().
  /// @param field  on_screen()
  template <class Take>
  void heights_bar(PlaneField field, std::span<const double> by_pixel, const Take& take) const {
    const OnPicture to = on_picture();
    field.pull(to, by_pixel);
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
    plan_.level = plan != nullptr ? plan->level : level();
    const std::size_t count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    nodes_.resize(count);
    corners_.resize(count);
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) trace_node(i, j, plan_.level);
    }
    weigh_triangles();
    if (is_dark()) return;
    if (plan != nullptr && fits(*plan)) {
      plan_ = *plan;
    } else {
      make_plan();
    }
    if (plan_.limited) for_each_ray([&](const Three&, double flux) { as_rays_ += flux; });
    plan_.divided = should_be_divided();
  }

  /// z of the starting plane: the mean height of the tile, but that of its part of the lens's rim
  /// if it has one, since the rim's diffraction starts there. 0.3 mm above it a portrait in one
  /// piece changes by 0.0004 (MAE).
  [[nodiscard]] double level() const {
    double sum = 0.0, rim = 0.0;
    int rim_nodes = 0;
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) {
        const double z = surface_.place[on_surface(i, j)].z();
        sum += z;
        if (!is_on_rim(tile_.x, i) && !is_on_rim(tile_.y, j)) continue;
        rim += z;
        ++rim_nodes;
      }
    }
    return rim_nodes > 0 ? rim / rim_nodes : sum / (static_cast<double>(columns_) * rows_);
  }
  static bool is_on_rim(const Stretch& axis, int node) {
    return (node == 0 && axis.rise == 0) || (node == axis.nodes() - 1 && axis.fall == 0);
  }

  /// True if the rays stay inside a patch's plan. What goes as rays does so for good.
  [[nodiscard]] bool fits(const TilePlan& plan) const {
    if (plan.limited) return true;
    return std::all_of(nodes_.begin(), nodes_.end(), [&](const Node& node) {
      if (!is_bright(node)) return true;
      const Eigen::Vector2d from = node.q - plan.field.centre;
      const Eigen::Vector2d aside = plan.field.distance * (node.slope - plan.field.slope());
      const Eigen::Vector2d off = node.cosine - plan.field.cosine;
      return (from.array().abs() <= plan.start.array()).all() &&
             ((from + aside).array().abs() <= plan.far.array()).all() &&
             (off.array().abs() <= plan.steepest.array()).all();
    });
  }

  void trace_node(int i, int j, double level) {
    const std::size_t k = index({i, j});
    const std::size_t n = on_surface(i, j);
    const LightPath& light = color_.light;
    const Eigen::Vector3d& p = surface_.place[n];
    const Eigen::Vector2d xy = p.head<2>();
    const Eigen::Vector2d& slope = surface_.slope[n];
    const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    const std::optional<IncidentRay> ray = incident_ray(light, p);
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
    if (tile_.patch) node.window *= tile_.patch->window(light.land(p, node.slope));
  }

  static bool is_bright(const Node& node) { return node.lit && node.window > 0.0; }

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
      const double flux = flux_of(color_.light, corners);
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
      const double least = 1e-3 * surface_.spacing.prod();
      amplitude_[k] = area[k] > 0.0 ? std::sqrt(amplitude_[k] / std::max(area[k], least)) : 0.0;
    }
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
      action(t, share * flux_of(color_.light, corners));
    });
  }

  void add_rays(const Eigen::AlignedBox2i& pixels, PixelLight& light) const {
    for_each_ray([&](const Three& t, double flux) {
      std::array<Eigen::Vector2d, 3> places;
      for (std::size_t k = 0; k < 3; ++k) {
        places[k] = color_.light.land(corners_[index(t[k])], nodes_[index(t[k])].slope);
      }
      add_ray(places, flux, pixels, light);
    });
  }

  /// Divides a triangle on the picture until it is smaller than half a pixel.
  void add_ray(const std::array<Eigen::Vector2d, 3>& t, double flux,
               const Eigen::AlignedBox2i& pixels, PixelLight& light) const {
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& corner : t) box.extend(corner);
    if (!box.intersects(pixels.cast<double>())) return;
    if (box.sizes().maxCoeff() > 0.5) {
      const std::array<Eigen::Vector2d, 3> m{0.5 * (t[0] + t[1]), 0.5 * (t[1] + t[2]),
                                             0.5 * (t[2] + t[0])};
      add_ray({t[0], m[0], m[2]}, 0.25 * flux, pixels, light);
      add_ray({m[0], t[1], m[1]}, 0.25 * flux, pixels, light);
      add_ray({m[2], m[1], t[2]}, 0.25 * flux, pixels, light);
      add_ray(m, 0.25 * flux, pixels, light);
      return;
    }
    const Eigen::Vector2i at = ((t[0] + t[1] + t[2]) / 3.0).array().floor().cast<int>();
    if ((at.array() < pixels.min().array()).any() || (at.array() >= pixels.max().array()).any()) {
      return;
    }
    light.rays.emplace_back(at.y() * color_.screen.plane().columns() + at.x(), flux);
  }

  /// Size of the field: as wide as the light on the starting plane and as that on the screen, each
  /// around the mean ray, which for a patch goes to its middle.
  void make_plan() {
    Eigen::AlignedBox2d start;
    for (const Node& node : nodes_) {
      if (is_bright(node)) start.extend(node.q);
    }
    const Eigen::Vector2d centre = start.center();
    const Eigen::Vector2d to =
        tile_.patch ? tile_.patch->pixels.cast<double>().center() : landing_along(mean_, centre);
    const Eigen::Vector3d far = color_.screen.at(to);
    plan_.far_level = far.z();
    const double distance = plan_.far_level - plan_.level;
    FieldPlan& field = plan_.field;
    field.cosine = mean_;
    if (tile_.patch) {
      const Eigen::Vector2d slope = (far.head<2>() - centre) / distance;
      field.cosine = slope / std::sqrt(1.0 + slope.squaredNorm());
    }
    const double unit = std::sqrt(color_.wavelength / distance);
    const auto spread_of = [&](const Stretch& axis) {
      return std::max((is_cut(axis) ? kEdgeSpread : kSpread) * unit, options_.scatter);
    };
    plan_.spread = {spread_of(tile_.x), spread_of(tile_.y)};
    field.wavelength = color_.wavelength;
    field.distance = distance;
    field.centre = centre;
    field.points = {is_cut(tile_.x) ? kEdgePoints : 1, is_cut(tile_.y) ? kEdgePoints : 1};
    plan_.steepest.setConstant(1e-9);
    for (const Node& node : nodes_) {
      if (!is_bright(node)) continue;
      plan_.steepest = plan_.steepest.cwiseMax((node.cosine - field.cosine).cwiseAbs());
    }
    if (tile_.patch) plan_.steepest *= kSlack;
    plan_nodes(0.5 * start.sizes());
    const double most = tile_.patch ? kMostPatchNodes : kMostNodes;
    // Below the spread of the waves, giving up more rays would save little.
    while (node_count() > most && options_.tile > 0.0 &&
           (plan_.steepest.array() > plan_.spread.array()).any()) {
      plan_.limited = true;
      plan_.steepest *= 0.9;
      plan_nodes(0.5 * start.sizes());
    }
  }

  /// Pixel coordinates where a ray from a place on the starting plane lands.
  [[nodiscard]] Eigen::Vector2d landing_along(const Eigen::Vector2d& cosine,
                                              const Eigen::Vector2d& place) const {
    const Eigen::Vector2d slope = cosine / std::sqrt(1.0 - cosine.squaredNorm());
    return color_.light.land({place.x(), place.y(), plan_.level}, slope);
  }

  [[nodiscard]] double node_count() const {
    return static_cast<double>(plan_.field.columns) * static_cast<double>(plan_.field.rows);
  }

  /// @param start  half the box of the light on the starting plane.
  void plan_nodes(const Eigen::Vector2d& start) {
    FieldPlan& field = plan_.field;
    Eigen::AlignedBox2d beyond;  // On the screen, seen from the mean ray.
    const Eigen::Vector2d slope = field.slope();
    for (const Node& node : nodes_) {
      if (!is_bright(node) || as_wave(node) <= 0.0) continue;
      beyond.extend(node.q - field.centre + field.distance * (node.slope - slope));
    }
    const Eigen::Vector2d scattered = field.distance * plan_.spread;
    const Eigen::Vector2d farthest = beyond.min().cwiseAbs().cwiseMax(beyond.max().cwiseAbs());
    Eigen::Vector2d size;
    if (tile_.patch) {
      plan_.start = kSlack * start;
      plan_.far = kSlack * farthest;
      // What is cyclic beside the patch does no harm.
      size = (2.0 * plan_.start).cwiseMax(half_patch() + plan_.far + scattered);
      field.reach = plan_.far + plan_.start + scattered;
    } else {
      const double least_room = kRoom * std::sqrt(field.wavelength * field.distance);
      const Eigen::Vector2d room = (2.0 * scattered).cwiseMax(least_room);
      size = 2.0 * start.cwiseMax(farthest) + room;
      field.reach = farthest + start + room;
    }
    field.step =
        color_.wavelength / (2.0 * kFiner) * (plan_.steepest + plan_.spread).cwiseInverse();
    field.columns = transform_size(size.x() / field.step.x());
    field.rows = transform_size(size.y() / field.step.y());
  }

  /// Half the size of the patch, seen from the mean ray, mm.
  [[nodiscard]] Eigen::Vector2d half_patch() const {
    Eigen::Vector2d half = Eigen::Vector2d::Zero();
    const Eigen::AlignedBox2d box = tile_.patch->pixels.cast<double>();
    const Eigen::Vector3d middle = color_.screen.at(box.center());
    for (const auto corner : {Eigen::AlignedBox2d::BottomLeft, Eigen::AlignedBox2d::BottomRight,
                              Eigen::AlignedBox2d::TopLeft, Eigen::AlignedBox2d::TopRight}) {
      const Eigen::Vector3d to = color_.screen.at(box.corner(corner)) - middle;
      half = half.cwiseMax((to.head<2>() - to.z() * plan_.field.slope()).cwiseAbs());
    }
    return half;
  }

  /// True if it ends at the lens's rim, where no window fades the light.
  static bool is_cut(const Stretch& axis) { return axis.rise == 0 || axis.fall == 0; }

  /// Calls `take(vertices, indices)` for the lit triangles on the starting plane.
  template <class Take>
  void for_each_laid(const Take& take) const {
    const double reference = nodes_[index({columns_ / 2, rows_ / 2})].path;
    for_each_triangle([&](const Three& t) {
      if (!is_lit(t)) return;
      const auto is_in = [&](const Corner& c) { return nodes_[index(c)].window > 0.0; };
      if (std::none_of(t.begin(), t.end(), is_in)) return;
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
    const Eigen::Vector2i all(color_.screen.plane().columns(), color_.screen.plane().rows());
    return {at, by_mm, all.x(),
            tile_.patch ? tile_.patch->pixels : Eigen::AlignedBox2i(Eigen::Vector2i::Zero(), all)};
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
  Eigen::Vector2d mean_{0.0, 0.0};  ///< Direction of all its light, along x and y.
  double whole_ = 0.0;
  double as_rays_ = 0.0;  ///< Light of directions that are too steep for the field.
  TilePlan plan_;
};

/// Adds the light of a tile, or of its quarters if its field would be too large.
void add_tile(const WaveScene& scene, const WaveColor& color, const SurfaceNodes& nodes,
              const Tile& tile, std::vector<PixelLight>& parts) {
  if (scene.control.stop_requested()) return;
  const WaveTile whole(scene, color, nodes, tile, nullptr);
  if (whole.is_dark()) return;
  if (!whole.plan().divided) {
    parts.push_back(whole.light(whole.on_screen()));
    return;
  }
  for (const Stretch& y : tile.y.halves()) {
    for (const Stretch& x : tile.x.halves()) add_tile(scene, color, nodes, {x, y, {}}, parts);
  }
}

}  // namespace

double flux_of(const LightPath& light, const Corners& t) {
  if (!light.varies()) return light.flux(t);
  const IncidentRay a = light.ray_to(t.v0);
  const IncidentRay b = light.ray_to(t.v1);
  const IncidentRay c = light.ray_to(t.v2);
  return light.flux(t, {&a, &b, &c});
}

Eigen::Vector2d landing_of(const WaveColor& color, const Eigen::Vector3d& place,
                           const Eigen::Vector2d& slope) {
  const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const std::optional<IncidentRay> ray = incident_ray(color.light, place);
  const IncidentRay* const known = ray ? &*ray : nullptr;
  if (!color.light.transmits(place, normal, known)) return Eigen::Vector2d::Constant(NAN);
  return color.light.land(place, color.light.beam(place, normal, known).m);
}

std::vector<PixelLight> tile_light(const WaveScene& scene, const WaveColor& color,
                                   const SurfaceNodes& nodes, const Tile& tile) {
  std::vector<PixelLight> parts;
  add_tile(scene, color, nodes, tile, parts);
  return parts;
}

PixelLight patch_light(const WaveScene& scene, const WaveColor& color, const SurfaceNodes& nodes,
                       const Tile& tile, PatchMemory& memory) {
  if (scene.control.stop_requested()) return {};
  const WaveTile patch(scene, color, nodes, tile, memory.plan ? &*memory.plan : nullptr);
  if (patch.is_dark()) return {};
  memory.plan = patch.plan();
  PlaneField field = patch.on_screen();
  PixelLight light = patch.light(field);
  if (memory.keeps_field) memory.field.emplace(std::move(field));
  return light;
}

std::vector<double> patch_heights_bar(const WaveScene& scene, const WaveColor& color,
                                      const SurfaceNodes& nodes, const Tile& tile,
                                      std::span<const double> by_pixel, PatchMemory& memory) {
  const auto columns = static_cast<std::size_t>(tile.x.nodes());
  std::vector<double> bars(columns * static_cast<std::size_t>(tile.y.nodes()), 0.0);
  if (scene.control.stop_requested()) return bars;
  const WaveTile patch(scene, color, nodes, tile, memory.plan ? &*memory.plan : nullptr);
  if (patch.is_dark()) return bars;
  PlaneField field = memory.field ? std::move(*memory.field) : patch.on_screen();
  memory.field.reset();
  patch.heights_bar(std::move(field), by_pixel,
                    [&](std::int64_t column, std::int64_t row, double bar) {
                      bars[static_cast<std::size_t>(row - tile.y.begin) * columns +
                           static_cast<std::size_t>(column - tile.x.begin)] += bar;
                    });
  return bars;
}

}  // namespace lensforge

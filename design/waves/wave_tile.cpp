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

/// Nodes per pixel, at least: the light of each is spread evenly over its cell.
constexpr double kLeastPerPixel = 8.0;

/// Room around the light of a tile, in √(λ f): what a window's edge scatters farther is lost.
constexpr double kRoom = 8.0;

/// Directions beyond those of the rays, in √(λ / f); more where the lens's rim cuts the light off.
/// With 4 in place of 6 a derivative in small tiles is 5.4 % off, with 6 less than 5 %.
constexpr double kSpread = 6.0;
constexpr double kEdgeSpread = 11.0;

/// Points across a node's cell at a hard edge.
constexpr int kEdgePoints = 4;

/// Larger fields are not made: what is steepest in them goes as rays if it is little, or if
/// quarters of the tile would overlap too little; else the tile is divided. Tiles of a drawing of
/// 128² on 25 mm have up to 2.4e7.
constexpr double kMostNodes = 4e7;
constexpr double kLittle = 0.005;   ///< Share of a tile's light.
constexpr double kLeastRamp = 1.0;  ///< In √(λ f).

/// Magnifications that are tried: so many either side of 1, up to the most.
constexpr int kMagnifications = 12;
constexpr double kMostWider = 8.0;

/// Room for rays to change in a plan that is kept, as a factor; one that is used less than by
/// kLeastUse is made anew: a step that went too far may have left it.
constexpr double kSlack = 1.05;
constexpr double kLeastUse = 0.6;

/// A tile that needs so many times more nodes than before has strayed: it is not followed.
constexpr double kMostGrowth = 8.0;

/// By how much light may stray from a plane to the next, in pixels or √(λ f), whichever is more:
/// what lands between them is a mixture of both. And the most planes on either side.
constexpr double kPlaneStep = 0.1;
constexpr double kMostPlaneSteps = 8.0;

/// From this share of the steepest direction kept on, waves fade into rays.
constexpr double kFade = 0.8;

/// The ray that comes to a point, where it is not the same for all.
std::optional<IncidentRay> incident_ray(const LightPath& light, const Eigen::Vector3d& p) {
  if (!light.varies()) return std::nullopt;
  return light.ray_to(p);
}

/// Light on a triangle of the surface, as a share of all.
double flux_of(const LightPath& light, const Corners& t) {
  if (!light.varies()) return light.flux(t);
  const IncidentRay a = light.ray_to(t.v0);
  const IncidentRay b = light.ray_to(t.v1);
  const IncidentRay c = light.ray_to(t.v2);
  return light.flux(t, {&a, &b, &c});
}

double node_count(const TilePlan& plan) {
  return static_cast<double>(plan.field.columns) * static_cast<double>(plan.field.rows);
}

/// One tile's way from the surface to the screen.
class WaveTile {
 public:
  /// @param plan   of an earlier look, to be used if it fits; null: a new one is made.
  /// @param slack  room in a new one, as a factor.
  WaveTile(const WaveScene& scene, const WaveColor& color, const SurfaceNodes& surface,
           const Tile& tile, const TilePlan* plan, double slack)
      : color_(color),
        options_(scene.options),
        edge_(scene.edge ? &*scene.edge : nullptr),
        surface_(surface),
        tile_(tile),
        slack_(slack),
        columns_(static_cast<int>(tile.x.nodes())),
        rows_(static_cast<int>(tile.y.nodes())),
        window_x_(windows(tile.x)),
        window_y_(windows(tile.y)) {
    trace(plan);
  }

  [[nodiscard]] const TilePlan& plan() const { return plan_; }

  /// True if no light leaves.
  [[nodiscard]] bool is_dark() const { return whole_ <= 0.0; }

  /// Calls `take(number, field)` for its field on each of the planes at the screen.
  template <class Take>
  void for_each_plane(const Take& take) const {
    PlaneField laid(plan_.field);
    if (has_edge()) {
      for_each_laid([&](const auto& corners, const auto& indices) {
        if (from_edge(indices) < 2 * edge_ring()) laid.cover(corners);
      });
    }
    for_each_laid(
        [&](const auto& corners, const auto& indices) { laid.add(corners, where(indices)); });
    laid.lay_rest();
    if (is_on_one_plane()) {
      laid.propagate();
      return take(0, laid);
    }
    for (int k = 0; k < plan_.planes; ++k) {
      PlaneField plane = laid.to_plane(plan_.way_to(k));
      plane.propagate();
      take(static_cast<std::size_t>(k), plane);
    }
  }

  /// Each node's light is spread over its cell, along the mean ray.
  /// @param kept  gets a field on one plane; may be null. @return of each plane.
  [[nodiscard]] std::vector<PixelLight> light(std::vector<PlaneField>* kept) const {
    std::vector<PixelLight> all;
    for_each_plane([&](std::size_t k, PlaneField& plane) {
      all.push_back(plane.spread(on_picture(k)));
      if (kept != nullptr && is_on_one_plane()) kept->push_back(std::move(plane));
    });
    all.front().whole = whole_;
    if (as_rays_ > 0.0) add_rays(all.front());
    return all;
  }
  [[nodiscard]] bool is_on_one_plane() const { return plan_.planes == 1; }

  /// Calls `take(column, row, derivative)` for all nodes: tile_heights_bar().
  /// @param kept  the field of light(), if it was kept.
  template <class Take>
  void heights_bar(std::optional<PlaneField> kept, std::span<const double> by_pixel,
                   const Take& take) const {
    std::optional<PlaneField> sum;
    const auto pull = [&](std::size_t k, PlaneField& plane) {
      plane.pull(on_picture(k), by_pixel);
      plane.return_back();
      if (sum) {
        sum->add(plane);
      } else {
        sum = std::move(plane);
      }
    };
    if (kept) {
      pull(0, *kept);
    } else {
      for_each_plane(pull);
    }
    PlaneField& field = *sum;
    std::vector<double> by_path(nodes_.size(), 0.0);
    for_each_laid([&](const auto& corners, const auto& indices) {
      field.gather(corners, where(indices), indices, by_path);
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
    Eigen::Vector3d direction;  ///< Of the light behind the surface, unit.
    Eigen::Vector2d q;          ///< mm
    Eigen::Vector2d cosine;     ///< p
    double path = 0.0;          ///< W, mm; up to the surface before start_rays().
    double rise = 0.0;  ///< ∂W/∂z of the surface, where the ray meets the starting plane.
    double window = 0.0;
    double light = 0.0;         ///< Of the triangles around.
    PlaneField::Vertex laid{};  ///< laid_ray(); its amplitude with the window.
  };

  /// Number of a node of the tile on the surface.
  [[nodiscard]] std::size_t on_surface(int i, int j) const {
    return surface_.at(tile_.x.begin + i, tile_.y.begin + j);
  }

  void trace(const TilePlan* plan) {
    const std::size_t count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    nodes_.assign(count, {});
    corners_.resize(count);
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) trace_node(i, j);
    }
    gather_light();
    if (is_dark()) return;
    if (plan != nullptr) {
      plan_ = *plan;
      start_rays();
      lay_rays();
      // From a new plane, too: a plan depends on the nodes alone.
      if (!fits()) return trace(nullptr);
    } else {
      plan_.frame = TileFrame(mean_);
      plan_.frame.level = level(mean_);
      start_rays();
      make_plan();
    }
    weigh_nodes();
    if (has_edge()) find_edge();
    if (plan_.limited) for_each_ray([&](const Three&, double flux) { as_rays_ += flux; });
    plan_.divided = should_be_divided();
  }

  /// Where the starting plane is along an axis: at the mean of the tile, but at that of its part of
  /// the lens's rim if it has one, since the rim's diffraction starts there. 0.3 mm above it a
  /// portrait in one piece changes by 0.0004 (MAE).
  [[nodiscard]] double level(const Eigen::Vector3d& axis) const {
    double sum = 0.0, rim = 0.0;
    int rim_nodes = 0;
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) {
        const double along = axis.dot(surface_.place[on_surface(i, j)]);
        sum += along;
        if (!is_on_rim(tile_.x, i) && !is_on_rim(tile_.y, j)) continue;
        rim += along;
        ++rim_nodes;
      }
    }
    return rim_nodes > 0 ? rim / rim_nodes : sum / (static_cast<double>(columns_) * rows_);
  }
  static bool is_on_rim(const Stretch& axis, int node) {
    return (node == 0 && axis.rise == 0) || (node == axis.nodes() - 1 && axis.fall == 0);
  }

  /// True if the rays stay inside the plan and need most of it.
  [[nodiscard]] bool fits() const {
    const Extents now = extents();
    const auto within = [](const Eigen::Vector2d& needed, const Eigen::Vector2d& planned) {
      return (needed.array() <= planned.array()).all() &&
             (needed.array() >= kLeastUse * planned.array()).all();
    };
    return within(now.start, plan_.start) && within(now.far, plan_.far) &&
           within(now.steepest + plan_.spread, plan_.steepest + plan_.spread);
  }

  /// How far laid rays go.
  struct Extents {
    Eigen::Vector2d start{0.0, 0.0};  ///< From the field's centre, mm.
    Eigen::Vector2d far{0.0, 0.0};    ///< Where they land, mm before magnification.
    Eigen::Vector2d steepest{1e-9, 1e-9};
  };
  [[nodiscard]] Extents extents() const {
    Extents all;
    for (const Node& node : nodes_) {
      if (!is_bright(node)) continue;
      all.start = all.start.cwiseMax(from_centre(node).cwiseAbs());
      all.far = all.far.cwiseMax(landing(node).cwiseAbs());
      all.steepest = all.steepest.cwiseMax(node.laid.cosine.cwiseAbs());
    }
    return all;
  }

  /// Follows the rays to the starting plane.
  void start_rays() {
    const TileFrame& frame = plan_.frame;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      Node& node = nodes_[k];
      if (!node.lit) continue;
      const Eigen::Vector3d from = frame.axes.transpose() * corners_[k];
      const Eigen::Vector3d direction = frame.axes.transpose() * node.direction;
      const double way = (frame.level - from.z()) / direction.z();
      node.q = from.head<2>() + way * direction.head<2>();
      node.cosine = direction.head<2>();
      node.path += way;
    }
  }

  void lay_rays() {
    for (Node& node : nodes_) {
      if (!node.lit) continue;
      node.laid = laid_ray(plan_.field, {node.q, node.cosine, node.path, 0.0});
    }
  }
  /// Of a laid ray, mm.
  [[nodiscard]] Eigen::Vector2d from_centre(const Node& node) const {
    return node.laid.place - plan_.field.centre;
  }
  /// Where a ray lands, from the mean ray, mm before magnification.
  [[nodiscard]] Eigen::Vector2d landing(const Node& node) const {
    const FieldPlan& field = plan_.field;
    return from_centre(node) + field.distance * node.laid.cosine.cwiseQuotient(field.magnification);
  }

  static Eigen::ArrayXd windows(const Stretch& axis) {
    return Eigen::ArrayXd::NullaryExpr(axis.nodes(),
                                       [&](Eigen::Index k) { return axis.window(axis.begin + k); });
  }

  void trace_node(int i, int j) {
    const std::size_t k = index({i, j});
    const std::size_t n = on_surface(i, j);
    const LightPath& light = color_.light;
    const Eigen::Vector3d& p = surface_.place[n];
    const Eigen::Vector2d& slope = surface_.slope[n];
    const Eigen::Vector3d normal = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    const std::optional<IncidentRay> ray = incident_ray(light, p);
    const IncidentRay* const known = ray ? &*ray : nullptr;
    corners_[k] = p;
    Node& node = nodes_[k];
    node.lit = light.transmits(p, normal, known);
    if (!node.lit) return;
    const Eigen::Vector2d m = light.beam(p, normal, known).m;
    node.direction = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
    node.path = color_.path.to(p, known);
    node.rise = color_.path.rise(p, known) - node.direction.z();
    // An outline's edge fades over one step of the rays, far below √(λ f).
    const bool in = edge_ == nullptr || edge_->contains(p.head<2>());
    node.window = in ? window_x_[i] * window_y_[j] : 0.0;
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
  /// True if light leaves all of a triangle, and the window lets some of it through.
  [[nodiscard]] bool is_bright(const Three& t) const {
    const Node& a = nodes_[index(t[0])];
    const Node& b = nodes_[index(t[1])];
    const Node& c = nodes_[index(t[2])];
    return a.lit && b.lit && c.lit && (a.window > 0.0 || b.window > 0.0 || c.window > 0.0);
  }
  /// Twice the area of laid rays, negative beyond a fold, mm².
  [[nodiscard]] double doubled_area(const Three& t) const {
    const Eigen::Vector2d& a = nodes_[index(t[0])].laid.place;
    return cross(nodes_[index(t[1])].laid.place - a, nodes_[index(t[2])].laid.place - a);
  }
  [[nodiscard]] double flux_on(const Three& t) const {
    return flux_of(color_.light,
                   {corners_[index(t[0])], corners_[index(t[1])], corners_[index(t[2])]});
  }

  /// The light around the nodes, all of the tile's, and its mean ray.
  void gather_light() {
    mean_.setZero();
    whole_ = 0.0;
    for_each_triangle([&](const Three& t) {
      if (!is_bright(t)) return;
      const double flux = flux_on(t);
      for (const Corner& c : t) {
        Node& node = nodes_[index(c)];
        node.light += flux;
        const double light = flux * node.window * node.window / 3.0;
        mean_ += light * node.direction;
        whole_ += light;
      }
    });
    mean_.normalize();
  }

  /// Amplitudes at the nodes, from the light and the area of the triangles around them.
  void weigh_nodes() {
    std::vector<double> area(nodes_.size(), 0.0);
    for_each_triangle([&](const Three& t) {
      if (!is_bright(t)) return;
      const double on_plane = 0.5 * std::abs(doubled_area(t));
      for (const Corner& c : t) area[index(c)] += on_plane;
    });
    const double reference = nodes_[index({columns_ / 2, rows_ / 2})].laid.path;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      Node& node = nodes_[k];
      if (area[k] == 0.0) continue;
      // At a caustic of the starting plane itself the area vanishes, but not the light around it.
      const double least = 1e-3 * surface_.spacing.prod();
      const double amplitude = std::sqrt(node.light / std::max(area[k], least));
      node.laid.amplitude = amplitude * node.window * std::sqrt(as_wave(node));
      node.laid.path -= reference;
    }
  }

  /// Share of a node's light that goes as a wave.
  [[nodiscard]] double as_wave(const Node& node) const {
    const Eigen::Vector2d off = node.laid.cosine.cwiseAbs().cwiseQuotient(plan_.steepest);
    const double share = (1.0 - off.maxCoeff()) / (1.0 - kFade);
    if (!plan_.limited || share >= 1.0) return 1.0;
    return share <= 0.0 ? 0.0 : share * share * (3.0 - 2.0 * share);
  }

  /// Light of the triangles that goes as rays.
  template <class Action>
  void for_each_ray(const Action& action) const {
    for_each_triangle([&](const Three& t) {
      if (!is_bright(t)) return;
      double share = 0.0;
      for (const Corner& c : t) {
        const Node& node = nodes_[index(c)];
        share += node.window * node.window * (1.0 - as_wave(node)) / 3.0;
      }
      if (share <= 0.0) return;
      action(t, share * flux_on(t));
    });
  }

  void add_rays(PixelLight& light) const {
    for_each_ray([&](const Three& t, double flux) {
      std::array<Eigen::Vector2d, 3> places;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t n = index(t[k]);
        places[k] = color_.light.land(corners_[n], slope_of(nodes_[n].direction));
      }
      add_ray(places, flux, light);
    });
  }

  /// Divides a triangle on the picture until it is smaller than half a pixel.
  void add_ray(const std::array<Eigen::Vector2d, 3>& t, double flux, PixelLight& light) const {
    const Eigen::Vector2i pixels(color_.screen.plane().columns(), color_.screen.plane().rows());
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& corner : t) box.extend(corner);
    if ((box.max().array() <= 0.0).any() ||
        (box.min().array() >= pixels.cast<double>().array()).any()) {
      return;
    }
    if (box.sizes().maxCoeff() > 0.5) {
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
    Eigen::AlignedBox2d start;
    for (const Node& node : nodes_) {
      if (is_bright(node)) start.extend(node.q);
    }
    const Eigen::Vector2d centre = start.center();
    FieldPlan& field = plan_.field;
    field.centre = centre;
    const TileFrame& frame = plan_.frame;
    field.distance =
        frame.axes.col(2).dot(color_.screen.at(lands(centre, frame.level))) - frame.level;
    field.wavelength = color_.wavelength;
    field.magnification = best_magnification();
    plan_.spread = {spread(0, field.magnification.x()), spread(1, field.magnification.y())};
    lay_rays();
    field.points = {is_cut(tile_.x) ? kEdgePoints : 1, is_cut(tile_.y) ? kEdgePoints : 1};
    const Extents now = extents();
    plan_.steepest = slack_ * now.steepest;
    plan_.limited = false;
    plan_nodes(now.start);
    // Below the spread of the waves, giving up more rays would save little.
    while (node_count(plan_) > kMostNodes && options_.tile > 0.0 &&
           (plan_.steepest.array() > plan_.spread.array()).any()) {
      plan_.limited = true;
      plan_.steepest *= 0.9;
      plan_nodes(now.start);
    }
    plan_planes();
  }

  /// One plane, or so many that light that strays goes a short way from the nearest to the screen.
  void plan_planes() {
    const FieldPlan& field = plan_.field;
    const OnPicture to = on_picture();
    double farthest = 0.0;  // mm
    double most = 0.0;      // Pixels.
    for (const Node& node : nodes_) {
      if (!is_bright(node)) continue;
      const Eigen::Vector2d at = field.magnification.cwiseProduct(landing(node));
      const Eigen::Vector2d wider = field.divergence().cwiseProduct(at);
      const double way = std::abs(to.tilt.dot(at) / (1.0 + to.tilt.dot(wider)));
      const Eigen::Vector2d slope = (landing(node) - from_centre(node)) / field.distance;
      farthest = std::max(farthest, way);
      most = std::max(most, way * (to.by_mm * slope).lpNorm<Eigen::Infinity>());
    }
    plan_.planes = 1;
    if (most <= options_.stray) return;
    const double spot = std::sqrt(color_.wavelength * field.distance);
    const double step = kPlaneStep * std::max(1.0, to.by_mm.col(0).norm() * spot);
    const double steps = std::min(std::ceil(most / step), kMostPlaneSteps);
    plan_.planes = 1 + 2 * static_cast<int>(steps);
    plan_.apart = farthest / steps;
  }

  /// The magnification with which the field has the fewest nodes.
  [[nodiscard]] Eigen::Vector2d best_magnification() const {
    const FieldPlan& field = plan_.field;
    // Places of the rays along each axis on both planes, from the middle.
    Eigen::ArrayX2d from(nodes_.size(), 2), to(nodes_.size(), 2);
    Eigen::Index rays = 0;
    for (const Node& node : nodes_) {
      if (!is_bright(node)) continue;
      const Eigen::Vector2d begin = node.q - field.centre;
      const double secant = 1.0 / std::sqrt(1.0 - node.cosine.squaredNorm());
      from.row(rays) = begin;
      to.row(rays) = begin + field.distance * secant * node.cosine;
      ++rays;
    }
    Eigen::Vector2d best(1.0, 1.0);
    for (int axis = 0; axis < 2; ++axis) {
      const auto begin = from.col(axis).head(rays);
      const auto end = to.col(axis).head(rays);
      const double start = begin.abs().maxCoeff();
      const double far = end.abs().maxCoeff();
      double fewest = HUGE_VAL;
      for (int k = -kMagnifications; k <= kMagnifications; ++k) {
        const double wider = std::pow(kMostWider, static_cast<double>(k) / kMagnifications);
        const double steepest = (end - wider * begin).abs().maxCoeff() / field.distance;
        const double count =
            field_size(axis, start, far / wider, wider) / node_step(axis, steepest, wider);
        if (count >= fewest) continue;
        fewest = count;
        best[axis] = wider;
      }
    }
    return best;
  }

  // Along an axis, for a magnification.

  /// Directions to which laid rays are scattered. √(λ f) is √(λ f m) where the light gets wider.
  [[nodiscard]] double spread(int axis, double wider) const {
    const double units = is_cut(axis == 0 ? tile_.x : tile_.y) ? kEdgeSpread : kSpread;
    return std::max(units * std::sqrt(color_.wavelength / plan_.field.distance * wider),
                    options_.scatter[axis]);
  }
  /// What scattered light needs around the rays, mm before magnification.
  [[nodiscard]] double room(int axis, double wider) const {
    const double distance = plan_.field.distance;
    return std::max(2.0 * distance * spread(axis, wider),
                    kRoom * std::sqrt(color_.wavelength * distance)) /
           wider;
  }
  /// @param start, far  farthest that light is on either plane, mm before magnification.
  [[nodiscard]] double field_size(int axis, double start, double far, double wider) const {
    return 2.0 * std::max(start, far) + room(axis, wider);
  }
  [[nodiscard]] double node_step(int axis, double steepest, double wider) const {
    const double pixel = color_.setup.image_size[axis] / color_.setup.pixels[axis];
    return std::min(color_.wavelength / (2.0 * kFiner * (steepest + spread(axis, wider))),
                    pixel / (kLeastPerPixel * wider));
  }

  /// @param start  farthest that laid rays are from the field's centre.
  void plan_nodes(const Eigen::Vector2d& start) {
    FieldPlan& field = plan_.field;
    Eigen::Vector2d farthest = Eigen::Vector2d::Zero();
    for (const Node& node : nodes_) {
      if (is_bright(node) && as_wave(node) > 0.0) {
        farthest = farthest.cwiseMax(landing(node).cwiseAbs());
      }
    }
    plan_.start = slack_ * start;
    plan_.far = slack_ * farthest;
    Eigen::Vector2i size;
    for (int axis = 0; axis < 2; ++axis) {
      const double wider = field.magnification[axis];
      field.reach[axis] = plan_.far[axis] + plan_.start[axis] + room(axis, wider);
      field.step[axis] = node_step(axis, plan_.steepest[axis], wider);
      size[axis] = transform_size(field_size(axis, plan_.start[axis], plan_.far[axis], wider) /
                                  field.step[axis]);
    }
    field.columns = size.x();
    field.rows = size.y();
  }

  /// True if it ends at the lens's rim, where no window fades the light.
  static bool is_cut(const Stretch& axis) { return axis.rise == 0 || axis.fall == 0; }

  [[nodiscard]] bool has_edge() const { return plan_.field.points.prod() > 1; }

  /// Numbers of nodes of a triangle.
  using Indices = std::array<std::size_t, 3>;

  /// Steps of the rays from a triangle to where the lit ones end, up to kFar.
  [[nodiscard]] int from_edge(const Indices& triangle) const {
    return std::min({from_edge_[triangle[0]], from_edge_[triangle[1]], from_edge_[triangle[2]]});
  }
  static constexpr std::uint8_t kFar = 200;

  /// Steps of the rays that a cell of the field reaches beyond a triangle, with room for rays that
  /// go closer together.
  [[nodiscard]] int edge_ring() const {
    const double reach = plan_.field.step.cwiseQuotient(surface_.spacing).maxCoeff();
    return 1 + static_cast<int>(std::ceil(std::min(2.0 * reach, 0.5 * kFar - 1.0)));
  }
  [[nodiscard]] PlaneField::Where where(const Indices& triangle) const {
    return has_edge() && from_edge(triangle) < edge_ring() ? PlaneField::Where::kAtEdge
                                                           : PlaneField::Where::kInside;
  }

  /// Counts the steps from the edge (Rosenfeld and Pfaltz's chessboard distance, two passes).
  void find_edge() {
    from_edge_.assign(nodes_.size(), kFar);
    const auto is_border = [&](int i, int j) {
      return i == 0 || j == 0 || i == columns_ - 1 || j == rows_ - 1;
    };
    for (int j = 0; j < rows_; ++j) {
      for (int i = 0; i < columns_; ++i) {
        if (is_border(i, j)) from_edge_[index({i, j})] = 0;
      }
    }
    for_each_triangle([&](const Three& t) {
      if (is_bright(t)) return;
      for (const Corner& c : t) from_edge_[index(c)] = 0;
    });
    const auto pass = [&](int to) {
      for (int m = 1; m + 1 < rows_; ++m) {
        const int j = to > 0 ? m : rows_ - 1 - m;
        for (int n = 1; n + 1 < columns_; ++n) {
          const int i = to > 0 ? n : columns_ - 1 - n;
          const std::size_t last = index({i, j - to});
          const int nearest = std::min({from_edge_[index({i - to, j})], from_edge_[last - 1],
                                        from_edge_[last], from_edge_[last + 1]});
          std::uint8_t& mine = from_edge_[index({i, j})];
          mine = static_cast<std::uint8_t>(std::min<int>(mine, nearest + 1));
        }
      }
    };
    pass(1);
    pass(-1);
  }

  /// Calls `take(corners, indices)` for the lit triangles on the starting plane.
  template <class Take>
  void for_each_laid(const Take& take) const {
    std::vector<PlaneField::Corner> corners(nodes_.size());
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      if (nodes_[k].lit) corners[k] = PlaneField::corner(plan_.field, nodes_[k].laid);
    }
    for_each_triangle([&](const Three& t) {
      if (!is_bright(t)) return;
      const Indices indices{index(t[0]), index(t[1]), index(t[2])};
      take(std::array<PlaneField::Corner, 3>{corners[indices[0]], corners[indices[1]],
                                             corners[indices[2]]},
           indices);
    });
  }

  static Eigen::Vector2d slope_of(const Eigen::Vector3d& direction) {
    return direction.head<2>() / direction.z();
  }
  /// Where a ray along the mean one lands from a place of a plane across it, pixel coordinates.
  [[nodiscard]] Eigen::Vector2d lands(const Eigen::Vector2d& place, double level) const {
    const TileFrame& frame = plan_.frame;
    return color_.light.land(frame.point(place, level), slope_of(frame.axes.col(2)));
  }

  /// Of a plane of the plan.
  [[nodiscard]] OnPicture on_picture(std::size_t plane) const {
    OnPicture to = on_picture();
    to.way = plan_.way_to(static_cast<int>(plane));
    if (plane > 0) to.before = plan_.apart;
    if (static_cast<int>(plane) + 1 < plan_.planes) to.behind = plan_.apart;
    return to;
  }
  /// Of the plane that meets the screen in its centre.
  [[nodiscard]] OnPicture on_picture() const {
    const FieldPlan& field = plan_.field;
    const double far = plan_.frame.level + field.distance;
    const Eigen::Vector2d at = lands(field.centre, far);
    Eigen::Matrix2d by_mm;
    by_mm << lands(field.centre + Eigen::Vector2d::UnitX(), far) - at,
        lands(field.centre + Eigen::Vector2d::UnitY(), far) - at;
    const OpticalSetup& setup = color_.setup;
    const Eigen::Vector3d normal =
        plan_.frame.axes.transpose() * setup.screen_x.cross(setup.screen_y);
    return {at, by_mm, setup.pixels, normal.head<2>() / normal.z()};
  }

  const WaveColor& color_;
  const WaveOptions& options_;
  const OutlineIndex* edge_;
  const SurfaceNodes& surface_;
  Tile tile_;
  double slack_;
  int columns_, rows_;
  Eigen::ArrayXd window_x_, window_y_;  ///< Of the columns and rows.
  std::vector<Node> nodes_;
  std::vector<Eigen::Vector3d> corners_;
  std::vector<std::uint8_t> from_edge_;  ///< By node; of a field with a hard edge.
  Eigen::Vector3d mean_{0.0, 0.0, 1.0};  ///< Direction of all its light.
  double whole_ = 0.0;
  double as_rays_ = 0.0;  ///< Light of directions that are too steep for the field.
  TilePlan plan_;
};

/// Calls `take(part)` for a tile that is lit, or for its quarters if its field would be too large.
/// @param memory  of the tile; null: nothing is kept.
template <class Take>
void for_each_part(const WaveScene& scene, const WaveColor& color, const SurfaceNodes& nodes,
                   const Tile& tile, TileMemory* memory, const Take& take) {
  if (scene.control.stop_requested()) return;
  const bool known = memory != nullptr && memory->plan;
  const WaveTile whole(scene, color, nodes, tile, known ? &*memory->plan : nullptr,
                       memory != nullptr ? kSlack : 1.0);
  if (whole.is_dark()) return;
  const TilePlan& plan = whole.plan();
  if (known && node_count(plan) > kMostGrowth * node_count(*memory->plan)) {
    memory->strayed = true;
    return;
  }
  if (memory != nullptr) {
    memory->plan.reset();
    if (!plan.limited) memory->plan = plan;
  }
  if (!plan.divided) {
    take(whole);
    return;
  }
  for (const Stretch& y : tile.y.halves()) {
    for (const Stretch& x : tile.x.halves()) {
      for_each_part(scene, color, nodes, {x, y}, nullptr, take);
    }
  }
}

}  // namespace

std::vector<PixelLight> tile_light(const WaveScene& scene, const WaveColor& color,
                                   const SurfaceNodes& nodes, const Tile& tile,
                                   TileMemory* memory) {
  std::vector<PixelLight> parts;
  for_each_part(scene, color, nodes, tile, memory, [&](const WaveTile& part) {
    const bool keeps = memory != nullptr && memory->keeps_fields;
    for (PixelLight& light : part.light(keeps ? &memory->fields : nullptr)) {
      parts.push_back(std::move(light));
    }
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
  for_each_part(scene, color, nodes, tile, &memory, [&](const WaveTile& part) {
    std::optional<PlaneField> field;
    if (part.is_on_one_plane() && next < kept.size()) field = std::move(kept[next++]);
    part.heights_bar(std::move(field), by_pixel, add);
  });
  return bars;
}

}  // namespace lensforge

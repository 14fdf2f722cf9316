// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/continued_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/lens/smooth_surface.h"
#include "core/optics/front.h"

namespace lensforge {
namespace {

/// From coefficients c_{−1} … c_n of lines, a line a column, on knots at all whole numbers to those
/// on knots with fourfold ends (Boehm's knot insertion): the value at the end, (2 c_0 + c_1) / 3,
/// c_1, ...
Eigen::MatrixXd clamped(const Eigen::MatrixXd& c) {
  const Eigen::Index last = c.rows() - 1;
  Eigen::MatrixXd result = c;
  result.row(0) = (c.row(0) + 4.0 * c.row(1) + c.row(2)) / 6.0;
  result.row(1) = (2.0 * c.row(1) + c.row(2)) / 3.0;
  result.row(last) = (c.row(last) + 4.0 * c.row(last - 1) + c.row(last - 2)) / 6.0;
  result.row(last - 1) = (2.0 * c.row(last - 1) + c.row(last - 2)) / 3.0;
  return result;
}

}  // namespace

ControlNet net_of(const HeightFront& front) {
  const HeightGrid& grid = front.spline->grid();
  ControlNet net{{grid.columns + 2, grid.rows + 2}, {}};
  Eigen::MatrixXd z(net.shape.columns, net.shape.rows);
  for (int j = 0; j < net.shape.rows; ++j) {
    for (int i = 0; i < net.shape.columns; ++i) z(i, j) = front.spline->coefficient(i - 1, j - 1);
  }
  z = clamped(clamped(z).transpose()).transpose().eval();
  const Eigen::Vector2i cells = net.cells();
  const Eigen::Vector2d step = front.size.cwiseQuotient(cells.cast<double>());
  net.points.resize(3, z.size());
  for (int j = 0; j < net.shape.rows; ++j) {
    for (int i = 0; i < net.shape.columns; ++i) {
      net.points.col(j * net.shape.columns + i)
          << front.corner.x() + step.x() * greville_point(i, cells.x()),
          front.corner.y() + step.y() * greville_point(j, cells.y()), z(i, j);
    }
  }
  return net;
}

namespace {

/// Vertices of the rim are at most this far from their side, mm: twice what a mesh's rim may
/// deviate (kRimDistance), since the box is that of the outermost ones.
constexpr double kOnSide = 0.02;

/// Largest slope that goes on beyond the rim, rise over run: lenses stay below 0.5, and a wall at
/// the rim must not reach the table within the continuation.
constexpr double kSteepest = 1.0;

/// Step of differences along the rim, mm: their errors are below 1e-6 of a slope.
constexpr double kStep = 1e-3;

/// Largest slope and curvature that go on, in means of their sizes over the rim: a rim's own stay
/// below, while those where a spline's knots crowd (3 µm apart at the corner of a picture of 24
/// pixels) and their derivatives at a corner would lift the continuation by 150 mm.
constexpr double kMostOfMean = 30.0;

constexpr int kSides = 4;
constexpr std::int64_t kFewestLayers = 2;
constexpr std::int64_t kMostLayers = 16;

/// A side of a rectangle, counter-clockwise from the lower one: outwards and along it.
struct Side {
  Eigen::Vector2d out, along;
};

Side side_of(int k) {
  constexpr std::array<double, kSides> cosine{1.0, 0.0, -1.0, 0.0};
  constexpr std::array<double, kSides> sine{0.0, 1.0, 0.0, -1.0};
  const auto i = static_cast<std::size_t>(k);
  return {{sine[i], -cosine[i]}, {cosine[i], sine[i]}};
}

/// An edge of the mesh on a side: from corner `corner` of a triangle to the next one.
struct RimEdge {
  std::int32_t triangle = 0;
  int corner = 0;
  double from = 0.0, to = 0.0;  ///< Places along the side, mm.
};

/// A point of the rim.
struct RimPoint {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  SurfaceShape shape;
};

/// The border of a surface over a rectangle, side by side.
class Rim {
 public:
  explicit Rim(const OpticalSurface& surface) : surface_(surface) {
    for (int k = 0; k < kSides; ++k) edges_[index(k)] = edges_on(k);
  }

  [[nodiscard]] const std::vector<RimEdge>& edges(int side) const { return edges_[index(side)]; }
  [[nodiscard]] double begin(int side) const { return edges(side).front().from; }
  [[nodiscard]] double end(int side) const { return edges(side).back().to; }

  /// @param at  place along the side, mm; the nearest valid one is taken.
  [[nodiscard]] RimPoint point(int side, double at) const {
    const std::vector<RimEdge>& all = edges(side);
    const auto behind =
        std::upper_bound(all.begin(), all.end(), at,
                         [](double place, const RimEdge& edge) { return place < edge.from; });
    const RimEdge& edge = behind == all.begin() ? all.front() : *(behind - 1);
    const double part = std::clamp((at - edge.from) / (edge.to - edge.from), 0.0, 1.0);
    Eigen::Vector3d weights = Eigen::Vector3d::Zero();
    weights[edge.corner] = 1.0 - part;
    weights[(edge.corner + 1) % 3] = part;
    RimPoint point;
    for (int c = 0; c < 3; ++c) {
      point.place += weights[c] * surface_.mesh().corner(edge.triangle, c).head<2>();
    }
    point.shape = surface_.shape_in(edge.triangle, weights);
    return point;
  }

 private:
  static std::size_t index(int side) { return static_cast<std::size_t>(side); }

  /// Edges with both ends on a side that no other triangle has in the other direction. Vertices
  /// need not be shared.
  [[nodiscard]] std::vector<RimEdge> edges_on(int k) const {
    const Side side = side_of(k);
    const SurfaceMesh& mesh = surface_.mesh();
    const Eigen::AlignedBox2d& box = surface_.box();
    const double level = std::max(side.out.dot(box.min()), side.out.dot(box.max()));
    const auto is_near = [&](const Eigen::Vector2d& p) {
      return level - side.out.dot(p) <= kOnSide;
    };
    using Ends = std::array<double, 4>;
    std::map<Ends, RimEdge> found;
    for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
      for (int c = 0; c < 3; ++c) {
        const Eigen::Vector2d a = mesh.corner(t, c).head<2>();
        const Eigen::Vector2d b = mesh.corner(t, (c + 1) % 3).head<2>();
        if (!is_near(a) || !is_near(b)) continue;
        if (found.erase(Ends{b.x(), b.y(), a.x(), a.y()}) > 0) continue;
        found.emplace(
            Ends{a.x(), a.y(), b.x(), b.y()},
            RimEdge{static_cast<std::int32_t>(t), c, side.along.dot(a), side.along.dot(b)});
      }
    }
    std::vector<RimEdge> edges;
    for (const auto& [ends, edge] : found) {
      // Others are of the sides before and behind, within kOnSide of the corner.
      const Eigen::Vector2d way(ends[2] - ends[0], ends[3] - ends[1]);
      if (side.along.dot(way) > std::abs(side.out.dot(way))) edges.push_back(edge);
    }
    std::sort(edges.begin(), edges.end(),
              [](const RimEdge& a, const RimEdge& b) { return a.from < b.from; });
    LF_CHECK(!edges.empty(), "no rim on side " + std::to_string(k));
    return edges;
  }

  const OpticalSurface& surface_;
  std::array<std::vector<RimEdge>, kSides> edges_;
};

/// Heights beyond the rim.
class Continuation {
 public:
  Continuation(const OpticalSurface& surface, const RunOut& run_out)
      : rim_(surface), run_out_(run_out) {
    double steep = 0.0;
    double bent = 0.0;
    double length = 0.0;
    for (int side = 0; side < kSides; ++side) {
      for (const RimEdge& edge : rim_.edges(side)) {
        const RimPoint middle = rim_.point(side, 0.5 * (edge.from + edge.to));
        const double along = edge.to - edge.from;
        steep += along * middle.shape.slope.norm();
        bent += along * std::abs(bend_at(side, middle));
        length += along;
      }
    }
    steepest_ = std::min(kSteepest, kMostOfMean * steep / length);
    // What a curvature adds to the slope in the end is bounded like the slope.
    most_bent_ = std::min(steepest_ / run_out_.slope(run_out_.length), kMostOfMean * bent / length);
    for (int side = 0; side < kSides; ++side) {
      CornerPoints& corner = corners_[static_cast<std::size_t>(side)];
      for (std::size_t k = 0; k < corner.size(); ++k) {
        corner[k] = rim_.point(side, rim_.end(side) - kStep * static_cast<double>(k));
      }
    }
  }

  [[nodiscard]] const Rim& rim() const { return rim_; }

  /// Beyond a side.
  [[nodiscard]] SurfacePoint beyond(int side, const Eigen::Vector2d& xy) const {
    const Side axes = side_of(side);
    const double at = axes.along.dot(xy);
    const Strip here = strip(side, at, axes.out.dot(xy));
    double low = std::max(at - kStep, rim_.begin(side));
    double high = std::min(at + kStep, rim_.end(side));
    const double along =
        (strip(side, high, here.level).added - strip(side, low, here.level).added) / (high - low);
    return {here.z, here.out * axes.out + (here.along + along) * axes.along};
  }

  /// beyond().z
  [[nodiscard]] double height_beyond(int side, const Eigen::Vector2d& xy) const {
    const Side axes = side_of(side);
    return strip(side, axes.along.dot(xy), axes.out.dot(xy)).z;
  }

  /// Beyond a side and the next one: the strip of the first, continued like the surface.
  [[nodiscard]] SurfacePoint beyond_corner(int side, const Eigen::Vector2d& xy) const {
    const Side axes = side_of(side);
    const Corner corner = corner_of(side, xy);
    const auto& [a, b, c, d] = corner.strips;
    const bool rising = std::abs(corner.slope) < steepest_;
    const double out_slope = rising ? first(a.out, b.out, c.out, d.out) : 0.0;
    const bool bent = std::abs(corner.bend) < most_bent_;
    const double out_bend = a.curved && bent ? second(a.out, b.out, c.out, d.out) : 0.0;
    const double distance = corner.distance;
    return {corner.z,
            (corner.slope + run_out_.slope(distance) * corner.bend) * axes.along +
                (a.out + distance * out_slope + run_out_.height(distance) * out_bend) * axes.out};
  }
  /// beyond_corner().z
  [[nodiscard]] double height_beyond_corner(int side, const Eigen::Vector2d& xy) const {
    return corner_of(side, xy).z;
  }

 private:
  /// A place beyond a side.
  struct Strip {
    double level = 0.0;   ///< Its coordinate outwards, mm.
    double z = 0.0;       ///< mm
    double added = 0.0;   ///< Of that, what the continuation adds to the rim's height.
    double out = 0.0;     ///< Slope outwards.
    double along = 0.0;   ///< Slope of the rim along it.
    bool curved = false;  ///< The rim's curvature is continued.
  };
  /// Points of a side's rim from its end backwards, kStep apart.
  using CornerPoints = std::array<RimPoint, 4>;
  /// A place beyond a side and the next one.
  struct Corner {
    std::array<Strip, 4> strips;  ///< Beyond the CornerPoints.
    double distance = 0.0;        ///< From the next side, mm.
    double slope = 0.0;           ///< Of the strip along the side, at its end.
    double bend = 0.0;            ///< Curvature there, 1/mm.
    double z = 0.0;               ///< mm
  };

  // Derivatives at the first of four places kStep apart, exact for cubics.
  static double first(double a, double b, double c, double d) {
    return (11.0 * a - 18.0 * b + 9.0 * c - 2.0 * d) / (6.0 * kStep);
  }
  static double second(double a, double b, double c, double d) {
    return (2.0 * a - 5.0 * b + 4.0 * c - d) / (kStep * kStep);
  }

  static double bend_at(int side, const RimPoint& rim) {
    const Eigen::Vector2d out = side_of(side).out;
    return out.dot(rim.shape.bend * out);
  }

  [[nodiscard]] Corner corner_of(int side, const Eigen::Vector2d& xy) const {
    const Side axes = side_of(side);
    const CornerPoints& rim = corners_[static_cast<std::size_t>(side)];
    Corner corner;
    for (std::size_t k = 0; k < rim.size(); ++k) {
      corner.strips[k] = strip(side, rim[k], axes.out.dot(xy));
    }
    const auto& [a, b, c, d] = corner.strips;
    corner.distance = std::max(axes.along.dot(xy) - rim_.end(side), 0.0);
    corner.slope = std::clamp(first(a.z, b.z, c.z, d.z), -steepest_, steepest_);
    corner.bend = a.curved ? std::clamp(second(a.z, b.z, c.z, d.z), -most_bent_, most_bent_) : 0.0;
    corner.z =
        a.z + corner.distance * corner.slope + run_out_.height(corner.distance) * corner.bend;
    return corner;
  }

  [[nodiscard]] Strip strip(int side, double at, double level) const {
    return strip(side, rim_.point(side, at), level);
  }

  [[nodiscard]] Strip strip(int side, const RimPoint& rim, double level) const {
    const Side axes = side_of(side);
    const double distance = std::max(level - axes.out.dot(rim.place), 0.0);
    const double slope = std::clamp(rim.shape.slope.dot(axes.out), -steepest_, steepest_);
    const double bend = std::clamp(bend_at(side, rim), -most_bent_, most_bent_);
    Strip strip;
    strip.level = level;
    strip.added = distance * slope + run_out_.height(distance) * bend;
    strip.z = rim.shape.z + strip.added;
    strip.out = slope + run_out_.slope(distance) * bend;
    strip.along = rim.shape.slope.dot(axes.along);
    strip.curved = !rim.shape.bend.isZero(0.0);
    return strip;
  }

  Rim rim_;
  RunOut run_out_;
  double steepest_ = kSteepest;  ///< Rise over run.
  double most_bent_ = 0.0;       ///< 1/mm
  std::array<CornerPoints, kSides> corners_;
};

/// A triangle of the continuation: beyond this side, or beyond it and the next one.
struct Beyond {
  int side = 0;
  bool corner = false;
};

/// Lays strips of quadrilaterals around a mesh, and squares at its corners; seen from above.
class ApronMesh {
 public:
  ApronMesh(const SurfaceMesh& mesh, const Rim& rim, double reach, std::int64_t layers)
      : mesh_(mesh), rim_(rim), reach_(reach), layers_(layers) {
    for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
      vertices_.emplace_back(mesh.vertices.col(v));
    }
    for (int k = 0; k < kSides; ++k) lay_strip(k);
    for (int k = 0; k < kSides; ++k) lay_corner(k);
  }

  /// Heights of new vertices are 0.
  [[nodiscard]] SurfaceMesh mesh() const {
    SurfaceMesh whole;
    whole.vertices.resize(3, static_cast<Eigen::Index>(vertices_.size()));
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      whole.vertices.col(static_cast<Eigen::Index>(v)) = vertices_[v];
    }
    const Eigen::Index inner = mesh_.triangles.cols();
    whole.triangles.resize(3, inner + static_cast<Eigen::Index>(triangles_.size()));
    whole.triangles.leftCols(inner) = mesh_.triangles;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      whole.triangles.col(inner + static_cast<Eigen::Index>(t)) = triangles_[t];
    }
    return whole;
  }
  /// Of every new triangle, in their order.
  [[nodiscard]] const std::vector<Beyond>& beyond() const { return beyond_; }
  /// The rim's vertex from which each new one was laid out.
  [[nodiscard]] const std::vector<int>& origins() const { return origins_; }

 private:
  using Line = std::vector<int>;  ///< Vertices along a side.

  [[nodiscard]] double distance(std::size_t layer) const {
    return reach_ * static_cast<double>(layer) / static_cast<double>(layers_);
  }

  int add(const Eigen::Vector2d& xy, int origin) {
    origins_.push_back(origin);
    vertices_.emplace_back(xy.x(), xy.y(), 0.0);
    return static_cast<int>(vertices_.size()) - 1;
  }

  /// @param inner, outer  in the side's direction.
  void lay(const Line& inner, const Line& outer, const Beyond& beyond) {
    for (std::size_t i = 0; i + 1 < inner.size(); ++i) {
      triangles_.emplace_back(outer[i], outer[i + 1], inner[i + 1]);
      triangles_.emplace_back(outer[i], inner[i + 1], inner[i]);
      beyond_.insert(beyond_.end(), 2, beyond);
    }
  }

  void lay_strip(int k) {
    const Side side = side_of(k);
    std::vector<Line>& lines = lines_[static_cast<std::size_t>(k)];
    Line rim;
    for (const RimEdge& edge : rim_.edges(k)) {
      rim.push_back(mesh_.triangles(edge.corner, edge.triangle));
    }
    const RimEdge& last = rim_.edges(k).back();
    rim.push_back(mesh_.triangles((last.corner + 1) % 3, last.triangle));
    double level = -HUGE_VAL;
    for (const int v : rim) level = std::max(level, side.out.dot(place(v)));
    lines.push_back(rim);
    for (std::size_t layer = 1; layer <= static_cast<std::size_t>(layers_); ++layer) {
      Line line;
      for (const int v : rim) {
        const double along = side.along.dot(place(v));
        line.push_back(add((level + distance(layer)) * side.out + along * side.along, v));
      }
      lay(lines.back(), line, {k, false});
      lines.push_back(std::move(line));
    }
  }

  /// The square between the last nodes of a side's lines and the first ones of the next side's.
  void lay_corner(int k) {
    const std::vector<Line>& lines = lines_[static_cast<std::size_t>(k)];
    const std::vector<Line>& next = lines_[static_cast<std::size_t>((k + 1) % kSides)];
    const int corner = lines.front().back();
    Line inner;
    for (const Line& line : next) inner.push_back(line.front());
    inner.front() = corner;
    for (std::size_t layer = 1; layer < lines.size(); ++layer) {
      Line outer{lines[layer].back()};
      for (std::size_t i = 1; i < inner.size(); ++i) {
        const Eigen::Vector2d xy =
            place(lines[layer].back()) + place(next[i].front()) - place(corner);
        outer.push_back(add(xy, corner));
      }
      lay(inner, outer, {k, true});
      inner = std::move(outer);
    }
  }

  [[nodiscard]] Eigen::Vector2d place(int vertex) const {
    return vertices_[static_cast<std::size_t>(vertex)].head<2>();
  }

  const SurfaceMesh& mesh_;
  const Rim& rim_;
  double reach_;
  std::int64_t layers_;
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<Beyond> beyond_;
  std::vector<int> origins_;
  std::array<std::vector<Line>, kSides> lines_;  ///< From the rim outwards.
};

/// As many as make triangles of about the size of the mesh's own.
std::int64_t layers_for(const OpticalSurface& surface, double reach) {
  const double area = surface.box().volume() / static_cast<double>(surface.mesh().triangle_count());
  const auto layers = static_cast<std::int64_t>(std::ceil(reach / std::sqrt(2.0 * area)));
  return std::clamp(layers, kFewestLayers, kMostLayers);
}

/// A spline and its continuation.
class ContinuedSurface final : public OpticalSurface {
 public:
  /// What is known before the mesh.
  struct Parts {
    std::shared_ptr<const OpticalSurface> inner;
    Continuation continuation;
    SurfaceMesh mesh;
    std::vector<Beyond> beyond;
    std::vector<std::array<SurfacePoint, 3>> corners;  ///< Of the triangles beyond.

    Parts(std::shared_ptr<const OpticalSurface> surface, double reach, const RunOut& run_out)
        : inner(std::move(surface)), continuation(*inner, run_out) {
      ApronMesh apron(inner->mesh(), continuation.rim(), reach, layers_for(*inner, reach));
      mesh = apron.mesh();
      beyond = apron.beyond();
      const std::int64_t first = inner->mesh().triangle_count();
      for (std::size_t n = 0; n < beyond.size(); ++n) {
        auto& points = corners.emplace_back();
        for (int k = 0; k < 3; ++k) {
          const auto triangle = first + static_cast<std::int64_t>(n);
          const int vertex = mesh.triangles(k, triangle);
          points[static_cast<std::size_t>(k)] = point(n, mesh.vertices.col(vertex).head<2>());
          if (vertex < inner->mesh().vertex_count()) continue;
          mesh.vertices(2, vertex) = points[static_cast<std::size_t>(k)].z;
        }
      }
    }

    [[nodiscard]] SurfacePoint point(std::size_t triangle, const Eigen::Vector2d& xy) const {
      const Beyond& place = beyond[triangle];
      return place.corner ? continuation.beyond_corner(place.side, xy)
                          : continuation.beyond(place.side, xy);
    }

    /// point().z
    [[nodiscard]] double height(std::size_t triangle, const Eigen::Vector2d& xy) const {
      const Beyond& place = beyond[triangle];
      return place.corner ? continuation.height_beyond_corner(place.side, xy)
                          : continuation.height_beyond(place.side, xy);
    }
  };

  explicit ContinuedSurface(Parts parts) : OpticalSurface(parts.mesh), parts_(std::move(parts)) {
    parts_.mesh = {};
    middles_.reserve(parts_.beyond.size());
    for (std::size_t n = 0; n < parts_.beyond.size(); ++n) {
      const auto [a, b, c] = places_of(first() + static_cast<std::int64_t>(n));
      middles_.push_back(parts_.height(n, (a + b + c) / 3.0));
    }
  }

  [[nodiscard]] bool has_creases() const override { return false; }

  [[nodiscard]] SurfacePoint in_triangle(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const override {
    if (triangle < first()) return parts_.inner->in_triangle(triangle, weights);
    return parts_.point(number(triangle), place_in(triangle, weights));
  }

  [[nodiscard]] double height_in(std::int64_t triangle,
                                 const Eigen::Vector3d& weights) const override {
    if (triangle < first()) return parts_.inner->height_in(triangle, weights);
    return parts_.height(number(triangle), place_in(triangle, weights));
  }

  [[nodiscard]] SmoothPatch patch_in(std::int64_t triangle,
                                     const Eigen::Vector3d& weights) const override {
    if (triangle < first()) return parts_.inner->patch_in(triangle, weights);
    const std::size_t n = number(triangle);
    return cubic_through(places_of(triangle), parts_.corners[n], middles_[n]);
  }

  [[nodiscard]] BendRange bend_range(std::int64_t triangle) const override {
    if (triangle < first()) return parts_.inner->bend_range(triangle);
    const SmoothPatch patch = patch_in(triangle, Eigen::Vector3d::Constant(1.0 / 3.0));
    BendRange range{HUGE_VAL, -HUGE_VAL};
    for (int k = 0; k < 3; ++k) {
      range.include(patch.at(mesh().corner(triangle, k).head<2>()).bend);
    }
    return range;
  }

 private:
  /// First triangle of the continuation.
  [[nodiscard]] std::int64_t first() const { return parts_.inner->mesh().triangle_count(); }
  [[nodiscard]] std::size_t number(std::int64_t triangle) const {
    return static_cast<std::size_t>(triangle - first());
  }
  /// Of a triangle's corners, seen from above.
  [[nodiscard]] std::array<Eigen::Vector2d, 3> places_of(std::int64_t triangle) const {
    std::array<Eigen::Vector2d, 3> places;
    for (int k = 0; k < 3; ++k) {
      places[static_cast<std::size_t>(k)] = mesh().corner(triangle, k).head<2>();
    }
    return places;
  }
  [[nodiscard]] Eigen::Vector2d place_in(std::int64_t triangle,
                                         const Eigen::Vector3d& weights) const {
    Eigen::Vector2d xy(0.0, 0.0);
    for (int k = 0; k < 3; ++k) xy += weights[k] * mesh().corner(triangle, k).head<2>();
    return xy;
  }

  Parts parts_;
  std::vector<double> middles_;  ///< Heights in the middles of the triangles beyond, mm.
};

/// The smooth surface with its own slopes at all vertices, old and new: slopes stay continuous
/// across the rim and all around.
std::shared_ptr<const OpticalSurface> continued_smooth(std::shared_ptr<const SmoothSurface> surface,
                                                       double reach, const RunOut& run_out) {
  Eigen::Matrix2Xd slopes = surface->slopes();
  const Eigen::Index inner = surface->mesh().triangles.cols();
  const Eigen::Index vertices = slopes.cols();
  ContinuedSurface::Parts parts(std::move(surface), reach, run_out);
  slopes.conservativeResize(2, parts.mesh.vertices.cols());
  for (std::size_t n = 0; n < parts.corners.size(); ++n) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int vertex =
          parts.mesh.triangles(static_cast<Eigen::Index>(k), inner + static_cast<Eigen::Index>(n));
      if (vertex >= vertices) slopes.col(vertex) = parts.corners[n][k].slope;
    }
  }
  return std::make_shared<const SmoothSurface>(parts.mesh, std::move(slopes));
}

/// Facets around facets, on the slopes of the mesh's own normals at its rim.
std::shared_ptr<const OpticalSurface> continued_facets(const OpticalSurface& surface,
                                                       double reach) {
  const SurfaceMesh& mesh = surface.mesh();
  const Rim rim(surface);
  const ApronMesh apron(mesh, rim, reach, 1);
  SurfaceMesh whole = apron.mesh();
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
  for (std::size_t n = 0; n < apron.origins().size(); ++n) {
    const int from = apron.origins()[n];
    auto vertex = whole.vertices.col(mesh.vertices.cols() + static_cast<Eigen::Index>(n));
    const Eigen::Vector2d slope =
        (-normals.col(from).head<2>() / normals(2, from)).cwiseMax(-kSteepest).cwiseMin(kSteepest);
    vertex.z() = mesh.vertices(2, from) + slope.dot((vertex - mesh.vertices.col(from)).head<2>());
  }
  return std::make_shared<const FacetSurface>(whole);
}

}  // namespace

std::shared_ptr<const OpticalSurface> continued_surface(
    std::shared_ptr<const OpticalSurface> surface, double reach, const RunOut& run_out) {
  if (surface->has_creases()) return continued_facets(*surface, reach);
  if (auto smooth = std::dynamic_pointer_cast<const SmoothSurface>(surface)) {
    return continued_smooth(std::move(smooth), reach, run_out);
  }
  return std::make_shared<const ContinuedSurface>(
      ContinuedSurface::Parts(std::move(surface), reach, run_out));
}

}  // namespace lensforge

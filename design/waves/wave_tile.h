// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "core/optics/screen.h"
#include "design/waves/wave_picture.h"

// Notation: in the frame of a tile, whose third axis is its mean ray: q a ray's place on the
// starting plane, W its optical path up to there, p its direction cosines along the first two axes,
// m = p / √(1 − |p|²) its slope. A bar is ∂E/∂.

namespace lensforge {

// How a field goes from one plane to another, tile by tile.

/// A field on a plane and its way to a parallel one, along their normal. Without the phase of rays
/// that keep to places magnified so: laid fields have little phase left, and few nodes. Parabolic,
/// for rays that laid_ray() moved.
struct FieldPlan {
  double wavelength = 550e-6;        ///< mm
  double distance = 0.0;             ///< Between the planes, mm, > 0.
  Eigen::Vector2d centre{0.0, 0.0};  ///< Of the nodes of both planes, mm.
  /// Of the light on the other plane against that on the first, along x and y, > 0.
  Eigen::Vector2d magnification{1.0, 1.0};
  Eigen::Vector2d step{0.0, 0.0};  ///< Of the nodes, mm.
  int columns = 0, rows = 0;
  /// Components that go farther aside than this on their way are dropped, mm before magnification:
  /// they would come back on the other side of the nodes.
  Eigen::Vector2d reach{HUGE_VAL, HUGE_VAL};
  /// Points along x and y by which a node's cell is known to be lit: more than one where the field
  /// has a hard edge across that axis.
  Eigen::Vector2i points{1, 1};

  /// Column and row of the centre.
  [[nodiscard]] Eigen::Vector2i centre_node() const { return Eigen::Vector2i(columns, rows) / 2; }
  [[nodiscard]] Eigen::Vector2d middle() const { return centre_node().cast<double>(); }
  /// The same field's to a plane farther along by `way`, mm.
  [[nodiscard]] FieldPlan beyond(double way) const {
    FieldPlan there = *this;
    there.distance += way;
    const Eigen::Vector2d wider = magnification - Eigen::Vector2d::Ones();
    there.magnification = Eigen::Vector2d::Ones() + there.distance / distance * wider;
    return there;
  }
  /// How the slopes of rays that keep to magnified places change along the other plane, 1/mm.
  [[nodiscard]] Eigen::Vector2d divergence() const {
    return (Eigen::Vector2d::Ones() - magnification.cwiseInverse()) / distance;
  }
};

/// The next size of 2, 3, 5 and 7 from `least` up, even: fast to transform.
/// @pre least is below kMostTransform: tiles need some thousands, so more is a surface with a hole.
int transform_size(double least);
inline constexpr double kMostTransform = 1e7;

/// How a plane's light lands on a picture. Light at a place x from the plane's centre goes the way
/// t = −(way + tilt·x) / (1 + tilt·(divergence x)) to the screen, where it is at centre + by_mm (1
/// + t divergence) x. Light that is far from a common magnification strays on it, by t times how
/// its slope differs; so that of planes `apart` from each other is mixed, linearly by t.
struct OnPicture {
  Eigen::Vector2d centre;          ///< Pixel coordinates of the field's centre.
  Eigen::Matrix2d by_mm;           ///< Their derivatives, along the normal.
  Eigen::Vector2i pixels;          ///< Columns and rows of the picture.
  Eigen::Vector2d tilt{0.0, 0.0};  ///< Slopes of the plane against the screen.
  double way = 0.0;                ///< Of the centre from the screen, along the normal, mm.
  /// To the plane before and behind, mm; none: this one has all the light there.
  double before = HUGE_VAL, behind = HUGE_VAL;

  /// Share of this plane in light with a way to the screen.
  [[nodiscard]] double share(double t) const {
    return std::max(0.0, 1.0 - (t < 0.0 ? -t / before : t / behind));
  }
};

/// Light of a rectangle of pixels.
struct PixelLight {
  Eigen::Vector2i first{0, 0};  ///< Column and row.
  int columns = 0, rows = 0;
  std::vector<double> light;  ///< Row by row.
  double whole = 0.0;         ///< All that the field has, on these pixels or not.
  /// Light that came as rays: pixels of the picture, row by row, and shares.
  std::vector<std::pair<int, double>> rays;
};

/// A scalar field on as many nodes as its rays ask for. Phases are found in double precision,
/// values kept in single: 1e-7 of the field.
class PlaneField {
 public:
  /// A ray on the plane.
  struct Vertex {
    Eigen::Vector2d place;   ///< mm
    Eigen::Vector2d cosine;  ///< Derivative of its path by the place.
    double path = 0.0;       ///< Optical, mm.
    double amplitude = 0.0;  ///< √(light per mm²)
  };

  /// A linear function of a place in steps from the first node.
  struct Linear {
    double a = 0.0, b = 0.0, c = 0.0;

    [[nodiscard]] double at(double x, double y) const { return a * x + b * y + c; }
  };
  /// A ray on the nodes of a plan.
  struct Corner {
    Eigen::Vector2d at{0.0, 0.0};  ///< In steps from the first node.
    Linear turns;                  ///< Phase ÷ 2π around it, as triangles lay it.
    double amplitude = 0.0;
  };
  [[nodiscard]] static Corner corner(const FieldPlan& plan, const Vertex& vertex);

  /// Where a triangle is: at a hard edge of the field, or where triangles are all around.
  enum class Where { kInside, kAtEdge };

  explicit PlaneField(const FieldPlan& plan);
  /// The same field, to go to a plane farther along by `way`, mm. @pre not propagated.
  [[nodiscard]] PlaneField to_plane(double way) const;

  /// Of a field with a hard edge, before the first of add(), its triangles at the edge and those
  /// that share nodes' cells with them: such cells have as much of their node's field as is lit of
  /// them.
  void cover(const std::array<Corner, 3>& corners);
  /// Adds the field of a triangle of neighbouring rays at the nodes inside it, or, of nodes that no
  /// triangle holds, of which a point is; at the latest when the field is propagated or lay_rest()
  /// is called. The path is the quadratic through the vertices with their directions as slopes; a
  /// triangle that is turned over is beyond a fold, where the phase is π/2 less. Points on a common
  /// side of two triangles belong to one of them.
  void add(const std::array<Corner, 3>& corners, Where where = Where::kInside);
  void lay_rest();

  /// Goes to the other plane by the angular spectrum: the nodes' distances are then magnified;
  /// their light stays what it was.
  void propagate();

  /// Adjoint of spread(): a field on the other plane becomes the derivative 2 ∂E/∂|U|² · U.
  /// @param by_pixel  derivatives by the light of all pixels, row by row.
  void pull(const OnPicture& to, std::span<const double> by_pixel);
  /// Adjoint of propagate().
  void return_back();
  /// Adjoint of add() by the paths of the vertices, on the field of return_back(): adds
  /// 2π/λ · Im(Ū U*) of the nodes, U what the triangle laid there, at the latest when
  /// gather_rest() is called.
  /// @param vertex  index of each in `by_path`.
  void gather(const std::array<Corner, 3>& corners, Where where,
              const std::array<std::size_t, 3>& vertex, std::span<double> by_path);
  void gather_rest(std::span<double> by_path);
  /// Adds the values of another field on the first plane. @pre the same nodes.
  void add(const PlaneField& other);

  /// Light of the nodes on pixels, each spread evenly over its cell.
  [[nodiscard]] PixelLight spread(const OnPicture& to) const;

  [[nodiscard]] const FieldPlan& plan() const { return plan_; }
  [[nodiscard]] double bytes() const {
    return static_cast<double>(values_.size() * sizeof(values_[0]) + lit_.size());
  }
  /// Node (i, j), (0, 0) the lowest.
  [[nodiscard]] const std::complex<float>& at(int i, int j) const {
    return values_[static_cast<std::size_t>(j) * static_cast<std::size_t>(plan_.columns) +
                   static_cast<std::size_t>(i)];
  }
  [[nodiscard]] std::complex<float>& at(int i, int j) {
    return values_[static_cast<std::size_t>(j) * static_cast<std::size_t>(plan_.columns) +
                   static_cast<std::size_t>(i)];
  }

 private:
  /// Nodes to lay or gather at once.
  struct Pending {
    std::vector<std::size_t> node;
    std::vector<double> turns;  ///< Phase ÷ 2π.
    std::vector<float> amplitude;
    // To gather alone.
    std::vector<std::array<std::size_t, 3>> vertex;
    std::vector<std::array<double, 3>> share;  ///< Of the vertices in the node's path.

    void clear() {
      node.clear();
      turns.clear();
      amplitude.clear();
      vertex.clear();
      share.clear();
    }
  };

  /// Calls `take(node, turns, amplitude, shares)` for the nodes that a triangle lays.
  template <class Take>
  void for_each_node(const std::array<Corner, 3>& corners, Where where, const Take& take) const;
  void go(bool back);
  void transform_rows(int sign);
  /// Transforms the columns, multiplies, and transforms them back.
  void turn_columns(const Eigen::ArrayXcf& along_x, const Eigen::ArrayXcf& along_y);

  FieldPlan plan_;
  std::vector<std::complex<float>> values_;
  std::vector<std::uint8_t> lit_;  ///< Of a field with a hard edge: by cover().
  Pending pending_;
};

/// A ray as its field has it: without the plan's phases, and moved along its own direction such
/// that parabolic waves land where it lands, with its path. The canonical map of what the square
/// root in the angular spectrum has beyond its parabola: as if rays were followed for some
/// 3/2 D |p|² more before waves start.
PlaneField::Vertex laid_ray(const FieldPlan& plan, const PlaneField::Vertex& ray);

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

struct Tile {
  Stretch x, y;

  [[nodiscard]] CellRange cells() const {
    return {x.begin, y.begin, x.end - x.begin, y.end - y.begin};
  }
};

/// Nodes of a surface, row by row: a rectangle of a grid that need not be even.
struct SurfaceNodes {
  std::int64_t columns = 0;
  std::int64_t first_column = 0, first_row = 0;  ///< Of the rectangle, in the grid.
  Eigen::Vector2d spacing{0.0, 0.0};             ///< Mean distance of neighbours, mm.
  std::vector<Eigen::Vector3d> place;            ///< mm
  std::vector<Eigen::Vector2d> slope;            ///< ∂z/∂x, ∂z/∂y

  /// Number of the grid's node (column, row) here.
  [[nodiscard]] std::size_t at(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>((row - first_row) * columns + column - first_column);
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
  /// Derivative of to() by the point's height.
  [[nodiscard]] double rise(const Eigen::Vector3d& p, const IncidentRay* ray) const {
    if (ray == nullptr) return index_ * inside_.z();
    return index_ * (p - ray->entry()).normalized().z();
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
  double wavelength;   ///< mm
  double share;        ///< Of the brightness.
  double whole = 0.0;  ///< Light of the whole lens, by light.flux(); 0: what the tiles add up to.
};

/// Common inputs of the tiles.
struct WaveScene {
  const WaveOptions& options;
  const RunControl& control;
  std::vector<WaveColor> colors;
  std::optional<OutlineIndex> edge;  ///< Of a lens with an outline.
};

/// Axes of a tile: across and along its mean ray. On planes across it waves are parabolic: on
/// planes z = const those of oblique rays have a third order in p, for which laid_ray() would
/// follow rays 3 D |p0 p| before waves start, a fifth of the way behind a mirror lit at 30°.
struct TileFrame {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Columns: across, across, along.
  double level = 0.0;  ///< Of the starting plane along the third, mm.

  TileFrame() = default;
  /// @param along  unit, z > 0.
  explicit TileFrame(const Eigen::Vector3d& along) {
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
    axes.col(0) = (x - along.x() * along).normalized();
    axes.col(1) = along.cross(axes.col(0));
    axes.col(2) = along;
  }
  /// A place on a plane across, in the lens's frame.
  [[nodiscard]] Eigen::Vector3d point(const Eigen::Vector2d& place, double along) const {
    return axes.leftCols<2>() * place + along * axes.col(2);
  }
};

/// How a tile's field is laid.
struct TilePlan {
  bool divided = false;  ///< Its quarters show it better.
  TileFrame frame;
  Eigen::Vector2d steepest{0.0, 0.0};  ///< Directions of laid rays that go as waves.
  Eigen::Vector2d spread{0.0, 0.0};    ///< Directions to which they are scattered besides.
  bool limited = false;                ///< Steeper ones go as rays.
  Eigen::Vector2d start{0.0, 0.0};  ///< Farthest that rays may start from the field's centre, mm.
  Eigen::Vector2d far{0.0, 0.0};    ///< The same where they land, before magnification.
  FieldPlan field;
  int planes = 1;      ///< On which the field is found, around that of `field`.
  double apart = 0.0;  ///< Of neighbours, mm.

  /// Of a plane from that of `field`, mm.
  [[nodiscard]] double way_to(int plane) const {
    const int middle = planes / 2;
    return (plane - middle) * apart;
  }
};

/// What is kept of a tile from one look at its surface to the next.
struct TileMemory {
  /// Stays while the rays fit it: pictures jump by some 1e-4 where the size of a field does. None
  /// if the tile was divided, or some of its light went as rays.
  std::optional<TilePlan> plan;
  /// True if the rays went so much farther apart than before that nothing was made.
  bool strayed = false;
  bool keeps_fields = false;
  /// On the screen, of parts with one plane; for tile_heights_bar(), which uses them up.
  std::vector<PlaneField> fields;
};

/// Light that a tile of a surface sends to the pixels, of its quarters if its field would be too
/// large. Nothing if the scene's control asks to stop.
/// @param nodes  of the tile and around. @param memory  may be null.
std::vector<PixelLight> tile_light(const WaveScene& scene, const WaveColor& color,
                                   const SurfaceNodes& nodes, const Tile& tile,
                                   TileMemory* memory = nullptr);

/// Derivatives of Σ by_pixel · light by the heights of the tile's nodes at their places, row by
/// row. A height changes the optical path of the ray through it, which is stationary (Fermat); that
/// it also changes the amplitude on the starting plane, by D q² / 2k of that for ripples of wave
/// number q and D from the surface to the plane, is left out, as is light that goes as rays.
/// @param by_pixel  of all pixels of color.setup, row by row from the top.
/// @param memory    of tile_light() for the same nodes.
std::vector<double> tile_heights_bar(const WaveScene& scene, const WaveColor& color,
                                     const SurfaceNodes& nodes, const Tile& tile,
                                     std::span<const double> by_pixel, TileMemory& memory);

}  // namespace lensforge

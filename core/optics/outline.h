// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge {

class Executor;

enum class OutlineKind { kCircle, kRoundedRectangle, kPolygon };

/// Edge of a lens seen along z: one closed line inside the rectangle OpticalSetup::lens_size. Light
/// passes only inside it.
struct Outline {
  OutlineKind kind = OutlineKind::kCircle;
  double radius = 0.0;  ///< Radius of a circle or of rounded corners, mm.
  /// Corners of the closed polygon that bounds the light, counter-clockwise, mm, lens frame. Chords
  /// of an arc are within 2.4e-6 of its radius: a circle of 100 mm is exact to 0.12 µm, its area to
  /// 3.2e-6 (OutlineTest.CircleIsRoundToItsErrorBound).
  std::vector<Eigen::Vector2d> points;

  friend bool operator==(const Outline&, const Outline&) = default;
};

/// Maximum number of corners of a polygon: with more, triangles are finer than any tool.
inline constexpr std::size_t kMaxOutlinePoints = 20000;

/// The largest circle centred in the rectangle [0, size.x] × [0, size.y].
Outline circle_outline(const Eigen::Vector2d& size);

/// The rectangle with rounded corners. @pre 0 < radius ≤ half of the shorter side.
Outline rounded_outline(const Eigen::Vector2d& size, double radius);

/// A polygon in any unit and either direction, made counter-clockwise, centred in the rectangle and
/// scaled uniformly to the largest size that fits. @pre at least 3 points.
Outline polygon_outline(const Eigen::Vector2d& size, std::vector<Eigen::Vector2d> points);

/// Signed area of a closed polygon; positive if counter-clockwise.
double polygon_area(const std::vector<Eigen::Vector2d>& points);

/// An outline in a few words: "circle of 100 mm", "corners of radius 5 mm".
std::string outline_words(const Outline& outline);

/// Returns one clause saying why a closed polygon cannot be a lens's edge (too few or too many
/// corners, a side without length, sides that cross or touch, no area); nothing if it can.
std::optional<std::string> polygon_fault(const std::vector<Eigen::Vector2d>& points);

/// A triangle seen along z, counter-clockwise, mm.
using PlanTriangle = std::array<Eigen::Vector2d, 3>;

Eigen::AlignedBox2d box_of(const PlanTriangle& t);

/// A triangular part of a triangle: column k holds the barycentric weights of its corner k,
/// counter-clockwise.
struct TrianglePiece {
  Eigen::Matrix3d weights = Eigen::Matrix3d::Identity();
  double share = 1.0;  ///< Share of the triangle's area, > 0.
};

/// Spatial index for the inside of an outline.
class OutlineIndex {
 public:
  explicit OutlineIndex(const Outline& outline);

  enum class Side { kOutside, kInside, kAcross };

  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const;
  /// Side of the outline on which a box lies; kAcross if the bounding box of one of the outline's
  /// sides touches it.
  [[nodiscard]] Side side_of(const Eigen::AlignedBox2d& box) const;
  /// The exact part of a triangle inside the outline, as triangles that do not overlap: the whole
  /// triangle if all of it is inside, none if nothing is. A share below kMinShare counts as
  /// nothing; a share less than that short of the whole counts as whole.
  [[nodiscard]] std::vector<TrianglePiece> inside(const PlanTriangle& t) const;

  static constexpr double kMinShare = 1e-12;

 private:
  [[nodiscard]] int slab_of(double y) const;
  [[nodiscard]] const Eigen::Vector2d& start(std::size_t side) const { return points_[side]; }
  [[nodiscard]] const Eigen::Vector2d& end(std::size_t side) const {
    return points_[side + 1 < points_.size() ? side + 1 : 0];
  }

  std::vector<Eigen::Vector2d> points_;
  double low_ = 0.0;                             ///< Least y, mm.
  double step_ = 1.0;                            ///< Height of a slab, mm.
  std::vector<std::vector<std::size_t>> slabs_;  ///< Sides that reach into each strip of y.
};

/// The cut of a mesh's triangles by an outline, seen along z.
struct MeshCut {
  struct Piece {
    std::int64_t face = -1;
    TrianglePiece piece;
  };

  static constexpr std::int32_t kWhole = -1;

  /// Per face: kWhole if inside the outline, otherwise the index in `pieces` of its first piece. If
  /// that piece belongs to another face, nothing of this face is inside.
  std::vector<std::int32_t> first;
  std::vector<Piece> pieces;  ///< Face by face; the last belongs to no face.
  std::vector<double> share;  ///< Share of each face's area that is inside, 0 … 1.
};

/// The result does not depend on the number of threads. @pre every triangle faces +z.
MeshCut cut_mesh(const SurfaceMesh& mesh, const Outline& outline, const Executor& executor);

/// The part of a surface inside an outline as a separate mesh. Height and unit normal of corners on
/// the outline are interpolated linearly, so facets stay in their planes.
/// @param normals  3 × V, of any length but 0.
SampledSurface part_inside(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                           const MeshCut& cut);

}  // namespace lensforge

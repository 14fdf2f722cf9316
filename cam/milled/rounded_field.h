// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/drop_cutter.h"
#include "cam/contact/smooth_roll.h"
#include "cam/milled/designed_field.h"
#include "cam/milled/surface_field.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Which triangles of a mesh a ball that is tangent to a facet may cut: for most facets none, for
/// those beside valleys a few.
class FacetReach {
 public:
  /// @param grid  must outlive this.
  FacetReach(const FacetGrid& grid, double radius, const Executor& executor);

  /// True if the ball around `centre` that is tangent to the facet certainly cuts no triangle.
  [[nodiscard]] bool surely_free(std::int32_t facet, const Eigen::Vector3d& centre) const;

 private:
  /// n·x = level
  struct Plane {
    Eigen::Vector3d normal;
    double level;
  };

  [[nodiscard]] std::vector<std::int32_t> suspects_of(const FacetGrid& grid,
                                                      std::int32_t facet) const;

  double radius_;
  std::vector<Plane> planes_;  ///< Of the facets.
  /// Of facet f: suspects_[begin_[f] … begin_[f + 1]).
  std::vector<std::int64_t> begin_;
  std::vector<std::int32_t> suspects_;
};

/// Where a ball that is tangent to a smooth surface certainly cuts nothing of it.
///
/// Where no second derivative of the surface under the ball exceeds 1/R, the height at which a
/// point of the surface holds the ball is concave in that point (SmoothBed), so that the one where
/// the ball is tangent holds it highest.
class SmoothReach {
 public:
  SmoothReach(const SmoothBed& bed, const Executor& executor);

  /// @param centre  of the ball, seen from above.
  [[nodiscard]] bool surely_free(const Eigen::Vector2d& centre) const {
    return free_[static_cast<std::size_t>(row_of(centre.y()) * columns_ + column_of(centre.x()))] !=
           0;
  }

 private:
  [[nodiscard]] static std::int64_t cell_of(double at, double begin, double cell,
                                            std::int64_t cells);
  [[nodiscard]] std::int64_t column_of(double x) const {
    return cell_of(x, box_.min().x(), cell_, columns_);
  }
  [[nodiscard]] std::int64_t row_of(double y) const {
    return cell_of(y, box_.min().y(), cell_, rows_);
  }

  Eigen::AlignedBox2d box_;
  double cell_ = 0.0;
  std::int64_t columns_ = 1;
  std::int64_t rows_ = 1;
  std::vector<std::uint8_t> free_;  ///< Of balls with their centres in a cell.
};

/// The ball that reaches deepest over a place, cutting into nothing.
struct LowestBall {
  double z = 0.0;                                    ///< Its lower side over the place, mm.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< mm
  double spread = 0.0;  ///< Largest distance between the points that hold it, mm; 0 with one.
};

/// A height and slopes of a surface over a place.
struct TangentPlane {
  double z = 0.0;  ///< mm
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};

/// Moves a ball over a place of a surface until it reaches deepest.
///
/// Sought is the centre c that makes c.z − √(R² − |q − c.xy|²) least while the ball cuts into no
/// triangle. Triangles are taken up one by one as the drop-cutter finds them cut. Each is replaced
/// by a plane that keeps the ball off it; over planes the lowest ball is known in closed form (on
/// one, in the valley of two, in the pit of three), and there the planes are laid anew: the
/// convex–concave procedure (Yuille and Rangarajan 2003). Over facets that meet in valleys one
/// round is exact. From the ball that is tangent at q it leads to a minimum next to it.
class LowestBallSearch {
 public:
  /// A ball rests where it cuts no deeper than this, mm.
  static constexpr double kResting = 1e-10;

  /// @param cutter  of the surface; must outlive the search.
  /// @param margin  how deep a ball may cut into the mesh and still count as resting, mm: what the
  ///                mesh may be off the surface that tangent planes are given of.
  explicit LowestBallSearch(const DropCutter& cutter, double margin = 0.0)
      : cutter_(cutter), resting_(kResting + margin) {}

  /// @param near  a location close by, which makes it faster; is set to the last one.
  [[nodiscard]] LowestBall over(const Eigen::Vector2d& q, const TangentPlane& plane,
                                CutterLocation& near) const;

 private:
  const DropCutter& cutter_;
  double resting_;
};

/// What a ball can reach of a surface when its rows lie infinitely close: the morphological closing
/// of the surface by the ball. Where the ball that is tangent to the designed surface cuts into
/// nothing the two surfaces are one; elsewhere it is the lower side of the ball that reaches
/// deepest (LowestBallSearch), with that ball's normal.
///
/// Two faces whose normals are Δ apart keep a fillet R·tan(Δ/2) wide on either face, and
/// R(1/cos(Δ/2) − 1) is left standing over the crease; the ball touches them 2R·sin(Δ/2) apart.
class RoundedField final : public SurfaceField {
 public:
  /// A fillet's `cut`; elsewhere it is that of the designed surface, empty where that has none.
  static constexpr std::int32_t kFillet = -1;

  /// Rounds the facets of a mesh. All must outlive the field; `cutter` was built on the mesh of
  /// `grid`, and `designed` samples its facets.
  RoundedField(const SurfaceField& designed, const FacetGrid& grid, const DropCutter& cutter,
               const Executor& executor);

  /// Rounds any surface, of which the facets of `cut` are an approximation; fillets follow those,
  /// everything else the surface. Facets are made for a square of kPatch at a time, and where the
  /// surface bends less than the ball not at all. Both must outlive the field.
  /// @param error  how far those facets may lie from the surface, mm: a ball that cuts no deeper
  ///               into them does not count as held.
  RoundedField(const SurfaceField& designed, const CutSurface& cut, double error,
               const Executor& executor);

  static constexpr double kPatch = 2.0;  ///< mm

  /// Tells as well what was left standing: SurfacePatch::depth and width.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  /// Nodes of a window: columns and rows [first, second).
  struct Range {
    std::pair<std::int64_t, std::int64_t> columns;
    std::pair<std::int64_t, std::int64_t> rows;
  };

  static std::vector<Range> squares_of(const GridWindow& window);
  void round_facets_of(const Range& range, SurfacePatch& patch) const;
  void round(const LowestBallSearch& search, const Range& range, const Executor& executor,
             SurfacePatch& patch) const;
  /// Centre of the ball that touches the surface from above over q.
  [[nodiscard]] Eigen::Vector3d tangent_ball(const Eigen::Vector2d& q,
                                             const TangentPlane& plane) const;
  [[nodiscard]] bool surely_free(std::size_t node, const Eigen::Vector3d& centre,
                                 const SurfacePatch& patch) const;

  const SurfaceField& designed_;
  double radius_;
  double error_ = 0.0;
  const CutSurface* cut_ = nullptr;         ///< Null for the facets of a mesh.
  std::optional<LowestBallSearch> search_;  ///< Of the facets of a mesh.
  std::optional<FacetReach> reach_;         ///< Likewise.
  std::optional<SmoothReach> smooth_reach_;
};

}  // namespace lensforge

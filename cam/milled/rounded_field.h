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
#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_field.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Triangles of a mesh that a ball tangent to a facet may cut: none for most facets, a few for
/// those beside valleys.
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

/// Places where a ball that is tangent to a smooth surface certainly cuts nothing of it.
///
/// Where no second derivative of the surface under the ball exceeds 1/R, the height at which a
/// point of the surface holds the ball is concave in that point (SmoothBed), so the tangent point
/// holds it highest.
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
  std::vector<std::uint8_t> free_;  ///< For balls with their centres in a cell.
};

/// The lowest ball over a place that cuts into nothing.
struct LowestBall {
  double z = 0.0;                                    ///< Its lower side over the place, mm.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< mm
  double spread = 0.0;  ///< Largest distance between the points that hold it, mm; 0 with one.
};

/// Height and slopes of a surface at a place.
struct TangentPlane {
  double z = 0.0;  ///< mm
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
};

/// Moves a ball over a place of a surface to its lowest position.
///
/// Finds the centre c with the least c.z − √(R² − |q − c.xy|²) for which the ball cuts into no
/// triangle. Triangles are added one by one as the drop-cutter finds them cut. Each is replaced by
/// a plane that keeps the ball off it; the lowest ball over planes has a closed form (on one, in
/// the valley of two, in the pit of three), and there the planes are set up anew: the
/// convex–concave procedure (Yuille and Rangarajan 2003). Over facets that meet in valleys one
/// round is exact. Starting from the ball tangent at q it finds a nearby minimum.
class LowestBallSearch {
 public:
  /// Maximum cut of a resting ball into the mesh, mm.
  static constexpr double kResting = 1e-10;

  /// @param cutter  of the surface; must outlive the search.
  /// @param margin  additional cut into the mesh with which a ball still counts as resting, mm: the
  ///                mesh's error against the surface of the tangent planes.
  explicit LowestBallSearch(const DropCutter& cutter, double margin = 0.0)
      : cutter_(cutter), resting_(kResting + margin) {}

  /// @param near  a close location, which speeds the search up; set to the last one.
  [[nodiscard]] LowestBall over(const Eigen::Vector2d& q, const TangentPlane& plane,
                                CutterLocation& near) const;

 private:
  const DropCutter& cutter_;
  double resting_;
};

/// The surface that a ball can reach with infinitely close rows: the morphological closing of the
/// designed surface by the ball. Where the ball tangent to the designed surface cuts into nothing
/// the two are equal; elsewhere it is the lower side of the lowest ball (LowestBallSearch), with
/// that ball's normal.
///
/// Two faces whose normals are Δ apart keep a fillet R·tan(Δ/2) wide on either face and
/// R(1/cos(Δ/2) − 1) high over the crease; the ball touches them 2R·sin(Δ/2) apart.
class RoundedField final : public SurfaceField {
 public:
  /// Value of `cut` in a fillet; elsewhere that of the designed surface, empty if it has none.
  static constexpr std::int32_t kFillet = -1;

  /// Rounds the facets of a mesh. All must outlive the field; `cutter` was built on the mesh of
  /// `grid`, and `designed` samples its facets.
  RoundedField(const SurfaceField& designed, const FacetGrid& grid, const DropCutter& cutter,
               const Executor& executor);

  /// Rounds any surface approximated by the facets of `cut`; fillets follow the facets, everything
  /// else the surface. Facets are made for a square of kPatch at a time, and not at all where the
  /// surface bends less than the ball. Both must outlive the field.
  /// @param error  maximum distance of those facets from the surface, mm: a ball that cuts no
  ///               deeper into them does not count as held.
  RoundedField(const SurfaceField& designed, const CutSurface& cut, double error,
               const Executor& executor);

  static constexpr double kPatch = 2.0;  ///< mm

  /// Also computes the remaining material: SurfacePatch::depth and width.
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

/// The facets of a mesh, not smoothed; `cut` is the number of the facet, the lowest one on a seam.
/// Nodes beside the mesh, up to FacetGrid::kRim, lie on the plane of the nearest facet.
class FacetField final : public SurfaceField {
 public:
  /// @param mesh  must outlive the field. @pre every triangle faces +z, and there is one.
  explicit FacetField(const SurfaceMesh& mesh) : grid_(mesh) {}

  /// @throw InputError naming a node farther from the mesh than FacetGrid::kRim.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

  [[nodiscard]] const FacetGrid& grid() const { return grid_; }

 private:
  FacetGrid grid_;
};

/// A surface without creases; no pieces. Nodes beside the mesh, up to
/// FacetGrid::kRim, lie on the tangent plane of the rim.
class SmoothField final : public SurfaceField {
 public:
  /// @param surface  must outlive the field. @pre not surface.has_creases()
  explicit SmoothField(const OpticalSurface& surface) : surface_(surface), grid_(surface.mesh()) {}

  /// @throw InputError naming a node farther from the mesh than FacetGrid::kRim.
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  const OpticalSurface& surface_;
  FacetGrid grid_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/drop_cutter.h"
#include "cam/milled/designed_field.h"
#include "cam/milled/facet_reach.h"
#include "cam/milled/lowest_ball.h"
#include "cam/milled/smooth_reach.h"
#include "cam/milled/surface_field.h"

namespace lensforge {

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

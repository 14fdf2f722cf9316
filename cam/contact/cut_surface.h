// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "cam/contact/drop_cutter.h"
#include "cam/contact/smooth_roll.h"
#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_check.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Size and steepness of a height field.
struct HeightField {
  Eigen::AlignedBox3d box;         ///< Of all triangles, mm.
  double steepest = 0.0;           ///< Largest slope, rise over run.
  Eigen::Vector3d steepest_place;  ///< Centre of that triangle, mm.
};

/// Checks a surface that is to be cut from above.
/// @param size  of the rectangle from (0, 0) that it has to cover, mm.
/// @throw InputError if it has no triangles, has coordinates that are not finite, or does not cover
///        the rectangle exactly once (height_field_fault()).
HeightField inspect_height_field(const SurfaceMesh& mesh, const Eigen::Vector2d& size);

/// The triangles of a height field, indexed by their place seen from above.
class FacetGrid {
 public:
  /// Points up to this far outside of the mesh belong to its nearest triangle, mm: a rim may
  /// deviate that far from its rectangle (kRimDistance).
  static constexpr double kRim = 0.02;

  /// @param mesh  must outlive the grid. @pre every triangle faces +z, and there is one.
  explicit FacetGrid(const SurfaceMesh& mesh);

  /// Numbers of all triangles whose boxes, kRim wider, overlap `box`; ascending.
  [[nodiscard]] std::vector<std::int32_t> near(const Eigen::AlignedBox2d& box) const;

  [[nodiscard]] const SurfaceMesh& mesh() const { return mesh_; }

 private:
  [[nodiscard]] Eigen::Vector2i cell_at(const Eigen::Vector2d& xy) const;
  [[nodiscard]] Eigen::AlignedBox2d box_of(std::int64_t triangle) const;

  const SurfaceMesh& mesh_;
  Eigen::AlignedBox2d box_;
  Eigen::Vector2i cells_{1, 1};
  /// Triangles that overlap cell c are triangles_[begin_[c] … begin_[c + 1]).
  std::vector<std::int64_t> begin_;
  std::vector<std::int32_t> triangles_;
};

/// Maximum distance of the cut triangles from the designed surface.
struct SurfaceDeviation {
  double height = 0.0;  ///< mm, along z
  double slope = 0.0;   ///< Difference of slopes, no less than the angle in rad.
};

/// Height at which a ball is held above its drop curve.
class BallLift {
 public:
  BallLift() = default;
  BallLift(const BallLift&) = delete;
  BallLift& operator=(const BallLift&) = delete;
  virtual ~BallLift() = default;

  /// Lift for these places of its axis and its contact, as it rolls, mm, ≥ 0. Where the ball
  /// follows facets, both are the axis.
  [[nodiscard]] virtual double at(const Eigen::Vector2d& axis,
                                  const Eigen::Vector2d& contact) const = 0;
  /// True if the ball stays clear of places where it cannot roll instead of following their facets.
  [[nodiscard]] virtual bool clears() const = 0;
};

/// The surface that a strategy cuts, with drop-cutters for parts of it.
class CutSurface {
 public:
  CutSurface() = default;
  CutSurface(const CutSurface&) = delete;
  CutSurface& operator=(const CutSurface&) = delete;
  virtual ~CutSurface() = default;

  /// A drop-cutter with all of the surface that a ball whose axis is in the box can touch. Drop
  /// curves have the same bits for any box.
  [[nodiscard]] virtual std::shared_ptr<const DropCutter> cutter(
      const Eigen::AlignedBox2d& axis, const Executor& executor) const = 0;
  [[nodiscard]] virtual double radius() const = 0;
  /// The surface without facets, on which most drop curves can be followed more closely; null where
  /// the facets are the designed surface.
  [[nodiscard]] virtual const SmoothBed* bed() const { return nullptr; }
  [[nodiscard]] virtual SurfaceDeviation deviation() const { return {}; }
  /// Lift of the ball above its drop curve; null if none.
  [[nodiscard]] virtual const BallLift* lift() const { return nullptr; }
  /// Maximum movement of the axis across the rows that share a cutter, mm, so that it fits in
  /// memory.
  [[nodiscard]] virtual double band() const { return std::numeric_limits<double>::infinity(); }
};

/// The facets of a mesh, not smoothed.
class FacetCutSurface final : public CutSurface {
 public:
  /// @param radius  of the ball, mm, > 0.
  FacetCutSurface(const SurfaceMesh& mesh, double radius, const Executor& executor)
      : cutter_(std::make_shared<const DropCutter>(mesh, radius, executor)) {}

  [[nodiscard]] std::shared_ptr<const DropCutter> cutter(
      const Eigen::AlignedBox2d& /*axis*/, const Executor& /*executor*/) const override {
    return cutter_;
  }
  [[nodiscard]] double radius() const override { return cutter_->radius(); }

 private:
  std::shared_ptr<const DropCutter> cutter_;
};

/// Fineness of the facets of a surface without creases. A triangle that would need more than
/// kMaxSplits parts, as at a crease, gets kMaxSplits, and deviation() includes it.
struct SmoothCutOptions {
  double deviation = 2e-5;        ///< Of a facet from the surface, mm, > 0.
  double slope_deviation = 4e-3;  ///< Of a facet's slopes from the surface's, > 0.
  /// Approximate maximum number of facets in a cutter: 260 bytes each.
  std::int64_t facets_at_once = 4'000'000;
};

/// Maximum number of parts of a triangle's edge.
inline constexpr int kMaxSplits = 48;

/// A surface without creases, as facets between points of it: every triangle is divided into n²
/// equal parts, n depending on its curvature. Facets are made for a band at a time.
///
/// On a triangle with second derivatives ≤ c the error of an interpolant is at most c r²/2, r being
/// the radius of the smallest circle around it, and that of its slopes c l₁ l₂ (l₃ + 4 r_in) / (4
/// A), l₁ ≥ l₂ ≥ l₃ (Shewchuk, "What is a good linear element?", 2002). Slits between neighbouring
/// triangles of different n are no higher than that.
class SmoothCutSurface final : public CutSurface {
 public:
  /// @param radius  of the ball, mm, > 0. @pre not surface->has_creases()
  SmoothCutSurface(std::shared_ptr<const OpticalSurface> surface, double radius,
                   const SmoothCutOptions& options, const Executor& executor);
  /// The same surface and ball with other facets.
  SmoothCutSurface(const SmoothCutSurface& same, const SmoothCutOptions& options,
                   const Executor& executor);
  /// The smooth model's surface over a mesh. @pre every triangle faces +z.
  SmoothCutSurface(const SurfaceMesh& mesh, double radius, const SmoothCutOptions& options,
                   const Executor& executor)
      : SmoothCutSurface(optical_surface(mesh, SurfaceModel::kSmooth), radius, options, executor) {}

  [[nodiscard]] std::shared_ptr<const DropCutter> cutter(const Eigen::AlignedBox2d& axis,
                                                         const Executor& executor) const override;
  [[nodiscard]] double radius() const override { return radius_; }
  [[nodiscard]] const SmoothBed* bed() const override { return &bent_->bed; }
  [[nodiscard]] SurfaceDeviation deviation() const override { return deviation_; }
  [[nodiscard]] double band() const override { return band_; }

  /// The facets that overlap or touch a window, in the order of the mesh's triangles.
  [[nodiscard]] SurfaceMesh facets(const Eigen::AlignedBox2d& window,
                                   const Executor& executor) const;
  [[nodiscard]] const OpticalSurface& surface() const { return *surface_; }
  /// Number of facets of the whole surface.
  [[nodiscard]] std::int64_t facet_count() const;

 private:
  /// The part that does not depend on the facets.
  struct Bent {
    std::vector<float> bends;  ///< Of each triangle, the largest second derivative, 1/mm.
    SmoothBed bed;
  };

  static std::shared_ptr<const Bent> bent(const OpticalSurface& surface, double radius,
                                          const Executor& executor);
  void split(const SmoothCutOptions& options, const Executor& executor);

  std::shared_ptr<const OpticalSurface> surface_;
  FacetGrid grid_;
  double radius_;
  std::shared_ptr<const Bent> bent_;
  std::vector<std::uint8_t> splits_;  ///< n of each triangle.
  SurfaceDeviation deviation_;
  double band_ = 0.0;
};

}  // namespace lensforge

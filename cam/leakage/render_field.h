// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/milled/creases.h"
#include "core/compute/executor.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/optics/outline.h"
#include "design/flux/flux_image.h"
#include "design/flux/flux_triangle.h"
#include "design/flux/surface_projection.h"

namespace lensforge {

// Light of a grid triangle that a crease runs through.
//
// Notation: a *side* is the smooth piece of surface that a corner belongs to, continued to second
// order around that corner; x_k the point where sides k and k + 1 meet on the edge between their
// corners; m a point inside the triangle where all sides meet.

/// The surface around a node, continued as if there were no crease.
struct SurfaceSide {
  Eigen::Vector2d place{0.0, 0.0};  ///< mm
  double z = 0.0;
  Eigen::Vector2d slope{0.0, 0.0};
  Eigen::Matrix2d bend = Eigen::Matrix2d::Zero();  ///< Derivatives of the slope, 1/mm, symmetric.
  std::int32_t cut = 0;

  [[nodiscard]] double height_at(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d d = p - place;
    return z + d.dot(slope + 0.5 * (bend * d));
  }
  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector2d& p) const {
    return {p.x(), p.y(), height_at(p)};
  }
  [[nodiscard]] Eigen::Vector2d slope_at(const Eigen::Vector2d& p) const {
    return slope + bend * (p - place);
  }
};

/// Landing place of the ray from a surface point of height z and the given slope, in pixel
/// coordinates; NaN if the light is reflected totally.
/// @param known  LightPath::enter() of the point, if already known.
inline Eigen::Vector2d land_of(const LightPath& light, const Eigen::Vector2d& place, double z,
                               const Eigen::Vector2d& slope, const IncidentRay* known = nullptr) {
  const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const Eigen::Vector3d p(place.x(), place.y(), z);
  if (!light.transmits(p, n, known)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return light.land(p, light.beam(p, n, known).m);
}

/// Meeting point of two sides between their nodes, as a share of the way from a to b.
inline double meeting_share(const SurfaceSide& a, const SurfaceSide& b) {
  return meeting_share(b.height_at(a.place) - a.z, b.z - a.height_at(b.place));
}

/// Passes the image triangles of a surface triangle whose corners lie on different cuts to `sink`:
/// every corner keeps the quadrilateral (corner, x_k, m, x_k−1) of its own side, whose points land
/// according to that side's slope. Each side's light stays on its side, and the pieces cover the
/// triangle exactly: nothing is projected between the two landing places.
/// @param lens_area  mm², of the grid; fluxes are shares of the light on it.
template <class Sink>
void split_at_crease(const std::array<SurfaceSide, 3>& sides, const LightPath& light,
                     double lens_area, const Sink& sink) {
  std::array<Eigen::Vector2d, 3> meeting;
  Eigen::Vector2d sum(0.0, 0.0);
  int creases = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const SurfaceSide& a = sides[k];
    const SurfaceSide& b = sides[(k + 1) % 3];
    const double share = a.cut == b.cut ? 0.5 : meeting_share(a, b);
    meeting[k] = a.place + share * (b.place - a.place);
    if (a.cut == b.cut) continue;
    sum += meeting[k];
    ++creases;
  }
  const Eigen::Vector2d middle = sum / std::max(1, creases);
  for (std::size_t k = 0; k < 3; ++k) {
    const SurfaceSide& side = sides[k];
    const Eigen::Vector2d& next = meeting[k];
    const Eigen::Vector2d& previous = meeting[(k + 2) % 3];
    const auto land = [&](const Eigen::Vector2d& p) {
      return land_of(light, p, side.height_at(p), side.slope_at(p));
    };
    const auto flux = [&](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
      return light.intake({side.at(side.place), side.at(p), side.at(q)}) / lens_area;
    };
    const Eigen::Vector2d corner = land_of(light, side.place, side.z, side.slope);
    const Eigen::Vector2d centre = land(middle);
    sink(ImageTriangle{corner, land(next), centre, flux(next, middle)});
    sink(ImageTriangle{corner, centre, land(previous), flux(middle, previous)});
  }
}

/// True for each axis along which a node of a grid has neighbours on both sides.
struct InnerNode {
  bool column = true;
  bool row = true;
};

/// Landing place for a node's beam such that the beams between nodes, interpolated linearly, are
/// right on average over the triangles: v − Δ/24, Δ being the sum of the second differences along
/// the three directions of the triangles' edges. Unchanged where a neighbour has none.
/// @param columns  of the grid, row by row.
inline Eigen::Vector2d sharp_landing(const std::vector<Eigen::Vector2d>& landing, std::size_t node,
                                     std::int64_t columns, InnerNode inner = {}) {
  Eigen::Vector2d bends = Eigen::Vector2d::Zero();
  const auto add = [&](std::int64_t step) {
    const auto offset = static_cast<std::size_t>(step);
    bends += landing[node - offset] - 2.0 * landing[node] + landing[node + offset];
  };
  if (inner.column) add(1);
  if (inner.row) add(columns);
  if (inner.column && inner.row) add(columns + 1);
  if (!bends.allFinite()) return landing[node];
  return landing[node] - bends / 24.0;
}

/// The image triangles of a rectangle of a sampled surface: two per cell, with their corners where
/// the refracted rays of the nodes' own slopes land. A triangle across a crease (nodes of different
/// SurfacePatch::cut) is split by split_at_crease(). On a surface without creases corners are moved
/// slightly, see sharpen_landing(). There is no light outside of the lens's outline: a triangle
/// across it projects exactly its inner parts or, if a crease also crosses it, that share of all of
/// its light. Keeps its buffers between tiles.
class SurfaceTile {
 public:
  /// @param grid   the whole lens.
  /// @param whole  light on the lens, mm², of which fluxes are shares; 0: the grid's area, as far
  ///               as light passes.
  SurfaceTile(const OpticalSetup& setup, const GridWindow& grid, double whole = 0.0);

  /// Samples the surface over `range` with one more node on every side where the grid has one, so
  /// that creases on the tile's rim are split as they are inside.
  void load(const SurfaceField& field, const CellRange& range, const Executor& executor);
  /// Puts the loaded and all later tiles into other light, such as another colour.
  /// @param whole  as in the constructor.
  void relight(const OpticalSetup& setup, double whole, const Executor& executor);

  [[nodiscard]] const CellRange& range() const { return range_; }
  /// The sampled nodes.
  [[nodiscard]] const SurfacePatch& patch() const { return patch_; }
  [[nodiscard]] std::int64_t cells() const { return range_.columns * range_.rows; }

  /// Height at node (i, j) counted from the tile's least corner, mm.
  [[nodiscard]] double height(std::int64_t i, std::int64_t j) const {
    return patch_.z[node_of(i, j)];
  }
  /// Place of the same node, mm.
  [[nodiscard]] Eigen::Vector2d place(std::int64_t i, std::int64_t j) const {
    return grid_.node(range_.column + i, range_.row + j);
  }

  /// True if light leaves some of a cell, counted row by row.
  [[nodiscard]] bool is_lit(std::int64_t cell) const {
    return side_of_cell(cell) != OutlineIndex::Side::kOutside;
  }

  /// Passes the image triangles of a cell, counted row by row, to `sink`.
  template <class Sink>
  void visit_cell(std::int64_t cell, const Sink& sink) const {
    if (!is_lit(cell)) return;
    const std::int64_t i = cell % range_.columns;
    const std::int64_t j = cell / range_.columns;
    const std::size_t a = node_of(i, j);
    const std::size_t d = node_of(i, j + 1);
    if (side_of_cell(cell) == OutlineIndex::Side::kAcross) {
      visit_rim(a, a + 1, d + 1, sink);
      visit_rim(a, d + 1, d, sink);
      return;
    }
    visit_triangle(a, a + 1, d + 1, sink);
    visit_triangle(a, d + 1, d, sink);
  }

 private:
  [[nodiscard]] std::size_t node_of(std::int64_t i, std::int64_t j) const {
    return static_cast<std::size_t>((j + halo_rows_) * patch_.window.columns + i + halo_columns_);
  }
  [[nodiscard]] bool is_smooth(std::size_t a, std::size_t b, std::size_t c) const {
    return patch_.cut.empty() || (patch_.cut[a] == patch_.cut[b] && patch_.cut[a] == patch_.cut[c]);
  }
  template <class Sink>
  void visit_triangle(std::size_t a, std::size_t b, std::size_t c, const Sink& sink) const {
    if (is_smooth(a, b, c)) {
      sink(ImageTriangle{landing_[a], landing_[b], landing_[c], flux_of(a, b, c)});
    } else {
      split_at_crease({side_of(a), side_of(b), side_of(c)}, light_, lens_area_, sink);
    }
  }
  /// Visits a triangle that the outline may cut.
  template <class Sink>
  void visit_rim(std::size_t a, std::size_t b, std::size_t c, const Sink& sink) const {
    const std::vector<TrianglePiece> pieces =
        outline_->inside({point(a).head<2>(), point(b).head<2>(), point(c).head<2>()});
    if (is_smooth(a, b, c)) {
      const ImageTriangle whole{landing_[a], landing_[b], landing_[c], flux_of(a, b, c)};
      for (const TrianglePiece& piece : pieces) sink(image_of(whole, piece));
      return;
    }
    double share = 0.0;
    for (const TrianglePiece& piece : pieces) share += piece.share;
    visit_triangle(a, b, c, [&](ImageTriangle t) {
      t.flux *= share;
      sink(t);
    });
  }
  [[nodiscard]] OutlineIndex::Side side_of_cell(std::int64_t cell) const {
    return outline_ ? sides_[static_cast<std::size_t>(cell)] : OutlineIndex::Side::kInside;
  }
  void find_rim(const Executor& executor);
  void take_light(const OpticalSetup& setup, double whole);
  void land(const Executor& executor);
  [[nodiscard]] double flux_of(std::size_t a, std::size_t b, std::size_t c) const {
    if (light_.intake_is_plan_area()) return triangle_flux_;
    const Corners corners{point(a), point(b), point(c)};
    return light_.intake(corners, {entry(a), entry(b), entry(c)}) / lens_area_;
  }
  /// Moves the corners so that triangles land in the right place on average.
  ///
  /// Between nodes the landing place v is interpolated linearly, which blurs it by the box spline
  /// of the triangulation: the light moved by a wave of six nodes across scallops comes out 9 % too
  /// small. v − Δ/24, with Δ the sum of the second differences of v along the three edges of the
  /// triangles, cancels that to second order in the spacing: 1 % is left.
  void sharpen_landing(const Executor& executor);
  [[nodiscard]] Eigen::Vector3d point(std::size_t node) const;
  [[nodiscard]] const IncidentRay* entry(std::size_t node) const {
    return entries_.empty() ? nullptr : &entries_[node];
  }
  [[nodiscard]] SurfaceSide side_of(std::size_t node) const;
  [[nodiscard]] Eigen::Vector2d bend_along(std::size_t node, std::int64_t step, bool has_before,
                                           bool has_after) const;

  LightPath light_;
  std::optional<OutlineIndex> outline_;
  std::vector<OutlineIndex::Side> sides_;  ///< Of the tile's cells, if there is an outline.
  GridWindow grid_;
  double lens_area_ = 0.0;
  double triangle_flux_ = 0.0;  ///< Of every triangle that takes light by its plan area.
  CellRange range_;
  std::int64_t halo_columns_ = 0;  ///< Nodes of the patch left of the tile.
  std::int64_t halo_rows_ = 0;
  SurfacePatch patch_;
  std::vector<IncidentRay> entries_;        ///< One per node in light that varies, else none.
  std::vector<Eigen::Vector2d> landing_;    ///< One per node, pixel coordinates; NaN without light.
  std::vector<Eigen::Vector2d> sharpened_;  ///< Next landing_; kept for its memory.
};

/// Common settings for rendering the surfaces of a lens.
struct FieldRenderSetup {
  OpticalSetup optics;
  GridWindow grid;          ///< Over the whole lens, see lens_grid().
  std::int64_t tile = 768;  ///< Side of the tiles sampled at once, cells: 30 MB.
  /// LightPath::intake() of the whole surface, mm², in each of light_colors(); if empty, the grid's
  /// area, that of light along z.
  std::vector<double> whole{};
  /// Approximate height of the surface, mm, for the image of an extended source.
  double surface_height = 0.0;
  /// If set, the surfaces that are rendered are entry faces, in place of that of `optics`, and this
  /// is the optical surface. Rays are then followed from the front: behind its ridges light may
  /// fold inside the lens. For render_fields() and what calls it, of whole lenses.
  const SurfaceField* back = nullptr;
  double beyond = 0.0;  ///< Distance beyond the lens's edges at which its light enters, mm.

  [[nodiscard]] double whole_in(std::size_t color) const {
    return whole.empty() ? 0.0 : whole[color];
  }

  /// Blur of an extended source against a point.
  [[nodiscard]] SourceKernel blur() const { return source_kernel(optics, surface_height); }
  /// The optics with pixels divided as the blur requires.
  [[nodiscard]] OpticalSetup optics_in_parts(const SourceKernel& kernel) const;
};

/// Renders a surface tile by tile: memory does not grow with the grid. Every image triangle is
/// deposited exactly (design/flux); only the curvature of the slope inside a triangle is neglected.
/// Under an extended source the picture is blurred as the optimiser does it, see source_kernel();
/// for a spectrum it is the sum of the colours' pictures. Same bits for any tile and any number of
/// threads.
/// @throw Interrupted if `control` or the executor asks for an end.
FluxPicture render_field(const SurfaceField& field, const FieldRenderSetup& setup,
                         const Executor& executor, const RunControl& control);

/// Renders several surfaces tile by tile, each tile for all of them in order, so that surfaces made
/// from one another can share samples (HeldField). One picture per surface, with the same bits as
/// when rendered alone.
std::vector<FluxPicture> render_fields(std::span<const SurfaceField* const> fields,
                                       const FieldRenderSetup& setup, const Executor& executor,
                                       const RunControl& control, const TileObserver& observe = {});

/// Picture that a part of the lens projects, as shares of the whole lens's flux.
FluxPicture render_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                         const CellRange& cells, const Executor& executor,
                         const RunControl& control);

/// The same, by waves if there are options for them: wave_flux_of().
FluxPicture light_of_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                           const CellRange& cells, const std::optional<WaveOptions>& waves,
                           const Executor& executor, const RunControl& control);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "cam/milled/creases.h"
#include "core/optics/light_path.h"
#include "design/optics/image_triangle.h"

/// Light of a grid triangle that a crease runs through.
///
/// Notation: a *side* is the smooth piece of surface that a corner belongs to, continued to second
/// order around that corner; x_k where sides k and k + 1 meet on the edge between their corners; m
/// a point inside the triangle where all sides meet.
namespace lensforge {

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

/// Where the ray of a surface point of height z and the given slope lands, in pixel coordinates;
/// NaN if the light is reflected totally.
/// @param known  LightPath::enter() of the point, if it has been found before.
inline Eigen::Vector2d land_of(const LightPath& light, const Eigen::Vector2d& place, double z,
                               const Eigen::Vector2d& slope, const IncidentRay* known = nullptr) {
  const Eigen::Vector3d n = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const Eigen::Vector3d p(place.x(), place.y(), z);
  if (!light.transmits(p, n, known)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return light.land(p, light.beam(p, n, known).m);
}

/// Where two sides meet between their nodes, as a share of the way from a to b.
inline double meeting_share(const SurfaceSide& a, const SurfaceSide& b) {
  return meeting_share(b.height_at(a.place) - a.z, b.z - a.height_at(b.place));
}

/// Hands the image triangles of a surface triangle whose corners lie on different cuts to `sink`:
/// every corner keeps the quadrilateral (corner, x_k, m, x_k−1) of its own side, whose points land
/// where that side's own slope sends them. Each side's light stays on its side, and the pieces
/// cover the triangle exactly: nothing is projected between the two landing places.
/// @param lens_area  mm², of the grid; fluxes are shares of the light that it takes.
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

}  // namespace lensforge

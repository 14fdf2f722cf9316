// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/face_sampler.h"

#include <BRepTools.hxx>
#include <Eigen/LU>
#include <Precision.hxx>
#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

/// Points of a face each way at which its direction is judged and Newton's method may start.
constexpr int kProbes = 9;

}  // namespace

FaceSampler::FaceSampler(const TopoDS_Face& face)
    : surface_(face),
      inside_(face, Precision::PConfusion()),
      reversed_(face.Orientation() == TopAbs_REVERSED) {
  BRepTools::UVBounds(face, low_.u, high_.u, low_.v, high_.v);
  for (int i = 0; i < kProbes; ++i) {
    for (int j = 0; j < kProbes; ++j) {
      const Parameters at{std::lerp(low_.u, high_.u, (i + 0.5) / kProbes),
                          std::lerp(low_.v, high_.v, (j + 0.5) / kProbes)};
      const gp_Pnt point = surface_.Value(at.u, at.v);
      probes_.push_back({at, {point.X(), point.Y()}});
    }
  }
}

std::pair<double, double> FaceSampler::normal_range() const {
  std::pair<double, double> range{1.0, -1.0};
  for (const Probe& probe : probes_) {
    if (!contains(probe.at)) continue;
    gp_Pnt point;
    gp_Vec du;
    gp_Vec dv;
    surface_.D1(probe.at.u, probe.at.v, point, du, dv);
    const gp_Vec normal = du.Crossed(dv);
    const double size = normal.Magnitude();
    if (!(size > 0.0)) continue;
    const double z = (reversed_ ? -normal.Z() : normal.Z()) / size;
    range = {std::min(range.first, z), std::max(range.second, z)};
  }
  return range;
}

std::optional<FacePoint> FaceSampler::above(const Eigen::Vector2d& xy) {
  if (!last_) last_ = nearest_probe(xy);
  if (const auto found = newton(*last_, xy)) return found;
  return newton(nearest_probe(xy), xy);
}

std::optional<std::array<int, 2>> FaceSampler::knot_cells() const {
  if (surface_.GetType() != GeomAbs_BSplineSurface) return std::nullopt;
  constexpr int kBorderPoints = 64;
  for (int i = 0; i <= kBorderPoints; ++i) {
    const double t = static_cast<double>(i) / kBorderPoints;
    const double u = std::lerp(low_.u, high_.u, t);
    const double v = std::lerp(low_.v, high_.v, t);
    for (const Parameters& at : {Parameters{u, low_.v}, Parameters{u, high_.v},
                                 Parameters{low_.u, v}, Parameters{high_.u, v}, Parameters{u, v}}) {
      if (!contains(at)) return std::nullopt;
    }
  }
  return std::array<int, 2>{surface_.NbUKnots() - 1, surface_.NbVKnots() - 1};
}

FacePoint FaceSampler::at(double share_u, double share_v) const {
  return point_at({std::lerp(low_.u, high_.u, share_u), std::lerp(low_.v, high_.v, share_v)});
}

bool FaceSampler::contains(const Parameters& at) const {
  return inside_.Perform(gp_Pnt2d(at.u, at.v), false) != TopAbs_OUT;
}

FaceSampler::Parameters FaceSampler::nearest_probe(const Eigen::Vector2d& xy) const {
  return std::min_element(probes_.begin(), probes_.end(),
                          [&](const Probe& a, const Probe& b) {
                            return (a.xy - xy).squaredNorm() < (b.xy - xy).squaredNorm();
                          })
      ->at;
}

FacePoint FaceSampler::point_at(const Parameters& at) const {
  gp_Pnt point;
  gp_Vec du;
  gp_Vec dv;
  surface_.D1(at.u, at.v, point, du, dv);
  gp_Vec normal = du.Crossed(dv);
  if (normal.Z() < 0.0) normal.Reverse();
  return {{point.X(), point.Y(), point.Z()}, {normal.X(), normal.Y(), normal.Z()}};
}

std::optional<FacePoint> FaceSampler::newton(Parameters at, const Eigen::Vector2d& xy) {
  constexpr int kMaxSteps = 20;
  for (int step = 0; step < kMaxSteps; ++step) {
    gp_Pnt point;
    gp_Vec du;
    gp_Vec dv;
    surface_.D1(at.u, at.v, point, du, dv);
    const Eigen::Vector2d miss = xy - Eigen::Vector2d(point.X(), point.Y());
    if (miss.norm() < kNearFace) {
      if (!contains(at)) return std::nullopt;
      last_ = at;
      return point_at(at);
    }
    Eigen::Matrix2d derivative;
    derivative << du.X(), dv.X(), du.Y(), dv.Y();
    if (!(std::abs(derivative.determinant()) > 0.0)) return std::nullopt;
    const Eigen::Vector2d change = derivative.inverse() * miss;
    at.u = std::clamp(at.u + change.x(), low_.u, high_.u);
    at.v = std::clamp(at.v + change.y(), low_.v, high_.v);
  }
  return std::nullopt;
}

}  // namespace lensforge

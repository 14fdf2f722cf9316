// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/rim_curve.h"

#include <Geom2dAPI_Interpolate.hxx>
#include <GeomAPI_Interpolate.hxx>
#include <TColStd_HArray1OfReal.hxx>
#include <TColgp_HArray1OfPnt.hxx>
#include <TColgp_HArray1OfPnt2d.hxx>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/error.h"

namespace lensforge {
namespace {

/// Points nearer than this are one to OpenCASCADE's interpolation, mm or parameters.
constexpr double kSamePoint = 1e-12;

gp_Pnt space_point(const RimPoint& p) { return {p.point.x(), p.point.y(), p.point.z()}; }
gp_Pnt2d plan_point(const RimPoint& p) { return {p.uv.x(), p.uv.y()}; }

template <class Interpolate, class Vector, class Points>
auto interpolated(const Handle(Points) & points, const Handle(TColStd_HArray1OfReal) & parameters,
                  const Vector& first, const Vector& last) {
  Interpolate curve(points, parameters, false, kSamePoint);
  curve.Load(first, last, false);
  curve.Perform();
  if (!curve.IsDone()) throw RunError("OpenCASCADE finds no curve along the outline");
  return curve.Curve();
}

/// Through every second of the points, from the first one on.
RimCurve curve_through(const std::vector<RimPoint>& points, double last) {
  const auto pieces = static_cast<int>(points.size() / 2);
  const Handle(TColStd_HArray1OfReal) parameters = new TColStd_HArray1OfReal(1, pieces + 1);
  const Handle(TColgp_HArray1OfPnt) space = new TColgp_HArray1OfPnt(1, pieces + 1);
  const Handle(TColgp_HArray1OfPnt2d) plan = new TColgp_HArray1OfPnt2d(1, pieces + 1);
  for (int k = 0; k <= pieces; ++k) {
    const RimPoint& p = points[2 * static_cast<std::size_t>(k)];
    parameters->SetValue(k + 1, last * k / pieces);
    space->SetValue(k + 1, space_point(p));
    plan->SetValue(k + 1, plan_point(p));
  }
  const auto direction = [](const RimPoint& p) {
    return gp_Vec(p.along.x(), p.along.y(), p.along.z());
  };
  const auto turn = [](const RimPoint& p) { return gp_Vec2d(p.turn.x(), p.turn.y()); };
  return {interpolated<GeomAPI_Interpolate>(space, parameters, direction(points.front()),
                                            direction(points.back())),
          interpolated<Geom2dAPI_Interpolate>(plan, parameters, turn(points.front()),
                                              turn(points.back()))};
}

/// Largest distance between the points and the curves, mm. What plan errors are in space follows
/// from the rim's own derivatives.
double distance(const RimCurve& curve, const std::vector<RimPoint>& points, double last) {
  double worst = 0.0;
  for (std::size_t k = 1; k < points.size(); k += 2) {
    const RimPoint& p = points[k];
    const double t = last * static_cast<double>(k) / static_cast<double>(points.size() - 1);
    const double scale = p.along.norm() / p.turn.norm();
    worst = std::max({worst, curve.space->Value(t).Distance(space_point(p)),
                      scale * curve.plan->Value(t).Distance(plan_point(p))});
  }
  return worst;
}

}  // namespace

RimCurve rim_curve(const std::function<RimPoint(double)>& at, double last, int pieces) {
  constexpr double kNear = 0.25 * kRimTolerance;
  while (true) {
    std::vector<RimPoint> points;
    for (int k = 0; k <= 2 * pieces; ++k) points.push_back(at(last * k / (2 * pieces)));
    RimCurve curve = curve_through(points, last);
    if (2 * pieces > kMostPieces || distance(curve, points, last) <= kNear) return curve;
    pieces *= 2;
  }
}

Handle(Geom2d_BSplineCurve) unrolled(const RimCurve& curve, double angle) {
  const Geom_BSplineCurve& space = *curve.space;
  const int degree = space.Degree();
  TColgp_Array1OfPnt2d poles(1, space.NbPoles());
  const TColStd_Array1OfReal& knots = space.KnotSequence();
  for (int i = 1; i <= space.NbPoles(); ++i) {
    double sum = 0.0;  // Of the Greville point: with it as coefficient the spline is t itself.
    for (int k = 1; k <= degree; ++k) sum += knots(i + k);
    poles(i) = gp_Pnt2d(angle + sum / degree, space.Pole(i).Z());
  }
  return new Geom2d_BSplineCurve(poles, space.Knots(), space.Multiplicities(), degree);
}

RimPoint point_on_sphere(const SphericalFront& front, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& along) {
  const double radius = std::abs(front.radius);
  const double sign = std::copysign(1.0, front.radius);
  const Eigen::Vector3d from = point - front.apex - Eigen::Vector3d(0.0, 0.0, front.radius);
  // The sphere's own axes: its X is z or −z, its Y is x or −x, its Z is y (sphere_of()).
  const Eigen::Vector3d p(sign * from.z(), sign * from.x(), from.y());
  const Eigen::Vector3d d(sign * along.z(), sign * along.x(), along.y());
  const double across = p.head<2>().squaredNorm();
  const double u = std::atan2(p.y(), p.x());
  return {point,
          along,
          {u < 0.0 ? u + 2.0 * std::numbers::pi : u, std::asin(p.z() / radius)},
          {(p.x() * d.y() - p.y() * d.x()) / across, d.z() / std::sqrt(across)}};
}

}  // namespace lensforge

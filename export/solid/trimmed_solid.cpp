// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/trimmed_solid.h"

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Eigen/Core>
#include <Geom2dAPI_Interpolate.hxx>
#include <Geom2d_BSplineCurve.hxx>
#include <Geom2d_Line.hxx>
#include <GeomAPI_Interpolate.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_Circle.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Precision.hxx>
#include <TColStd_HArray1OfReal.hxx>
#include <TColgp_HArray1OfPnt.hxx>
#include <TColgp_HArray1OfPnt2d.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <gp_Pln.hxx>
#include <numbers>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/optics/front_surface.h"
#include "export/spline/net_outline.h"

namespace lensforge {
namespace {

// Every edge has the parameter of its wall, in space and on the faces beside it.

/// A point of an edge, its place on a face, and the derivatives of both by the edge's parameter.
struct RimPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< mm
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();  ///< The face's own parameters.
  Eigen::Vector2d turn = Eigen::Vector2d::Zero();
};

/// An edge in space and in the plane of a face's parameters, with one parameter.
struct RimCurve {
  Handle(Geom_BSplineCurve) space;
  Handle(Geom2d_BSplineCurve) plan;
};

/// How far a rim's curves may be from the rim and from each other, mm; a tenth of the light's
/// wavelength is five times as much. rim_curve() stays at a quarter of it between its points.
constexpr double kRimTolerance = 2e-5;

/// Of one wall: with 16 a knot cell it needs no more on any lens measured.
constexpr int kMostPieces = 16384;

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

/// Cubic splines through points of an edge, at first over `pieces` equal parts, until they are as
/// near as kRimTolerance asks for, or kMostPieces. @param last  parameter of the end, 0 the
/// start's.
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

/// The curve on a vertical cylinder whose angles run with the edge's parameter.
/// @param angle  at the start. @pre the cylinder's origin is at z = 0.
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

/// A point of a front with its parameters on sphere_of().
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

/// The parameter of a quarter cylinder's first upright: its seam lies across from the wall.
constexpr double kFirstAngle = 0.25 * std::numbers::pi;

/// What an outline's corner has.
struct Corner {
  TopoDS_Vertex back;
  TopoDS_Vertex top;
  TopoDS_Edge upright;
};

/// What a wall has.
struct WallEdges {
  RimCurve top_curve;
  TopoDS_Edge top;
  RimCurve back_curve;  ///< On a sphere only.
  TopoDS_Edge back;
};

class TrimmedSolid {
 public:
  explicit TrimmedSolid(const SplineNet& net)
      : net_(net), walls_(walls_of(*net.outline)), uv_(walls_.front().from) {
    if (net.front) front_ = FrontSurface(*net.front);
    for (const OutlineWall& wall : walls_) edges_.push_back(curves_of(wall));
    for (std::size_t k = 0; k < walls_.size(); ++k) corners_.push_back(corner(k));
    for (std::size_t k = 0; k < walls_.size(); ++k) make_edges(k);
  }

  NamedSolid build() {
    add_top();
    for (std::size_t k = 0; k < walls_.size(); ++k) {
      walls_[k].arc ? add_cylinder(k) : add_plane(k);
    }
    net_.front ? add_sphere() : add_back();
    return shell_.close();
  }

 private:
  using Edges = SolidShell::Edges;

  [[nodiscard]] const SphericalFront& sphere() const {
    return std::get<SphericalFront>(*net_.front);
  }

  [[nodiscard]] std::size_t after(std::size_t k) const { return (k + 1) % walls_.size(); }

  /// The point of the patch above a place; places follow each other closely.
  RimPoint on_patch(const OutlineWall& wall, double t) {
    const Eigen::Vector2d xy = wall.at(t);
    auto uv = net_.parameters_of(xy, uv_);
    if (!uv) uv = net_.parameters_of(xy, xy);
    if (!uv) throw RunError("the outline leaves the splines");
    uv_ = *uv;
    const PatchFrame f = net_.patches.front().frame(uv_);
    Eigen::Matrix2d derivative;
    derivative << f.by_u.head<2>(), f.by_v.head<2>();
    const Eigen::Vector2d turn = derivative.inverse() * wall.along(t);
    return {{xy.x(), xy.y(), f.point.z()}, f.by_u * turn.x() + f.by_v * turn.y(), uv_, turn};
  }

  [[nodiscard]] RimPoint on_sphere(const OutlineWall& wall, double t) const {
    const Eigen::Vector2d xy = wall.at(t);
    const FrontPoint front = front_.at(xy);
    const Eigen::Vector2d along = wall.along(t);
    const Eigen::Vector3d point(xy.x(), xy.y(), front.z);
    return point_on_sphere(sphere(), point, {along.x(), along.y(), front.gradient.dot(along)});
  }

  WallEdges curves_of(const OutlineWall& wall) {
    constexpr double kFewest = 4.0;
    const SplinePatch& patch = net_.patches.front();
    const double cell = patch.box.sizes().cwiseQuotient(patch.cells()).minCoeff();
    const auto pieces = static_cast<int>(std::max(kFewest, std::ceil(2.0 * wall.length() / cell)));
    WallEdges edges;
    edges.top_curve = rim_curve([&](double t) { return on_patch(wall, t); }, wall.last(), pieces);
    if (!net_.front) return edges;
    edges.back_curve = rim_curve([&](double t) { return on_sphere(wall, t); }, wall.last(),
                                 static_cast<int>(8.0 * kFewest));
    return edges;
  }

  TopoDS_Vertex make_vertex(const gp_Pnt& at) {
    TopoDS_Vertex vertex;
    builder_.MakeVertex(vertex, at, kRimTolerance);
    return vertex;
  }

  Corner corner(std::size_t k) {
    const gp_Pnt top = edges_[k].top_curve.space->StartPoint();
    const double z = net_.front ? front_.height({top.X(), top.Y()}) : 0.0;
    Corner made{make_vertex({top.X(), top.Y(), z}), make_vertex(top), {}};
    made.upright = BRepBuilderAPI_MakeEdge(made.back, made.top).Edge();
    return made;
  }

  static TopoDS_Edge make_edge(const RimCurve& curve, const TopoDS_Vertex& from,
                               const TopoDS_Vertex& to) {
    return edge_along(curve.space, from, to, kRimTolerance);
  }

  void make_edges(std::size_t k) {
    const Corner& from = corners_[k];
    const Corner& to = corners_[after(k)];
    WallEdges& edges = edges_[k];
    edges.top = make_edge(edges.top_curve, from.top, to.top);
    if (net_.front) {
      edges.back = make_edge(edges.back_curve, from.back, to.back);
    } else if (walls_[k].arc) {
      const Handle(Geom_Circle) circle =
          new Geom_Circle(axes_of(*walls_[k].arc).Ax2(), walls_[k].arc->radius);
      edges.back = BRepBuilderAPI_MakeEdge(circle, from.back, to.back, kFirstAngle,
                                           kFirstAngle + walls_[k].last())
                       .Edge();
    } else {
      edges.back = BRepBuilderAPI_MakeEdge(from.back, to.back).Edge();
    }
  }

  /// Of a quarter cylinder.
  static gp_Ax3 axes_of(const WallArc& arc) {
    const double angle = arc.start - kFirstAngle;
    return {gp_Pnt(arc.centre.x(), arc.centre.y(), 0.0), gp_Dir(0.0, 0.0, 1.0),
            gp_Dir(std::cos(angle), std::sin(angle), 0.0)};
  }

  void add_top() {
    TopoDS_Face face;
    builder_.MakeFace(face, surface_of(net_.patches.front()), Precision::Confusion());
    Edges rim;
    for (const WallEdges& edges : edges_) {
      builder_.UpdateEdge(edges.top, edges.top_curve.plan, face, kRimTolerance);
      rim.push_back(edges.top);
    }
    shell_.add(face, rim, "optical surface");
  }

  /// Around a wall, seen from outside.
  Edges around(std::size_t k) const {
    return {edges_[k].back, corners_[after(k)].upright, edges_[k].top.Reversed(),
            corners_[k].upright.Reversed()};
  }

  void add_plane(std::size_t k) {
    const Eigen::Vector2d along = walls_[k].along(0.0);
    const gp_Pln plane(edges_[k].top_curve.space->StartPoint(), gp_Dir(along.y(), -along.x(), 0.0));
    shell_.add(BRepBuilderAPI_MakeFace(plane, SolidShell::wire(around(k))).Face(), "side wall");
  }

  void add_cylinder(std::size_t k) {
    const WallArc& arc = *walls_[k].arc;
    TopoDS_Face face;
    builder_.MakeFace(face, new Geom_CylindricalSurface(axes_of(arc), arc.radius),
                      Precision::Confusion());
    builder_.UpdateEdge(edges_[k].top, unrolled(edges_[k].top_curve, kFirstAngle), face,
                        kRimTolerance);
    if (net_.front) {
      builder_.UpdateEdge(edges_[k].back, unrolled(edges_[k].back_curve, kFirstAngle), face,
                          kRimTolerance);
    } else {
      const gp_Pnt2d start(0.0, 0.0);
      builder_.UpdateEdge(edges_[k].back, new Geom2d_Line(start, gp_Dir2d(1.0, 0.0)), face,
                          Precision::Confusion());
    }
    add_upright(corners_[k], kFirstAngle, face);
    add_upright(corners_[after(k)], kFirstAngle + walls_[k].last(), face);
    shell_.add(face, around(k), "side wall");
  }

  void add_upright(const Corner& corner, double angle, const TopoDS_Face& face) {
    const gp_Pnt2d foot(angle, BRep_Tool::Pnt(corner.back).Z());
    builder_.UpdateEdge(corner.upright, new Geom2d_Line(foot, gp_Dir2d(0.0, 1.0)), face,
                        Precision::Confusion());
  }

  /// Seen from below.
  [[nodiscard]] Edges back_rim() const {
    Edges rim;
    for (std::size_t k = edges_.size(); k-- > 0;) rim.push_back(edges_[k].back.Reversed());
    return rim;
  }

  void add_back() {
    const gp_Pln plane(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(0.0, 0.0, -1.0));
    shell_.add(BRepBuilderAPI_MakeFace(plane, SolidShell::wire(back_rim())).Face(), "back");
  }

  void add_sphere() {
    TopoDS_Face face;
    builder_.MakeFace(face, new Geom_SphericalSurface(sphere_of(sphere())), Precision::Confusion());
    for (const WallEdges& edges : edges_) {
      builder_.UpdateEdge(edges.back, edges.back_curve.plan, face, kRimTolerance);
    }
    // A sphere's own normal points away from its centre, which lies below a hollow front.
    if (sphere().radius < 0.0) return shell_.add_turned(face, back_rim(), "back");
    shell_.add(face, back_rim(), "back");
  }

  const SplineNet& net_;
  std::vector<OutlineWall> walls_;
  FrontSurface front_;
  Eigen::Vector2d uv_;  ///< Of the patch's last point that was looked up.
  BRep_Builder builder_;
  SolidShell shell_;
  std::vector<WallEdges> edges_;  ///< Of wall k.
  std::vector<Corner> corners_;   ///< Corner k begins wall k.
};

}  // namespace

NamedSolid make_trimmed_solid(const SplineNet& net) { return TrimmedSolid(net).build(); }

}  // namespace lensforge

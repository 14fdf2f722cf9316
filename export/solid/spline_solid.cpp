// SPDX-License-Identifier: GPL-3.0-or-later
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
#include <Geom_Curve.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Precision.hxx>
#include <ShapeFix_Edge.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColStd_HArray1OfReal.hxx>
#include <TColgp_HArray1OfPnt.hxx>
#include <TColgp_HArray1OfPnt2d.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Shape.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <gp_Circ.hxx>
#include <gp_Pln.hxx>
#include <gp_Sphere.hxx>
#include <numbers>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/optics/front.h"
#include "export/solid/opencascade_io.h"
#include "export/spline/spline_net.h"

namespace lensforge {
namespace {

// Splines and fronts in OpenCASCADE's terms.

constexpr int kSplineDegree = 3;

/// The knots of `cells` cells of one width, each once; clamped_multiplicities() gives their
/// multiplicities.
TColStd_Array1OfReal even_knots(double from, double to, int cells) {
  TColStd_Array1OfReal result(1, cells + 1);
  for (int i = 0; i <= cells; ++i) result(i + 1) = from + (to - from) * i / cells;
  return result;
}

TColStd_Array1OfInteger clamped_multiplicities(int cells) {
  TColStd_Array1OfInteger result(1, cells + 1);
  result.Init(1);
  result(1) = kSplineDegree + 1;
  result(cells + 1) = kSplineDegree + 1;
  return result;
}

Handle(Geom_BSplineSurface) surface_of(const SplinePatch& patch) {
  const int m = patch.cells_u;
  const int n = patch.cells_v;
  const Eigen::Vector2d low = patch.box.min();
  const Eigen::Vector2d high = patch.box.max();
  TColgp_Array2OfPnt poles(1, m + kSplineDegree, 1, n + kSplineDegree);
  const auto& [x, y, z] = patch.coefficients;
  for (int i = 0; i < m + kSplineDegree; ++i) {
    for (int j = 0; j < n + kSplineDegree; ++j) {
      poles(i + 1, j + 1) = gp_Pnt(x(i, j), y(i, j), z(i, j));
    }
  }
  return new Geom_BSplineSurface(poles, even_knots(low.x(), high.x(), m),
                                 even_knots(low.y(), high.y(), n), clamped_multiplicities(m),
                                 clamped_multiplicities(n), kSplineDegree, kSplineDegree);
}

/// The sphere of a front. Its poles and its seam lie beside the lens: the axis runs along y, and
/// angles count from the side of the centre that is away from the apex.
gp_Sphere sphere_of(const SphericalFront& front) {
  const gp_Pnt centre(front.apex.x(), front.apex.y(), front.apex.z() + front.radius);
  const gp_Dir away(0.0, 0.0, front.radius);
  return {gp_Ax3(centre, gp_Dir(0.0, 1.0, 0.0), away), std::abs(front.radius)};
}

/// A whole curve as an edge between two vertices shared with other edges.
TopoDS_Edge edge_along(const Handle(Geom_Curve) & curve, const TopoDS_Vertex& from,
                       const TopoDS_Vertex& to, double tolerance) {
  const BRep_Builder builder;
  TopoDS_Edge edge;
  builder.MakeEdge(edge, curve, tolerance);
  builder.Add(edge, from.Oriented(TopAbs_FORWARD));
  builder.Add(edge, to.Oriented(TopAbs_REVERSED));
  builder.Range(edge, curve->FirstParameter(), curve->LastParameter());
  return edge;
}

/// A solid's faces while they are put together.
class SolidShell {
 public:
  using Edges = std::vector<TopoDS_Shape>;

  SolidShell() { builder_.MakeShell(shell_); }

  /// @param edges  in order, around a face as seen from outside.
  [[nodiscard]] static TopoDS_Wire wire(const Edges& edges);

  void add(const TopoDS_Face& face, const char* name);
  /// Adds a surface, bounded by edges, whose own normal points out of the solid.
  void add(TopoDS_Face face, const Edges& edges, const char* name);
  /// Adds a surface whose own normal points into the solid.
  void add_turned(TopoDS_Face face, const Edges& edges, const char* name);

  /// @pre every edge is that of two faces.
  NamedSolid close();

 private:
  BRep_Builder builder_;
  TopoDS_Shell shell_;
  NamedSolid result_;
};

TopoDS_Wire SolidShell::wire(const Edges& edges) {
  const BRep_Builder builder;
  TopoDS_Wire wire;
  builder.MakeWire(wire);
  for (const TopoDS_Shape& edge : edges) builder.Add(wire, edge);
  wire.Closed(true);
  return wire;
}

void SolidShell::add(const TopoDS_Face& face, const char* name) {
  builder_.Add(shell_, face);
  result_.names.emplace_back(face, name);
}

void SolidShell::add(TopoDS_Face face, const Edges& edges, const char* name) {
  builder_.Add(face, wire(edges));
  add(face, name);
}

void SolidShell::add_turned(TopoDS_Face face, const Edges& edges, const char* name) {
  TopoDS_Wire turned = wire(edges);
  turned.Reverse();
  builder_.Add(face, turned);
  face.Reverse();
  add(face, name);
}

NamedSolid SolidShell::close() {
  shell_.Closed(true);
  builder_.MakeSolid(result_.solid);
  builder_.Add(result_.solid, shell_);
  return result_;
}

// Edges run along lines of the net's parameters: straight lines in the parameter planes of their
// faces, with the same parameter as in space.

Handle(Geom_BSplineCurve) curve_of(const SplineEdge& edge, double from, double to) {
  TColgp_Array1OfPnt poles(1, edge.cells + kSplineDegree);
  for (int i = 0; i < edge.cells + kSplineDegree; ++i) {
    const Eigen::Vector3d p = edge.coefficients.col(i);
    poles(i + 1) = gp_Pnt(p.x(), p.y(), p.z());
  }
  return new Geom_BSplineCurve(poles, even_knots(from, to, edge.cells),
                               clamped_multiplicities(edge.cells), kSplineDegree);
}

/// Of a wall.
gp_Dir outwards_of(int side) {
  static constexpr std::array<std::array<double, 2>, 4> kOutwards{
      {{0.0, -1.0}, {1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}}};
  const auto& [x, y] = kOutwards[static_cast<std::size_t>(side)];
  return {x, y, 0.0};
}

/// Builds vertices first, then edges, then faces; all are shared.
class SolidBuilder {
 public:
  explicit SolidBuilder(const SplineNet& net) : net_(net) {
    if (is_height_map()) back_ = patch_of(std::get<HeightFront>(*net_.front));
    make_vertices();
    make_edges();
  }

  NamedSolid build() {
    for (int row = 0; row < net_.rows; ++row) {
      for (int column = 0; column < net_.columns; ++column) add_patch(column, row);
    }
    for (int side = 0; side < 4; ++side) add_wall(side);
    add_back();
    return shell_.close();
  }

 private:
  using Edges = SolidShell::Edges;

  [[nodiscard]] double u(int line) const { return net_.u[static_cast<std::size_t>(line)]; }
  [[nodiscard]] double v(int line) const { return net_.v[static_cast<std::size_t>(line)]; }
  [[nodiscard]] TopoDS_Vertex& vertex(int column, int row) {
    return vertices_[table_index(column, row, net_.columns + 1)];
  }
  [[nodiscard]] TopoDS_Edge& edge_u(int column, int line) {
    return edges_u_[table_index(column, line, net_.columns)];
  }
  [[nodiscard]] TopoDS_Edge& edge_v(int line, int row) {
    return edges_v_[table_index(line, row, net_.columns + 1)];
  }

  TopoDS_Vertex make_vertex(const gp_Pnt& at) {
    TopoDS_Vertex vertex;
    builder_.MakeVertex(vertex, at, Precision::Confusion());
    return vertex;
  }

  void make_vertices() {
    for (int row = 0; row <= net_.rows; ++row) {
      for (int column = 0; column <= net_.columns; ++column) {
        vertices_.push_back(make_vertex(corner(column, row)));
      }
    }
    for (int side = 0; side < 4; ++side) {
      back_vertices_[static_cast<std::size_t>(side)] = make_vertex(foot(side));
    }
  }

  [[nodiscard]] gp_Pnt corner(int column, int row) const {
    const bool last = column == net_.columns;
    const auto& edge = net_.edges_u[table_index((last ? column - 1 : column), row, net_.columns)];
    const Eigen::Vector3d p = edge.coefficients.col(last ? edge.coefficients.cols() - 1 : 0);
    return {p.x(), p.y(), p.z()};
  }

  /// Below a corner of the rectangle.
  [[nodiscard]] gp_Pnt foot(int side) const {
    const gp_Pnt top = corner(corner_column(side), corner_row(side));
    const double z = net_.front ? FrontSurface(*net_.front).height({top.X(), top.Y()}) : 0.0;
    return {top.X(), top.Y(), z};
  }

  /// The rectangle's corners counter-clockwise from (0, 0).
  [[nodiscard]] int corner_column(int side) const {
    return side % 4 == 1 || side % 4 == 2 ? net_.columns : 0;
  }
  [[nodiscard]] int corner_row(int side) const { return side % 4 >= 2 ? net_.rows : 0; }

  static TopoDS_Edge make_edge(const Handle(Geom_BSplineCurve) & curve, const TopoDS_Vertex& from,
                               const TopoDS_Vertex& to) {
    return edge_along(curve, from, to, Precision::Confusion());
  }

  void make_edges() {
    for (int line = 0; line <= net_.rows; ++line) {
      for (int c = 0; c < net_.columns; ++c) {
        const SplineEdge& spline = net_.edges_u[edges_u_.size()];
        edges_u_.push_back(
            make_edge(curve_of(spline, u(c), u(c + 1)), vertex(c, line), vertex(c + 1, line)));
      }
    }
    for (int r = 0; r < net_.rows; ++r) {
      for (int line = 0; line <= net_.columns; ++line) {
        const SplineEdge& spline = net_.edges_v[edges_v_.size()];
        edges_v_.push_back(
            make_edge(curve_of(spline, v(r), v(r + 1)), vertex(line, r), vertex(line, r + 1)));
      }
    }
    for (int side = 0; side < 4; ++side) {
      const auto i = static_cast<std::size_t>(side);
      const TopoDS_Vertex& top = vertex(corner_column(side), corner_row(side));
      uprights_[i] = BRepBuilderAPI_MakeEdge(back_vertices_[i], top).Edge();
      back_edges_[i] = make_back_edge(side);
    }
  }

  /// Along the foot of a wall: a line, or where its plane cuts the front's sphere.
  TopoDS_Edge make_back_edge(int side) {
    const TopoDS_Vertex& from = back_vertices_[static_cast<std::size_t>(side)];
    const TopoDS_Vertex& to = back_vertices_[static_cast<std::size_t>((side + 1) % 4)];
    if (!net_.front) return BRepBuilderAPI_MakeEdge(from, to).Edge();
    if (is_height_map()) return make_edge(rim_curve(side), from, to);
    const gp_Pnt start = foot(side);
    const gp_Pnt end = foot(side + 1);
    const gp_Dir outwards = outwards_of(side);
    const gp_Pnt centre = sphere_of(std::get<SphericalFront>(*net_.front)).Location();
    const double off = gp_Vec(centre, start).Dot(outwards);
    const gp_Pnt middle = centre.Translated(off * gp_Vec(outwards));
    // The shorter of the two arcs between the corners runs counter-clockwise about this axis.
    const gp_Dir axis = gp_Vec(middle, start).Crossed(gp_Vec(middle, end));
    const gp_Circ circle(gp_Ax2(middle, axis, gp_Vec(middle, start)), middle.Distance(start));
    return BRepBuilderAPI_MakeEdge(circle, from, to).Edge();
  }

  [[nodiscard]] bool is_height_map() const {
    return net_.front && std::holds_alternative<HeightFront>(*net_.front);
  }

  /// The height map's edge along a side, counter-clockwise around the rectangle.
  [[nodiscard]] Handle(Geom_BSplineCurve) rim_curve(int side) const {
    const bool along_u = side % 2 == 0;
    SplineEdge edge{along_u ? back_.cells_u : back_.cells_v, {}};
    edge.coefficients.resize(3, edge.cells + kSplineDegree);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::MatrixXd& c = back_.coefficients[static_cast<std::size_t>(axis)];
      const Eigen::VectorXd line =
          along_u ? Eigen::VectorXd(c.col(side == 0 ? 0 : c.cols() - 1))
                  : Eigen::VectorXd(c.row(side == 1 ? c.rows() - 1 : 0).transpose());
      edge.coefficients.row(axis) = (side < 2 ? line : Eigen::VectorXd(line.reverse())).transpose();
    }
    return curve_of(edge, 0.0, back_.box.max()[along_u ? 0 : 1]);
  }

  void add_pcurve(const TopoDS_Edge& edge, int axis, double line, const TopoDS_Face& face) {
    const Handle(Geom2d_Line) pcurve =
        axis == 0 ? new Geom2d_Line(gp_Pnt2d(0.0, line), gp_Dir2d(1.0, 0.0))
                  : new Geom2d_Line(gp_Pnt2d(line, 0.0), gp_Dir2d(0.0, 1.0));
    builder_.UpdateEdge(edge, pcurve, face, Precision::Confusion());
  }

  void add_patch(int c, int r) {
    TopoDS_Face face;
    const SplinePatch& patch = net_.patches[table_index(c, r, net_.columns)];
    builder_.MakeFace(face, surface_of(patch), Precision::Confusion());
    add_pcurve(edge_u(c, r), 0, v(r), face);
    add_pcurve(edge_u(c, r + 1), 0, v(r + 1), face);
    add_pcurve(edge_v(c, r), 1, u(c), face);
    add_pcurve(edge_v(c + 1, r), 1, u(c + 1), face);
    shell_.add(
        face,
        {edge_u(c, r), edge_v(c + 1, r), edge_u(c, r + 1).Reversed(), edge_v(c, r).Reversed()},
        "optical surface");
  }

  /// The top edges of a side in the order of a walk around the wall, which is against the rim.
  Edges rim_of(int side) {
    Edges edges;
    for (int i = 0; i < (side % 2 == 0 ? net_.columns : net_.rows); ++i) {
      if (side == 0) edges.push_back(edge_u(net_.columns - 1 - i, 0).Reversed());
      if (side == 1) edges.push_back(edge_v(net_.columns, net_.rows - 1 - i).Reversed());
      if (side == 2) edges.push_back(edge_u(i, net_.rows));
      if (side == 3) edges.push_back(edge_v(0, i));
    }
    return edges;
  }

  void add_wall(int side) {
    const auto i = static_cast<std::size_t>(side);
    Edges edges{back_edges_[i], uprights_[(i + 1) % 4]};
    const Edges rim = rim_of(side);
    edges.insert(edges.end(), rim.begin(), rim.end());
    edges.push_back(uprights_[i].Reversed());
    const gp_Pln plane(foot(side), outwards_of(side));
    shell_.add(BRepBuilderAPI_MakeFace(plane, SolidShell::wire(edges)).Face(), "side wall");
  }

  void add_back() {
    Edges edges;
    for (std::size_t i = 4; i-- > 0;) edges.push_back(back_edges_[i].Reversed());
    if (is_height_map()) return add_height_map(edges);
    if (net_.front) return add_sphere(edges);
    const gp_Pln plane(foot(0), gp_Dir(0.0, 0.0, -1.0));
    shell_.add(BRepBuilderAPI_MakeFace(plane, SolidShell::wire(edges)).Face(), "back");
  }

  void add_height_map(const Edges& edges) {
    TopoDS_Face face;
    builder_.MakeFace(face, surface_of(back_), Precision::Confusion());
    const Eigen::Vector2d& size = back_.box.max();
    const std::array starts{gp_Pnt2d(0.0, 0.0), gp_Pnt2d(size.x(), 0.0),
                            gp_Pnt2d(size.x(), size.y()), gp_Pnt2d(0.0, size.y())};
    const std::array ways{gp_Dir2d(1.0, 0.0), gp_Dir2d(0.0, 1.0), gp_Dir2d(-1.0, 0.0),
                          gp_Dir2d(0.0, -1.0)};
    for (std::size_t side = 0; side < 4; ++side) {
      const Handle(Geom2d_Line) pcurve = new Geom2d_Line(starts[side], ways[side]);
      builder_.UpdateEdge(back_edges_[side], pcurve, face, Precision::Confusion());
    }
    shell_.add_turned(face, edges, "back");
  }

  void add_sphere(const Edges& edges) {
    const auto& front = std::get<SphericalFront>(*net_.front);
    TopoDS_Face face;
    builder_.MakeFace(face, new Geom_SphericalSurface(sphere_of(front)), Precision::Confusion());
    for (const TopoDS_Shape& edge : edges) {
      ShapeFix_Edge().FixAddPCurve(TopoDS::Edge(edge), face, false, Precision::Confusion());
    }
    // A sphere's own normal points away from its centre, which lies below a hollow front.
    if (front.radius < 0.0) return shell_.add_turned(face, edges, "back");
    shell_.add(face, edges, "back");
  }

  const SplineNet& net_;
  SplinePatch back_;  ///< Of a front that is a height map.
  BRep_Builder builder_;
  SolidShell shell_;
  std::vector<TopoDS_Vertex> vertices_;
  std::vector<TopoDS_Edge> edges_u_;
  std::vector<TopoDS_Edge> edges_v_;
  std::array<TopoDS_Vertex, 4> back_vertices_;
  std::array<TopoDS_Edge, 4> back_edges_;
  std::array<TopoDS_Edge, 4> uprights_;
};

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

/// Maximum distance of a rim's curves from the rim and from each other, mm: about 1/30 of a
/// wavelength of light. Between its points rim_curve() reaches a quarter of it.
constexpr double kRimTolerance = 2e-5;

/// Of one wall: with 16 a knot cell it needs no more on any lens measured.
constexpr int kMaxPieces = 16384;

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
/// near as kRimTolerance asks for, or kMaxPieces. @param last  parameter of the end, 0 the
/// start's.
RimCurve rim_curve(const std::function<RimPoint(double)>& at, double last, int pieces) {
  constexpr double kNear = 0.25 * kRimTolerance;
  while (true) {
    std::vector<RimPoint> points;
    for (int k = 0; k <= 2 * pieces; ++k) points.push_back(at(last * k / (2 * pieces)));
    RimCurve curve = curve_through(points, last);
    if (2 * pieces > kMaxPieces || distance(curve, points, last) <= kNear) return curve;
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

/// Parameter of a quarter cylinder's first upright: the seam is opposite the wall.
constexpr double kFirstAngle = 0.25 * std::numbers::pi;

/// Vertices and edge at an outline's corner.
struct Corner {
  TopoDS_Vertex back;
  TopoDS_Vertex top;
  TopoDS_Edge upright;
};

/// Edges of a wall.
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

/// The solid of a net of one patch that is cut along the net's outline: one optical face, a plane
/// for every straight wall, a cylinder for every quarter of a circle, and the face below.
/// @pre net.outline; no front that is a height map. @throw RunError if the outline leaves the
/// patch.
NamedSolid make_trimmed_solid(const SplineNet& net) { return TrimmedSolid(net).build(); }

}  // namespace

NamedSolid make_spline_solid(const SplineNet& net) {
  return net.outline ? make_trimmed_solid(net) : SolidBuilder(net).build();
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/spline_solid.h"

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <Geom2d_Line.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_SphericalSurface.hxx>
#include <Precision.hxx>
#include <ShapeFix_Edge.hxx>
#include <TopoDS.hxx>
#include <array>
#include <cmath>
#include <gp_Circ.hxx>
#include <gp_Pln.hxx>
#include <variant>

#include "export/solid/trimmed_solid.h"

namespace lensforge {

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

gp_Sphere sphere_of(const SphericalFront& front) {
  const gp_Pnt centre(front.apex.x(), front.apex.y(), front.apex.z() + front.radius);
  const gp_Dir away(0.0, 0.0, front.radius);
  return {gp_Ax3(centre, gp_Dir(0.0, 1.0, 0.0), away), std::abs(front.radius)};
}

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

namespace {

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

/// Builds vertices first, then edges, then faces, so that all are shared.
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

}  // namespace

NamedSolid make_spline_solid(const SplineNet& net) {
  return net.outline ? make_trimmed_solid(net) : SolidBuilder(net).build();
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <BRep_Builder.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_Curve.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <gp_Sphere.hxx>
#include <string>
#include <utility>
#include <vector>

#include "core/optics/front_surface.h"
#include "export/spline/spline_net.h"

/// Splines, fronts and the solids between them in OpenCASCADE's terms.
namespace lensforge {

inline constexpr int kSplineDegree = 3;

/// The knots of `cells` cells of one width, each once; clamped_multiplicities() says how often.
TColStd_Array1OfReal even_knots(double from, double to, int cells);
TColStd_Array1OfInteger clamped_multiplicities(int cells);

Handle(Geom_BSplineSurface) surface_of(const SplinePatch& patch);

/// The sphere of a front. Its poles and its seam lie beside the lens: the axis runs along y, and
/// angles count from the side of the centre that is away from the apex.
gp_Sphere sphere_of(const SphericalFront& front);

/// A solid in OpenCASCADE's terms and the names of its faces.
struct NamedSolid {
  TopoDS_Solid solid;
  std::vector<std::pair<TopoDS_Face, std::string>> names;
};

/// All of a curve as an edge between two vertices that other edges share.
TopoDS_Edge edge_along(const Handle(Geom_Curve) & curve, const TopoDS_Vertex& from,
                       const TopoDS_Vertex& to, double tolerance);

/// A solid's faces while they are put together.
class SolidShell {
 public:
  using Edges = std::vector<TopoDS_Shape>;

  SolidShell() { builder_.MakeShell(shell_); }

  /// @param edges  in order, around a face as seen from outside.
  [[nodiscard]] static TopoDS_Wire wire(const Edges& edges);

  void add(const TopoDS_Face& face, const char* name);
  /// A surface whose own normal points out of the solid, as far as edges reach.
  void add(TopoDS_Face face, const Edges& edges, const char* name);
  /// The same of one whose normal points into the solid.
  void add_turned(TopoDS_Face face, const Edges& edges, const char* name);

  /// @pre every edge is that of two faces.
  NamedSolid close();

 private:
  BRep_Builder builder_;
  TopoDS_Shell shell_;
  NamedSolid result_;
};

/// The solid between a net and the face below it; neighbouring faces share their edges.
NamedSolid make_spline_solid(const SplineNet& net);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <BRep_Builder.hxx>
#include <Geom_Curve.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Shape.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <vector>

#include "export/spline_solid.h"

namespace lensforge {

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

}  // namespace lensforge

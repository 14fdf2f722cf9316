// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid_shell.h"

namespace lensforge {

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

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/unit_frame.h"

#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {

UnitFrame::UnitFrame(const SurfaceMesh& mesh)
    : centre_(0.5 * (mesh.vertices.rowwise().maxCoeff() + mesh.vertices.rowwise().minCoeff())),
      scale_(kUnitDiagonal / bounding_diagonal(mesh)) {}

SurfaceMesh UnitFrame::to_unit(SurfaceMesh mesh) const {
  mesh.vertices = scale_ * (mesh.vertices.colwise() - centre_);
  return mesh;
}

LightField UnitFrame::to_unit(LightField field) const {
  field.goal.from = to_unit(field.goal.from);
  field.goal.to = to_unit(field.goal.to);
  return field;
}

SurfaceMesh UnitFrame::from_unit(SurfaceMesh mesh) const {
  mesh.vertices = (mesh.vertices / scale_).colwise() + centre_;
  return mesh;
}

}  // namespace lensforge::reflect

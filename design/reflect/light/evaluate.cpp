// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/light/evaluate.h"

#include "design/reflect/light/reflection_energy.h"

namespace lensforge::reflect {

Energies evaluate(const SurfaceMesh& mesh, const Goal& goal, const DirectionSet& directions,
                  const Executor& executor) {
  if (mesh.triangle_count() < kEvaluatedFaces) {
    return evaluate(quartered(mesh), goal, directions, executor);
  }
  const LightPaths paths(mesh, goal, directions, kGatherDirections, executor);
  const ReflectionEnergy energy(paths, Loss::kSquare, executor);
  const Eigen::Matrix3Xd& normals = paths.faces().normal;
  return {energy.direct_value(normals), energy.value(normals)};
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/mesh/mirror.h"

#include <cmath>
#include <map>
#include <tuple>

#include "core/error.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {
namespace {

/// Share of the diagonal within which vertices count as mirror images: single precision's rounding
/// of large coordinates, and a thousandth of what an edge measures.
constexpr double kMatch = 1e-4;

using Cell = std::tuple<long, long, long>;

}  // namespace

std::vector<int> mirror_partners(const SurfaceMesh& mesh, int axis) {
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Eigen::Vector3d high = mesh.vertices.rowwise().maxCoeff();
  const double reach = kMatch * bounding_diagonal(mesh);
  const auto cell = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d at = ((p - low) / reach).array().floor();
    return Cell(std::lround(at.x()), std::lround(at.y()), std::lround(at.z()));
  };
  std::multimap<Cell, int> cells;
  for (int v = 0; v < mesh.vertex_count(); ++v) cells.emplace(cell(mesh.vertices.col(v)), v);
  std::vector<int> partner(static_cast<std::size_t>(mesh.vertex_count()), -1);
  for (int v = 0; v < mesh.vertex_count(); ++v) {
    Eigen::Vector3d image = mesh.vertices.col(v);
    image[axis] = low[axis] + high[axis] - image[axis];
    double nearest = reach;
    for (int i = 0; i < 27; ++i) {
      const Eigen::Vector3d beside(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const auto [begin, end] = cells.equal_range(cell(image + reach * beside));
      for (auto it = begin; it != end; ++it) {
        const double distance = (mesh.vertices.col(it->second) - image).norm();
        if (distance > nearest) continue;
        nearest = distance;
        partner[static_cast<std::size_t>(v)] = it->second;
      }
    }
    if (partner[static_cast<std::size_t>(v)] >= 0) continue;
    const std::string name(1, static_cast<char>('x' + axis));
    throw InputError("--symmetry " + name + ": vertex " + std::to_string(v) +
                     " has no mirror image: the mesh must be symmetric; leave the option out");
  }
  return partner;
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// Share of the edges that is split (Tojo et al., 4.5).
inline constexpr double kSplitShare = 0.05;

/// How much every edge stands in the way of a clean crease (Tojo et al., 4.5):
/// C = (E_k1 + E_k2)·Σ_{four neighbouring edges} |e| arccos(n_1·n_2); 0 at the boundary. In the
/// order of make_edges().
Eigen::VectorXd split_criterion(const SurfaceMesh& mesh, const Eigen::VectorXd& energy_by_face);

/// The edges with the largest criterion, at most `count`, no two with a vertex in common, none with
/// a criterion of 0. @param partner  mirror image of every vertex, so that edges are chosen in
/// pairs; empty: none.
std::vector<int> chosen_edges(const SurfaceMesh& mesh, const Eigen::VectorXd& criterion, int count,
                              const std::vector<int>& partner);

/// The mesh with these edges cut at their middles; the new vertices stand behind the old ones, in
/// the edges' order, and so do the second halves of faces. @pre no two edges share a vertex
struct SplitMesh {
  SurfaceMesh mesh;
  std::vector<int> parent;  ///< The face that each new face was cut from, from the first one on.
};
SplitMesh split_at_middles(const SurfaceMesh& mesh, const std::vector<int>& edges);

}  // namespace lensforge::reflect

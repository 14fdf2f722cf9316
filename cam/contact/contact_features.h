// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "core/compute/executor.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Which edges and corners of a triangle have to be tried against a ball, as bits: edge k (from
/// corner k to corner k+1 mod 3) is bit k, corner k is bit 3 + k.
using ContactFeatures = std::uint8_t;

inline constexpr ContactFeatures edge_bit(int k) { return static_cast<ContactFeatures>(1 << k); }
inline constexpr ContactFeatures corner_bit(int k) {
  return static_cast<ContactFeatures>(1 << (3 + k));
}

/// Hands every edge and vertex of a mesh to one of its triangles, the first, so that a search over
/// triangles tries it once; valleys and flat seams, which a ball cannot touch without touching a
/// facet beside them as high, to none. Edges of one triangle, of three or more, and of triangles
/// too thin or steep to judge are kept.
/// @return one set of bits a triangle.
/// @pre vertex numbers are in range.
std::vector<ContactFeatures> contact_features(const SurfaceMesh& mesh, const Executor& executor);

}  // namespace lensforge

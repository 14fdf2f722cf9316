// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// The optical surface of a solid from any program.
struct SolidSurface {
  SampledSurface samples;
  int faces = 0;         ///< Number of the solid's faces that form it.
  bool by_name = false;  ///< Found by the name "optical surface", else by shape.
};

/// Reads a STEP file's one solid and samples its optical surface: the faces named "optical
/// surface", or else all curved faces that look up, or else all flat ones that look up (+z).
/// Lengths are converted to millimetres; the solid stays where it is in its own coordinates.
/// Splines are sampled over their knot cells, like the lens they were made from; faces with other
/// outlines or of other kinds on a square raster.
/// @param points  approximate total number of samples.
/// @throw InputError naming the file if there is no solid or several, if no face looks up, if the
///        optical faces overhang or lie above one another, or if their extent is less than 0.1 mm
///        or above 10 m, which a wrong length unit causes; Interrupted. OpenCASCADE runs in a child
///        process; its crash is an InputError too.
SolidSurface read_solid_surface(const std::filesystem::path& path, double points,
                                const Executor& executor, const RunControl& control = {});

/// Maximum distance of read_solid_mesh()'s triangles from the faces, relative to the diagonal of
/// the bounding box.
inline constexpr double kSolidDeflection = 1e-3;
/// Maximum angle between the normals of adjacent triangles, rad.
inline constexpr double kSolidTurn = 0.2;

/// Returns the triangles of all solids and shells of a STEP file, oriented like its faces; faces
/// that share an edge share its vertices. Lengths become millimetres.
/// @throw InputError naming the file if it cannot be read or holds no faces, or if one of them
///        cannot be tessellated; Interrupted. OpenCASCADE runs in a child process; its crash is an
///        InputError too.
SurfaceMesh read_solid_mesh(const std::filesystem::path& path, const RunControl& control = {});

}  // namespace lensforge

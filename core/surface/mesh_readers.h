// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "core/surface/surface_mesh.h"

/// Strict readers of other programs' mesh files: whatever is missing, left over or no number is
/// refused with the line that it stands on. Coordinates are rounded to single precision, in which
/// such files are made as a rule. White space, blank lines, the ends of lines, a byte order mark
/// and capitals in keywords do not matter. Polygons become triangles.
///
/// All take the file's content and its name for messages, and throw InputError "name: line N: …".
/// Indices that are out of range and coordinates that are not finite come back as they stand.
namespace lensforge {

/// PLY 1.0, text or binary in either byte order: the elements "vertex" (x, y, z of any type) and
/// "face" (a list vertex_indices or vertex_index); everything else is passed over.
SurfaceMesh read_ply(std::string_view content, const std::string& name);

/// Wavefront OBJ: the lines "v" and "f", also those that a backslash continues; no material or
/// other file that it names is opened.
SurfaceMesh read_obj(std::string_view content, const std::string& name);

/// OFF as text, with or without its keyword and further values behind vertices and faces (COFF,
/// NOFF, …).
SurfaceMesh read_off(std::string_view content, const std::string& name);

/// STL, text or binary. Corners that coincide become one vertex.
SurfaceMesh read_stl(std::string_view content, const std::string& name);

}  // namespace lensforge

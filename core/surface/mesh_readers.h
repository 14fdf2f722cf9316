// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "core/surface/surface_mesh.h"

/// Strict readers of other programs' mesh files: missing or surplus data and malformed numbers are
/// refused with their line. Coordinates are rounded to single precision, the usual precision of
/// such files. White space, blank lines, line endings, a byte order mark and capitals in keywords
/// do not matter. Polygons become triangles.
///
/// All take the file's content and its name for messages, and throw InputError "name: line N: …".
/// Indices out of range and coordinates that are not finite are returned unchanged.
namespace lensforge {

/// PLY 1.0, text or binary in either byte order: the elements "vertex" (x, y, z of any type) and
/// "face" (a list vertex_indices or vertex_index); everything else is ignored.
SurfaceMesh read_ply(std::string_view content, const std::string& name);

/// Wavefront OBJ: the lines "v" and "f", also continued by a backslash; no file that it names, such
/// as materials, is opened.
SurfaceMesh read_obj(std::string_view content, const std::string& name);

/// OFF as text, with or without its keyword and further values after vertices and faces (COFF,
/// NOFF, …).
SurfaceMesh read_off(std::string_view content, const std::string& name);

/// STL, text or binary. Corners that coincide become one vertex.
SurfaceMesh read_stl(std::string_view content, const std::string& name);

}  // namespace lensforge

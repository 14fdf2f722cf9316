// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "fuzz/random.h"

/// Mesh files drawn by the campaign itself, small and readable, with one thing wrong or nothing.
namespace lensforge::fuzz {

/// A good sheet of 3 × 3 vertices as OFF.
std::string off_of_sheet();

/// ASCII PLY, OBJ, ASCII STL or OFF by `extension`: a sheet with a hole, a wall, a flipped, doubled
/// or missing triangle, an index that is out of range, a coordinate that is no number, a header
/// that counts wrong or declares what no mesh has.
std::string odd_mesh(const std::string& extension, Random& random);

}  // namespace lensforge::fuzz

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace lensforge {

/// Diameters of ball-end mills as makers of small tools keep them, below a given one, largest
/// first, mm: tenths down to 0.1 mm, above 0.6 mm in the steps of their lists.
/// @param count  at most.
std::vector<double> smaller_balls(double diameter, std::size_t count);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "cam/check/lamp_picture.h"
#include "cam/check/virtual_wall.h"
#include "core/lens/lens.h"

/// Lamps with a shape, and how near a picture of one is to it, for tests of `check --lamp-from`.
namespace lensforge::virtual_wall {

/// A ring that is brighter on one side, a slanted bar, two unequal dots: none has a symmetry that
/// hides a flip.
std::vector<std::pair<std::string, DrawnLamp>> drawn_lamps(double width);

/// How near a measured picture is to a drawn one, after their centres of light are put together.
struct LampMatch {
  double correlation = 0.0;
  double mae = 0.0;    ///< Share of the brightest, of pictures with the same light.
  double width = 0.0;  ///< Root mean square distance from the centre over that of the drawn lamp.
};
LampMatch match(const LampPicture& measured, const DrawnLamp& drawn);

/// wavy_lens() with waves that are `times` as high: above 1.5 its light crosses before the wall,
/// and the picture has bright lines.
Lens steep_lens(double times);

}  // namespace lensforge::virtual_wall

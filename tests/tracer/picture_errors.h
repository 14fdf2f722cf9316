// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tracer/clipped_picture.h"
#include "tracer/lens_files.h"

namespace tracer {

/// Picture and all the light that the surface takes.
struct Traced {
  ClippedPicture picture;
  double whole = 0.0;
};

/// Mean absolute errors of a picture against a target.
struct PictureErrors {
  double mae = 0.0;     ///< As a display shows them, sRGB.
  double linear = 0.0;  ///< In linear light, as a share of the target's largest.
};

/// Both pictures have the same light in total.
/// @param rim  pixels that are left out along every side.
PictureErrors picture_errors(const Traced& traced, const Picture& target, int rim);

}  // namespace tracer

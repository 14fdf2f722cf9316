// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/lens/lens.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Picture that a lens projects when it is printed in steps (PrintedField) and levelled by a film
/// (PolishedField), by rays. Beyond the lens's rim the print goes on (continued_surface()).
/// @throw Interrupted
FluxPicture printed_picture(const Lens& lens, const Printer& printer, const Executor& executor,
                            const RunControl& control);

/// Blurs of the light, of the film ("film") and, last, of the steps where they move light farthest
/// ("steps").
/// @param height  of the surface, about, mm. @param wavelength  mm
std::vector<PictureBlur> print_blurs(const OpticalSetup& setup, const Printer& printer,
                                     double height, double wavelength);

/// Where steps spread light over more than a pixel.
struct Terraces {
  double width = 0.0;  ///< Of the narrowest, mm; 0 if there are none.
  double share = 0.0;  ///< Of the lens's area that has such.
};

/// @param steeper  factor by which the lens that is meant has greater slopes than this one, with
///                 the same pixels.
Terraces terraces_of(const Lens& lens, const Printer& printer, double steeper,
                     const Executor& executor);

}  // namespace lensforge

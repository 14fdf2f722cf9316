// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cam/check/wall_view.h"
#include "cam/plan/cam_options.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"

namespace lensforge {

/// A lamp's picture from a photograph of the wall.
struct LampPicture {
  Image light;         ///< As SourceShape: seen from the lens, y up. Square; the brightest has 1.
  double width = 0.0;  ///< Of the picture, as SourceExtent::width.
  double lit = 0.0;    ///< Share of the width that the lamp itself takes.
  /// Pixels of the photograph across the lamp's image.
  double pixels = 0.0;
  /// Root mean square of display values that lens and lamp leave unexplained; 0 for a pinhole.
  double residual = 0.0;
};

/// A small hole that throws a lamp's image on a wall, as a camera seen straight on shows it.
struct Pinhole {
  double distance = 0.0;     ///< To the wall, mm.
  double photo_width = 0.0;  ///< What the photograph shows of the wall, mm.
};

/// The lamp whose image a pinhole throws: what is brighter than a plane through the photograph's
/// borders, turned as the lamp is seen from the hole. The wall is photographed from the lamp's
/// side. The hole's own blur stays in it.
/// @return with the width as an angle, rad.
/// @throw InputError naming the photograph: too dark, clipped, no lamp, too small, or it touches
///        the border.
LampPicture lamp_by_pinhole(const Photograph& photo, const Pinhole& pinhole);

/// The lamp behind a lens: the kernel k ≥ 0 that makes its photograph of the part's forecast in the
/// light of a point, by least squares of display values to first order, with a small penalty on
/// differences between neighbours. Picture, view and grid are found by turns. Everything else that
/// blurs, such as a polish other than the workshop's, counts to the lamp.
/// @param lens     with a distance of the wall that is certain: it is the scale.
/// @param options  with the workshop that made the part.
/// @throw InputError as find_picture(), and if the lamp's image is too narrow; Interrupted.
LampPicture lamp_by_lens(const Lens& lens, const CamOptions& options, const Photograph& photo,
                         const Executor& executor, const RunControl& control);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "core/image/image.h"
#include "core/image/image_io.h"

/// Pictures in linear light: reading and writing files, resampling, comparing.
///
///     const lensforge::LoadedImage portrait = lensforge::read_image("portrait.png");
///     lensforge::write_image(portrait.image, "portrait.exr");

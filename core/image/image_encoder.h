// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <OpenImageIO/imageio.h>

#include <functional>
#include <string>
#include <vector>

#include "core/compute/executor.h"

namespace lensforge {

/// Returns the pixels of rows first … end − 1 in the layout of the file format.
using EncodedRows = std::function<const void*(int first, int end)>;

/// The bytes of a picture file with the program's mark.
/// @param what       name for messages. @param extension  ".png", ".exr".
/// @throw RunError if it cannot be encoded; Interrupted.
std::vector<unsigned char> encode_rows(const std::string& what, OIIO::ImageSpec spec,
                                       const std::string& extension, const EncodedRows& rows,
                                       const RunControl& control);

}  // namespace lensforge

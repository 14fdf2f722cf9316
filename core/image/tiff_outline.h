// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <istream>
#include <string>

namespace lensforge {

/// Returns why no decoder should open the stream: its first picture has pixel data beyond the
/// stream's end, or an unknown compression. Empty for every other stream, TIFF or not.
std::string tiff_problem(std::istream& file);

}  // namespace lensforge

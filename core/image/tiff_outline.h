// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <istream>
#include <string>

namespace lensforge {

/// Why no decoder should be given the stream: its first picture has pixel data beyond the stream's
/// end, or a compression that no decoder knows. Empty for every other stream, also for one that is
/// no TIFF.
std::string tiff_problem(std::istream& file);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <istream>
#include <string>

namespace lensforge {

/// Header of a PNM stream (PBM, PGM, PPM, PFM).
struct PnmOutline {
  char kind = '5';  ///< Second character of the stream: '1' … '6', 'f', 'F'.
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::int64_t max_value = 1;  ///< PGM and PPM only.
  std::string problem;         ///< "has …"; empty if the header is valid.
};

/// Reads the header from the stream's start; the stream is then at the pixels.
PnmOutline read_pnm_outline(std::istream& file);

/// Reads all pixels after the header. @return why they contradict it; empty if they do not.
/// @pre read_pnm_outline() found no problem.
std::string pnm_pixel_problem(std::istream& file, const PnmOutline& outline);

}  // namespace lensforge

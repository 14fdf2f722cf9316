// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <istream>
#include <string>

namespace lensforge {

/// What the header of a PNM stream (PBM, PGM, PPM, PFM) tells.
struct PnmOutline {
  char kind = '5';  ///< Second character of the stream: '1' … '6', 'f', 'F'.
  std::int64_t columns = 0;
  std::int64_t rows = 0;
  std::int64_t max_value = 1;  ///< Of PGM and PPM.
  std::string problem;         ///< "has …"; empty if the header holds.
};

/// Reads the header from the stream's start; the stream stands before the pixels afterwards.
PnmOutline read_pnm_outline(std::istream& file);

/// Reads all pixels behind the header. @return why they are not what it says; empty if they are.
/// @pre read_pnm_outline() found no problem.
std::string pnm_pixel_problem(std::istream& file, const PnmOutline& outline);

}  // namespace lensforge

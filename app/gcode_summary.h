// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace lensforge::app {

/// What a look through a G-code program tells without interpreting it.
struct GcodeSummary {
  std::vector<std::string> header;  ///< Comments before the first command, brackets taken off.
  std::int64_t lines = 0;
  std::int64_t moves = 0;         ///< Lines with an X, Y or Z word.
  std::int64_t passed_over = 0;   ///< Lines with parameters or expressions.
  std::int64_t first_passed = 0;  ///< The first of them, counted from 1.
  Eigen::AlignedBox3d extent;     ///< Of the X, Y and Z words as written; empty along unused axes.
};

/// @throw InputError if the file cannot be read or holds bytes that no program has.
GcodeSummary summarise_gcode(const std::filesystem::path& path);

}  // namespace lensforge::app

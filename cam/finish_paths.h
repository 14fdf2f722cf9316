// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "cam/milled/ball_path.h"
#include "cam/path/finish_raster.h"
#include "cam/path/move.h"
#include "core/compute/run_control.h"
#include "machine/gcode/gcode_dialect.h"

namespace lensforge {

/// The finishing ball's ways in the lens frame, from what is meant to what is written.
struct FinishPaths {
  std::vector<BallPath> ideal;    ///< Along the exact drop curves, to kExactRow.
  std::vector<BallPath> fitted;   ///< The moves before their numbers are rounded.
  std::vector<BallPath> written;  ///< As the programs have them.
};

/// Adds a row's exact way and that of its moves before rounding to the last of `ideal` and of
/// `fitted`. @pre the row has traces.
void add_row(const RasterRow& row, FinishPaths& paths);

/// A MoveSink that hands moves at feed to a path.
MoveSink path_sink(BallPath& path);

/// What a program's motions at feed with one tool come to.
/// @param z_offset  program Z − lens-frame z, mm.
/// @throw InputError, RunError if the program cannot be read; Interrupted.
void read_path(const std::filesystem::path& program, const GcodeDialect& dialect, int tool,
               BallPath& path, const RunControl& control);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "cam/milled/ball_sweep.h"
#include "cam/path/finish_raster.h"
#include "cam/path/move.h"
#include "cam/tool/process.h"
#include "core/compute/run_control.h"
#include "machine/gcode/gcode_dialect.h"

namespace lensforge {

/// The finishing ball's ways in the lens frame, from what is meant to what is written.
struct FinishPaths {
  std::vector<BallPath> ideal;    ///< Along the exact drop curves, to kExactRow.
  std::vector<BallPath> fitted;   ///< The moves before their numbers are rounded.
  std::vector<BallPath> written;  ///< As the programs have them.
  /// As a machine makes them that goes too far across the passes; empty for one that does not.
  std::vector<BallPath> stretched;
};

/// An axis that goes farther than a program says: from the program's zero, `factor` times as far.
struct AxisStretch {
  int axis = 1;
  double factor = 1.0;

  /// What FinishProcess::pitch_error does.
  static AxisStretch of(const FinishProcess& finish);
  [[nodiscard]] bool any() const { return factor != 1.0; }
};

/// Adds a motion as a machine makes it whose axis is stretched. Arcs in a plane that holds this
/// axis are ellipses then: arcs within 1e-6 mm of them.
void add_stretched(const GcodeMotion& motion, const AxisStretch& stretch, BallPath& path);

/// Adds a row's exact way and that of its moves before rounding to the last of `ideal` and of
/// `fitted`. @pre the row has traces.
void add_row(const RasterRow& row, FinishPaths& paths);

/// A MoveSink that hands moves at feed to a path.
MoveSink path_sink(BallPath& path, const AxisStretch& stretch = {});

/// Hands a program's motions at feed with one tool to `take`.
/// @throw InputError, RunError if the program cannot be read; Interrupted.
void read_path(const std::filesystem::path& program, const GcodeDialect& dialect, int tool,
               const std::function<void(const GcodeMotion&)>& take, const RunControl& control);

}  // namespace lensforge

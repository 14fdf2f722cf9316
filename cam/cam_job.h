// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "cam/post/gcode_writer.h"
#include "core/executor.h"
#include "core/lens.h"
#include "core/run_control.h"

namespace lensforge {

/// Where program Z = 0 lies.
enum class ZZero {
  kStock,  ///< Top of the blank: the highest point of the surface plus CamOptions::stock.
  kTable,  ///< What the blank lies on: the flat entry face, z = 0 of the lens frame.
  kLens,   ///< Highest point of the finished surface.
};

/// "stock", "table" or "lens" → ZZero. @throw InputError naming the option and the value.
ZZero parse_z_zero(std::string_view name);

/// Everything that shapes the finishing program but the lens itself.
struct CamOptions {
  double tool_diameter = 0.4;    ///< Ball-end mill, mm, > 0, smaller than both sides of the lens.
  double pitch = 0.06;           ///< Stepover between rows at most, mm, > 0, ≤ tool_diameter.
  double spindle_rpm = 23000.0;  ///< > 0, at most 1e6.
  /// Cutting feed, mm/min, > 0, ≤ 1e5. The default is a chip load of 0.011 mm on each of two teeth
  /// at 23,000 rpm, the middle of what makers of 0.4 mm ball-end mills give for acrylic.
  double feed = 500.0;
  double plunge = 150.0;     ///< Feed straight down, mm/min, > 0, ≤ 1e5.
  double stock = 0.5;        ///< Top of the blank above the surface's highest point, mm, ≥ 0.
  double safe_height = 5.0;  ///< Rapid moves run this far above the top of the blank, mm, > 0.
  double spin_up = 3.0;      ///< Dwell after the spindle was switched on, s, ≥ 0.
  /// Farthest that the path may run from the drop curve, mm, ≥ 4 · 10^−decimals (finish_raster.h).
  /// LinuxCNC is told to cut corners of the path by no more than as much again.
  double tolerance = 0.0005;
  /// Farthest that the direction of a move may differ from the drop curve's, rad, > 0, ≤ 1.
  double slope_tolerance = 1e-3;
  /// Digits after the point in the program, 4 … 6. Moves are 0.06 mm long on average: rounding to
  /// five decimals turns them by 0.2 mrad at most, to four by 1.7.
  int decimals = 5;
  Post post = Post::kLinuxcnc;
  ZZero z_zero = ZZero::kStock;
  std::string job = "lens";  ///< Name of the part in the program's first comment.
};

/// Names of the files that make_finish_program() writes.
namespace cam_file {
inline constexpr const char* kFinish = "finish.ngc";
inline constexpr const char* kReport = "report.json";
}  // namespace cam_file

/// What came out, mm; lens frame but where said otherwise.
struct CamResult {
  enum class Status { kDone, kInterrupted, kFailed };
  Status status = Status::kFailed;
  std::string message;                ///< Why it ended, in one line.
  std::vector<std::string> warnings;  ///< Plain sentences on what an operator should question.
  std::vector<std::filesystem::path> files;  ///< What was written.

  std::int64_t rows = 0;        ///< Passes along x, those outside the rim included.
  std::int64_t points = 0;      ///< Cutter location points of the path, that is cutting moves + 1.
  std::int64_t lines = 0;       ///< Lines of the program.
  double pitch = 0.0;           ///< Stepover as cut, ≤ CamOptions::pitch.
  double cutting_length = 0.0;  ///< Length of all moves at cutting feed.
  /// cutting_length ÷ feed, minutes. No promise: acceleration makes the real time longer.
  double length_over_feed_min = 0.0;
  Eigen::AlignedBox3d tip;   ///< Box of the tool tip's cutting moves.
  double surface_top = 0.0;  ///< Highest point of the surface.
  double stock_top = 0.0;    ///< Top of the blank.
  double deepest_cut = 0.0;  ///< Deepest tip below the top of the blank, ≥ 0.
  double z_offset = 0.0;     ///< Program Z = lens-frame z + z_offset.
  double seconds = 0.0;      ///< Wall clock spent.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// Makes the finishing program of a lens: zig-zag rows of a ball-end mill (finish_raster.h) written
/// as G-code (gcode_writer.h). Writes cam_file::kFinish and then cam_file::kReport into `folder`,
/// each whole or not at all; on an interruption neither, and what an earlier run left stays. Memory
/// does not grow with the number of rows; the program has the same bytes for any number of threads.
/// @throw InputError naming option, value and rule if an option breaks its rule; naming the surface
///        if it has no triangles, is no height field over the lens's rectangle or does not cover
///        it.
/// @throw RunError if the files cannot be written (disk full, …).
CamResult make_finish_program(const Lens& lens, const CamOptions& options,
                              const std::filesystem::path& folder, const Executor& executor,
                              const RunControl& control);

/// @throw InputError naming option, value and rule if an option breaks its rule on its own or
///        against the size of the lens.
void validate(const CamOptions& options, const OpticalSetup& setup);

/// The content of report.json.
nlohmann::json cam_report(const CamOptions& options, const CamResult& result);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "cam/tool/polish_model.h"
#include "cam/tool/process.h"
#include "cam/tool/tolerances.h"
#include "cam/tool/tool.h"
#include "core/text/toml_fields.h"

namespace lensforge {

/// The mill. Limits belong to the axes x, y, z.
struct Machine {
  std::string name = "JDGR100 in 3-axis mode";
  Eigen::Vector3d travel{400.0, 400.0, 150.0};           ///< mm
  double spindle_min_rpm = 3000.0;                       ///< ≥ 0
  double spindle_max_rpm = 24000.0;                      ///< > 0
  bool spindle_by_hand = false;                          ///< The program cannot switch it.
  Eigen::Vector3d max_rate{10000.0, 10000.0, 6000.0};    ///< Rapids and feeds at most, mm/min.
  Eigen::Vector3d acceleration{2000.0, 2000.0, 1000.0};  ///< mm/s²
  double junction_deviation = 0.005;                     ///< Rounding of corners, mm.
  double arc_tolerance = 0.0005;                ///< Of arcs as the controller splits them, mm.
  Eigen::Vector3d steps_per_mm{0.0, 0.0, 0.0};  ///< 0 rounds to no steps.
  int look_ahead = 200;                         ///< Moves that the controller plans ahead.
  double lines_per_second = 1000.0;             ///< That it takes at most; 0 without limit.

  friend bool operator==(const Machine&, const Machine&) = default;
};

/// The blank before the first cut: a box in the lens frame, entry face in z = 0.
struct Stock {
  double margin = 3.0;     ///< Beyond the lens's rectangle on every side, mm, ≥ 0.
  double allowance = 0.5;  ///< Above the surface's highest point, mm, ≥ 0.

  /// The blank around a surface, mm. @param surface  box of the surface.
  [[nodiscard]] Eigen::AlignedBox3d box(const Eigen::AlignedBox3d& surface) const;
  friend bool operator==(const Stock&, const Stock&) = default;
};

/// A box that no part of the tool may enter: a clamp, a vice's jaw. mm, lens frame.
struct KeepOut {
  std::string name;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();

  friend bool operator==(const KeepOut&, const KeepOut&) = default;
};

/// What the blank is made of.
struct Material {
  std::string name = "cast acrylic (PMMA)";
  double ior = 0.0;  ///< Refractive index against air, > 1; 0 where it is not stated.

  friend bool operator==(const Material&, const Material&) = default;
};

/// The tools of the defaults: 3 a 3 mm flat end mill to rough, 2 a 1 mm ball to semi-finish, 1 the
/// 0.4 mm ball of the paper (Sun et al., Section 5) to finish; 4 a 6 mm ball for FinishProcess::
/// large_tool, whose feed takes 0.04 mm a tooth.
std::vector<Tool> default_tools();

/// Everything about a cut but the lens: machine, blank, clamps, tools and how they are used.
struct Workshop {
  Machine machine;
  Material material;
  Stock stock;
  std::vector<KeepOut> keep_outs;
  std::vector<Tool> tools = default_tools();
  Process process;
  PolishModel polish{0.03, 0.0, 1.0};  ///< What happens to the surface after the last cut.
  Tolerances tolerances;               ///< How far all this may be off.

  /// Null if no tool has this number.
  [[nodiscard]] const Tool* find_tool(int number) const;
  /// @throw InputError if no tool has this number.
  [[nodiscard]] const Tool& tool(int number) const;
  friend bool operator==(const Workshop&, const Workshop&) = default;
};

/// Rapid moves run at least this high above blank and clamps, mm: sheets of cast acrylic are up to
/// half a millimetre thicker than stated (ISO 7823-1 allows 0.4 mm and a tenth of the thickness),
/// and a touch-off and a blank that lies askew are off by a tenth or two.
inline constexpr double kMinSafeHeight = 0.5;

/// Least and most of one of the workshop's numbers, by its place in the file:
/// "process.safe_height", "tool.diameter", "finish.pitch". What sets such a number from elsewhere
/// follows the same rule.
/// @pre there is such a number.
NumberRule workshop_rule(const std::string& key);

/// @param file  what to name in messages.
/// @throw InputError naming file, key, value and rule where a number is out of its range, or where
///        two entries contradict one another: tool numbers, shapes and sections, speeds beyond the
///        machine, steps wider than the tool.
void validate(const Workshop& workshop, const std::string& file);

/// @throw InputError naming file, key, value and rule where a number is out of its range.
void validate_ranges(const Workshop& workshop, const std::string& file);

/// Reads a workshop from TOML text. What is missing keeps its default; tools and clamps replace the
/// defaults as a whole.
/// @throw InputError naming file, key, value and rule.
Workshop parse_workshop(std::string_view text, const std::string& file);

/// parse_workshop() of a file. @throw InputError also if it cannot be read.
Workshop read_workshop(const std::filesystem::path& path);

/// The workshop as commented TOML: parse_workshop() returns it unchanged.
std::string workshop_toml(const Workshop& workshop);

/// The tool in another diameter, mm, > 0: flutes and neck in proportion, shank and holder as they
/// are.
Tool resized(Tool tool, double diameter);

}  // namespace lensforge

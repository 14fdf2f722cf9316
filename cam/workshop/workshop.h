// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cam/workshop/tool.h"

namespace lensforge {

class Description;
struct Limits;

/// Axis along which the passes of a raster run.
enum class PassAxis { kX, kY };

/// Order and direction of a raster's passes, with a spindle that turns clockwise (M3).
enum class PassStyle {
  kZigzag,        ///< To and fro.
  kClimb,         ///< One way, uncut material on the right of the travel.
  kConventional,  ///< One way, uncut material on the left.
};

/// Entry of a tool into material.
enum class EntryStyle {
  kRamp,   ///< Along its pass, to and fro.
  kHelix,  ///< On a circle where one fits, else along its pass.
};

/// Level-by-level roughing.
struct RoughProcess {
  bool enabled = true;
  int tool = 3;                 ///< Tool::number
  double stepdown = 1.0;        ///< Maximum distance of levels, mm, > 0.
  double stepover = 1.2;        ///< Maximum distance of passes, mm, in 0 … its diameter.
  double allowance = 0.2;       ///< Left on the surface, along its normal, mm, ≥ 0.
  double ramp_angle_deg = 3.0;  ///< Steepest way into material, degrees, in 0.1 … 45.
  EntryStyle entry = EntryStyle::kRamp;
  double helix_radius = 1.0;  ///< Of the axis's circle, mm, in 0 … the tool's radius.
  double spacing = 0.1;       ///< Distance of points at which the surface is sampled, mm, > 0.
  PassStyle style = PassStyle::kZigzag;
  PassAxis along = PassAxis::kX;

  friend bool operator==(const RoughProcess&, const RoughProcess&) = default;
};

/// One raster that follows the surface with a stock allowance.
struct SemiProcess {
  bool enabled = true;
  int tool = 2;                 ///< Tool::number
  double stepover = 0.15;       ///< Maximum distance of passes, mm, in 0 … its diameter.
  double allowance = 0.03;      ///< Left on the surface, along its normal, mm, ≥ 0.
  double ramp_angle_deg = 3.0;  ///< Steepest way into material, degrees, in 0.1 … 45.
  EntryStyle entry = EntryStyle::kRamp;
  double helix_radius = 0.3;  ///< Of the axis's circle, mm, in 0 … the tool's radius.
  double spacing = 0.05;      ///< Distance of points at which the surface is sampled, mm, > 0.
  PassStyle style = PassStyle::kZigzag;
  PassAxis along = PassAxis::kX;

  friend bool operator==(const SemiProcess&, const SemiProcess&) = default;
};

/// The ball's raster that cuts the optical surface.
struct FinishProcess {
  int tool = 1;               ///< Tool::number, a ball.
  double pitch = 0.06;        ///< Maximum distance of passes, mm, in 0 … its diameter.
  double scallop = 0.0;       ///< If > 0, mm: determines the pitch, see max_pitch().
  double tolerance = 0.0005;  ///< Maximum distance from the drop curve, mm, > 0.
  /// Maximum error of a move's direction, rad, > 0. Polishing does not remove an error that
  /// neighbouring rows share; for leakage and number of moves by value see docs/tuning.md,
  /// "Defaults of cam".
  double slope_tolerance = 6e-5;
  PassStyle style = PassStyle::kZigzag;
  PassAxis along = PassAxis::kX;
  bool cross = false;   ///< A second raster along the other axis.
  bool pencil = false;  ///< A pass along concave creases.
  /// Tool::number of a larger ball that finishes all it can reach before `tool` finishes the rest;
  /// 0: `tool` alone.
  int large_tool = 0;
  int large_every = 1;  ///< Rows of `tool`, at its pitch, per row of the larger ball, ≥ 1.
  /// Overshoot of the machine across the passes, share of a length, −0.02 … 0.02. It does not
  /// change the programs; the part that cam predicts is longer by it.
  double pitch_error = 0.0;

  /// Sets the pitch, in mm, whatever the scallops.
  void set_pitch(double mm) {
    pitch = mm;
    scallop = 0.0;
  }

  friend bool operator==(const FinishProcess&, const FinishProcess&) = default;
};

/// All choices about the cut.
struct Process {
  double safe_height = 5.0;  ///< Of rapid moves above the blank and the clamps, mm, > 0.
  double clearance = 0.5;    ///< Of the tool to clamps, and above material before it is fed, mm.
  RoughProcess rough;
  SemiProcess semi;
  FinishProcess finish;

  friend bool operator==(const Process&, const Process&) = default;
};

/// Slope of a surface that is not known yet: it counts as level.
inline constexpr double kUnknownSlope = 0.0;

/// Maximum stepover of the finishing ball's rows, mm: FinishProcess::pitch, or the stepover that
/// leaves scallops of FinishProcess::scallop on a plane that rises by `steepest` (rise over run, s)
/// across the rows, 2√(h(2R − h)) / √(1 + s²). Rows are cut at finish_pitch(), which fits it to the
/// surface's width.
double max_pitch(const FinishProcess& process, double ball_radius, double steepest);

/// Model of polishing; all lengths in mm.
struct PolishModel {
  double sigma = 0.0;        ///< Of the transfer function, ≥ 0; 0: not polished.
  double rim_depth = 0.0;    ///< Additional removal at the rim, ≥ 0.
  double rim_length = 1.0;   ///< Distance over which that falls to 1/e, > 0.
  int order = 2;             ///< Of the transfer function (PolishTransfer): 2 or 4.
  double floor = 0.0;        ///< Share of every ripple that stays, in [0, 1).
  double roughness = 0.0;    ///< Roughness::rms, nm, ≥ 0; 0: not stated.
  double correlation = 5.0;  ///< Roughness::correlation, µm, > 0.

  friend bool operator==(const PolishModel&, const PolishModel&) = default;
};

/// Waves that an axis of the machine leaves in the surface, around one wavelength: the height error
/// depends on that axis's position alone and is the same in every row.
struct WavinessBand {
  double wavelength = 10.0;  ///< mm, > 0; waves of 0.7 to 1.4 times this are drawn.
  double rms_um = 0.1;       ///< Root mean square of the height, µm, ≥ 0.

  friend bool operator==(const WavinessBand&, const WavinessBand&) = default;
};

/// Deviations of machine, tool, polish and light from the values that the programs assume. Measured
/// quantities are normal with the stated standard deviation (σ); limits kept by a maker or a person
/// are uniform up to the stated bound. For the origin of the defaults see docs/fabrication.md, "How
/// sure is the forecast".
struct Tolerances {
  /// Of the machine's X axis and of its Y axis.
  std::vector<WavinessBand> waviness{{30.0, 0.3}, {3.0, 0.03}};
  double row_um = 0.02;      ///< Height of one row against the next, σ, µm, ≥ 0.
  double row_length = 10.0;  ///< Length along a row over which that changes, mm, > 0.
  double backlash_um = 1.0;  ///< Of the axis along the rows, 0 to this, µm, ≥ 0.
  double radius_um = 5.0;    ///< Radius of the ball, ± this, µm, ≥ 0.
  double runout_um = 5.0;    ///< Total indicated run-out of the ball, 0 to this, µm, ≥ 0.

  double polish_sigma = 0.1;    ///< Relative σ of the polish's σ from part to part, 0 … 0.3.
  double polish_within = 0.05;  ///< The same from place to place on a part, 0 … 0.3.
  double roughness = 0.0;       ///< Relative σ of the polish's roughness, part to part, 0 … 0.3.

  double index = 0.001;   ///< Refractive index, ± this, ≥ 0.
  double distance = 1.0;  ///< Of the screen, ± this, mm, ≥ 0.
  double tilt_deg = 0.2;  ///< Of the part about its x and y axes, σ each, degrees, ≥ 0.
  /// Full angle of the source as the lens sees it, 0 to this, mrad, ≥ 0; the design assumes 0.
  double source_mrad = 0.5;
  double temperature_k = 5.0;     ///< Of the part, ± this, K, ≥ 0.
  double expansion_per_k = 7e-5;  ///< Of the material's lengths.
  double index_per_k = -1.05e-4;  ///< Of the material's refractive index.

  // Of the front against the back where both are cut, in two setups; each ±. Assumed: edges are
  // found to 0.01 mm, but a milled edge is straight and square to some hundredths, and a blank that
  // lies on chips of 0.01 mm is tilted by as much over its width.
  double face_shift = 0.03;      ///< Along x and along y, mm, ≥ 0.
  double face_turn_deg = 0.05;   ///< About z, degrees, ≥ 0: 0.04 mm over an edge of 50 mm.
  double face_tilt_deg = 0.02;   ///< About x and about y, degrees, ≥ 0: 0.01 mm over 30 mm.
  double face_thickness = 0.02;  ///< mm, ≥ 0: of two touch-offs.

  friend bool operator==(const Tolerances&, const Tolerances&) = default;
};

/// Causes of error, in the order of Tolerances.
enum class ErrorCause : std::uint8_t {
  kWaviness,
  kRows,
  kBacklash,
  kTool,
  kPolish,
  kIndex,
  kDistance,
  kTilt,
  kSource,
  kTemperature,
};
inline constexpr std::size_t kErrorCauses = 10;

/// The mill. Limits belong to the axes x, y, z.
struct Machine {
  std::string name = "JDGR100 in 3-axis mode";
  std::string post = "linuxcnc";                ///< Dialect of its controller, see post_of().
  Eigen::Vector3d travel{400.0, 400.0, 150.0};  ///< mm
  double spindle_min_rpm = 3000.0;              ///< ≥ 0
  double spindle_max_rpm = 24000.0;             ///< > 0
  bool spindle_by_hand = false;                 ///< The program cannot switch it.
  Eigen::Vector3d max_rate{10000.0, 10000.0, 6000.0};    ///< Rapids and feeds at most, mm/min.
  Eigen::Vector3d acceleration{2000.0, 2000.0, 1000.0};  ///< mm/s²
  double junction_deviation = 0.005;                     ///< Rounding of corners, mm.
  double arc_tolerance = 0.0005;                ///< Of arcs as the controller splits them, mm.
  Eigen::Vector3d steps_per_mm{0.0, 0.0, 0.0};  ///< 0 rounds to no steps.
  int look_ahead = 200;                         ///< Moves that the controller plans ahead.
  double lines_per_second = 1000.0;             ///< Maximum that it takes; 0: no limit.

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

/// Thicknesses in which sheets of acrylic are sold, mm.
inline constexpr std::array kSheetsOnSale{2.0,  3.0,  4.0,  5.0,  6.0,  8.0,
                                          10.0, 12.0, 15.0, 20.0, 25.0, 30.0};

/// The thinnest of these sheets that is as high as a blank; 0 if none is. mm
inline double thinnest_sheet(std::span<const double> sheets, double height) {
  double thinnest = 0.0;
  for (const double sheet : sheets) {
    if (sheet >= height && (thinnest == 0.0 || sheet < thinnest)) thinnest = sheet;
  }
  return thinnest;
}

/// A box that no part of the tool may enter: a clamp, a vice's jaw. mm, lens frame.
struct KeepOut {
  std::string name;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();

  friend bool operator==(const KeepOut&, const KeepOut&) = default;
};

/// Material of the blank.
struct Material {
  std::string name = "cast acrylic (PMMA)";
  double ior = 0.0;  ///< Refractive index against air, > 1; 0 where it is not stated.

  friend bool operator==(const Material&, const Material&) = default;
};

/// A resin printer (DLP, LCD), and the film that levels the steps which it leaves. The defaults are
/// those of a usual one with a screen of 3840 × 2400 pixels; the film's are assumed.
struct Printer {
  std::string name = "resin printer with an LCD of 3840 x 2400 pixels";
  double pixel = 0.035;                     ///< Side of a pixel on the bed, mm, > 0.
  double layer = 0.025;                     ///< Thickness of a layer, mm, > 0.
  Eigen::Vector3d bed{130.0, 80.0, 160.0};  ///< Largest part, mm; z is across the layers.
  /// The lens stands on its lower edge, y across the layers; else its entry face lies on the bed.
  bool upright = false;
  double seconds_per_layer = 8.0;  ///< Exposure, lift and settling, > 0.
  double start_minutes = 5.0;      ///< Of the first layers, ≥ 0.
  double film_sigma = 0.3;         ///< PolishTransfer::sigma of the levelling film, mm, > 0.
  int film_order = 4;              ///< PolishTransfer::order of it.

  /// Unit of the printed lens's heights, mm.
  [[nodiscard]] double step() const { return upright ? pixel : layer; }
  /// Rectangle of the lens that has one height, mm.
  [[nodiscard]] Eigen::Vector2d cell() const { return {pixel, upright ? layer : pixel}; }

  friend bool operator==(const Printer&, const Printer&) = default;
};

/// The default tools: 3, a 3 mm flat end mill for roughing; 2, a 1 mm ball for semi-finishing; 1,
/// the 0.4 mm ball of the paper (Sun et al., Section 5) for finishing; 4, a 6 mm ball for
/// FinishProcess::large_tool, with a feed of 0.04 mm per tooth.
std::vector<Tool> default_tools();

/// A whole workshop: machine, blank, clamps, tools and their use, or its printer; everything about
/// a part except the lens.
struct Workshop {
  Machine machine;
  Material material;
  Stock stock;
  std::vector<KeepOut> keep_outs;
  std::vector<Tool> tools = default_tools();
  Process process;
  PolishModel polish{0.03, 0.0, 1.0};  ///< Polish after the last cut.
  Tolerances tolerances;               ///< Errors of all these.
  Printer printer;                     ///< For parts that are printed instead.

  /// Null if no tool has this number.
  [[nodiscard]] const Tool* find_tool(int number) const;
  /// @throw InputError if no tool has this number.
  [[nodiscard]] const Tool& tool(int number) const;
  friend bool operator==(const Workshop&, const Workshop&) = default;
};

/// Minimum height of rapid moves above blank and clamps, mm: sheets of cast acrylic are up to 0.5
/// mm thicker than stated (ISO 7823-1 allows 0.4 mm and a tenth of the thickness), and a touch-off
/// and a tilted blank are off by 0.1 to 0.2 mm.
inline constexpr double kMinSafeHeight = 0.5;

/// The keys of the workshop file, with ranges and comments (core/schema/description.h).
void describe(Description& d, Machine& machine);
void describe(Description& d, Material& material);
void describe(Description& d, Stock& stock);
void describe(Description& d, KeepOut& box);
void describe(Description& d, ToolSection& section);
void describe(Description& d, Tool& tool);
void describe(Description& d, RoughProcess& rough);
void describe(Description& d, SemiProcess& semi);
void describe(Description& d, FinishProcess& finish);
void describe(Description& d, Process& process);  ///< But for roughing, semi and finishing.
void describe(Description& d, PolishModel& polish);
void describe(Description& d, WavinessBand& band);
void describe(Description& d, Tolerances& t);
void describe(Description& d, Printer& printer);
void describe(Description& d, Workshop& shop);

/// The range of one of the workshop's numbers, by its key in the file: "process.safe_height",
/// "tool.diameter", "finish.pitch". @pre there is such a number.
Limits workshop_limits(std::string_view key);

/// @param file  its name in messages.
/// @throw InputError naming file, key, value and rule where a number is out of its range, or where
///        two entries contradict one another: tool numbers, shapes and sections, speeds beyond the
///        machine, steps wider than the tool.
void validate(const Workshop& workshop, const std::string& file);

/// @throw InputError naming file, key, value and rule where a number is out of its range.
void validate_ranges(const Workshop& workshop, const std::string& file);

/// Reads a workshop from TOML text. Missing keys keep their defaults; tools and clamps replace the
/// defaults as a whole.
/// @throw InputError naming file, key, value and rule.
Workshop parse_workshop(std::string_view text, const std::string& file);

/// parse_workshop() of a file. @throw InputError also if it cannot be read.
Workshop read_workshop(const std::filesystem::path& path);

/// The workshop as commented TOML: parse_workshop() returns it unchanged.
std::string workshop_toml(const Workshop& workshop);

}  // namespace lensforge

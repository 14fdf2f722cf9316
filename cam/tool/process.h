// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Along which axis the passes of a raster run.
enum class PassAxis { kX, kY };

/// How the passes of a raster follow one another, with a spindle that turns clockwise (M3).
enum class PassStyle {
  kZigzag,        ///< To and fro.
  kClimb,         ///< One way, uncut material on the right of the travel.
  kConventional,  ///< One way, uncut material on the left.
};

/// How a tool gets down into material.
enum class EntryStyle {
  kRamp,   ///< Along its pass, to and fro.
  kHelix,  ///< On a circle where one fits, else along its pass.
};

/// Level-by-level roughing.
struct RoughProcess {
  bool enabled = true;
  int tool = 3;                 ///< Tool::number
  double stepdown = 1.0;        ///< Between levels at most, mm, > 0.
  double stepover = 1.2;        ///< Between passes at most, mm, in 0 … its diameter.
  double allowance = 0.2;       ///< Left on the surface, along its normal, mm, ≥ 0.
  double ramp_angle_deg = 3.0;  ///< Steepest way into material, degrees, in 0.1 … 45.
  EntryStyle entry = EntryStyle::kRamp;
  double helix_radius = 1.0;  ///< Of the axis' circle, mm, in 0 … the tool's radius.
  double spacing = 0.1;       ///< Of points at which the surface is asked for, mm, > 0.
  PassStyle style = PassStyle::kZigzag;
  PassAxis along = PassAxis::kX;

  friend bool operator==(const RoughProcess&, const RoughProcess&) = default;
};

/// One raster that follows the surface with a stock allowance.
struct SemiProcess {
  bool enabled = true;
  int tool = 2;                 ///< Tool::number
  double stepover = 0.15;       ///< Between passes at most, mm, in 0 … its diameter.
  double allowance = 0.03;      ///< Left on the surface, along its normal, mm, ≥ 0.
  double ramp_angle_deg = 3.0;  ///< Steepest way into material, degrees, in 0.1 … 45.
  EntryStyle entry = EntryStyle::kRamp;
  double helix_radius = 0.3;  ///< Of the axis' circle, mm, in 0 … the tool's radius.
  double spacing = 0.05;      ///< Of points at which the surface is asked for, mm, > 0.
  PassStyle style = PassStyle::kZigzag;
  PassAxis along = PassAxis::kX;

  friend bool operator==(const SemiProcess&, const SemiProcess&) = default;
};

/// The ball's raster that makes the optical surface.
struct FinishProcess {
  int tool = 1;               ///< Tool::number, a ball.
  double pitch = 0.06;        ///< Between passes at most, mm, in 0 … its diameter.
  double scallop = 0.0;       ///< If > 0, mm: the pitch follows from it, see finish_pitch().
  double tolerance = 0.0005;  ///< Farthest from the drop curve, mm, > 0.
  /// Largest error of a move's direction, rad, > 0. Polishing does not even out what neighbouring
  /// rows have in common; docs/tuning.md, "Defaults of cam", has the leak and the moves by value.
  double slope_tolerance = 6e-5;
  PassStyle style = PassStyle::kZigzag;
  PassAxis along = PassAxis::kX;
  bool cross = false;   ///< A second raster along the other axis.
  bool pencil = false;  ///< A pass along concave creases.
  /// Tool::number of a larger ball that finishes wherever it reaches, before `tool` finishes the
  /// rest; 0: `tool` alone.
  int large_tool = 0;
  int large_every = 1;  ///< Rows of `tool`, whose pitch holds, per row of the larger ball, ≥ 1.
  /// By how much the machine goes too far across the passes, share of a length, −0.02 … 0.02. The
  /// programs are as without it; the part that cam predicts is longer by it.
  double pitch_error = 0.0;

  /// Passes `mm` apart, whatever scallops they leave.
  void set_pitch(double mm) {
    pitch = mm;
    scallop = 0.0;
  }

  friend bool operator==(const FinishProcess&, const FinishProcess&) = default;
};

/// Everything that is chosen about the cut.
struct Process {
  double safe_height = 5.0;  ///< Of rapid moves above the blank and the clamps, mm, > 0.
  double clearance = 0.5;    ///< Of the tool to clamps, and above material before it is fed, mm.
  RoughProcess rough;
  SemiProcess semi;
  FinishProcess finish;

  friend bool operator==(const Process&, const Process&) = default;
};

/// The pitch as it will be cut at most, mm: FinishProcess::pitch, or what leaves scallops of
/// FinishProcess::scallop on a plane, 2√(h(2R − h)).
double finish_pitch(const FinishProcess& process, double ball_radius);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace lensforge {

struct LeakPlace;

/// Maximum allowed for each fault of a part. Those of quality (all but gouge and block_rate) are
/// limits if the user stated them, and advice otherwise.
struct CutLimits {
  double leakage = 0.05;       ///< Share of the light that lands where the design puts less.
  double dark_flux = 0.02;     ///< Share of the light in the target's dark parts.
  double mae_increase = 0.01;  ///< MAE of the part minus that of the design.
  double gouge = 0.001;        ///< Deepest cut below the surface that the tool should leave, mm.
  double excess = 0.002;       ///< Most material left above it between passes, mm.
  double slope = 0.002;        ///< Largest error of a move's direction, rad.
  double fillet_depth = 0.01;  ///< Most material that the ball leaves in a crease, mm.
  double block_rate = 1000.0;  ///< Lines per second that the controller takes.

  friend bool operator==(const CutLimits&, const CutLimits&) = default;
};

/// Measured faults in the units of CutLimits; those not measured are left out of the verdict.
struct CutFindings {
  std::optional<double> leakage;
  std::optional<double> dark_flux;
  std::optional<double> mae_increase;
  std::optional<double> gouge;
  std::optional<double> excess;
  std::optional<double> slope;
  std::optional<double> fillet_depth;
  std::optional<double> block_rate;
};

/// One finding against its limit, in display units.
struct LimitCheck {
  std::string key;   ///< As in CutLimits.
  std::string name;  ///< In words.
  double value = 0.0;
  double limit = 0.0;    ///< Maximum for the value.
  std::string unit;      ///< "%", "µm", "mrad", "lines/s" or none.
  int decimals = 0;      ///< Number shown.
  bool advises = false;  ///< A limit of quality that the user did not state.

  /// True if the value is within its limit; NaN does not pass.
  [[nodiscard]] bool passes() const { return value <= limit; }
  /// True if it does not pass and is more than advice.
  [[nodiscard]] bool missed() const { return !passes() && !advises; }
};

/// All findings against their limits.
struct Verdict {
  std::vector<LimitCheck> checks;

  [[nodiscard]] bool passes() const;
  /// Number of missed limits; any gives exit code 3.
  [[nodiscard]] int missed() const;
  /// Number of checks that do not pass and are advice.
  [[nodiscard]] int advice() const;
};

/// Result of one or several cuts, in a sentence.
std::string verdict_words(int missed, int advice);

/// @param stated  keys of the limits of quality that count as limits.
/// @throw InputError naming the limit and its value if one is negative or no number.
Verdict judge_cut(const CutFindings& findings, const CutLimits& limits,
                  const std::set<std::string>& stated = {});

/// The cause with the largest part of a place's leakage; empty without parts.
std::string main_cause(const LeakPlace& place);

/// Describes a place in plain words: the surface's fault, how much light leaks and where to, and
/// what helps, if remedies were tried. "The groove at x 41.2 y 37.5 keeps 4.0 µm; 1.30 % of the
/// light leaks from here, 0.900 % into dark parts of the picture. A 0.3 mm ball would halve it, to
/// 0.640 %."
std::string leak_words(const LeakPlace& place);

}  // namespace lensforge

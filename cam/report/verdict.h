// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace lensforge {

struct LeakPlace;

/// Most that a part may have of each fault. Those of quality (all but gouge and block_rate) are
/// limits where they were stated, and advice otherwise.
struct CutLimits {
  double leakage = 0.05;       ///< Share of the light that lands where the design puts less.
  double dark_flux = 0.02;     ///< Share of the light in the target's dark parts.
  double mae_increase = 0.01;  ///< MAE of the part less that of the design.
  double gouge = 0.001;        ///< Deepest cut below the surface the tool should leave, mm.
  double excess = 0.002;       ///< Most material left above it between passes, mm.
  double slope = 0.002;        ///< Largest error of a move's direction, rad.
  double fillet_depth = 0.01;  ///< Most material that the ball leaves in a crease, mm.
  double block_rate = 1000.0;  ///< Lines a second that the controller takes.

  friend bool operator==(const CutLimits&, const CutLimits&) = default;
};

/// What was found, in the units of CutLimits; what was not measured is left out of the verdict.
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

/// One finding against its limit, in the unit that it is shown in.
struct LimitCheck {
  std::string key;   ///< As in CutLimits.
  std::string name;  ///< In words.
  double value = 0.0;
  double limit = 0.0;    ///< The value may be at most this.
  std::string unit;      ///< "%", "µm", "mrad", "lines/s" or none.
  int decimals = 0;      ///< That are shown.
  bool advises = false;  ///< A limit of quality that nobody stated.

  /// A value that is no number does not pass.
  [[nodiscard]] bool passes() const { return value <= limit; }
  /// It does not pass, and that is no mere advice.
  [[nodiscard]] bool missed() const { return !passes() && !advises; }
};

/// All findings against their limits.
struct Verdict {
  std::vector<LimitCheck> checks;

  [[nodiscard]] bool passes() const;
  /// How many limits are missed: these give exit code 3.
  [[nodiscard]] int missed() const;
  /// How many checks do not pass and are advice.
  [[nodiscard]] int advice() const;
};

/// What came of a cut, or of several, in a sentence.
std::string verdict_words(int missed, int advice);

/// @param stated  keys of the limits of quality that count as limits.
/// @throw InputError naming the limit and its value if one is negative or no number.
Verdict judge_cut(const CutFindings& findings, const CutLimits& limits,
                  const std::set<std::string>& stated = {});

/// The cause with the largest part of a place's leakage; empty without parts.
std::string main_cause(const LeakPlace& place);

/// A place in plain words: what is wrong with the surface there, how much light leaks and into
/// what, and what would help, if remedies were tried. "The groove at x 41.2 y 37.5 keeps 4.0 µm;
/// 1.30 % of the light leaks from here, 0.900 % into dark parts of the picture. A 0.3 mm ball would
/// halve it, to 0.640 %."
std::string leak_words(const LeakPlace& place);

}  // namespace lensforge

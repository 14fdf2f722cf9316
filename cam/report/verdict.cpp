// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/verdict.h"

#include <algorithm>
#include <cmath>

#include "cam/leakage/leakage.h"
#include "core/error.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {

bool Verdict::passes() const { return missed() + advice() == 0; }

int Verdict::missed() const {
  return static_cast<int>(std::count_if(checks.begin(), checks.end(),
                                        [](const LimitCheck& check) { return check.missed(); }));
}

int Verdict::advice() const {
  return static_cast<int>(std::count_if(checks.begin(), checks.end(), [](const LimitCheck& check) {
    return !check.passes() && !check.missed();
  }));
}

std::string verdict_words(int missed, int advice) {
  if (missed > 0) return "done, but limits were missed: see the report";
  if (advice > 0) return "done, no limit was missed; the report has advice";
  return "done, all limits met";
}

Verdict judge_cut(const CutFindings& findings, const CutLimits& limits,
                  const std::set<std::string>& stated) {
  struct Shown {
    const char* unit;
    double scale;
    int decimals;
    bool of_quality = true;
  };
  constexpr Shown kPercent{"%", 100.0, 2};
  constexpr Shown kMicrometres{"µm", 1000.0, 2};
  Verdict verdict;
  const auto check = [&](const char* key, const char* name, std::optional<double> value,
                         double limit, const Shown& shown) {
    if (!(limit >= 0.0)) {
      throw InputError("limit " + std::string(key) + " is " + shortest_text(limit) +
                       ": must be at least 0");
    }
    if (!value) return;
    verdict.checks.push_back({key, name, shown.scale * *value, shown.scale * limit, shown.unit,
                              shown.decimals, shown.of_quality && !stated.contains(key)});
  };
  check("leakage", "leakage", findings.leakage, limits.leakage, kPercent);
  check("dark_flux", "light in dark parts", findings.dark_flux, limits.dark_flux, kPercent);
  check("mae_increase", "picture error (MAE) added", findings.mae_increase, limits.mae_increase,
        {"", 1.0, 4});
  check("gouge", "deepest gouge", findings.gouge, limits.gouge, {"µm", 1000.0, 2, false});
  check("excess", "material left by the path", findings.excess, limits.excess, kMicrometres);
  check("slope", "error of the path's direction", findings.slope, limits.slope, {"mrad", 1e3, 2});
  check("fillet_depth", "deepest groove not cleared", findings.fillet_depth, limits.fillet_depth,
        kMicrometres);
  check("block_rate", "lines per second for the controller", findings.block_rate, limits.block_rate,
        {"lines/s", 1.0, 0, false});
  return verdict;
}

namespace {

constexpr double kHelps = 0.8;      ///< Maximum share of a leak that a useful remedy leaves.
constexpr double kSameWork = 0.05;  ///< Differences of work that do not matter.
constexpr double kNearHalf = 0.05;  ///< Shares this close to a half are called that.

/// Fault of the surface at a place.
std::string fault_words(const LeakPlace& place, const std::string& cause) {
  const std::string at =
      joined({" at x ", decimal_text(place.place.x(), 1), " y ", decimal_text(place.place.y(), 1)});
  const std::string depth = decimal_text(1e3 * std::abs(place.height.value), 1) + " µm";
  const bool left = place.height.value > 0.0;
  if (cause == leak_cause::kCrease && left)
    return "The groove" + at + " is left " + depth + " too high";
  if (cause == leak_cause::kPolish) {
    return "The polished edge" + at + (left ? " is filled by " : " is worn by ") + depth;
  }
  return "The surface" + at + (left ? " is " + depth + " too high" : " is " + depth + " too low");
}

/// The first trial that halves the leak, else the one that leaves least.
const LeakTrial& best_trial(const LeakPlace& place) {
  const auto halves = [&](const LeakTrial& trial) { return trial.leakage <= 0.5 * place.leakage; };
  const auto first = std::find_if(place.trials.begin(), place.trials.end(), halves);
  if (first != place.trials.end()) return *first;
  return *std::min_element(
      place.trials.begin(), place.trials.end(),
      [](const LeakTrial& a, const LeakTrial& b) { return a.leakage < b.leakage; });
}

std::string sentence(std::string words) {
  const char first = words.front();
  if (first >= 'a' && first <= 'z') words.front() = static_cast<char>(first - 'a' + 'A');
  return words;
}

std::string times(double factor) { return trimmed_decimal(factor, 1) + " times"; }

bool is_more(double factor) { return factor > 1.0 + kSameWork; }

/// Cost of a remedy in finishing: " for 1.4 times as many moves and 2 times the minutes".
std::string cost_words(const LeakTrial& trial) {
  if (is_more(trial.moves) && is_more(trial.minutes)) {
    return " for " + times(trial.moves) + " as many finishing moves and " + times(trial.minutes) +
           " the finishing time";
  }
  if (is_more(trial.moves)) return " for " + times(trial.moves) + " as many finishing moves";
  if (is_more(trial.minutes)) return " for " + times(trial.minutes) + " the finishing time";
  return "";
}

std::string remedy_words(const LeakPlace& place) {
  if (place.trials.empty()) return "";
  const LeakTrial& best = best_trial(place);
  const double left = std::max(0.0, best.leakage);
  const double share = left / place.leakage;
  if (share > kHelps) {
    std::string tried;
    for (const LeakTrial& trial : place.trials) {
      tried += joined({tried.empty() ? "" : ", ", "with ", trial.change, " ",
                       percent_text(std::max(0.0, trial.leakage))});
      if (&trial == &place.trials.front()) tried += " would still leak";
    }
    return "No change that was tried helps much: " + tried + ".";
  }
  const bool half = std::abs(share - 0.5) < kNearHalf;
  return sentence(best.change) + " would " + (half ? "halve it, to " : "bring it down to ") +
         percent_text(left) + cost_words(best) + ".";
}

}  // namespace

std::string main_cause(const LeakPlace& place) {
  const auto most = std::max_element(
      place.parts.begin(), place.parts.end(),
      [](const CausePart& a, const CausePart& b) { return a.leakage < b.leakage; });
  return most == place.parts.end() ? "" : most->cause;
}

std::string leak_words(const LeakPlace& place) {
  const std::string cause = main_cause(place);
  std::string words = fault_words(place, cause) + "; " + percent_text(place.leakage) +
                      " of the light leaks from here";
  if (place.dark_flux > 0.0) {
    words += ", " + percent_text(place.dark_flux) + " into dark parts of the picture";
  }
  const std::string remedy = remedy_words(place);
  return words + "." + (remedy.empty() ? "" : " " + remedy);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/verdict.h"

#include <algorithm>

#include "core/error.h"
#include "core/text/number_text.h"

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

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/cam_output.h"

#include <algorithm>
#include <map>

#include "app/json_output.h"

namespace lensforge::app {
namespace {

/// The option that states a limit of quality.
const char* option_of(const std::string& key) {
  static const std::map<std::string, const char*> options{{"leakage", "--max-leakage"},
                                                          {"dark_flux", "--max-dark"},
                                                          {"mae_increase", "--max-mae-increase"},
                                                          {"excess", "--max-excess"},
                                                          {"slope", "--max-slope"},
                                                          {"fillet_depth", "--max-fillet"}};
  return options.at(key);
}

std::string limit_text(const LimitCheck& check) {
  return "  limit not met: " + check.name + " " + fixed(check.value, check.decimals) +
         (check.unit.empty() ? "" : " " + check.unit) + ", at most " +
         fixed(check.limit, check.decimals) + "\n";
}

}  // namespace

std::string missed_limits_text(const Verdict& verdict) {
  std::string text;
  for (const LimitCheck& check : verdict.checks) {
    if (!check.passes()) text += limit_text(check);
  }
  return text;
}

bool stated_limits_hold(const OptionSet& options, const Verdict& verdict) {
  return std::all_of(verdict.checks.begin(), verdict.checks.end(), [&](const LimitCheck& check) {
    const bool counts = !check.of_quality || options.given(option_of(check.key));
    return !counts || check.passes();
  });
}

}  // namespace lensforge::app

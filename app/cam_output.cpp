// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/cam_output.h"

#include "app/json_output.h"

namespace lensforge::app {
namespace {

std::string check_text(const LimitCheck& check) {
  const std::string unit = check.unit.empty() ? "" : " " + check.unit;
  return (check.missed() ? "  limit missed: " : "  advice: ") + check.name + " " +
         fixed(check.value, check.decimals) + unit + ", at most " +
         fixed(check.limit, check.decimals) + unit + "\n";
}

}  // namespace

std::string verdict_text(const Verdict& verdict) {
  std::string text;
  for (const LimitCheck& check : verdict.checks) {
    if (!check.passes()) text += check_text(check);
  }
  return text;
}

}  // namespace lensforge::app

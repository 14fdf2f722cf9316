// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/units.h"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace lensforge {
namespace {

constexpr std::array<std::pair<std::string_view, double>, 8> kUnits{{{"", 1.0},
                                                                     {"mm", 1.0},
                                                                     {"cm", 10.0},
                                                                     {"m", 1000.0},
                                                                     {"in", 25.4},
                                                                     {"um", 1e-3},
                                                                     {"\u00b5m", 1e-3},
                                                                     {"\u03bcm", 1e-3}}};

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

[[noreturn]] void refuse(std::string_view text, const std::string& name) {
  throw InputError(name + ": '" + std::string(text) +
                   "' is no length: a number is needed, with mm, cm, m, in or um after it (mm "
                   "without a unit)");
}

}  // namespace

double parse_length_mm(std::string_view text, const std::string& name) {
  const std::string_view body = trimmed(text);
  double number = 0.0;
  const auto [end, error] = std::from_chars(body.data(), body.data() + body.size(), number);
  if (error != std::errc{}) refuse(text, name);
  const std::string_view unit = trimmed(body.substr(static_cast<std::size_t>(end - body.data())));
  for (const auto& [symbol, millimetres] : kUnits) {
    if (unit != symbol) continue;
    const double length = number * millimetres;
    if (!std::isfinite(length)) refuse(text, name);
    return length;
  }
  refuse(text, name);
}

}  // namespace lensforge

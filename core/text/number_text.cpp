// SPDX-License-Identifier: GPL-3.0-or-later

#include "core/text/number_text.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/error.h"
#include "core/text/words.h"

namespace lensforge {
std::vector<double> parse_numbers(std::string_view text, const std::string& name, int count) {
  const auto refuse = [&] {
    std::vector<double> example;  // Not all zero: a direction needs a length.
    example.reserve(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) example.push_back(k % 3);
    throw InputError(name + " " + std::string(text) + ": must be " + std::to_string(count) +
                     " finite numbers with commas between them, such as " + numbers_text(example));
  };
  std::vector<double> numbers;
  for (std::string_view rest = text;;) {
    const std::size_t comma = rest.find(',');
    const std::string_view word = trimmed(rest.substr(0, comma));
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) refuse();
    numbers.push_back(value);
    if (comma == std::string_view::npos) break;
    rest.remove_prefix(comma + 1);
  }
  if (numbers.size() != static_cast<std::size_t>(count)) refuse();
  return numbers;
}

std::string numbers_text(std::span<const double> numbers) {
  std::string text;
  for (const double number : numbers) {
    if (!text.empty()) text += ',';
    text += shortest_text(number);
  }
  return text;
}

namespace {

constexpr std::array<std::pair<std::string_view, double>, 8> kUnits{{{"", 1.0},
                                                                     {"mm", 1.0},
                                                                     {"cm", 10.0},
                                                                     {"m", 1000.0},
                                                                     {"in", 25.4},
                                                                     {"um", 1e-3},
                                                                     {"\u00b5m", 1e-3},
                                                                     {"\u03bcm", 1e-3}}};

[[noreturn]] void refuse_length(std::string_view text, const std::string& name) {
  throw InputError(name + ": '" + std::string(text) +
                   "' is no length: a number is needed, with mm, cm, m, in or um after it (mm "
                   "without a unit)");
}

}  // namespace

double parse_length_mm(std::string_view text, const std::string& name) {
  const std::string_view body = trimmed(text);
  double number = 0.0;
  const auto [end, error] = std::from_chars(body.data(), body.data() + body.size(), number);
  if (error != std::errc{}) refuse_length(text, name);
  const std::string_view unit = trimmed(body.substr(static_cast<std::size_t>(end - body.data())));
  for (const auto& [symbol, millimetres] : kUnits) {
    if (unit != symbol) continue;
    const double length = number * millimetres;
    if (!std::isfinite(length)) refuse_length(text, name);
    return length;
  }
  refuse_length(text, name);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_words.h"

#include <cmath>
#include <string>

namespace lensforge {
namespace {

/// A decimal number at `at`, which moves behind it; nothing if there is none.
std::optional<double> read_number(std::string_view line, std::size_t& at) {
  const bool minus = at < line.size() && line[at] == '-';
  if (at < line.size() && (line[at] == '-' || line[at] == '+')) ++at;
  double value = 0.0;
  double scale = 1.0;
  bool point = false;
  bool any = false;
  for (; at < line.size(); ++at) {
    const char c = line[at];
    if (c == '.' && !point) {
      point = true;
    } else if (c >= '0' && c <= '9') {
      any = true;
      value = 10.0 * value + (c - '0');
      if (point) scale *= 10.0;
    } else {
      break;
    }
  }
  if (!any) return std::nullopt;
  return (minus ? -value : value) / scale;
}

int add_word(char letter, double value, SimWords& words) {
  if (letter == 'G' || letter == 'M') {
    const double tenths = std::round(value * 10.0);
    if (std::abs(tenths - value * 10.0) > 1e-6) return 23;
    (letter == 'G' ? words.g : words.m).push_back(static_cast<int>(tenths));
    return 0;
  }
  if (std::string_view("FIJKLNPRSTXYZ").find(letter) == std::string_view::npos) return 20;
  auto& slot = words.values[static_cast<std::size_t>(letter - 'A')];
  if (slot) return 25;
  slot = value;
  return 0;
}

}  // namespace

bool SimWords::any(std::string_view letters) const {
  for (const char letter : letters) {
    if ((*this)[letter]) return true;
  }
  return false;
}

int split_words(std::string_view line, SimWords& words) {
  std::size_t at = 0;
  while (at < line.size()) {
    const char letter = line[at++];
    if (letter < 'A' || letter > 'Z') return 1;
    const auto value = read_number(line, at);
    if (!value) return 2;
    if (const int error = add_word(letter, *value, words); error != 0) return error;
  }
  return 0;
}

}  // namespace lensforge

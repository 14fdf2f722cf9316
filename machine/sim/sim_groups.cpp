// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_groups.h"

#include <algorithm>
#include <cmath>

namespace lensforge {
namespace {

using Slot = std::optional<int> SimGroups::*;

constexpr double kLargestLineNumber = 10'000'000.0;

/// The group of a G word that is one of a kind; null for one that is quiet or unknown.
Slot group_of_g(int code) {
  switch (code) {
    case 40:
    case 100:
    case 280:
    case 281:
    case 300:
    case 301:
    case 530:
    case 920:
    case 921:
      return &SimGroups::special;
    case 0:
    case 10:
    case 20:
    case 30:
    case 800:
      return &SimGroups::motion;
    case 170:
    case 180:
    case 190:
      return &SimGroups::plane;
    case 200:
    case 210:
      return &SimGroups::units;
    case 900:
    case 910:
      return &SimGroups::distance;
    case 930:
    case 940:
      return &SimGroups::feed_mode;
    case 431:
    case 490:
      return &SimGroups::tool_length;
    case 540:
    case 550:
    case 560:
    case 570:
    case 580:
    case 590:
      return &SimGroups::frame;
    default:
      return nullptr;
  }
}

/// Null for one that this firmware, as it is built, does not know.
Slot group_of_m(int code, const SimulatedOptions& options) {
  switch (code) {
    case 0:
    case 10:
    case 20:
    case 300:
      return &SimGroups::stop;
    case 30:
    case 40:
    case 50:
      return &SimGroups::spindle;
    case 60:
      return options.firmware == SimulatedFirmware::kGrblHal ? &SimGroups::tool : nullptr;
    case 70:
      return options.mist ? &SimGroups::coolant : nullptr;
    case 80:
    case 90:
      return &SimGroups::coolant;
    default:
      return nullptr;
  }
}

/// The place of a G word that is taken and changes nothing, each a group of its own.
std::optional<int>* quiet_slot(int code, SimGroups& groups) {
  constexpr std::array kQuiet = {911, 400, 610};
  const auto found = std::find(kQuiet.begin(), kQuiet.end(), code);
  if (found == kQuiet.end()) return nullptr;
  return &groups.quiet[static_cast<std::size_t>(found - kQuiet.begin())];
}

int set_once(std::optional<int>* slot, int code) {
  if (slot == nullptr) return 20;
  if (*slot) return 21;
  *slot = code;
  return 0;
}

int check_numbers(const SimWords& words) {
  const auto number = words['N'];
  if (number && (*number < 0.0 || *number > kLargestLineNumber || *number != std::floor(*number))) {
    return 27;
  }
  for (const char letter : {'F', 'S', 'T'}) {
    if (words[letter].value_or(0.0) < 0.0) return 4;
  }
  return 0;
}

}  // namespace

bool SimGroups::any_quiet() const {
  return std::any_of(quiet.begin(), quiet.end(), [](const auto& word) { return word.has_value(); });
}

SimGroups group_words(const SimWords& words, const SimulatedOptions& options) {
  SimGroups groups;
  for (const int code : words.g) {
    const Slot slot = group_of_g(code);
    groups.error = set_once(slot != nullptr ? &(groups.*slot) : quiet_slot(code, groups), code);
    if (groups.error != 0) return groups;
  }
  for (const int code : words.m) {
    const Slot slot = group_of_m(code, options);
    groups.error = set_once(slot != nullptr ? &(groups.*slot) : nullptr, code);
    if (groups.error != 0) return groups;
  }
  groups.error = check_numbers(words);
  return groups;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/sim_intake.h"

#include <utility>

namespace lensforge {
namespace {

/// Used-up bytes that are kept at most before the rest is moved to the front.
constexpr std::size_t kUsedUp = 4096;

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

SimIntake with_character(SimIntake intake, char c, std::size_t longest) {
  if (intake.comment != 0) {
    if (intake.comment == '(' && c == ')') intake.comment = 0;
    return intake;
  }
  if (c <= ' ' || c == '/') return intake;
  if (c == '(' || c == ';') {
    intake.comment = c;
  } else if (intake.line.size() >= longest) {
    intake.overflows = true;
  } else {
    intake.line += upper(c);
  }
  return intake;
}

}  // namespace

void SimBuffer::add(char byte) {
  if (empty() || read > kUsedUp) {
    bytes.erase(0, read);
    read = 0;
  }
  bytes += byte;
}

SimTaken taken(SimIntake intake, char c, const SimIntakeRules& rules) {
  if (c != '\n' && c != '\r') {
    intake.last_end = 0;
    return {with_character(std::move(intake), c, rules.longest), false};
  }
  const bool second = rules.crlf_is_one && intake.last_end != 0 && intake.last_end != c;
  intake.last_end = second ? '\0' : c;
  return {std::move(intake), !second};
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace lensforge {

/// Bytes that were received and not read yet.
struct SimBuffer {
  std::string bytes;
  std::size_t read = 0;  ///< Those of `bytes` that are used up.

  [[nodiscard]] bool empty() const { return read == bytes.size(); }
  [[nodiscard]] std::size_t size() const { return bytes.size() - read; }
  [[nodiscard]] std::string_view rest() const { return std::string_view(bytes).substr(read); }
  /// Puts a byte behind the others.
  void add(char byte);
};

/// The line in the making: what is left of the characters that came.
struct SimIntake {
  std::string line;
  bool overflows = false;
  char comment = 0;   ///< '(' or ';' while in one.
  char last_end = 0;  ///< CR or LF, if that was the last character.
};

/// How a firmware takes lines in.
struct SimIntakeRules {
  std::size_t longest = 79;  ///< Characters that count.
  bool crlf_is_one = false;  ///< grblHAL takes CR LF for one end; Grbl the second for a line.
};

/// A character comes. `ended` says whether it ends the line.
struct SimTaken {
  SimIntake intake;
  bool ended = false;
};
SimTaken taken(SimIntake intake, char c, const SimIntakeRules& rules);

}  // namespace lensforge

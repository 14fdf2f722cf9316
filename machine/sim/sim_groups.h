// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>

#include "machine/sim/sim_words.h"
#include "machine/sim/simulated_options.h"

namespace lensforge {

/// The G and M words of one line by modal group, ten times their numbers.
struct SimGroups {
  std::optional<int> special;  ///< What is in force for this line only: G4, G10, G28, G53 …
  std::optional<int> motion;
  std::optional<int> plane;
  std::optional<int> units;
  std::optional<int> distance;
  std::optional<int> feed_mode;
  std::optional<int> frame;
  std::optional<int> tool_length;           ///< G43.1, G49
  std::array<std::optional<int>, 3> quiet;  ///< What is taken and changes nothing: G40, G61 …
  std::optional<int> stop;
  std::optional<int> spindle;
  std::optional<int> coolant;
  std::optional<int> tool;
  int error = 0;  ///< 0, or 4, 20, 21, 27: what is wrong with the words.

  [[nodiscard]] bool any_quiet() const;
};

/// Sorts a line's words, and checks what can be checked of each alone.
SimGroups group_words(const SimWords& words, const SimulatedOptions& options);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace lensforge {

/// The words of one line as the firmware takes them apart.
struct SimWords {
  std::array<std::optional<double>, 26> values;  ///< By letter, G and M apart.
  std::vector<int> g;                            ///< Ten times the numbers.
  std::vector<int> m;

  [[nodiscard]] std::optional<double> operator[](char letter) const {
    return values[static_cast<std::size_t>(letter - 'A')];
  }
  [[nodiscard]] bool any(std::string_view letters) const;
};

/// Takes a line apart that is free of blanks and comments, in upper case.
/// @return 0, or the number of the error: 1, 2, 20, 23, 25.
int split_words(std::string_view line, SimWords& words);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/mill.h"

#include <sstream>

namespace lensforge::scenario {

std::string zig_zag(int rows) {
  std::ostringstream text;
  text << "G21 G90 G17 G94\nG54\nG0 Z-30\nS12000 M3\nG0 X-200 Y-150\nG1 Z-32 F300\nF600\n";
  for (int row = 0; row < rows; ++row) {
    for (int i = 1; i <= 20; ++i) {
      text << "G1 X" << -200.0 + 0.5 * (row % 2 == 0 ? i : 20 - i) << "\n";
    }
    text << "G1 Y" << -150.0 + 0.2 * (row + 1) << "\n";
  }
  text << "G0 Z-20\nM5\nM2\n";
  return text.str();
}

}  // namespace lensforge::scenario

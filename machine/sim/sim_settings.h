// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>

#include "machine/sim/simulated_options.h"

namespace lensforge {

/// The `$` values of a simulated controller and its start-up lines.
class SimSettings {
 public:
  explicit SimSettings(const SimulatedOptions& options);

  /// A value; 0 for a number that the firmware lacks.
  [[nodiscard]] double operator[](int number) const;
  [[nodiscard]] bool on(int number) const { return (*this)[number] != 0.0; }
  /// Three values from `first` on: X, Y, Z.
  [[nodiscard]] Eigen::Vector3d axes(int first) const;
  /// Writes a value. @return 0, or the number of the error.
  int set(int number, double value);
  /// Back to what the options said (`$RST=$`).
  void restore() { values_ = defaults_; }
  /// The answer to `$$`, without its ok.
  [[nodiscard]] std::string text() const;

  std::array<std::string, 2> startup;  ///< `$N0`, `$N1`

 private:
  std::map<int, double> values_;
  std::map<int, double> defaults_;
};

}  // namespace lensforge

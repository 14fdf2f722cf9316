// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "machine/gcode/gcode_block.h"
#include "machine/gcode/gcode_dialect.h"

namespace lensforge {

/// Groups of which at most one word may stand on a line. RS-274/NGC, table 4.
enum class ModalGroup {
  kNonModal,  ///< G4 G28 G30 G53
  kMotion,
  kPlane,
  kDistance,
  kArcDistance,
  kFeedMode,
  kUnits,
  kCutterCompensation,
  kToolLength,
  kCoordinateSystem,
  kPathControl,
  kStop,
  kToolChange,
  kSpindle,
  kCoolant,
};
constexpr std::size_t kModalGroups = 15;

/// The G and M words of one line, by group, ten times their numbers.
class ModalWords {
 public:
  /// @throw GcodeError naming a word that the dialect lacks, or two of one group.
  ModalWords(const GcodeBlock& block, const GcodeDialect& dialect);

  [[nodiscard]] std::optional<int> operator[](ModalGroup group) const {
    return words_[static_cast<std::size_t>(group)];
  }
  [[nodiscard]] bool has(ModalGroup group, int tenths) const { return (*this)[group] == tenths; }

 private:
  std::array<std::optional<int>, kModalGroups> words_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "machine/gcode/gcode_motion.h"
#include "machine/sim/sim_firmware.h"

namespace lensforge::campaign {

/// A finishing job of a minute or two: two passes of a zig-zag over a wave, with arcs, a retract, a
/// change of speed and a dwell in between.
std::string random_program(std::uint64_t seed);

/// The path that a program asks for, against which what was carried out is held.
class ProgramPath {
 public:
  ProgramPath(const std::string& program, const GcodeState& start);

  /// Compares what was cut with the program. `resumed_at` is the index of the first piece of the
  /// second run, up to `entry_pieces` of which are the way back in. @return what is wrong.
  [[nodiscard]] std::vector<std::string> compare(const std::vector<ExecutedPiece>& pieces,
                                                 double highest_above) const;

  /// Number of motion lines at feed.
  [[nodiscard]] std::size_t cuts() const { return cuts_.size(); }

 private:
  struct Sample {
    Eigen::Vector3d at;
    std::int64_t line;
  };
  using Cell = std::int64_t;
  [[nodiscard]] static Cell cell_of(const Eigen::Vector3d& point);
  template <class Accept>
  [[nodiscard]] bool near(const Eigen::Vector3d& point, const Accept& accept) const;

  std::vector<GcodeMotion> cuts_;
  std::vector<Sample> samples_;
  std::unordered_map<Cell, std::vector<std::size_t>> cells_;
};

}  // namespace lensforge::campaign

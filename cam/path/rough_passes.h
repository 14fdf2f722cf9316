// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "cam/path/operation.h"
#include "cam/path/tip_floor.h"
#include "cam/workshop/workshop.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"

namespace lensforge {

/// Parallel passes over a rectangle and how closely the surface is asked for along them.
struct PassLayout {
  Eigen::AlignedBox2d area;      ///< Of the tool's axis, mm.
  Eigen::AlignedBox2d material;  ///< Where the axis is when the tool is over the blank, mm.
  PassAxis along = PassAxis::kX;
  double stepover = 1.0;  ///< Between passes at most, mm, > 0.
  double spacing = 0.1;   ///< Between nodes along them at most, mm, > 0.
};

/// Tips of the tool in the order of travel, mm, lens frame; two at least.
using TipPath = std::vector<Eigen::Vector3d>;

/// A part of a pass. Where a clamp lifts the tip off the surface, the part runs level.
struct PassPart {
  TipPath path;
  bool lifted = false;  ///< By a clamp.
};

/// The lowest that the tip may run along parallel passes. Heights belong to nodes, evenly spaced;
/// a straight move between neighbouring nodes that is nowhere below them stays above the floor over
/// its whole length, because each node is as high as the floor over the intervals beside it
/// (TipFloor::over), not only as the floor at its place.
class PassGrid {
 public:
  /// @throw Interrupted if `control` asks for an end.
  PassGrid(const TipFloor& floor, const PassLayout& layout, const Executor& executor,
           const RunControl& control);

  [[nodiscard]] std::int64_t passes() const { return passes_; }
  /// Of neighbouring passes as laid out, mm.
  [[nodiscard]] double stepover() const { return stepover_; }
  /// Lowest of all nodes, mm.
  [[nodiscard]] double lowest() const;
  /// Highest that a node is above the floor at its very place, mm; between nodes it can be more by
  /// the floor's slope times half a spacing.
  [[nodiscard]] Extreme excess() const;

  /// The parts of a pass that have something to cut between the heights `previous` and `level`:
  /// where its nodes are over the material and below `previous`, with one node beyond at either
  /// end. The tip follows the nodes but never goes below `level`; chords are nowhere below the
  /// nodes and at most a tenth of the spacing above them. A pass is divided beside every clamp, and
  /// no part goes up or down along one: how the tool gets from part to part is for links.
  [[nodiscard]] std::vector<PassPart> parts(std::int64_t pass, double level, double previous) const;

 private:
  [[nodiscard]] Eigen::Vector2d place(std::int64_t pass, double node) const;
  [[nodiscard]] double node(std::int64_t pass, std::int64_t i) const {
    return nodes_[static_cast<std::size_t>(pass * count_ + i)];
  }
  void fill(std::int64_t pass, const TipFloor& floor);
  [[nodiscard]] bool lifted(std::int64_t pass, std::int64_t i, double level) const;
  void divide(std::int64_t pass, std::int64_t begin, std::int64_t end, double level,
              double previous, std::vector<PassPart>& parts) const;
  [[nodiscard]] TipPath level_part(std::int64_t pass, std::int64_t begin, std::int64_t end,
                                   double level) const;
  [[nodiscard]] TipPath chords(std::int64_t pass, std::int64_t begin, std::int64_t end,
                               double level) const;

  PassLayout layout_;
  std::int64_t passes_;
  std::int64_t count_;  ///< Nodes a pass.
  double stepover_;
  double spacing_;
  std::vector<double> nodes_;
  std::vector<double> ground_;   ///< Nodes as they were without clamps; empty where there are none.
  std::vector<Extreme> excess_;  ///< One a pass.
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "cam/path/collision.h"
#include "cam/post/program_reader.h"
#include "cam/workshop/tool.h"

namespace lensforge {

/// What a line belongs to.
struct WatchedOperation {
  std::string name;
  Tool tool;  ///< That it is meant for.
  DescentRule rule;
};

/// Follows programs as they were read back, lines of the post's own included, and finds what a
/// machine must not do: collisions and ways down into material that are too steep for their feed
/// (CollisionCheck), and ways that nobody can know because they
/// begin or end where the program has not said. Where a tool is when a program begins, and after a
/// tool change, is not known; G28, G30 and G53 are taken to lift a tool above everything and to
/// leave their other axes at places that are not known.
class ProgramWatch {
 public:
  /// @param collisions  must outlive this, as must `tools`, the workshop's.
  /// @param z_offset    program Z − lens-frame z, mm.
  /// @param top         nothing stands higher than this on the table, mm, lens frame.
  ProgramWatch(CollisionCheck& collisions, const std::vector<Tool>& tools, double z_offset,
               double top);

  /// The next line.
  void take(const WatchedOperation& operation, const ProgramLine& line);

  /// Ways that nobody can know, a sentence for each operation.
  [[nodiscard]] std::vector<std::string> faults() const;
  /// How far the motions of all programs reach, mm: along Z of the tool for which that is most,
  /// since tools differ in length.
  [[nodiscard]] Eigen::Vector3d extent() const;

 private:
  /// First line of an operation that goes where nobody knows.
  struct Fault {
    std::int64_t line = 0;
    std::int64_t lines = 0;
  };

  using Known = std::array<bool, 3>;

  void begin(const WatchedOperation& operation);
  void forget();
  void move(const GcodeMotion& motion, const GcodeBlock& block, bool absolute);
  void go_home(const GcodeMotion& motion, const GcodeBlock& block);
  void step(const GcodeMotion& motion, const GcodeBlock& block, bool absolute);
  void follow(const GcodeMotion& motion);
  void reach(const Eigen::AlignedBox3d& box);
  void doubt(std::int64_t line);

  CollisionCheck& collisions_;
  const std::vector<Tool>& tools_;
  double z_offset_;
  double top_;
  std::string operation_;
  std::size_t programs_ = 0;  ///< That have begun.
  int tool_ = 0;              ///< In the spindle.
  int changed_ = 0;           ///< The last that was changed to in this program; 0 for none.
  Known known_{false, false, false};
  bool lifted_ = false;                           ///< By G28, G30 or G53: above everything.
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();  ///< Lens frame, as far as it is known.
  std::vector<std::string> order_;                ///< Of faults' operations.
  std::map<std::string, Fault> faults_;
  Eigen::AlignedBox2d places_;                  ///< All that are known, seen from above.
  std::map<int, Eigen::AlignedBox1d> heights_;  ///< Tool → heights of its tip.
};

/// Which axes would have to go farther than the machine can, a sentence; empty if none would.
std::string travel_fault(const Eigen::Vector3d& extent, const Eigen::Vector3d& travel);

}  // namespace lensforge

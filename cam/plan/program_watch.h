// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "cam/path/collision.h"
#include "cam/path/stock_map.h"
#include "cam/post/program_reader.h"
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// The operation of a program line.
struct WatchedOperation {
  std::string name;
  Tool tool;  ///< Intended tool.
  DescentRule rule;
};

/// Follows programs as they were read back, including the post's own lines, and finds faults:
/// collisions and descents too steep for their feed (CollisionCheck), and unknown motions, which
/// begin or end where the program has not stated. The tool's place is unknown at the beginning of a
/// program and after a tool change; G28, G30 and G53 are taken to lift it above everything and to
/// leave their other axes at unknown places.
class ProgramWatch {
 public:
  /// @param collisions  must outlive this, as must `tools`, the workshop's.
  /// @param z_offset    program Z − lens-frame z, mm.
  /// @param top         highest point of anything on the table, mm, lens frame.
  ProgramWatch(CollisionCheck& collisions, const std::vector<Tool>& tools, double z_offset,
               double top);

  /// Takes the next line.
  void take(const WatchedOperation& operation, const ProgramLine& line);

  /// Unknown motions: a sentence for each operation.
  [[nodiscard]] std::vector<std::string> faults() const;
  /// Extent of the motions of all programs, mm: along Z the largest of any single tool, since tools
  /// differ in length.
  [[nodiscard]] Eigen::Vector3d extent() const;

 private:
  /// Unknown motions of an operation: their first line and their number.
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
  std::size_t programs_ = 0;  ///< Number begun.
  int tool_ = 0;              ///< In the spindle.
  int changed_ = 0;           ///< Last tool change in this program; 0: none.
  Known known_{false, false, false};
  bool lifted_ = false;                           ///< By G28, G30 or G53: above everything.
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();  ///< Lens frame, as far as known.
  std::vector<std::string> order_;                ///< Of faults' operations.
  std::map<std::string, Fault> faults_;
  Eigen::AlignedBox2d places_;                  ///< All known ones, seen from above.
  std::map<int, Eigen::AlignedBox1d> heights_;  ///< Tool → heights of its tip.
};

/// All checks of the programs of one blank.
class ProgramChecks {
 public:
  /// @param surface  all that is to be left of the blank. @param workshop  must outlive this.
  /// @param stock    the blank. @param z_offset  program Z − lens-frame z, mm.
  ProgramChecks(std::shared_ptr<const ProfileCutter> surface, const Workshop& workshop,
                StockMap stock, double z_offset);
  ProgramChecks(const ProgramChecks&) = delete;
  ProgramChecks& operator=(const ProgramChecks&) = delete;

  /// Takes the next line that was read back.
  void take(const WatchedOperation& operation, const ProgramLine& line) {
    watch_.take(operation, line);
  }

  [[nodiscard]] const std::vector<Collision>& collisions() const {
    return collisions_.collisions();
  }
  /// Descents that are too steep for their feed.
  [[nodiscard]] const std::vector<SteepDescent>& descents() const { return collisions_.descents(); }
  /// Other faults.
  [[nodiscard]] const ProgramWatch& watch() const { return watch_; }

 private:
  std::shared_ptr<const ProfileCutter> surface_;
  CollisionCheck collisions_;
  ProgramWatch watch_;
};

/// Names the axes whose extent exceeds the machine's travel, in a sentence; empty if none.
std::string travel_fault(const Eigen::Vector3d& extent, const Eigen::Vector3d& travel);

}  // namespace lensforge

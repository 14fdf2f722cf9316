// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "cam/path/descent.h"
#include "cam/path/move.h"
#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// What the blank lies on, as an obstacle.
inline constexpr const char* kTable = "the table under the blank";

/// One part of one tool that touches one thing, in one operation.
struct Collision {
  std::string operation;
  int tool = 1;                 ///< Tool::number
  std::string part;             ///< "cutter", "tool above its flutes", "section of 4 mm"
  std::string obstacle;         ///< "the lens", "the blank", kTable, "the keep-out box 'vice'"
  std::int64_t moves = 0;       ///< How many moves touch it.
  Eigen::Vector3d first_place;  ///< Tip, mm, lens frame.
  Extreme worst;                ///< How much too low the tool is at most, mm, and where.

  /// One plain sentence.
  [[nodiscard]] std::string sentence() const;
};

/// Follows the moves of all operations, cuts them from a model of the blank, and finds where what
/// does not cut touches something: the tool above its flutes, its shank and holder against the lens
/// and the remaining blank; the whole tool against the keep-out boxes and against the table,
/// which is everywhere at the height of the blank's underside; and the cutter against material in
/// rapid moves. Ways down into material are looked over as well (DescentCheck). Moves are looked at
/// in parts of a tenth of a millimetre, each with all that the tool sweeps in it.
///
/// What is left of the blank is known as an upper bound (StockMap): a touch may be reported where
/// the tool passes material closer than a cell of it, and none is missed.
class CollisionCheck {
 public:
  /// References must outlive this. @param stock  the blank before the first move that is checked.
  CollisionCheck(const ProfileCutter& surface, const Workshop& workshop, StockMap stock);

  /// What comes next is an operation of this name, with this tool, from an unknown place.
  void begin(const std::string& operation, const Tool& tool, const DescentRule& rule = {});

  /// Where the tool is when the next move begins.
  void place(const Eigen::Vector3d& at);

  /// The operation's next moves; a MoveSink may hand them on. @param place  where they stand.
  void check(std::span<const PathMove> moves, const ProgramPlace& place = {});

  /// All collisions so far, in the order in which they were first met.
  [[nodiscard]] const std::vector<Collision>& collisions() const { return collisions_; }
  /// All ways down into material that are too steep for their feed, likewise.
  [[nodiscard]] const std::vector<SteepDescent>& descents() const { return descents_.descents(); }
  [[nodiscard]] const StockMap& stock() const { return stock_; }

 private:
  struct Part {
    CutterProfile profile;
    std::string name;
  };
  struct Touch;

  void check_table(const PathMove& move);
  void check_boxes(const PathMove& move);
  void check_material(const PathMove& move);
  void note(const Touch& touch);
  [[nodiscard]] std::string material_at(const CutterProfile& profile, const Eigen::Vector2d& p,
                                        double lowest) const;

  const ProfileCutter& surface_;
  const Workshop& workshop_;
  StockMap stock_;
  double highest_ = 0.0;  ///< Of the stock when the operation began.
  std::string operation_;
  const Tool* tool_ = nullptr;
  std::vector<Part> parts_;  ///< The cutter, then what may touch nothing.
  bool placed_ = false;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
  std::int64_t move_ = 0;
  std::vector<Collision> collisions_;
  std::vector<std::int64_t> last_move_;  ///< One a collision: the last move that was counted.
  ProgramPlace place_;                   ///< Of the moves that are checked.
  DescentCheck descents_;
};

}  // namespace lensforge

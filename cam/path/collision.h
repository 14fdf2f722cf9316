// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cam/contact/profile_cutter.h"
#include "cam/path/operation.h"
#include "cam/path/stock_map.h"
#include "cam/path/tip_floor.h"
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// How a tool may go down into material at more than its plunge feed.
struct DescentRule {
  double ramp_angle_deg = 3.0;  ///< Steepest way into material.
  double allowance = 0.0;       ///< That the operation leaves on the surface, mm.
  double spacing = 0.0;         ///< Of points at which it asks for the surface, mm.
  /// Of the part at hand, where the surface holds several; empty: of the whole surface.
  Eigen::AlignedBox2d rim;
};

/// As a process has it for the operation of this name.
DescentRule descent_rule(const Process& process, const std::string& operation);

/// Where a move stands.
struct ProgramPlace {
  std::size_t program = 0;  ///< Of those that were read, in order.
  std::int64_t line = 0;
};

/// Moves of one operation that go down into material too steeply for their feed.
struct SteepDescent {
  std::string operation;
  Tool tool;
  ProgramPlace first;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< Tip, mm, lens frame, in the first.
  double angle_deg = 0.0;                           ///< Of the first, against the horizontal.
  double feed = 0.0;                                ///< Of the first, mm/min.
  double ramp_angle_deg = 0.0;                      ///< That would have been right.
  std::int64_t moves = 0;

  /// One plain sentence. @param program  name of the file that `first` stands in.
  [[nodiscard]] std::string sentence(const std::string& program) const;
};

/// Finds ways down into material that are steeper than the ramp angle at more than the tool's
/// plunge feed. A tool that follows the surface goes down with it: what counts is by how much the
/// way sinks below what the surface and the ramp allow, over any stretch of it that takes material.
/// Found is what sinks so by 0.2 mm, or twice DescentRule::spacing where that is more; nothing that
/// stays within half of that is.
class DescentCheck {
 public:
  /// @param surface  must outlive this.
  explicit DescentCheck(const ProfileCutter& surface) : surface_(surface) {}

  void begin(const std::string& operation, const Tool& tool, const DescentRule& rule);

  /// The tool is elsewhere, or comes from a rapid move.
  void rest() { sunk_ = 0.0; }

  /// The next part of a move at feed. @param taken  material that it took, upwards, mm.
  void take(const PathMove& move, const MovePiece& piece, double taken, const ProgramPlace& place);

  /// One an operation and tool, in the order in which they were met.
  [[nodiscard]] const std::vector<SteepDescent>& descents() const { return descents_; }

 private:
  [[nodiscard]] double surface_drop(const Eigen::Vector3d& to);
  void note(const PathMove& move, const MovePiece& piece, const ProgramPlace& place);

  const ProfileCutter& surface_;
  std::optional<TipFloor> floor_;
  TipFloor::Trace trace_;
  std::string operation_;
  Tool tool_;
  double ramp_angle_deg_ = 0.0;
  double ramp_ = 0.0;     ///< Rise over run.
  double allowed_ = 0.0;  ///< Of sunk_, mm.
  double sunk_ = 0.0;     ///< By how much the stretch sinks below what is allowed, mm.
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();  ///< Of the stretch.
  ProgramPlace last_;                                ///< That was counted.
  std::vector<SteepDescent> descents_;
};

/// What the blank lies on, as an obstacle.
inline constexpr const char* kTableObstacle = "the table under the blank";

/// One part of one tool that touches one thing, in one operation.
struct Collision {
  std::string operation;
  int tool = 1;            ///< Tool::number
  std::string part;        ///< "cutter", "tool above its flutes", "section of 4 mm"
  std::string obstacle;    ///< "the lens", "the blank", kTableObstacle, "the keep-out box 'vice'"
  std::int64_t moves = 0;  ///< How many moves touch it.
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

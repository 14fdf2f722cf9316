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
#include "cam/workshop/tool.h"
#include "cam/workshop/workshop.h"

namespace lensforge {

/// Limits of a tool's descent into material at more than its plunge feed.
struct DescentRule {
  double ramp_angle_deg = 3.0;  ///< Steepest path into material.
  double allowance = 0.0;       ///< Left on the surface by the operation, mm.
  double spacing = 0.0;         ///< Distance of points at which it samples the surface, mm.
  /// Of the current part, where the surface holds several; empty: of the whole surface.
  Eigen::AlignedBox2d rim;
};

/// The rule of a process for the operation of this name.
DescentRule descent_rule(const Process& process, const std::string& operation);

/// Place of a move in the programs.
struct ProgramPlace {
  std::size_t program = 0;  ///< Index of the program in reading order.
  std::int64_t line = 0;
};

/// Moves of one operation that go down into material too steeply for their feed.
struct SteepDescent {
  std::string operation;
  Tool tool;
  ProgramPlace first;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< Tip at the first, mm, lens frame.
  double angle_deg = 0.0;                           ///< Of the first, against the horizontal.
  double feed = 0.0;                                ///< Of the first, mm/min.
  double ramp_angle_deg = 0.0;                      ///< The limit that it exceeds.
  std::int64_t moves = 0;

  /// One plain sentence. @param program  name of the file that contains `first`.
  [[nodiscard]] std::string sentence(const std::string& program) const;
};

/// Finds descents into material that are steeper than the ramp angle at more than the tool's plunge
/// feed. A tool may descend with the surface: what counts is how far the path sinks below what
/// surface and ramp allow, over any stretch that removes material. Descents that sink by 0.2 mm, or
/// by twice DescentRule::spacing where that is more, are found; those within half of that are not
/// reported.
class DescentCheck {
 public:
  /// @param surface  must outlive this.
  explicit DescentCheck(const ProfileCutter& surface) : surface_(surface) {}

  void begin(const std::string& operation, const Tool& tool, const DescentRule& rule);

  /// Ends the stretch: the tool is elsewhere, or comes from a rapid move.
  void rest() { sunk_ = 0.0; }

  /// Takes the next piece of a move at feed. @param taken  height of material that it removed, mm.
  void take(const PathMove& move, const MovePiece& piece, double taken, const ProgramPlace& place);

  /// One per operation and tool, in the order found.
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
  double allowed_ = 0.0;  ///< Limit of sunk_, mm.
  double sunk_ = 0.0;     ///< Depth of the stretch below what is allowed, mm.
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();  ///< Of the stretch.
  ProgramPlace last_;                                ///< The last one counted.
  std::vector<SteepDescent> descents_;
};

/// Name of the support under the blank as an obstacle.
inline constexpr const char* kTableObstacle = "the table under the blank";

/// One part of one tool that touches one thing, in one operation.
struct Collision {
  std::string operation;
  int tool = 1;            ///< Tool::number
  std::string part;        ///< "cutter", "tool above its flutes", "section of 4 mm"
  std::string obstacle;    ///< "the lens", "the blank", kTableObstacle, "the keep-out box 'vice'"
  std::int64_t moves = 0;  ///< Number of moves that touch it.
  Eigen::Vector3d first_place;  ///< Tip, mm, lens frame.
  Extreme worst;  ///< Largest depth of the tool below the free height, mm, and its place.

  /// One plain sentence.
  [[nodiscard]] std::string sentence() const;
};

/// Follows the moves of all operations, cuts them from a model of the blank and finds forbidden
/// contacts: of the tool above its flutes, its shank and holder with the lens and the remaining
/// blank; of the whole tool with the keep-out boxes and with the table, which is everywhere at the
/// height of the blank's underside; and of the cutter with material in rapid moves. Descents into
/// material are checked as well (DescentCheck). Moves are checked in pieces of 0.1 mm, each with
/// all that the tool sweeps in it.
///
/// The remaining blank is an upper bound (StockMap): a contact may be reported where the tool
/// passes material closer than a cell, but none is missed.
class CollisionCheck {
 public:
  /// References must outlive this. @param stock  the blank before the first move that is checked.
  CollisionCheck(const ProfileCutter& surface, const Workshop& workshop, StockMap stock);

  /// Begins an operation of this name, with this tool, from an unknown place.
  void begin(const std::string& operation, const Tool& tool, const DescentRule& rule = {});

  /// Sets the tool's place at the beginning of the next move.
  void place(const Eigen::Vector3d& at);

  /// Checks the operation's next moves; a MoveSink may pass them on. @param place  of the moves.
  void check(std::span<const PathMove> moves, const ProgramPlace& place = {});

  /// All collisions so far, in the order found.
  [[nodiscard]] const std::vector<Collision>& collisions() const { return collisions_; }
  /// All descents into material too steep for their feed, in the order found.
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
  std::vector<Part> parts_;  ///< The cutter, then the parts that must not touch anything.
  bool placed_ = false;
  Eigen::Vector3d at_ = Eigen::Vector3d::Zero();
  std::int64_t move_ = 0;
  std::vector<Collision> collisions_;
  std::vector<std::int64_t> last_move_;  ///< Per collision: the last move counted.
  ProgramPlace place_;                   ///< Of the moves being checked.
  DescentCheck descents_;
};

}  // namespace lensforge

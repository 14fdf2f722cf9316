// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <functional>

#include "machine/sim/sim_firmware.h"

namespace lensforge {

/// A straight piece to run.
struct SimMove {
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< In the controller's coordinates, mm.
  double feed = 0.0;                                 ///< mm/min; ignored for a rapid.
  bool rapid = false;
  bool jog = false;
  std::int64_t number = 0;    ///< N word
  std::int64_t received = 0;  ///< Ordinal of its line.
};

/// The simulated controller's planner and step generator: queues pieces, plans their corner speeds,
/// and moves along them in time.
///
/// It shares no code with the time model in machine/planner/; each is a check of the other.
class SimQueue {
 public:
  /// @param settings  must outlive the queue; read when pieces are pushed.
  SimQueue(const SimSettings& settings, int capacity);

  /// Called for every piece that ended, complete or not.
  std::function<void(const ExecutedPiece&)> ended;
  /// Called for every piece that begins.
  std::function<void(const ExecutedPiece&)> begun;

  [[nodiscard]] bool empty() const { return blocks_.empty(); }
  [[nodiscard]] int room() const { return capacity_ - static_cast<int>(blocks_.size()); }
  /// Appends a piece; ignores one shorter than a step. @pre room() > 0
  void push(const SimMove& move);
  /// Runs for at most `seconds`; stops early when a piece ends or a hold has stopped the motion.
  /// @return the seconds used.
  double run(double seconds);
  /// Runs everything without using time.
  void finish_now();
  /// Stops at the current position and discards all pieces.
  void clear();

  void hold() { holding_ = true; }
  void resume();
  [[nodiscard]] bool holding() const { return holding_; }
  /// True if a hold has stopped the motion.
  [[nodiscard]] bool stands() const { return speed_ == 0.0; }

  /// Percent of the programmed feed and of the rapid rate.
  void set_overrides(double feed, double rapid);

  /// Position according to the controller, mm.
  [[nodiscard]] Eigen::Vector3d position() const;
  void set_position(const Eigen::Vector3d& position) { position_ = position; }
  [[nodiscard]] double speed() const { return speed_; }  ///< mm/s
  /// N word of the running piece; 0 for none.
  [[nodiscard]] std::int64_t number() const { return empty() ? 0 : blocks_.front().move.number; }
  [[nodiscard]] Eigen::Vector3d direction() const;

  double now = 0.0;  ///< Set by the owner; recorded with the pieces.
  int spindle = 0;   ///< Set by the owner.
  double rpm = 0.0;  ///< Set by the owner.

 private:
  struct Block {
    SimMove move;
    Eigen::Vector3d start;
    Eigen::Vector3d unit;
    double length = 0.0;
    double acceleration = 0.0;
    double fastest = 0.0;  ///< Limit of the axes along it, mm/s.
    double corner = 0.0;   ///< Speed at the corner before it.
    double entry = 0.0;    ///< Planned.
    bool begun = false;
    double begin_time = 0.0;
    int spindle = 0;
    double rpm = 0.0;
  };
  struct Phase {
    double seconds;
    double acceleration;
  };
  [[nodiscard]] double nominal(const Block& block) const;
  [[nodiscard]] double corner_speed(const Block& before, const Block& block) const;
  [[nodiscard]] double fastest_along(const Eigen::Vector3d& unit, int first_setting) const;
  [[nodiscard]] Eigen::Vector3d on_steps(const Eigen::Vector3d& point) const;
  [[nodiscard]] Phase phase() const;
  void plan();
  [[nodiscard]] ExecutedPiece piece_of(const Block& block) const;
  void begin_front();
  void end_front(bool complete);

  const SimSettings& settings_;
  int capacity_;
  std::deque<Block> blocks_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();  ///< Start of the front piece.
  double done_ = 0.0;                                   ///< mm of the front piece.
  double speed_ = 0.0;
  bool holding_ = false;
  double feed_override_ = 1.0;
  double rapid_override_ = 1.0;
};

}  // namespace lensforge

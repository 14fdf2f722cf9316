// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "machine/guard/guard.h"
#include "machine/guard/register_map.h"

namespace lensforge {

/// Judges readings of a spindle against what was asked of it. Pure logic: time and readings come in
/// through the calls, nothing is read or written. A failure while a speed is asked for, or one that
/// stands when it is asked for, stays until the next request; while stopping or idle it lasts as
/// long as its cause.
class SpindleWatch {
 public:
  explicit SpindleWatch(const SpindleMap& map) : map_(map) {}

  void expect_speed(double rpm, bool clockwise, double now);
  void expect_stop(double now);
  /// The device has taken the command: readings from now on count.
  void command_taken(double now);
  /// The device has not taken it yet.
  void command_failed(const std::string& error) { command_error_ = error; }

  void see_speed(double rpm, double now);
  void see_fault(std::uint16_t code, double now);
  void see_at_speed(bool at_speed, double now);
  void see_direction(std::uint16_t value, double now);
  /// The device cannot be read or written; empty: it can again.
  void set_bus_trouble(const std::string& reason);
  /// A request that cannot be fulfilled: stays failed until the next.
  void refuse(const std::string& reason);
  /// Judges the time since the request.
  void check_time(double now);

  [[nodiscard]] SpindleState state() const;
  /// What is wrong, without the device's name; or empty.
  [[nodiscard]] std::string reason() const;
  [[nodiscard]] double rpm() const { return rpm_; }

 private:
  enum class Goal { kNone, kSpeed, kStop };
  /// A signal beside the speed: what it last said, and when.
  struct Flag {
    bool good = false;
    double seen = 0.0;
    int bad = 0;
  };

  void ask(Goal goal, double now);
  void fail(std::string& live, const std::string& reason);
  void judge(double now);
  [[nodiscard]] bool speed_is_good() const;
  [[nodiscard]] bool flags_are_good() const;
  [[nodiscard]] std::string speed_text() const;
  [[nodiscard]] std::string direction_text() const;
  [[nodiscard]] std::string unverified_text() const;
  void note_flag(Flag& flag, bool good, double now, const std::string& trouble);

  SpindleMap map_;
  Goal goal_ = Goal::kNone;
  double asked_rpm_ = 0.0;
  bool clockwise_ = true;
  double asked_at_ = 0.0;
  bool taken_ = true;
  std::string command_error_;
  bool verified_ = false;

  double rpm_ = 0.0;
  int good_reads_ = 0;
  int bad_reads_ = 0;
  double streak_start_ = 0.0;
  Flag fault_;
  Flag at_speed_;
  Flag direction_;

  std::string latched_;        ///< The first failure since a speed was asked for.
  std::string bus_trouble_;    ///< Live.
  std::string fault_trouble_;  ///< Live.
  std::string speed_trouble_;  ///< Live.
};

}  // namespace lensforge

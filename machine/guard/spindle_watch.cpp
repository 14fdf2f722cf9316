// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/spindle_watch.h"

#include <algorithm>
#include <cmath>

#include "core/text/number_text.h"

namespace lensforge {

void SpindleWatch::ask(Goal goal, double now) {
  goal_ = goal;
  asked_at_ = now;
  taken_ = false;
  command_error_.clear();
  verified_ = false;
  good_reads_ = 0;
  bad_reads_ = 0;
  at_speed_ = {};
  direction_ = {};
  latched_.clear();
  speed_trouble_.clear();
  if (goal == Goal::kSpeed) latched_ = reason();
}

void SpindleWatch::expect_speed(double rpm, bool clockwise, double now) {
  asked_rpm_ = rpm;
  clockwise_ = clockwise;
  ask(Goal::kSpeed, now);
}

void SpindleWatch::expect_stop(double now) {
  asked_rpm_ = 0.0;
  ask(Goal::kStop, now);
}

// Readings from before the command say nothing about what it brought, so the streak starts anew.
void SpindleWatch::command_taken(double now) {
  taken_ = true;
  good_reads_ = 0;
  streak_start_ = now;
  if (goal_ != Goal::kSpeed) speed_trouble_.clear();
}

void SpindleWatch::fail(std::string& live, const std::string& reason) {
  live = reason;
  if (goal_ == Goal::kSpeed && latched_.empty()) latched_ = reason;
}

void SpindleWatch::refuse(const std::string& reason) {
  verified_ = false;
  fail(speed_trouble_, reason);
}

void SpindleWatch::set_bus_trouble(const std::string& reason) {
  if (reason.empty()) {
    bus_trouble_.clear();
    return;
  }
  good_reads_ = 0;
  fail(bus_trouble_, reason);
}

bool SpindleWatch::speed_is_good() const {
  if (goal_ != Goal::kSpeed) return rpm_ <= map_.stopped_rpm;
  return std::abs(rpm_ - asked_rpm_) <= map_.tolerance * asked_rpm_;
}

std::string SpindleWatch::speed_text() const {
  const std::string read = "speed reads " + number_text(rpm_) + " rpm";
  if (goal_ != Goal::kSpeed) {
    return read + ": at most " + number_text(map_.stopped_rpm) + " rpm is stopped";
  }
  return read + ": " + number_text(asked_rpm_) + " rpm within " +
         number_text(100.0 * map_.tolerance) + " % was requested";
}

void SpindleWatch::see_speed(double rpm, double now) {
  rpm_ = rpm;
  if (!taken_) return;
  if (speed_is_good()) {
    if (good_reads_++ == 0) streak_start_ = now;
    bad_reads_ = 0;
  } else {
    good_reads_ = 0;
    ++bad_reads_;
  }
  if (verified_ && bad_reads_ >= map_.lost_reads) {
    fail(speed_trouble_, speed_text() + " (" + std::to_string(bad_reads_) + " readings in a row)");
  } else if (goal_ != Goal::kSpeed && bad_reads_ == 0) {
    speed_trouble_.clear();
  }
  judge(now);
}

void SpindleWatch::see_fault(std::uint16_t code, double now) {
  const bool clear = code == map_.fault->clear;
  fault_.seen = now;
  fault_.good = clear;
  if (clear) {
    fault_trouble_.clear();
  } else {
    const auto text = map_.fault->texts.find(code);
    fail(fault_trouble_,
         "fault " + std::to_string(code) + ": " +
             (text != map_.fault->texts.end() ? text->second : "no text in the register map"));
  }
  judge(now);
}

/// Beside a verified speed, a flag that is wrong as often in a row as a lost speed is a failure.
void SpindleWatch::note_flag(Flag& flag, bool good, double now, const std::string& trouble) {
  flag.seen = now;
  flag.good = good;
  flag.bad = good ? 0 : flag.bad + 1;
  if (verified_ && goal_ == Goal::kSpeed && flag.bad >= map_.lost_reads) {
    fail(speed_trouble_, trouble);
  }
  judge(now);
}

void SpindleWatch::see_at_speed(bool at_speed, double now) {
  note_flag(at_speed_, at_speed, now, "the at-speed signal is off: it must be on while cutting");
}

std::string SpindleWatch::direction_text() const {
  return std::string("does not turn ") + (clockwise_ ? "clockwise" : "counter-clockwise") +
         ", which was requested";
}

void SpindleWatch::see_direction(std::uint16_t value, double now) {
  const std::uint16_t wanted = clockwise_ ? map_.direction->forward : map_.direction->reverse;
  note_flag(direction_, value == wanted, now, direction_text());
}

bool SpindleWatch::flags_are_good() const {
  const auto fresh = [this](const Flag& flag) { return flag.good && flag.seen >= streak_start_; };
  if (map_.fault && !fresh(fault_)) return false;
  if (goal_ != Goal::kSpeed) return true;
  return (!map_.at_speed || fresh(at_speed_)) && (!map_.direction || fresh(direction_));
}

// A stop is believed without the fault register: a drive that tripped has stopped all the same.
void SpindleWatch::judge(double now) {
  if (!taken_ || good_reads_ < map_.verify_reads) return check_time(now);
  if (goal_ != Goal::kSpeed || flags_are_good()) verified_ = true;
  check_time(now);
}

/// What has kept the request from being verified.
std::string SpindleWatch::unverified_text() const {
  if (!taken_) {
    return "the command was not taken" +
           (command_error_.empty() ? "" : " (" + command_error_ + ")");
  }
  if (good_reads_ < map_.verify_reads) return speed_text();
  if (map_.at_speed && !at_speed_.good) return "the at-speed signal stays off";
  if (map_.direction && !direction_.good) return direction_text();
  return "its other signals could not be read";
}

void SpindleWatch::check_time(double now) {
  if (verified_ || goal_ == Goal::kNone) return;
  const bool spins_up = goal_ == Goal::kSpeed;
  const double limit = spins_up ? map_.spin_up_limit : map_.spin_down_limit;
  if (now - asked_at_ <= limit || !speed_trouble_.empty()) return;
  fail(speed_trouble_, unverified_text() + " " + number_text(limit) + " s after the " +
                           (spins_up ? "start" : "stop"));
}

SpindleState SpindleWatch::state() const {
  if (!reason().empty()) return SpindleState::kFailed;
  if (!verified_) return SpindleState::kChanging;
  return goal_ == Goal::kSpeed ? SpindleState::kAtSpeed : SpindleState::kStopped;
}

// A drive that trips is often seen to lose speed before its fault is read: both are told then.
std::string SpindleWatch::reason() const {
  if (!latched_.empty() && latched_.find(fault_trouble_) == std::string::npos) {
    return latched_ + "; " + fault_trouble_;
  }
  for (const std::string* trouble : {&latched_, &fault_trouble_, &bus_trouble_, &speed_trouble_}) {
    if (!trouble->empty()) return *trouble;
  }
  return {};
}

}  // namespace lensforge

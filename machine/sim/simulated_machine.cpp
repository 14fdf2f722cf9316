// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/simulated_machine.h"

#include <algorithm>
#include <limits>

namespace lensforge {
namespace {

constexpr double kShortestRead = 1e-5;  ///< s
constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

SimulatedMachine::SimulatedMachine(const SimulatedOptions& options, const WireOptions& wire,
                                   const MachineWatch& watch)
    : wire_(wire), controller_(options, watch) {}

std::unique_ptr<Link> SimulatedMachine::open() {
  if (now() < unplugged_until_) throw LinkLost("simulated controller: unplugged");
  opened_ = ++opens_;
  outgoing_.clear();
  outgoing_read_ = 0;
  incoming_.clear();
  if (powerless_ || wire_.reset_on_open) controller_.power_cycle();
  powerless_ = false;
  // Output from now on is received; the power-up banner only if no time has passed.
  hear();
  return std::make_unique<SimulatedLink>(*this, opened_);
}

void SimulatedMachine::require_open(std::int64_t opened) const {
  if (opened != opened_) throw LinkLost("simulated controller: the link was closed");
}

double SimulatedMachine::byte_seconds() const {
  return wire_.bytes_per_second > 0.0 ? 1.0 / wire_.bytes_per_second : 0.0;
}

std::size_t SimulatedMachine::write(std::int64_t opened, std::string_view bytes) {
  require_open(opened);
  if (now() < blocked_until_) return 0;
  std::size_t count =
      std::min(bytes.size(), wire_.host_buffer - (outgoing_.size() - outgoing_read_));
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const std::int64_t at = faults_[i].at_byte - accepted_;
    const bool here = at >= 0 && at < static_cast<std::int64_t>(count);
    if (faults_[i].kind != FaultKind::kPartialWrite || !here) continue;
    count = static_cast<std::size_t>(at);
    blocked_until_ = now() + faults_[i].seconds;
    strikes_.push_back({faults_[i], now()});
    faults_.erase(faults_.begin() + static_cast<std::ptrdiff_t>(i));
    break;
  }
  if (outgoing_read_ == outgoing_.size()) {
    outgoing_.clear();
    outgoing_read_ = 0;
    next_byte_ = std::max(next_byte_, now() + wire_.latency) + byte_seconds();
  }
  outgoing_.append(bytes.substr(0, count));
  accepted_ += static_cast<std::int64_t>(count);
  deliver();
  return count;
}

std::string SimulatedMachine::read(std::int64_t opened, double wait) {
  require_open(opened);
  run_to_first_byte(now() + std::max(wait, kShortestRead));
  require_open(opened);
  if (first_arrival() <= now() && wire_.gathering > 0.0) run_until(now() + wire_.gathering);
  require_open(opened);
  return take_arrived();
}

/// Time passes until `deadline`, or until a byte has come to the host.
void SimulatedMachine::run_to_first_byte(double deadline) {
  while (now() < deadline && first_arrival() > now()) {
    run_to_next_event(std::min(deadline, first_arrival()));
  }
}

void SimulatedMachine::run_until(double time) {
  while (now() < time) run_to_next_event(time);
}

/// Time passes until `time`, or until a byte has come to the controller or the door moves.
void SimulatedMachine::run_to_next_event(double time) {
  double next = time;
  if (outgoing_read_ < outgoing_.size()) next = std::min(next, next_byte_);
  if (door_until_ > now()) next = std::min(next, door_until_);
  controller_.run_until(next);
  hear();
  deliver();
  end_timed_faults();
}

/// Hands every byte that has arrived by now to the controller.
void SimulatedMachine::deliver() {
  while (outgoing_read_ < outgoing_.size() && next_byte_ <= now()) {
    const char byte = outgoing_[outgoing_read_++];
    next_byte_ += byte_seconds();
    std::string text(1, byte);
    for (std::size_t i = faults_.size(); i-- > 0;) {
      const bool here = faults_[i].direction == WireDirection::kToController &&
                        faults_[i].kind != FaultKind::kPartialWrite &&
                        faults_[i].at_byte <= carried_[0];
      if (here && strike(i, &text, 0)) return;
    }
    ++carried_[0];
    if (!text.empty()) controller_.receive(byte);
  }
}

/// Takes what the controller has said and puts it on the line to the host.
void SimulatedMachine::hear() {
  for (const Spoken& spoken : controller_.take_output()) carry_to_host(spoken);
}

void SimulatedMachine::carry_to_host(const Spoken& spoken) {
  if (opened_ == 0 || powerless_) return;
  Chunk chunk;
  chunk.text = spoken.text;
  const auto length = static_cast<std::int64_t>(chunk.text.size());
  for (std::size_t i = faults_.size(); i-- > 0;) {
    const std::int64_t at = faults_[i].at_byte - carried_[1];
    const bool here = faults_[i].direction == WireDirection::kToHost &&
                      faults_[i].kind != FaultKind::kPartialWrite && at < length;
    if (here && strike(i, &chunk.text, static_cast<std::size_t>(std::max<std::int64_t>(at, 0)))) {
      return;
    }
  }
  carried_[1] += length;
  spoil_replies(chunk.text);
  const double spoken_at = std::max(spoken.time, silent_until_);
  chunk.begin = std::max(line_free_, spoken_at + wire_.latency);
  line_free_ = chunk.begin + static_cast<double>(chunk.text.size()) * byte_seconds();
  incoming_.push_back(std::move(chunk));
}

/// @return whether nothing of the present text gets through.
bool SimulatedMachine::strike(std::size_t index, std::string* text, std::size_t at) {
  const SimulatedFault fault = faults_[index];
  faults_.erase(faults_.begin() + static_cast<std::ptrdiff_t>(index));
  strikes_.push_back({fault, now()});
  switch (fault.kind) {
    case FaultKind::kUnplug:
    case FaultKind::kUnplugReset:
      unplug(fault);
      return true;
    case FaultKind::kDroppedByte:
      if (at < text->size()) text->erase(at, 1);
      return false;
    case FaultKind::kLostReply:
      lose_reply_ = true;
      return false;
    case FaultKind::kGarbledReply:
      garble_reply_ = true;
      return false;
    case FaultKind::kDuplicatedOk:
      double_ok_ = true;
      return false;
    case FaultKind::kStall:
      silent_until_ = now() + fault.seconds;
      return false;
    default:
      strike_machine(fault);
      return false;
  }
}

void SimulatedMachine::strike_machine(const SimulatedFault& fault) {
  switch (fault.kind) {
    case FaultKind::kReset:
      return controller_.power_cycle();
    case FaultKind::kAlarm:
      return controller_.raise_alarm(fault.code == 0 ? 1 : fault.code);
    case FaultKind::kError:
      return controller_.fail_next_line(fault.code == 0 ? 20 : fault.code);
    case FaultKind::kRxOverrun:
      return controller_.lose_bytes(fault.code == 0 ? 8 : fault.code);
    case FaultKind::kDoor:
      door_until_ = now() + fault.seconds;
      return controller_.move_door(true);
    case FaultKind::kHold:
      return controller_.feed_hold();
    default:
      return;
  }
}

void SimulatedMachine::unplug(const SimulatedFault& fault) {
  unplugged_until_ = now() + fault.seconds;
  opened_ = 0;
  outgoing_.clear();
  outgoing_read_ = 0;
  incoming_.clear();
  if (fault.kind != FaultKind::kUnplugReset) return;
  powerless_ = true;
  controller_.power_cycle();
  controller_.take_output();
}

void SimulatedMachine::spoil_replies(std::string& text) {
  const bool is_ok = text == "ok\r\n";
  const bool is_reply = is_ok || text.rfind("error:", 0) == 0;
  if (is_ok && double_ok_) {
    double_ok_ = false;
    text += "ok\r\n";
  } else if (is_reply && lose_reply_) {
    lose_reply_ = false;
    text.clear();
  } else if (is_reply && garble_reply_) {
    garble_reply_ = false;
    text[1] = static_cast<char>(text[1] ^ 0x04);
  }
}

void SimulatedMachine::end_timed_faults() {
  if (door_until_ < 0.0 || now() < door_until_) return;
  door_until_ = -1.0;
  controller_.move_door(false);
}

double SimulatedMachine::first_arrival() const {
  for (const Chunk& chunk : incoming_) {
    if (chunk.taken < chunk.text.size()) {
      return chunk.begin + static_cast<double>(chunk.taken + 1) * byte_seconds();
    }
  }
  return kNever;
}

std::string SimulatedMachine::take_arrived() {
  std::string arrived;
  while (!incoming_.empty()) {
    Chunk& chunk = incoming_.front();
    std::size_t count = chunk.text.size();
    if (byte_seconds() > 0.0) {
      const double bytes = (now() - chunk.begin) / byte_seconds() + 1e-6;
      count = std::min(count, static_cast<std::size_t>(std::max(0.0, bytes)));
    } else if (chunk.begin > now()) {
      count = 0;
    }
    if (count > chunk.taken) arrived.append(chunk.text, chunk.taken, count - chunk.taken);
    chunk.taken = std::max(chunk.taken, count);
    if (chunk.taken < chunk.text.size()) break;
    incoming_.pop_front();
  }
  return arrived;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/faulty_machine.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace lensforge {

bool FaultyMachine::opening() {
  if (now() < unplugged_until_) throw LinkLost("simulated controller: unplugged");
  return std::exchange(powerless_, false);
}

SimulatedFault FaultyMachine::take_fault(std::size_t index) {
  const SimulatedFault fault = faults_[index];
  faults_.erase(faults_.begin() + static_cast<std::ptrdiff_t>(index));
  strikes_.push_back({fault, now()});
  return fault;
}

std::size_t FaultyMachine::taken(std::size_t count) {
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const std::int64_t at = faults_[i].at_byte - accepted_;
    const bool here = at >= 0 && at < static_cast<std::int64_t>(count);
    if (faults_[i].kind != FaultKind::kPartialWrite || !here) continue;
    count = static_cast<std::size_t>(at);
    blocked_until_ = now() + take_fault(i).seconds;
    break;
  }
  accepted_ += static_cast<std::int64_t>(count);
  return count;
}

SimulatedMachine::Passage FaultyMachine::to_controller() {
  std::string byte("?");
  for (std::size_t i = faults_.size(); i-- > 0;) {
    const bool here = faults_[i].direction == WireDirection::kToController &&
                      faults_[i].kind != FaultKind::kPartialWrite &&
                      faults_[i].at_byte <= bytes(WireDirection::kToController);
    if (here && strike(i, byte, 0)) return Passage::kCut;
  }
  return byte.empty() ? Passage::kLost : Passage::kArrives;
}

bool FaultyMachine::to_host(std::string& text) {
  const auto length = static_cast<std::int64_t>(text.size());
  for (std::size_t i = faults_.size(); i-- > 0;) {
    const std::int64_t at = faults_[i].at_byte - bytes(WireDirection::kToHost);
    const bool here = faults_[i].direction == WireDirection::kToHost &&
                      faults_[i].kind != FaultKind::kPartialWrite && at < length;
    if (here && strike(i, text, static_cast<std::size_t>(std::max<std::int64_t>(at, 0)))) {
      return false;
    }
  }
  spoil_reply(text);
  return true;
}

double FaultyMachine::spoken_at(double time) const { return std::max(time, silent_until_); }

double FaultyMachine::next_event() const {
  return door_until_ > now() ? door_until_ : SimulatedMachine::next_event();
}

/// @return true if nothing of the present text gets through.
bool FaultyMachine::strike(std::size_t index, std::string& text, std::size_t at) {
  const SimulatedFault fault = take_fault(index);
  switch (fault.kind) {
    case FaultKind::kUnplug:
    case FaultKind::kUnplugReset:
      unplug(fault);
      return true;
    case FaultKind::kDroppedByte:
      if (at < text.size()) text.erase(at, 1);
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

void FaultyMachine::strike_machine(const SimulatedFault& fault) {
  switch (fault.kind) {
    case FaultKind::kReset:
      return controller().power_cycle();
    case FaultKind::kAlarm:
      return controller().raise_alarm(fault.code == 0 ? 1 : fault.code);
    case FaultKind::kError:
      return controller().fail_next_line(fault.code == 0 ? 20 : fault.code);
    case FaultKind::kRxOverrun:
      return controller().lose_bytes(fault.code == 0 ? 8 : fault.code);
    case FaultKind::kDoor:
      door_until_ = now() + fault.seconds;
      return controller().move_door(true);
    case FaultKind::kHold:
      return controller().feed_hold();
    default:
      return;
  }
}

void FaultyMachine::unplug(const SimulatedFault& fault) {
  unplugged_until_ = now() + fault.seconds;
  close();
  if (fault.kind != FaultKind::kUnplugReset) return;
  powerless_ = true;
  controller().power_cycle();
  controller().take_output();
}

void FaultyMachine::spoil_reply(std::string& text) {
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

void FaultyMachine::passed() {
  if (door_until_ < 0.0 || now() < door_until_) return;
  door_until_ = -1.0;
  controller().move_door(false);
}

}  // namespace lensforge

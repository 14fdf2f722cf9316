// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/sim/simulated_machine.h"

#include <algorithm>
#include <limits>
#include <thread>

namespace lensforge {
namespace {

constexpr double kShortestRead = 1e-5;  ///< s
constexpr double kNever = std::numeric_limits<double>::infinity();

}  // namespace

SimulatedMachine::SimulatedMachine(const SimulatedOptions& options, const WireOptions& wire,
                                   const MachineWatch& watch)
    : wire_(wire), controller_(options, watch) {}

std::unique_ptr<Link> SimulatedMachine::open() {
  const bool was_off = opening();
  close();
  opened_ = ++opens_;
  if (was_off || wire_.reset_on_open) controller_.power_cycle();
  // Output from now on is received; the power-up banner only if no time has passed.
  hear();
  return std::make_unique<SimulatedLink>(*this, opened_);
}

void SimulatedMachine::close() {
  opened_ = 0;
  outgoing_.clear();
  outgoing_read_ = 0;
  incoming_.clear();
}

void SimulatedMachine::require_open(std::int64_t opened) const {
  if (opened != opened_) throw LinkLost("simulated controller: the link was closed");
}

double SimulatedMachine::byte_seconds() const {
  return wire_.bytes_per_second > 0.0 ? 1.0 / wire_.bytes_per_second : 0.0;
}

std::size_t SimulatedMachine::write(std::int64_t opened, std::string_view bytes) {
  require_open(opened);
  if (blocked()) return 0;
  const std::size_t count =
      taken(std::min(bytes.size(), wire_.host_buffer - (outgoing_.size() - outgoing_read_)));
  if (outgoing_read_ == outgoing_.size()) {
    outgoing_.clear();
    outgoing_read_ = 0;
    next_byte_ = std::max(next_byte_, now() + wire_.latency) + byte_seconds();
  }
  outgoing_.append(bytes.substr(0, count));
  deliver();
  return count;
}

std::string SimulatedMachine::read(std::int64_t opened, double wait) {
  require_open(opened);
  run_to_first_byte(now() + std::max(wait, kShortestRead));
  require_open(opened);
  if (first_arrival() <= now() && wire_.gathering > 0.0) run_until(now() + wire_.gathering);
  require_open(opened);
  keep_pace();
  return take_arrived();
}

void SimulatedMachine::wait(double seconds) {
  run_until(now() + seconds);
  keep_pace();
}

void SimulatedMachine::keep_pace() const {
  if (wire_.pace <= 0.0) return;
  const std::chrono::duration<double> due(now() / wire_.pace);
  std::this_thread::sleep_until(
      begun_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(due));
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

/// Time passes until `time`, or until a byte has come to the controller or the next disturbance.
void SimulatedMachine::run_to_next_event(double time) {
  double next = time;
  if (outgoing_read_ < outgoing_.size()) next = std::min(next, next_byte_);
  next = std::min(next, next_event());
  controller_.run_until(next);
  hear();
  deliver();
  passed();
}

/// Hands every byte that has arrived by now to the controller.
void SimulatedMachine::deliver() {
  while (outgoing_read_ < outgoing_.size() && next_byte_ <= now()) {
    const char byte = outgoing_[outgoing_read_++];
    next_byte_ += byte_seconds();
    const Passage passage = to_controller();
    if (passage == Passage::kCut) return;
    ++carried_[0];
    if (passage == Passage::kArrives) controller_.receive(byte);
  }
}

/// Takes what the controller has said and puts it on the line to the host.
void SimulatedMachine::hear() {
  for (const Spoken& spoken : controller_.take_output()) carry_to_host(spoken);
}

void SimulatedMachine::carry_to_host(const Spoken& spoken) {
  if (opened_ == 0) return;
  Chunk chunk;
  chunk.text = spoken.text;
  if (!to_host(chunk.text)) return;
  carried_[1] += static_cast<std::int64_t>(spoken.text.size());
  chunk.begin = std::max(line_free_, spoken_at(spoken.time) + wire_.latency);
  line_free_ = chunk.begin + static_cast<double>(chunk.text.size()) * byte_seconds();
  incoming_.push_back(std::move(chunk));
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

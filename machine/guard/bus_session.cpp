// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/bus_session.h"

#include <algorithm>
#include <utility>

namespace lensforge {
namespace {

/// A serial adapter that was unplugged and came back answers only on a newly opened port, and does
/// not always report an error on the old one.
constexpr int kSilencesBeforeReopen = 3;

}  // namespace

BusSession::BusSession(std::unique_ptr<RegisterBus> bus, const BusTransport& transport,
                       Clock& clock)
    : bus_(std::move(bus)),
      transport_(transport),
      clock_(clock),
      not_before_(clock.now()),
      pause_(transport.reconnect_pause) {}

bool BusSession::ready() const { return clock_.now() >= not_before_; }

std::uint16_t BusSession::read(const RegisterAddress& at) {
  return exchange([&] { return bus_->read(at); });
}

void BusSession::write(const RegisterAddress& at, std::uint16_t value) {
  exchange([&] {
    bus_->write(at, value);
    return value;
  });
}

std::uint16_t BusSession::exchange(const std::function<std::uint16_t()>& exchange) {
  const double started = clock_.now();
  try {
    if (!bus_->is_open()) bus_->open();
    if (discard_first_) bus_->discard();
    discard_first_ = false;
    const std::uint16_t answer = exchange();
    silences_ = 0;
    pause_ = transport_.reconnect_pause;
    return answer;
  } catch (const BusError& error) {
    recover(error.fault(), started);
    throw;
  }
}

// A connection of TCP dies with its late answers; an RTU line has to be waited out. The response
// time-out is counted from the request, not from the failure: a simulated bus fails at once.
void BusSession::recover(BusFault fault, double started) {
  if (fault == BusFault::kRefused) return;
  if (fault == BusFault::kDown) return hang_up(clock_.now());
  const double waited = fault == BusFault::kSilent ? transport_.response_timeout : 0.0;
  const double given_up = std::max(clock_.now(), started + waited);
  ++silences_;
  if (transport_.is_tcp || silences_ >= kSilencesBeforeReopen) return hang_up(given_up);
  discard_first_ = true;
  not_before_ = given_up + transport_.late_answer_window;
}

void BusSession::hang_up(double from) {
  bus_->close();
  silences_ = 0;
  not_before_ = from + std::max(pause_, transport_.is_tcp ? 0.0 : transport_.late_answer_window);
  discard_first_ = true;
  pause_ = std::min(2.0 * pause_, transport_.reconnect_pause_max);
}

}  // namespace lensforge

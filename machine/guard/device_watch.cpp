// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <numeric>
#include <utility>

#include "core/text/number_text.h"
#include "machine/guard/spindle_guard.h"

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

std::size_t DeviceWatch::add(const ReadSignal& signal) {
  polled_.push_back({signal, clock_.now(), 0, {}});
  return polled_.size() - 1;
}

// The most overdue goes first, so that a slow bus starves no signal.
std::vector<DeviceWatch::Reading> DeviceWatch::poll() {
  std::vector<std::size_t> order(polled_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return polled_[a].due < polled_[b].due;
  });
  std::vector<Reading> readings;
  for (const std::size_t index : order) {
    if (polled_[index].due > clock_.now() || !session_.ready()) break;
    if (!read_one(index, readings)) break;
  }
  return readings;
}

/// @return whether the device answered.
bool DeviceWatch::read_one(std::size_t index, std::vector<Reading>& readings) {
  Polled& polled = polled_[index];
  const double started = clock_.now();
  bool answered = true;
  try {
    const std::uint16_t raw = session_.read(polled.signal.at);
    readings.push_back({index, static_cast<std::uint16_t>(raw & polled.signal.mask), clock_.now()});
    polled.failures = 0;
  } catch (const BusError& error) {
    ++polled.failures;
    polled.error = error.what();
    answered = error.fault() == BusFault::kRefused;
  }
  if (answered) {
    silent_since_.reset();
    unanswered_ = 0;
    polled.due = started + polled.signal.interval;
    return true;
  }
  polled.due = clock_.now();  // behind the others: one dead register must not starve them
  ++unanswered_;
  last_error_ = polled.error;
  if (!silent_since_) silent_since_ = started;
  return false;
}

std::optional<std::string> DeviceWatch::write(const RegisterAddress& at, std::uint16_t value) {
  try {
    session_.write(at, value);
    return std::nullopt;
  } catch (const BusError& error) {
    return "writing " + std::to_string(value) + " to " + address_text(at) + ": " + error.what();
  }
}

std::string DeviceWatch::trouble(std::size_t signal) const {
  const Polled& polled = polled_[signal];
  const std::string name = polled.signal.key + " (" + address_text(polled.signal.at) + "): ";
  const int failures = std::max(polled.failures, unanswered_);
  if (failures > polled.signal.retries) {
    return name + (polled.failures == failures ? polled.error : last_error_) + ", " +
           std::to_string(failures) + " times in a row: " + std::to_string(polled.signal.retries) +
           " retries are borne";
  }
  const double silence = silent_since_ ? clock_.now() - *silent_since_ : 0.0;
  if (silence <= silence_limit_) return {};
  return name + "no good answer for " + number_text(silence, 3) + " s: at most " +
         number_text(silence_limit_, 3) + " s are borne";
}

}  // namespace lensforge

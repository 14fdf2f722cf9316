// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/device_watch.h"

#include <algorithm>
#include <numeric>

#include "core/text/number_text.h"

namespace lensforge {

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

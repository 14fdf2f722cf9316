// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/live_design.h"

#include <charconv>
#include <exception>
#include <system_error>
#include <utility>
#include <vector>

#include "app/interrupt.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/page/html_text.h"
#include "core/text/printable.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

std::string picture_bytes(const Image& image) {
  const std::vector<unsigned char> png = encode_png(grey_picture(image));
  return {png.begin(), png.end()};
}

}  // namespace

int live_port(const std::string& text) {
  constexpr int kLargest = 65535;
  int port = -1;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  if (error == std::errc() && stop == end && port >= 0 && port <= kLargest) return port;
  throw InputError("--live " + printable_line(text) +
                   ": must be a port, 1 to 65535, or 0 for a free one; 8080 would do");
}

LiveDesign::LiveDesign(int port, const std::string& name, fs::path checkpoint, DesignGoalView goal)
    : checkpoint_(std::move(checkpoint)),
      goal_(std::move(goal)),
      server_(port, name, picture_bytes(goal_.target), [] { InterruptWatch::interrupt(); }),
      watcher_([this](const std::stop_token& stop) { watch(stop); }) {}

LiveDesign::~LiveDesign() {
  watcher_.request_stop();
  watcher_.join();
}

void LiveDesign::look() {
  {
    const std::lock_guard lock(mutex_);
    asked_ = true;
  }
  wake_.notify_one();
}

void LiveDesign::watch(const std::stop_token& stop) {
  fs::file_time_type seen = fs::file_time_type::min();
  const Executor executor = Executor::cpu(1).with_stop(stop);
  for (std::int64_t number = 1; !stop.stop_requested();) {
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [this] { return asked_; })) return;
      asked_ = false;
    }
    std::error_code none;
    const fs::file_time_type saved = fs::last_write_time(checkpoint_, none);
    if (none || saved == seen) continue;
    seen = saved;
    try {
      server_.publish(state_of_design(checkpoint_, goal_, number, executor));
      ++number;
    } catch (const std::exception&) {
      // The design itself says what is wrong with its checkpoint, and ends where it cannot go on.
    }
  }
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/progress_display.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "app/console.h"
#include "core/text/printable.h"

namespace lensforge::app {
namespace {

constexpr std::chrono::milliseconds kBarInterval{100};
constexpr std::chrono::seconds kLineInterval{5};
constexpr int kBarWidth = 24;

std::string clock_text(double seconds) {
  const int whole = static_cast<int>(seconds);
  char text[32];
  std::snprintf(text, sizeof text, "%d:%02d", whole / 60, whole % 60);
  return text;
}

std::string bar(double share, int width) {
  const auto all = static_cast<std::size_t>(width);
  const auto filled = static_cast<std::size_t>(share * width);
  std::string text = "[";
  text.append(filled, '#').append(all - filled, '.').append("] ");
  return text;
}

}  // namespace

std::string progress_line(const Progress& progress, double seconds, int bar_width) {
  std::string line = printable_line(progress.stage) + "  ";
  if (progress.total > 0.0) {
    const double share = std::clamp(progress.done / progress.total, 0.0, 1.0);
    if (bar_width > 0) line += bar(share, bar_width);
    line += std::to_string(static_cast<int>(100.0 * share)) + " %  ";
  }
  if (!progress.detail.empty()) line += printable_line(progress.detail) + "  ";
  return line + clock_text(seconds);
}

ProgressDisplay::ProgressDisplay(bool quiet)
    : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0), shown_(start_) {
  if (quiet_) return;
  redrawer_ = std::jthread([this](const std::stop_token& stop) { redraw_until(stop); });
}

ProgressDisplay::~ProgressDisplay() {
  if (redrawer_.joinable()) {
    redrawer_.request_stop();
    redrawer_.join();
  }
  wipe();
}

std::function<void(const Progress&)> ProgressDisplay::sink() {
  if (quiet_) return {};
  return [this](const Progress& progress) { show(progress); };
}

void ProgressDisplay::wipe() {
  const std::lock_guard lock(mutex_);
  if (bar_drawn_) std::fputs("\r\033[K", stderr);
  bar_drawn_ = false;
}

void ProgressDisplay::show(const Progress& progress) {
  const std::lock_guard lock(mutex_);
  last_ = progress;
  draw();
}

void ProgressDisplay::redraw_until(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kInterval{500};
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    ended_.wait_for(lock, stop, kInterval, [] { return false; });
    if (!last_.stage.empty() && !stop.stop_requested()) draw();
  }
}

void ProgressDisplay::draw() {
  const Clock::time_point now = Clock::now();
  const Clock::duration wait = terminal_ ? Clock::duration(kBarInterval) : kLineInterval;
  if (now - shown_ < wait) return;
  shown_ = now;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  std::string line = progress_line(last_, seconds, terminal_ ? kBarWidth : 0);
  if (terminal_) {
    line.resize(std::min(line.size(), terminal_width() - 1));
    std::fprintf(stderr, "\r%s\033[K", line.c_str());
    bar_drawn_ = true;
  } else {
    std::fprintf(stderr, "%s\n", line.c_str());
  }
}

}  // namespace lensforge::app

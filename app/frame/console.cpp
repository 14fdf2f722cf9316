// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"
#include "core/text/words.h"

namespace lensforge::app {
namespace {

/// Writes DEL and C1, which JSON allows in strings and terminals obey, as \u escapes.
std::string without_controls(const std::string& json) {
  std::string text;
  text.reserve(json.size());
  for (std::size_t i = 0; i < json.size(); ++i) {
    const auto next = static_cast<unsigned char>(i + 1 < json.size() ? json[i + 1] : '\0');
    const bool c1 = json[i] == '\xC2' && next >= 0x80 && next < 0xA0;
    if (!c1 && json[i] != '\x7F') {
      text += json[i];
      continue;
    }
    std::array<char, 8> escape{};
    std::snprintf(escape.data(), escape.size(), "\\u%04x", c1 ? next : 0x7FU);
    text += escape.data();
    if (c1) ++i;
  }
  return text;
}

/// File names need not be UTF-8, which JSON has to be: other bytes become U+FFFD.
std::string dump(const nlohmann::json& object) {
  const auto replace = nlohmann::json::error_handler_t::replace;
  return without_controls(object.dump(2, ' ', false, replace)) + "\n";
}

/// Longest value that is shown whole: a list of numbers, say. Paths may be longer.
constexpr std::size_t kLongestValue = 200;

/// A message with long values truncated, which keeps the reason visible.
std::string message_line(const std::string& message) {
  std::string line;
  for (std::size_t at = 0; at < message.size();) {
    const std::size_t end = std::min(message.find(' ', at), message.size());
    const std::string word = message.substr(at, end - at);
    const bool cut = word.size() > kLongestValue && word.find('/') == std::string::npos;
    line += cut ? printable_line(word, kLongestValue) : word;
    if (end < message.size()) line += ' ';
    at = end + 1;
  }
  return printable_line(line);
}

}  // namespace

std::size_t terminal_width() {
  constexpr std::size_t kUsual = 80;
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kUsual;
}

void print_to_stdout(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0) {
    throw RunError(std::string("standard output: ") + std::strerror(errno));
  }
}

int report_error(const std::string& message, int exit_code, bool json) noexcept {
  try {
    const std::string line = message_line(message);
    std::fprintf(stderr, "lensforge: %s\n", line.c_str());
    if (json) print_to_stdout(dump({{"error", line}, {"exit_code", exit_code}}));
  } catch (const std::exception&) {
    // The reason was printed; a stdout that is gone as well changes nothing.
  }
  return exit_code;
}

void Console::note(const std::string& message) const {
  if (!begun_) {
    held_.push_back(message);
  } else if (!quiet_) {
    std::fprintf(stderr, "lensforge: %s\n", message_line(message).c_str());
  }
}

void Console::begin() const {
  begun_ = true;
  for (const std::string& message : std::exchange(held_, {})) note(message);
}

void Console::result(const nlohmann::json& object, const std::string& text) const {
  begin();
  print_to_stdout(json_ ? dump(object) : printable_lines(text));
}

namespace {

constexpr std::chrono::milliseconds kBarInterval{100};
/// Lines where there is no terminal: often enough to follow short work, and a log of hours short.
/// The first comes late: an error of the input is to be the only line.
constexpr double kLineShare = 0.02;  ///< Of the time so far.
constexpr double kMinLineSeconds = 1.0;
constexpr double kMaxLineSeconds = 5.0;
constexpr int kMaxBarWidth = 24;
constexpr int kMinBarWidth = 8;  ///< With less room there is no bar.
constexpr int kBarEnds = 3;      ///< Characters around the bar.

/// Minimum span of a pace, seconds and share of the total: the first steps of a stage are uneven.
constexpr double kMinPaceSeconds = 3.0;
constexpr double kMinPaceShare = 0.01;

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

void StagePace::take(const Progress& progress, double seconds) {
  const bool goes_on =
      progress.stage == stage_ && progress.total == total_ && progress.done >= last_.done;
  if (goes_on && progress.done > last_.done) last_ = {progress.done, seconds};
  if (goes_on && last_.done > first_.done) return;
  stage_ = progress.stage;
  total_ = progress.total;
  first_ = {progress.done, seconds};
  last_ = first_;
}

std::optional<double> StagePace::left(double seconds) const {
  const double done = last_.done - first_.done;
  const double span = last_.seconds - first_.seconds;
  const bool known =
      total_ > last_.done && done >= kMinPaceShare * total_ && span >= kMinPaceSeconds;
  if (!known) return std::nullopt;
  const double left = (total_ - last_.done) / done * span - (seconds - last_.seconds);
  return left > 0.0 ? std::optional(left) : std::nullopt;
}

std::string progress_line(const Progress& progress, double seconds, std::optional<double> left,
                          int bar_width) {
  std::string line = printable_line(progress.stage) + "  ";
  if (progress.total > 0.0) {
    const double share = std::clamp(progress.done / progress.total, 0.0, 1.0);
    if (bar_width > 0) line += bar(share, bar_width);
    line += std::to_string(static_cast<int>(100.0 * share)) + " %  ";
  }
  if (!progress.detail.empty()) line += printable_line(progress.detail) + "  ";
  line += clock_text(seconds);
  if (left) line.append(", ").append(clock_text(std::round(*left))).append(" left");
  return line;
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
  pace_.take(progress, std::chrono::duration<double>(Clock::now() - start_).count());
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

/// The words come first where the terminal is too narrow for a whole bar.
std::string ProgressDisplay::line(double seconds) const {
  const std::optional<double> left = pace_.left(seconds);
  std::string words = progress_line(last_, seconds, left, 0);
  if (!terminal_) return words;
  const std::size_t width = terminal_width() - 1;
  const int room = static_cast<int>(width) - static_cast<int>(words.size()) - kBarEnds;
  if (room < kMinBarWidth) {
    words.resize(std::min(words.size(), width));
    return words;
  }
  return progress_line(last_, seconds, left, std::min(room, kMaxBarWidth));
}

void ProgressDisplay::draw() {
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double> spent = now - start_;
  const double line_wait =
      shown_ == start_ ? kMaxLineSeconds
                       : std::clamp(kLineShare * spent.count(), kMinLineSeconds, kMaxLineSeconds);
  const std::chrono::duration<double> wait =
      terminal_ ? kBarInterval : std::chrono::duration<double>(line_wait);
  if (now - shown_ < wait) return;
  shown_ = now;
  const std::string text = line(spent.count());
  if (terminal_) {
    std::fprintf(stderr, "\r%s\033[K", text.c_str());
    bar_drawn_ = true;
  } else {
    std::fprintf(stderr, "%s\n", text.c_str());
  }
}

}  // namespace lensforge::app

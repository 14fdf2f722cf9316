// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/text_sink.h"

#include <fcntl.h>
#include <poll.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/error.h"

namespace lensforge::app {

std::string time_stamp() {
  using std::chrono::milliseconds;
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  const auto ms = std::chrono::duration_cast<milliseconds>(since).count();
  const std::time_t seconds = ms / 1000;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  std::array<char, 32> day{};
  std::strftime(day.data(), day.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%s.%03dZ", day.data(), static_cast<int>(ms % 1000));
  return text.data();
}

// A named pipe that nobody reads would block here for ever without O_NONBLOCK.
TextSink::TextSink(const std::filesystem::path& path)
    : path_(path),
      file_(path == "-"
                ? ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0)
                : ::open(path.c_str(),
                         O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666)) {
  if (file_.open()) return;
  const int error = errno;
  throw InputError(
      path.string() + ": cannot be written: " +
      (error == ENXIO ? "nobody reads from this pipe" : std::generic_category().message(error)));
}

// Standard output may be shared, so it is not made non-blocking: a pipe that poll() finds ready
// takes a line of up to PIPE_BUF bytes whole and at once.
std::string TextSink::write(const std::string& line) {
  if (!file_.open()) return {};
  const std::string text = line + "\n";
  std::string_view left = text;
  while (!left.empty()) {
    pollfd entry{file_.number(), POLLOUT, 0};
    const bool whole = left.size() == text.size();
    if (whole && ::poll(&entry, 1, 0) == 0) {
      ++lost_;
      return {};
    }
    const ssize_t count = ::write(file_.number(), left.data(), left.size());
    if (count > 0) left.remove_prefix(static_cast<std::size_t>(count));
    if (count >= 0 || errno == EINTR) continue;
    if (errno == EAGAIN && whole) {
      ++lost_;
      return {};
    }
    const int error = errno;
    file_ = Descriptor();
    return path_.string() + ": not written any more: " + std::generic_category().message(error);
  }
  return {};
}

long TextSink::take_lost() { return std::exchange(lost_, 0); }

}  // namespace lensforge::app

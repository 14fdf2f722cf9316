// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/text_sink.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
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
namespace {

/// What is read of a file to tell what it is: more than any first line of ours.
constexpr std::size_t kFirstLine = 1 << 16;

std::string reason(int error) { return std::generic_category().message(error); }

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& why) {
  throw InputError(path.string() + ": " + why);
}

/// The first line without its end, of what a file may be told from; empty if it cannot be read.
std::string first_line(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  std::string text(kFirstLine, '\0');
  const ssize_t count = file.open() ? ::pread(file.number(), text.data(), text.size(), 0) : 0;
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  const std::size_t end = text.find('\n');
  return end == std::string::npos ? std::string() : text.substr(0, end);
}

/// Whether a terminal is the one that this process was started from, not the port of a machine.
bool is_own_terminal(int descriptor) {
  struct stat about {};
  struct stat own {};
  if (::fstat(descriptor, &about) != 0) return false;
  for (const int number : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fstat(number, &own) == 0 && own.st_rdev == about.st_rdev && S_ISCHR(own.st_mode)) {
      return true;
    }
  }
  return false;
}

void require_own(const std::filesystem::path& path, int descriptor, const SinkKind& kind) {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0) refuse(path, reason(errno));
  if (S_ISBLK(about.st_mode)) refuse(path, "is a disk; name a file or a pipe");
  if (::isatty(descriptor) != 0 && !is_own_terminal(descriptor)) {
    refuse(path,
           "is a serial port or another terminal, where text may move a machine; name a file "
           "or a pipe");
  }
  if (!S_ISREG(about.st_mode) || about.st_size == 0 || kind.begins(first_line(path))) return;
  refuse(path, std::string("exists and is no ") + kind.name + " of lensforge; name another file");
}

}  // namespace

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

bool begins_with_time(std::string_view text) {
  constexpr std::string_view kForm = "0000-00-00T00:00:00.000Z";
  if (text.size() < kForm.size()) return false;
  return std::equal(kForm.begin(), kForm.end(), text.begin(), [](char form, char c) {
    return form == '0' ? c >= '0' && c <= '9' : c == form;
  });
}

// A named pipe that nobody reads would block here for ever without O_NONBLOCK.
TextSink::TextSink(const std::filesystem::path& path, const SinkKind& kind)
    : path_(path),
      file_(path == "-"
                ? ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0)
                : ::open(path.c_str(),
                         O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0666)) {
  const int error = errno;
  if (!file_.open()) {
    refuse(path, "cannot be written: " +
                     (error == ENXIO ? "nobody reads from this pipe" : reason(error)));
  }
  if (path != "-") require_own(path, file_.number(), kind);
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

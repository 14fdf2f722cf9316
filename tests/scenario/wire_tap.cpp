// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/wire_tap.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>

#include "scenario/terminal_process.h"

namespace lensforge::scenario {
namespace {

int open_raw(const std::string& device) {
  const int terminal = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  if (::tcgetattr(terminal, &settings) == 0) {
    ::cfmakeraw(&settings);
    ::tcsetattr(terminal, TCSANOW, &settings);
  }
  return terminal;
}

/// Bytes that wait in `from`, handed on to `to`.
std::string pass(int from, int to) {
  std::array<char, 4096> bytes{};
  const ssize_t count = ::read(from, bytes.data(), bytes.size());
  if (count <= 0) return {};
  std::string text(bytes.data(), static_cast<std::size_t>(count));
  write_all(to, text);
  return text;
}

}  // namespace

WireTap::WireTap(const std::string& device)
    : held_(open_raw(near_.device())), far_(open_raw(device)), thread_([this] { pass_on(); }) {}

WireTap::~WireTap() {
  ends_ = true;
  thread_.join();
}

std::string WireTap::sent() {
  const std::lock_guard lock(mutex_);
  return sent_;
}

bool WireTap::sends(const std::string& text, const std::string& before) {
  return comes_true([&] {
    const std::string so_far = sent();
    return so_far.find(text, so_far.find(before)) != std::string::npos;
  });
}

void WireTap::pass_on() {
  while (!ends_) {
    std::array<pollfd, 2> ends{pollfd{near_.master(), POLLIN, 0}, pollfd{far_.number(), POLLIN, 0}};
    ::poll(ends.data(), ends.size(), 10);
    if ((ends[0].revents & POLLIN) != 0) {
      const std::string text = pass(near_.master(), far_.number());
      const std::lock_guard lock(mutex_);
      sent_ += text;
    }
    if ((ends[1].revents & POLLIN) != 0) pass(far_.number(), near_.master());
  }
}

}  // namespace lensforge::scenario

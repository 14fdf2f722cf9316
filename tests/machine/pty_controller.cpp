// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/pty_controller.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <system_error>

#include "core/error.h"
#include "machine/sim/simulated_controller.h"

namespace lensforge {
namespace {

constexpr int kPollMilliseconds = 2;
/// What nobody reads is dropped beyond this, as an unread serial port does.
constexpr std::size_t kUnreadBytes = 1 << 16;

[[noreturn]] void fail(const std::string& what) {
  throw RunError("pseudo-terminal: " + what + ": " + std::generic_category().message(errno));
}

std::string slave_name(int master) {
  std::array<char, 128> name{};
  if (::ptsname_r(master, name.data(), name.size()) != 0) fail("its name cannot be had");
  return name.data();
}

void make_raw(int terminal) {
  termios settings{};
  if (::tcgetattr(terminal, &settings) != 0) fail("its settings cannot be read");
  ::cfmakeraw(&settings);
  if (::tcsetattr(terminal, TCSANOW, &settings) != 0) fail("its settings cannot be written");
}

void receive_all(int master, SimulatedController& controller) {
  std::array<char, 512> bytes{};
  const ssize_t count = ::read(master, bytes.data(), bytes.size());
  for (ssize_t i = 0; i < count; ++i) controller.receive(bytes[static_cast<std::size_t>(i)]);
}

void send_all(int master, std::string& unsent) {
  if (unsent.empty()) return;
  const ssize_t count = ::write(master, unsent.data(), unsent.size());
  if (count > 0) unsent.erase(0, static_cast<std::size_t>(count));
  if (unsent.size() > kUnreadBytes) unsent.clear();
}

}  // namespace

PtyController::PtyController(const SimulatedOptions& options, double speed,
                             const MachineWatch& watch)
    : master_(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
  const int master = master_.number();
  if (!master_.open()) fail("none is to be had");
  if (::grantpt(master) != 0 || ::unlockpt(master) != 0) fail("it stays locked");
  path_ = slave_name(master);
  slave_ = Descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  if (!slave_.open()) fail(path_);
  make_raw(slave_.number());
  ::fcntl(master, F_SETFL, O_NONBLOCK);
  thread_ = std::thread([this, options, speed, watch] { serve(options, speed, watch); });
}

PtyController::~PtyController() {
  ends_ = true;
  if (thread_.joinable()) thread_.join();
}

void PtyController::serve(const SimulatedOptions& options, double speed,
                          const MachineWatch& watch) {
  SimulatedController controller(options, watch);
  const auto begin = std::chrono::steady_clock::now();
  std::string unsent;
  while (!ends_) {
    pollfd wanted{master_.number(), POLLIN, 0};
    ::poll(&wanted, 1, kPollMilliseconds);
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    while (controller.run_until(passed.count() * speed) < passed.count() * speed) {
      for (const Spoken& spoken : controller.take_output()) unsent += spoken.text;
    }
    if ((wanted.revents & POLLIN) != 0) receive_all(master_.number(), controller);
    controller.run_until(controller.now());
    for (const Spoken& spoken : controller.take_output()) unsent += spoken.text;
    send_all(master_.number(), unsent);
  }
}

}  // namespace lensforge

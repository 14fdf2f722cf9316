// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/served_port.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <mutex>
#include <stdexcept>

#include "machine/pty_controller.h"

namespace lensforge::fuzz {
namespace {

constexpr double kSpeed = 100.0;  ///< Simulated seconds in a second.

void send_text(int pipe, const std::string& text) {
  if (write(pipe, text.data(), text.size()) < 0) _exit(1);
}

/// A line, or what there is before the end.
std::string read_line(int pipe) {
  std::string line;
  for (char c = 0; read(pipe, &c, 1) == 1 && c != '\n';) line += c;
  return line;
}

/// In the process of its own: serves until `orders` ends, then says what happened.
[[noreturn]] void serve(int orders, int answers) {
  std::mutex mutex;
  ServedPort::Record record;
  MachineWatch watch;
  watch.piece = [&](const ExecutedPiece&) {
    const std::lock_guard lock(mutex);
    ++record.pieces;
  };
  watch.event = [&](const MachineEvent& event) {
    const std::lock_guard lock(mutex);
    record.events.push_back(event.what);
  };
  const PtyController controller(simulated_grbl(), kSpeed, watch);
  send_text(answers, controller.path() + "\n");
  read_line(orders);
  const std::lock_guard lock(mutex);
  send_text(answers, std::to_string(record.pieces) + "\n");
  for (const std::string& event : record.events) send_text(answers, event + "\n");
  _exit(0);
}

}  // namespace

ServedPort::ServedPort() {
  std::array<int, 2> orders{};
  std::array<int, 2> answers{};
  if (pipe2(orders.data(), O_CLOEXEC) != 0 || pipe2(answers.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("no pipe");
  }
  pid_ = fork();
  if (pid_ == 0) {
    close(orders[1]);
    close(answers[0]);
    serve(orders[0], answers[1]);
  }
  close(orders[0]);
  close(answers[1]);
  to_ = orders[1];
  from_ = answers[0];
  path_ = read_line(from_);
}

ServedPort::~ServedPort() {
  if (pid_ > 0) kill(pid_, SIGKILL);
  if (pid_ > 0) waitpid(pid_, nullptr, 0);
  if (to_ >= 0) close(to_);
  close(from_);
}

ServedPort::Record ServedPort::finish() {
  close(to_);
  to_ = -1;
  Record record;
  record.pieces = std::stoi("0" + read_line(from_));
  for (std::string line = read_line(from_); !line.empty(); line = read_line(from_)) {
    record.events.push_back(line);
  }
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
  return record;
}

}  // namespace lensforge::fuzz

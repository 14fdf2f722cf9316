// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/terminal_keys.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <utility>

namespace lensforge::app {
namespace {

/// Interval at which a background process checks whether it is in the foreground again, ms.
constexpr int kForegroundCheckMs = 300;

/// Signals that end the process without a destructor; a sanitizer may have taken some of them.
constexpr std::array kEnds = {SIGQUIT, SIGABRT, SIGSEGV, SIGBUS,  SIGFPE,
                              SIGILL,  SIGALRM, SIGUSR1, SIGUSR2, SIGXCPU};

// A handler reaches nothing but globals.
std::atomic<bool> keys_taken;                     // NOLINT: see above
termios state_before;                             // NOLINT: see above
termios during;                                   // NOLINT: see above
std::array<struct sigaction, kEnds.size()> ends;  // NOLINT: see above
struct sigaction stop_before;                     // NOLINT: see above
struct sigaction continue_before;                 // NOLINT: see above

/// A terminal belongs to the process group in its foreground; touching it from elsewhere would stop
/// this one (SIGTTOU).
bool in_foreground() { return ::tcgetpgrp(STDIN_FILENO) == ::getpgrp(); }

/// What is no terminal belongs to who opened it.
bool may_read() { return ::isatty(STDIN_FILENO) == 0 || in_foreground(); }

void take_terminal() {
  if (keys_taken && in_foreground()) ::tcsetattr(STDIN_FILENO, TCSANOW, &during);
}

void end_by(int signal) {
  restore_terminal();
  struct sigaction standard {};
  standard.sa_handler = SIG_DFL;
  ::sigaction(signal, &standard, nullptr);
  ::raise(signal);  // Strikes when this handler returns.
}

/// Stops the process as without a handler, by the default action; in an orphaned process group it
/// does nothing.
void stop_by(int signal) {
  const int error = errno;
  restore_terminal();
  struct sigaction own {};
  struct sigaction standard {};
  standard.sa_handler = SIG_DFL;
  ::sigaction(signal, &standard, &own);
  ::raise(signal);
  sigset_t only{};
  sigset_t blocked{};
  ::sigemptyset(&only);
  ::sigaddset(&only, signal);
  ::pthread_sigmask(SIG_UNBLOCK, &only, &blocked);  // Sleeps in here.
  ::pthread_sigmask(SIG_SETMASK, &blocked, nullptr);
  ::sigaction(signal, &own, nullptr);
  take_terminal();
  errno = error;
}

void continue_by(int /*signal*/) {
  const int error = errno;
  take_terminal();
  errno = error;
}

/// @return what was there before.
struct sigaction handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  struct sigaction old {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigemptyset(&action.sa_mask);
  ::sigaction(signal, nullptr, &old);
  if (old.sa_handler == SIG_DFL) ::sigaction(signal, &action, nullptr);
  return old;
}

void handle_signals() {
  for (std::size_t i = 0; i < kEnds.size(); ++i) ends[i] = handle(kEnds[i], end_by);
  stop_before = handle(SIGTSTP, stop_by);
  continue_before = handle(SIGCONT, continue_by);
}

void release_signals() {
  for (std::size_t i = 0; i < kEnds.size(); ++i) ::sigaction(kEnds[i], &ends[i], nullptr);
  ::sigaction(SIGTSTP, &stop_before, nullptr);
  ::sigaction(SIGCONT, &continue_before, nullptr);
}

/// Without Enter and echo; Ctrl-C is still a signal. Ctrl-S is disabled: stopped terminal output
/// would stop the sender too. Earlier input is dropped: it was not meant for a running machine.
bool enter() {
  if (::isatty(STDIN_FILENO) == 0 || !in_foreground()) return false;
  if (::tcgetattr(STDIN_FILENO, &state_before) != 0) return false;
  during = state_before;
  during.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  during.c_iflag &= ~static_cast<tcflag_t>(IXON);
  during.c_cc[VMIN] = 1;
  during.c_cc[VTIME] = 0;
  during.c_cc[VSUSP] = _POSIX_VDISABLE;
  keys_taken = true;
  handle_signals();
  return ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &during) == 0;
}

/// A read from the background then fails instead of stopping the process.
void block_terminal_signals() {
  sigset_t set{};
  ::sigemptyset(&set);
  ::sigaddset(&set, SIGTTIN);
  ::sigaddset(&set, SIGTTOU);
  ::pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

}  // namespace

void restore_terminal() noexcept {
  if (keys_taken && in_foreground()) ::tcsetattr(STDIN_FILENO, TCSANOW, &state_before);
}

namespace {

/// The order behind a key; nothing for other keys and for Q.
std::optional<OperatorKey> order_of(char key) {
  static constexpr std::pair<char, OperatorKey> kOrders[] = {
      {' ', OperatorKey::kHold},         {'h', OperatorKey::kHold},
      {'!', OperatorKey::kHold},         {'r', OperatorKey::kResume},
      {'~', OperatorKey::kResume},       {'+', OperatorKey::kFeedUp},
      {'-', OperatorKey::kFeedDown},     {'=', OperatorKey::kFeedNormal},
      {'1', OperatorKey::kRapidFull},    {'2', OperatorKey::kRapidHalf},
      {'3', OperatorKey::kRapidQuarter}, {'>', OperatorKey::kSpindleUp},
      {'<', OperatorKey::kSpindleDown},  {'.', OperatorKey::kSpindleNormal}};
  for (const auto& [letter, order] : kOrders) {
    if (letter == key) return order;
  }
  return std::nullopt;
}

}  // namespace

TerminalKeys::TerminalKeys(std::function<void()> abort, KeySource source)
    : abort_(std::move(abort)) {
  std::array<int, 2> wake{};
  if (::pipe2(wake.data(), O_CLOEXEC) != 0) return;
  wake_read_ = Descriptor(wake[0]);
  wake_write_ = Descriptor(wake[1]);
  const bool pipe = source == KeySource::kAnyInput && ::isatty(STDIN_FILENO) == 0;
  if (pipe || enter()) reader_ = std::thread([this] { read_keys(); });
}

TerminalKeys::~TerminalKeys() {
  wake_write_ = Descriptor();
  if (reader_.joinable()) reader_.join();
  if (!keys_taken) return;
  restore_terminal();
  release_signals();
  keys_taken = false;
}

std::optional<OperatorKey> TerminalKeys::next() {
  const std::lock_guard lock(mutex_);
  if (orders_.empty()) return std::nullopt;
  const OperatorKey order = orders_.front();
  orders_.pop_front();
  return order;
}

void TerminalKeys::read_keys() {
  block_terminal_signals();
  for (;;) {
    const bool ours = may_read();
    std::array<pollfd, 2> sources{pollfd{wake_read_.number(), POLLIN, 0},
                                  pollfd{ours ? STDIN_FILENO : -1, POLLIN, 0}};
    if (::poll(sources.data(), sources.size(), kForegroundCheckMs) < 0 && errno != EINTR) return;
    if (sources[0].revents != 0) return;
    if (sources[1].revents == 0) continue;
    char key = 0;
    const ssize_t count = ::read(STDIN_FILENO, &key, 1);
    if (count == 1) take(key);
    if (count == 0 || (count < 0 && errno != EINTR && may_read())) return;
  }
}

void TerminalKeys::take(char key) {
  if (key == 'Q') return abort_();
  const std::optional<OperatorKey> order = order_of(key);
  if (!order) return;
  const std::lock_guard lock(mutex_);
  orders_.push_back(*order);
}

}  // namespace lensforge::app

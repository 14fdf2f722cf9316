// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/interrupt.h"

#include <semaphore.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <utility>

#include "app/frame/command_line.h"
#include "app/frame/terminal_keys.h"
#include "core/io/files.h"

// The handler only wakes a thread; nothing else must be async-signal-safe. Blocking the signals and
// waiting for them does not work: linked libraries such as OpenBLAS start threads before main()
// that do not block the signals.
namespace lensforge::app {
namespace {

constexpr std::array kSignals = {SIGINT, SIGTERM, SIGHUP};

// A handler reaches nothing but globals.
volatile std::sig_atomic_t json_at_signals = 0;                 // NOLINT: see above
volatile std::sig_atomic_t interrupted = 0;                     // NOLINT: see above
sem_t wake;                                                     // NOLINT: see above
std::array<struct sigaction, kSignals.size()> handlers_before;  // NOLINT: see above

void wake_waiter(int /*signal*/) {
  interrupted = 1;
  sem_post(&wake);
}

void exit_interrupted(int /*signal*/) {
  write_all(STDERR_FILENO, "lensforge: interrupted\n");
  if (json_at_signals != 0) {
    write_all(STDOUT_FILENO, "{\n  \"error\": \"interrupted\",\n  \"exit_code\": 130\n}\n");
  }
  _exit(kInterrupted);
}

/// Signals that are ignored stay so. @return what was there before.
std::array<struct sigaction, kSignals.size()> handle_with(void (*handler)(int)) {
  std::array<struct sigaction, kSignals.size()> old{};
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &old[i]);
    if (old[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &action, nullptr);
  }
  return old;
}

}  // namespace

void exit_at_signals() noexcept { handle_with(exit_interrupted); }

void print_json_at_signals(bool json) noexcept { json_at_signals = json ? 1 : 0; }

void ignore_signals() noexcept { handle_with(SIG_IGN); }

InterruptWatch::InterruptWatch(SecondInterrupt second, std::function<void()> overdue)
    : second_(second), overdue_(std::move(overdue)) {
  sem_init(&wake, 0, 0);
  handlers_before = handle_with(wake_waiter);
  // A signal that came at the end of an earlier watch, whose token was no longer checked.
  if (interrupted != 0) stop_.request_stop();
  waiter_ = std::thread([this] { wait_for_signals(); });
}

InterruptWatch::~InterruptWatch() {
  for (std::size_t i = 0; i < kSignals.size(); ++i)
    sigaction(kSignals[i], &handlers_before[i], nullptr);
  finished_ = true;
  sem_post(&wake);
  waiter_.join();
  sem_destroy(&wake);
}

void InterruptWatch::interrupt() { sem_post(&wake); }

/// True for a signal or the end of the watch; false if the time limit after the first request has
/// passed.
bool InterruptWatch::wait_for_one() {
  if (!overdue_ || !stop_.stop_requested()) return sem_wait(&wake) == 0;
  constexpr long kPatience = 700'000'000;  // Nanoseconds.
  constexpr long kSecond = 1'000'000'000;
  timespec until{};
  clock_gettime(CLOCK_MONOTONIC, &until);
  until.tv_sec += (until.tv_nsec + kPatience) / kSecond;
  until.tv_nsec = (until.tv_nsec + kPatience) % kSecond;
  if (sem_clockwait(&wake, CLOCK_MONOTONIC, &until) == 0) return true;
  if (errno == ETIMEDOUT) std::exchange(overdue_, {})();
  return false;
}

void InterruptWatch::wait_for_signals() {
  while (true) {
    if (!wait_for_one()) continue;
    if (finished_) return;
    if (stop_.request_stop()) continue;
    if (second_ == SecondInterrupt::kRequest && second_stop_.request_stop()) continue;
    restore_terminal();
    _exit(kInterrupted);
  }
}

}  // namespace lensforge::app

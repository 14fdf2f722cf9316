// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/terminal_process.h"

#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>

namespace lensforge::scenario {
namespace {

/// The shell: puts the command in the foreground and waits for its end, however often it stops.
[[noreturn]] void run_job(std::vector<char*>& argv) {
  std::signal(SIGTTOU, SIG_IGN);
  const pid_t job = fork();
  if (job == 0) {
    setpgid(0, 0);
    tcsetpgrp(STDIN_FILENO, getpid());
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGTTOU}) std::signal(number, SIG_DFL);
    execv(argv.front(), argv.data());
    _exit(127);
  }
  int status = 0;
  while (waitpid(job, &status, 0) < 0) {
  }
  _exit(WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
}

}  // namespace

bool comes_true(const std::function<bool()>& fact) {
  for (int i = 0; i < 2000; ++i) {
    if (fact()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

TerminalProcess::TerminalProcess(const Arguments& arguments) {
  Arguments words = arguments;
  words.insert(words.begin(), LENSFORGE_COMMAND);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  winsize size{40, 120, 0, 0};
  shell_ = forkpty(&master_, nullptr, nullptr, &size);
  if (shell_ == 0) run_job(argv);
  reader_ = std::thread([this] { read_screen(); });
  comes_true([this] { return (job_ = tcgetpgrp(master_)) > 0 && job_ != shell_; });
}

TerminalProcess::~TerminalProcess() {
  if (!ended_) {
    kill(job_, SIGKILL);
    wait();
  }
  reader_.join();
  close(master_);
}

void TerminalProcess::press(const std::string& keys) const {
  EXPECT_EQ(::write(master_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
}

void TerminalProcess::send(int signal) const { kill(job_, signal); }

std::string TerminalProcess::screen() {
  const std::lock_guard lock(mutex_);
  return screen_;
}

bool TerminalProcess::shows(const std::string& text) {
  return comes_true([&] { return screen().find(text) != std::string::npos; });
}

bool TerminalProcess::line_by_line() const {
  termios settings{};
  tcgetattr(master_, &settings);
  return (settings.c_lflag & ICANON) != 0 && (settings.c_lflag & ECHO) != 0;
}

bool TerminalProcess::stopped() const {
  std::ifstream stat("/proc/" + std::to_string(job_) + "/stat");
  std::string pid;
  std::string name;
  std::string state;
  stat >> pid >> name >> state;
  return state == "T";
}

int TerminalProcess::wait() {
  int status = 0;
  ended_ = comes_true([&] { return waitpid(shell_, &status, WNOHANG) == shell_; });
  if (!ended_) kill(job_, SIGKILL);
  return ended_ ? WEXITSTATUS(status) : -1;
}

/// Ends with the last process that has the terminal open.
void TerminalProcess::read_screen() {
  std::array<char, 1024> bytes{};
  for (;;) {
    const ssize_t count = read(master_, bytes.data(), bytes.size());
    if (count <= 0) return;
    const std::lock_guard lock(mutex_);
    screen_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace lensforge::scenario

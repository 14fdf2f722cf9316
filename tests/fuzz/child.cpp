// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/child.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <system_error>
#include <thread>
#include <utility>

#include "app/frame/command_line.h"

namespace lensforge::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kPoll{1};

void limit(int what, rlim_t value) {
  const rlimit limits{value, value};
  setrlimit(static_cast<__rlimit_resource>(what), &limits);
}

void put(int opened, int descriptor) {
  if (opened == descriptor) return;
  dup2(opened, descriptor);
  close(opened);
}

/// A pipe's end whose other end is closed.
int broken_pipe(int end) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) _exit(126);
  close(ends.at(static_cast<std::size_t>(1 - end)));
  return ends.at(static_cast<std::size_t>(end));
}

void set_stream(int descriptor, Stream stream, const fs::path& usual) {
  const bool in = descriptor == STDIN_FILENO;
  switch (stream) {
    case Stream::kClosed:
      close(descriptor);
      return;
    case Stream::kFull:
      return put(open("/dev/full", in ? O_RDONLY : O_WRONLY), descriptor);
    case Stream::kBroken:
      return put(broken_pipe(in ? 0 : 1), descriptor);
    case Stream::kUsual:
      return put(open(usual.c_str(), in ? O_RDONLY : O_WRONLY | O_CREAT | O_TRUNC, 0600),
                 descriptor);
  }
}

/// Whatever the campaign has open is not the command's business.
void close_the_rest() {
  for (int descriptor = STDERR_FILENO + 1; descriptor < 256; ++descriptor) close(descriptor);
}

std::vector<char*> pointers(Arguments& words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  return argv;
}

/// In the child: what the shell and main() do.
[[noreturn]] void become_command(const Command& command, const fs::path& folder,
                                 const fs::path& record) {
  setpgid(0, 0);
  if (chdir(folder.c_str()) != 0) _exit(126);
  close_the_rest();
  set_stream(STDIN_FILENO, command.in, "/dev/null");
  set_stream(STDOUT_FILENO, command.out, record.string() + ".out");
  set_stream(STDERR_FILENO, command.err, record.string() + ".err");
#ifndef __SANITIZE_ADDRESS__  // It maps terabytes that it never touches.
  limit(RLIMIT_AS, kMaxMemory);
#endif
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, command.file_size_limit > 0 ? command.file_size_limit : kMaxFile);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, SIG_DFL);
  Arguments words = command.arguments;
  words.insert(words.begin(), LENSFORGE_COMMAND);
  std::vector<char*> argv = pointers(words);
  if (command.exec) {
    execv(argv.front(), argv.data());
    _exit(127);
  }
  const int code = app::run_main(static_cast<int>(words.size()), argv.data());
  std::cout.flush();
  std::fflush(nullptr);
  // Not exit(): a logging library that comes with the picture reader joins threads there which a
  // forked process does not have. Runs with `exec` do that part.
  _exit(code);
}

}  // namespace

std::string file_content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

Child::Child(const Command& command, const fs::path& folder, fs::path record)
    : record_(std::move(record)) {
  std::fflush(nullptr);
  pid_ = fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0) become_command(command, folder, record_);
  setpgid(pid_, pid_);
}

Child::~Child() {
  kill(-pid_, SIGKILL);
  if (!ended_) waitpid(pid_, &status_, 0);
}

double Child::age() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

bool Child::ended_within(double seconds) {
  const double end = age() + seconds;
  while (!ended_) {
    ended_ = waitpid(pid_, &status_, WNOHANG) == pid_;
    if (ended_ || age() >= end) break;
    std::this_thread::sleep_for(kPoll);
  }
  return ended_;
}

Ending Child::wait(double budget, int signal) {
  Ending ending;
  if (!ended_within(budget)) {
    ending.asked = signal;
    const double sent = age();
    kill(pid_, signal);
    ending.killed = !ended_within(kMaxStop);
    ending.stop_seconds = age() - sent;
    if (ending.killed) kill(-pid_, SIGKILL);
    if (ending.killed) ended_ = waitpid(pid_, &status_, 0) == pid_;
  }
  ending.seconds = age();
  if (WIFEXITED(status_)) ending.exit_code = WEXITSTATUS(status_);
  if (WIFSIGNALED(status_)) ending.signal = WTERMSIG(status_);
  ending.out = file_content(record_.string() + ".out");
  ending.err = file_content(record_.string() + ".err");
  return ending;
}

Ending run_to_end(const Command& command, const fs::path& folder, const fs::path& record) {
  return Child(command, folder, record).wait(kMaxPreparation, SIGTERM);
}

}  // namespace lensforge::fuzz

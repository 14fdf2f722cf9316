// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/child_process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>

#include "core/error.h"

namespace lensforge::bench {
namespace {

constexpr int kCannotRun = 127;  ///< As a shell says it.

void redirect(int descriptor, const char* file) {
  const int opened = open(file, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (opened < 0 || dup2(opened, descriptor) < 0) _exit(kCannotRun);
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

std::string reason() { return std::system_category().message(errno); }

}  // namespace

ChildResult run_child(const std::vector<std::string>& words, const std::filesystem::path& out,
                      const std::filesystem::path& err) {
  std::vector<std::string> copy = words;
  std::vector<char*> argv;
  argv.reserve(copy.size() + 1);
  for (std::string& word : copy) argv.push_back(word.data());
  argv.push_back(nullptr);
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = fork();
  if (child < 0) throw RunError(words.front() + ": " + reason());
  if (child == 0) {
    redirect(STDOUT_FILENO, out.c_str());
    redirect(STDERR_FILENO, err.c_str());
    execv(argv.front(), argv.data());
    _exit(kCannotRun);
  }
  int status = 0;
  rusage used{};
  while (wait4(child, &status, 0, &used) < 0) {
    if (errno != EINTR) throw RunError(words.front() + ": " + reason());
  }
  ChildResult result;
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  result.wall_seconds = wall.count();
  result.cpu_seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
  result.peak_mib = static_cast<double>(used.ru_maxrss) / 1024.0;
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

}  // namespace lensforge::bench

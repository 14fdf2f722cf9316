// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/step_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <string>
#include <system_error>
#include <vector>

#include "core/error.h"
#include "core/io/descriptor.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

constexpr int kSignalBase = 128;
constexpr int kCannotStart = 127;

[[noreturn]] void fail(const std::string& what) {
  throw RunError(what + ": " + std::generic_category().message(errno));
}

Descriptor open_output(const fs::path& path, int how) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | how, 0644));
  if (!file.open()) fail(path.string());
  return file;
}

/// What execv() takes.
struct CommandLine {
  explicit CommandLine(const Arguments& words) : words_(words) {
    for (std::string& word : words_) pointers_.push_back(word.data());
    pointers_.push_back(nullptr);
  }
  [[nodiscard]] char* const* pointers() const { return pointers_.data(); }

 private:
  Arguments words_;
  std::vector<char*> pointers_;
};

/// The child's way to its program: only what may be called between fork() and execv(). It has a
/// process group of its own, so that Ctrl-C on the terminal reaches it once, through the parent.
[[noreturn]] void become(const char* program, const CommandLine& command, int in, int out, int err,
                         pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGINT);
  if (::getppid() != parent) ::_exit(kCannotStart);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) {
    std::signal(signal, signal == SIGXFSZ || signal == SIGPIPE ? SIG_IGN : SIG_DFL);
  }
  ::dup2(in, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(err, STDERR_FILENO);
  ::execv(program, command.pointers());
  ::_exit(kCannotStart);
}

int wait_for(pid_t child, const std::stop_token& stop) {
  {
    // Not reaped before nobody signals it any more: its number could be another process's then.
    const std::stop_callback interrupt(stop, [child] { ::kill(child, SIGINT); });
    siginfo_t ended{};
    while (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOWAIT) != 0) {
      if (errno != EINTR) fail("waitid");
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : kSignalBase + WTERMSIG(status);
}

}  // namespace

StepEnd run_step(const Arguments& words, const fs::path& out, const fs::path& log,
                 const std::stop_token& stop) {
  const auto start = std::chrono::steady_clock::now();
  const std::string program = fs::read_symlink("/proc/self/exe").string();
  Arguments all{program};
  all.insert(all.end(), words.begin(), words.end());
  const CommandLine command(all);
  const Descriptor result = open_output(out, O_TRUNC);
  const Descriptor messages = open_output(log, O_APPEND);
  const Descriptor nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) fail("fork");
  if (child == 0) {
    become(program.c_str(), command, nothing.number(), result.number(), messages.number(), parent);
  }
  const int code = wait_for(child, stop);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  return {code, spent.count()};
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/frame/child_command.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

constexpr int kSignalBase = 128;
constexpr int kCannotStart = 127;

[[noreturn]] void fail(const std::string& what) {
  throw RunError(what + ": " + system_reason(errno));
}

Descriptor open_output(const fs::path& path, int how) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | how, 0644));
  if (!file.open()) fail(path.string());
  return file;
}

/// Arguments of execv().
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

/// Holds back the signals that stop a program while it lives. Between fork() and execv() they would
/// end in the parent's handlers, and be lost.
class StopsHeld {
 public:
  StopsHeld() {
    sigset_t stops;
    sigemptyset(&stops);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&stops, signal);
    ::pthread_sigmask(SIG_BLOCK, &stops, &before_);
  }
  ~StopsHeld() { release(); }
  StopsHeld(const StopsHeld&) = delete;
  StopsHeld& operator=(const StopsHeld&) = delete;

  void release() const { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

/// Starts the program in the child, with only the calls allowed between fork() and execv(). The
/// child has its own process group: Ctrl-C on the terminal reaches it once, through the parent.
[[noreturn]] void become(const char* program, const CommandLine& command, const char* folder,
                         const std::array<int, 3>& streams, pid_t parent, const StopsHeld& held) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGINT);
  if (::getppid() != parent) ::_exit(kCannotStart);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ}) {
    std::signal(signal, signal == SIGXFSZ || signal == SIGPIPE ? SIG_IGN : SIG_DFL);
  }
  held.release();
  if (folder[0] != '\0' && ::chdir(folder) != 0) ::_exit(kCannotStart);
  ::dup2(streams[0], STDIN_FILENO);
  ::dup2(streams[1], STDOUT_FILENO);
  ::dup2(streams[2], STDERR_FILENO);
  // Sockets of libraries that do not close them here would outlive the parent.
  ::close_range(STDERR_FILENO + 1, ~0U, 0);
  ::execv(program, command.pointers());
  ::_exit(kCannotStart);
}

int wait_for(pid_t child, const std::stop_token& stop) {
  {
    // Reaped only after the last possible signal: its number could then belong to another process.
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

Arguments own_program() { return {fs::read_symlink("/proc/self/exe").string()}; }

}  // namespace

ChildEnd run_child(const ChildCommand& child, const std::stop_token& stop) {
  const auto start = std::chrono::steady_clock::now();
  Arguments all = child.program.empty() ? own_program() : child.program;
  all.insert(all.end(), child.words.begin(), child.words.end());
  const CommandLine command(all);
  const Descriptor result = open_output(child.out, O_TRUNC);
  const Descriptor messages = open_output(child.log, O_APPEND);
  const Descriptor nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  const int input = child.input >= 0 ? child.input : nothing.number();
  const std::string folder = child.folder.string();
  const pid_t parent = ::getpid();
  pid_t process = -1;
  {
    const StopsHeld held;
    process = ::fork();
    if (process == 0) {
      become(all.front().c_str(), command, folder.c_str(),
             {input, result.number(), messages.number()}, parent, held);
    }
  }
  if (process < 0) fail("fork");
  const int code = wait_for(process, stop);
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  return {code, spent.count()};
}

std::string last_line(std::string_view text) {
  text = text.substr(0, text.find_last_not_of("\n\r ") + 1);  // npos + 1 is 0.
  std::string_view line = text.substr(text.find_last_of('\n') + 1);
  constexpr std::string_view kProgram = "lensforge: ";
  if (line.starts_with(kProgram)) line.remove_prefix(kProgram.size());
  return std::string(line);
}

nlohmann::json json_in(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  nlohmann::json value = nlohmann::json::parse(stream, nullptr, false);
  return value.is_discarded() ? nlohmann::json() : value;
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/driver.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <sstream>
#include <thread>

namespace lensforge::scenario {
namespace {

constexpr std::chrono::milliseconds kPoll{2};

fs::path make_folder() {
  std::string name = ::testing::TempDir() + "lensforge-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for the test");
  return name;
}

void redirect(int descriptor, const fs::path& file) {
  const int opened = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  dup2(opened, descriptor);
  close(opened);
}

/// In the child: defaults for signals that a caller may have ignored, then the command.
[[noreturn]] void become_command(std::vector<char*>& argv, const fs::path& folder,
                                 unsigned long file_size_limit) {
  redirect(STDOUT_FILENO, folder / "out");
  redirect(STDERR_FILENO, folder / "err");
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, SIG_DFL);
  if (file_size_limit > 0) {
    const rlimit limit{file_size_limit, file_size_limit};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  execv(argv.front(), argv.data());
  _exit(127);
}

}  // namespace

Process::Process(const Arguments& arguments, unsigned long file_size_limit)
    : folder_(make_folder()) {
  Arguments words = arguments;
  words.insert(words.begin(), LENSFORGE_COMMAND);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) become_command(argv, folder_, file_size_limit);
}

Process::~Process() {
  if (!ended_) {
    send(SIGKILL);
    reap(0);
  }
  fs::remove_all(folder_);
}

void Process::send(int signal) const { kill(pid_, signal); }

bool Process::catches(int signal) const {
  const std::string status = content("/proc/" + std::to_string(pid_) + "/status");
  const std::string field = "SigCgt:\t";
  const std::size_t at = status.find(field);
  if (at == std::string::npos) return false;
  const unsigned long long caught = std::stoull(status.substr(at + field.size(), 16), nullptr, 16);
  return (caught >> static_cast<unsigned>(signal - 1) & 1U) != 0;
}

void Process::kill_all() const {
  std::vector<pid_t> children;
  const fs::path tasks = "/proc/" + std::to_string(pid_) + "/task";
  send(SIGSTOP);  // It makes no more of them.
  for (const auto& task : fs::directory_iterator(tasks)) {
    std::istringstream numbers(content(task.path() / "children"));
    for (pid_t child = 0; numbers >> child;) children.push_back(child);
  }
  for (const pid_t child : children) kill(child, SIGKILL);
  send(SIGKILL);
}

bool Process::reap(int options) {
  if (!ended_) ended_ = waitpid(pid_, &status_, options) == pid_;
  return ended_;
}

bool Process::runs_for(std::chrono::milliseconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  while (!reap(WNOHANG) && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(kPoll);
  }
  return !ended_;
}

std::string Process::said() const { return content(folder_ / "err"); }

Outcome Process::wait(std::chrono::seconds limit) {
  if (runs_for(limit)) {
    ADD_FAILURE() << "still running after " << limit.count() << " s";
    send(SIGKILL);
    reap(0);
  }
  Outcome outcome;
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start_;
  outcome.seconds = spent.count();
  if (WIFEXITED(status_)) outcome.exit_code = WEXITSTATUS(status_);
  if (WIFSIGNALED(status_)) outcome.signal = WTERMSIG(status_);
  outcome.out = content(folder_ / "out");
  outcome.err = content(folder_ / "err");
  return outcome;
}

Outcome run(const Arguments& arguments, unsigned long file_size_limit) {
  return Process(arguments, file_size_limit).wait();
}

Scenario::Scenario() : folder_(make_folder()) {}

Scenario::~Scenario() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

std::string picture(const std::string& name) {
  return (fs::path(LENSFORGE_PICTURES) / name).string();
}

Arguments small_design(const std::string& target, const std::string& out) {
  return {"design", target,     "--out", out,         "--pixels", "32",        "--model",
          "facet",  "--rounds", "2",     "--quality", "draft",    "--threads", "2"};
}

void place_small_lens(const fs::path& folder) {
  struct Kept {
    fs::path folder = make_folder();
    Outcome made = run(small_design(picture("stripes.png"), (folder / "lens").string()));
    ~Kept() {
      std::error_code ignored;
      fs::remove_all(folder, ignored);
    }
  };
  static const Kept kept;
  ASSERT_EQ(kept.made.exit_code, 0) << kept.made.err;
  fs::copy(kept.folder / "lens", folder, fs::copy_options::recursive);
}

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write(const fs::path& file, const std::string& content) {
  std::ofstream(file, std::ios::binary) << content;
}

nlohmann::json json_printed_by(const std::string& command) {
  FILE* const output = popen(command.c_str(), "r");
  std::string text;
  for (int c = std::fgetc(output); c != EOF; c = std::fgetc(output)) {
    text.push_back(static_cast<char>(c));
  }
  EXPECT_EQ(pclose(output), 0) << command;
  return nlohmann::json::parse(text, nullptr, false);
}

void expect_refusal(const Outcome& outcome, int exit_code, const std::vector<std::string>& parts) {
  EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_THAT(outcome.err, ::testing::StartsWith("lensforge: "));
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_THAT(outcome.err, ::testing::EndsWith("\n"));
  for (const std::string& part : parts) EXPECT_THAT(outcome.err, ::testing::HasSubstr(part));
}

std::vector<std::string> listing(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace lensforge::scenario

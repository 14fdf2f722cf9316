// SPDX-License-Identifier: GPL-3.0-or-later
// Hostile runs of every command, see README.md for the variables that steer them.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/statvfs.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "fuzz/campaign_run.h"

namespace lensforge::fuzz {
namespace {

namespace fs = std::filesystem;

/// Enough for every kind, in about a minute.
constexpr std::uint64_t kUsualRuns = 300;
constexpr std::size_t kSlowestShown = 5;
/// Memory for the sandboxes of a few runs at once.
constexpr std::uintmax_t kMemoryNeeded = 512U << 20U;

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// Files that are flushed to a disk cost more time than all the rest.
fs::path fast_folder() {
  const fs::path memory = "/dev/shm";
  std::error_code none;
  const bool roomy = fs::space(memory, none).available > kMemoryNeeded && !none;
  return roomy ? memory : fs::temp_directory_path();
}

/// A folder of the campaign's own.
class Folder {
 public:
  Folder() {
    std::string name = (fast_folder() / "lensforge-fuzz-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder " + name);
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

Campaign asked_for() {
  Campaign campaign;
  campaign.seed = from_environment("LENSFORGE_CAMPAIGN_SEED", 1);
  campaign.first = from_environment("LENSFORGE_CAMPAIGN_FIRST", 0);
  campaign.runs = from_environment("LENSFORGE_CAMPAIGN", kUsualRuns);
  if (std::getenv("LENSFORGE_CAMPAIGN_ONLY") != nullptr) {
    campaign.first = from_environment("LENSFORGE_CAMPAIGN_ONLY", 0);
    campaign.runs = 1;
  }
  campaign.budget = static_cast<double>(from_environment("LENSFORGE_CAMPAIGN_BUDGET", 3));
  campaign.exec = from_environment("LENSFORGE_CAMPAIGN_EXEC", 0) != 0;
  if (const char* kind = std::getenv("LENSFORGE_CAMPAIGN_KIND")) campaign.kind = kind;
  const char* kept = std::getenv("LENSFORGE_CAMPAIGN_KEEP");
  campaign.kept =
      kept != nullptr ? fs::path(kept) : fs::temp_directory_path() / "lensforge-fuzz-kept";
  return campaign;
}

void report_at_once(const Campaign& campaign, const RunResult& result) {
  std::string text = "run " + std::to_string(result.run) + ", " + result.kind + ": " +
                     result.command.substr(0, 600) + "\n";
  for (const std::string& wrong : result.wrong) text += "    " + wrong + "\n";
  text += "    repeat: " + repeat_line(campaign, result.run) + "\n";
  std::fputs(text.c_str(), stderr);
}

/// In a worker: takes the next run until there is none, and writes down what came of it.
void work(const Campaign& campaign, const BaseSet& base, const fs::path& folder,
          const fs::path& record, std::atomic<std::uint64_t>& next) {
  std::ofstream stream(record);
  for (std::uint64_t i = next++; i < campaign.first + campaign.runs; i = next++) {
    const RunResult result = run_one(campaign, base, i, folder);
    if (!result.wrong.empty()) report_at_once(campaign, result);
    stream << to_json(result).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
           << std::endl;
  }
}

/// Starts a worker for each processor and waits for all of them.
std::vector<RunResult> carry_out(const Campaign& campaign, const BaseSet& base,
                                 const fs::path& folder) {
  void* shared = mmap(nullptr, sizeof(std::atomic<std::uint64_t>), PROT_READ | PROT_WRITE,
                      MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  auto* next = new (shared) std::atomic<std::uint64_t>(campaign.first);
  const std::size_t workers = std::max(1U, std::thread::hardware_concurrency());
  std::fflush(nullptr);
  for (std::size_t i = 0; i < workers; ++i) {
    if (fork() != 0) continue;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
      work(campaign, base, folder, folder / ("results-" + std::to_string(i)), *next);
    } catch (const std::exception& e) {
      std::fprintf(stderr, "the campaign itself failed: %s\n", e.what());
      std::_Exit(1);
    }
    std::_Exit(0);
  }
  std::vector<RunResult> results;
  for (std::size_t i = 0; i < workers; ++i) {
    int status = 0;
    wait(&status);
    EXPECT_EQ(status, 0) << "a worker of the campaign failed";
  }
  for (std::size_t i = 0; i < workers; ++i) {
    std::ifstream stream(folder / ("results-" + std::to_string(i)));
    for (std::string line; std::getline(stream, line);) {
      results.push_back(result_of(nlohmann::json::parse(line)));
    }
  }
  return results;
}

/// One row of the table.
struct Row {
  int runs = 0;
  int broken = 0;
  double seconds = 0.0;
  std::map<int, int> codes;
};

void print_table(const std::vector<RunResult>& results) {
  std::map<std::string, Row> table;
  for (const RunResult& result : results) {
    for (const std::string& name : {result.kind, std::string("~ all")}) {
      Row& row = table[name];
      ++row.runs;
      row.broken += result.wrong.empty() ? 0 : 1;
      row.seconds += result.seconds;
      for (const int code : result.codes) ++row.codes[code];
    }
  }
  std::printf("%-28s %6s %6s %8s  %s\n", "kind", "runs", "broken", "seconds",
              "exit codes (signals below 0)");
  for (const auto& [name, row] : table) {
    std::string codes;
    for (const auto& [code, count] : row.codes) {
      codes += std::to_string(code) + ": " + std::to_string(count) + "  ";
    }
    std::printf("%-28s %6d %6d %8.1f  %s\n", name.c_str(), row.runs, row.broken, row.seconds,
                codes.c_str());
  }
}

void print_slowest(std::vector<RunResult> results) {
  const auto slower = [](const RunResult& a, const RunResult& b) {
    return a.stop_seconds > b.stop_seconds;
  };
  std::sort(results.begin(), results.end(), slower);
  std::vector<double> stops;
  for (const RunResult& result : results) {
    if (result.stop_seconds >= 0.0) stops.push_back(result.stop_seconds);
  }
  if (stops.empty()) return;
  std::printf("%zu stopped by a signal: half within %.3f s, 9 of 10 within %.3f s; the slowest:\n",
              stops.size(), stops[stops.size() / 2], stops[stops.size() / 10]);
  for (std::size_t i = 0; i < std::min(kSlowestShown, stops.size()); ++i) {
    std::printf("  %.2f s  run %llu: %s\n", stops[i],
                static_cast<unsigned long long>(results[i].run),
                results[i].command.substr(0, 160).c_str());
  }
}

/// What was broken, without its names and numbers.
std::string cause_of(const RunResult& result, const std::string& wrong) {
  std::string cause = wrong.substr(0, wrong.find_first_of("\"0123456789"));
  const std::size_t path = cause.find_last_of('/');
  if (path != std::string::npos) cause = wrong.substr(0, cause.find(' ') + 1) + "...";
  return cause + "  [" + result.kind + "]";
}

void print_causes(const std::vector<RunResult>& results) {
  std::map<std::string, std::vector<std::uint64_t>> causes;
  for (const RunResult& result : results) {
    for (const std::string& wrong : result.wrong) {
      std::vector<std::uint64_t>& runs = causes[cause_of(result, wrong)];
      if (runs.empty() || runs.back() != result.run) runs.push_back(result.run);
    }
  }
  for (const auto& [cause, runs] : causes) {
    std::printf("%5zu times, first run %llu: %s\n", runs.size(),
                static_cast<unsigned long long>(runs.front()), cause.c_str());
  }
}

TEST(FuzzCampaign, NoInputBreaksARule) {
  const Campaign campaign = asked_for();
  const Folder folder;
  fs::create_directories(folder.path() / "base");
  const BaseSet base(folder.path() / "base");
  const std::vector<RunResult> results = carry_out(campaign, base, folder.path());
  EXPECT_EQ(results.size(), campaign.runs);
  print_table(results);
  print_causes(results);
  print_slowest(results);
  for (const RunResult& result : results) {
    for (const std::string& wrong : result.wrong) {
      ADD_FAILURE() << "run " << result.run << ", " << result.kind << ": " << wrong
                    << "\n    repeat: " << repeat_line(campaign, result.run) << "\n    kept: "
                    << (campaign.kept / ("run-" + std::to_string(result.run))).string();
    }
  }
}

}  // namespace
}  // namespace lensforge::fuzz

/// A program that forks must have no threads; the linear algebra would start some before main().
int main(int argc, char** argv) {
  const char* const kThreads = "OPENBLAS_NUM_THREADS";
  if (std::getenv(kThreads) == nullptr) {
    setenv(kThreads, "1", 1);
    execv("/proc/self/exe", argv);
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}

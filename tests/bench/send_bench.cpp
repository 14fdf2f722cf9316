// SPDX-License-Identifier: GPL-3.0-or-later
// Speed of the sender with a controller that accepts every line at once, cost of the journal, and
// memory for five million lines. LENSFORGE_SEND_LINES sets another number.
#include <sys/resource.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <istream>
#include <memory>
#include <streambuf>
#include <string>

#include "core/temp_folder.h"
#include "machine/fast_controller.h"
#include "machine/link/link.h"
#include "machine/stream/journal.h"
#include "machine/stream/program_facts.h"
#include "machine/stream/program_feed.h"
#include "machine/stream/sender.h"

namespace lensforge::bench {
namespace {

/// A program of any length that is nowhere stored.
class EndlessProgram : public std::streambuf {
 public:
  explicit EndlessProgram(std::int64_t lines) : lines_(lines) {}

 protected:
  int_type underflow() override {
    if (line_ > lines_) return traits_type::eof();
    text_.clear();
    while (text_.size() < kPiece && line_ <= lines_) add_line();
    setg(text_.data(), text_.data(), text_.data() + text_.size());
    return traits_type::to_int_type(text_.front());
  }

 private:
  static constexpr std::size_t kPiece = 1 << 16;

  void add_line() {
    std::array<char, 64> line{};
    const std::int64_t i = line_++;
    if (i == 1) text_ += "G21 G90\n";
    if (i == 2) text_ += "S12000 M3\n";
    if (i == 3) text_ += "G1 X0 Y0 Z0 F500\n";
    if (i <= 3) return;
    if (i == lines_) {
      text_ += "M2\n";
      return;
    }
    const double x = 0.06 * static_cast<double>(i % 1000);
    std::snprintf(line.data(), line.size(), "X%.5f Z%.5f\n", x, -0.5 - 0.001 * x);
    text_ += line.data();
  }

  std::int64_t lines_;
  std::int64_t line_ = 1;
  std::string text_;
};

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double peak_megabytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

struct Run {
  const char* name;
  bool counting;
  bool journal;
};

void send(const Run& run, std::int64_t lines) {
  testing::FastController controller;
  controller.keep_lines = false;
  SteadyClock clock;
  Wire wire(controller);
  Dialogue dialogue(wire, clock, {});
  const ControllerInfo info = learn_controller(dialogue, dialogue.reset());
  const testing::TempFolder folder;
  std::unique_ptr<Journal> journal;
  if (run.journal) {
    journal = Journal::create(folder / "job.journal", {std::string(64, 'a'), 1, "bench"}, {});
  }
  EndlessProgram program(lines);
  std::istream stream(&program);
  ProgramFeed feed(stream, {info.dialect, true, info.start, 1, 0, {}});
  SenderOptions options;
  options.character_counting = run.counting;
  Sender sender({wire, clock, nullptr, journal.get()}, info, options, 1);
  const double begin = clock.now();
  const double cpu = cpu_seconds();
  const SendResult result = sender.run(feed, {});
  // The start and the end wait for reports; what they wait is no work.
  std::printf("%-34s %9lld lines  %6.2f s  %6.2f s CPU  %9.0f lines/s CPU  peak %5.1f MB  %s\n",
              run.name, static_cast<long long>(result.acknowledged), clock.now() - begin,
              cpu_seconds() - cpu, static_cast<double>(result.acknowledged) / (cpu_seconds() - cpu),
              peak_megabytes(), result.done() ? "done" : result.reason.c_str());
}

void examine(std::int64_t lines) {
  EndlessProgram program(lines);
  std::istream stream(&program);
  FactsOptions options;
  options.dialect = grbl_dialect();
  const double cpu = cpu_seconds();
  const ProgramFacts facts = examine_program(stream, options, {});
  std::printf("%-34s %9lld lines  %6.2f s CPU, peak %.1f MB\n", "pre-flight with time estimate",
              static_cast<long long>(facts.lines), cpu_seconds() - cpu, peak_megabytes());
}

int run_all() {
  const char* given = std::getenv("LENSFORGE_SEND_LINES");
  const std::int64_t lines = given != nullptr ? std::strtoll(given, nullptr, 10) : 5'000'000;
  send({"warm-up", false, false}, lines / 50);
  for (const Run& run :
       {Run{"send-response", false, false}, Run{"send-response, journal", false, true},
        Run{"character counting", true, false}, Run{"character counting, journal", true, true}}) {
    send(run, lines);
  }
  examine(lines);
  return 0;
}

}  // namespace
}  // namespace lensforge::bench

int main() { return lensforge::bench::run_all(); }

// SPDX-License-Identifier: GPL-3.0-or-later
// Faults at random bytes of a job, each followed by a resume. LENSFORGE_CAMPAIGN sets the number of
// runs (1,020 for the whole campaign), LENSFORGE_CAMPAIGN_FIRST the first of them.
#include "machine/campaign.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "core/temp_folder.h"
#include "core/text/words.h"

namespace lensforge::campaign {
namespace {

/// Enough for every mishap in each dialect and mode.
constexpr std::uint64_t kUsualRuns = 68;

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

std::string description(std::uint64_t index) {
  const Case what = case_of(index);
  return "run " + std::to_string(index) + ": " + mishap_name(what.mishap) +
         (what.hal ? ", grblHAL" : ", Grbl") +
         (what.counting ? ", character counting" : ", send-response") +
         (what.numbered ? "" : ", no Ln:");
}

/// One row of the table.
struct Row {
  int runs = 0;
  int struck = 0;
  int finished = 0;
  int resumed = 0;
  int violations = 0;
  int spoilt = 0;
  std::int64_t overlap = 0;
  std::map<std::string, int> causes;
};

void print(const std::map<Mishap, Row>& table) {
  std::printf("%-15s %5s %7s %9s %8s %9s %7s %12s  %s\n", "mishap", "runs", "struck", "unharmed",
              "resumed", "broken", "spoilt", "lines twice", "stopped for");
  for (const auto& [mishap, row] : table) {
    std::string causes;
    for (const auto& [cause, count] : row.causes) {
      causes = with_word(causes, cause + " " + std::to_string(count));
    }
    std::printf("%-15s %5d %7d %9d %8d %9d %7d %12.1f  %s\n", mishap_name(mishap).c_str(), row.runs,
                row.struck, row.finished, row.resumed, row.violations, row.spoilt,
                row.resumed > 0 ? static_cast<double>(row.overlap) / row.resumed : 0.0,
                causes.c_str());
  }
}

void add(const Outcome& outcome, Row& row) {
  ++row.runs;
  row.struck += outcome.struck ? 1 : 0;
  row.finished += outcome.finished_at_once ? 1 : 0;
  row.resumed += outcome.resumed ? 1 : 0;
  row.violations += outcome.violations.empty() ? 0 : 1;
  row.spoilt += outcome.spoilt ? 1 : 0;
  row.overlap += outcome.overlap;
  if (outcome.finished_at_once) return;
  const std::string cause(outcome.cause == StopCause::kNone ? "killed" : cause_name(outcome.cause));
  ++row.causes[cause];
}

TEST(Campaign, NoFaultBreaksTheJob) {
  const std::uint64_t runs = from_environment("LENSFORGE_CAMPAIGN", kUsualRuns);
  const std::uint64_t first = from_environment("LENSFORGE_CAMPAIGN_FIRST", 0);
  std::map<Mishap, Row> table;
  for (std::uint64_t i = first; i < first + runs; ++i) {
    const testing::TempFolder folder;
    Outcome outcome;
    ASSERT_NO_THROW(outcome = run_case(case_of(i), folder.path())) << description(i);
    add(outcome, table[case_of(i).mishap]);
    for (const std::string& violation : outcome.violations) {
      ADD_FAILURE() << description(i) << ": " << violation;
    }
  }
  print(table);
}

}  // namespace
}  // namespace lensforge::campaign

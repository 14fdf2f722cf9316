// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/send.h"

#include <gmock/gmock.h>

#include <chrono>

#include "core/error.h"
#include "core/temp_folder.h"
#include "machine/stream/journal.h"

namespace lensforge {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::message_of;
using testing::TempFolder;

constexpr const char* kProgram =
    "G21 G90\nS12000 M3\nG0 X10 Y10 Z5\nG1 Z-1 F300\nX50 F600\nG0 Z5\nM5\nM2\n";

class SendJob : public ::testing::Test {
 protected:
  SendJob() { testing::write_bytes(program_, kProgram); }

  TempFolder folder_;
  std::filesystem::path program_ = folder_ / "job.ngc";
};

SendOptions simulated() {
  SendOptions options;
  options.port = "sim:grbl";
  return options;
}

/// Notes what it is told.
struct Notes : JobWatcher {
  void opened(const JobIdentity& program) override { add("opened " + program.name); }
  void connected(const ControllerInfo& controller) override {
    add("connected " + controller.dialect.name);
  }
  void examined(const ProgramFacts& facts, const Findings& /*findings*/) override {
    add("examined " + std::to_string(facts.lines));
  }
  void began(const SendSummary& so_far, std::int64_t first_byte) override {
    add("began " + std::to_string(first_byte) + " of " + std::to_string(so_far.job.bytes));
  }
  void took(const SendEvent& /*event*/) override { events += 1; }
  void ended(const SendResult& result) override { add("ended " + std::to_string(result.executed)); }
  [[nodiscard]] std::vector<NamedFile> files() const override { return written; }

  void add(const std::string& text) { said.push_back(text); }

  std::vector<NamedFile> written;
  std::vector<std::string> said;
  int events = 0;
};

TEST_F(SendJob, ASimulatedMillKeepsTheSpeedThatIsAsked) {
  SendOptions options = simulated();
  options.port = "sim:grbl@100x";
  JobWatcher nobody;
  const auto start = std::chrono::steady_clock::now();
  const SendSummary summary = send_job(program_.string(), options, nobody, {}, {});
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  ASSERT_TRUE(summary.result && summary.result->done());
  EXPECT_GT(summary.result->seconds, 10.0);
  EXPECT_GE(spent.count(), summary.result->seconds / 100.0);
}

TEST_F(SendJob, RefusesASpeedThatIsNone) {
  JobWatcher nobody;
  for (const char* port : {"sim:grbl@0x", "sim:grbl@", "sim:grbl@fast", "sim:grbl@-1x",
                           "sim:grbl@1e9x", "sim:grbl@5"}) {
    SendOptions options = simulated();
    options.port = port;
    EXPECT_THAT(message_of<InputError>([&] { send_job(program_, options, nobody); }),
                HasSubstr("--port sim:"));
  }
}

TEST_F(SendJob, AProgramThatLinksTheLibrarySendsAsTheCommandDoes) {
  Notes notes;
  const SendSummary summary = send_job(program_, simulated(), notes);
  ASSERT_TRUE(summary.result.has_value());
  EXPECT_TRUE(summary.result->done()) << summary.result->reason;
  EXPECT_EQ(summary.result->executed, 8);
  EXPECT_THAT(notes.said, ElementsAre("opened job.ngc", "connected grbl", "examined 8",
                                      "began 0 of 65", "ended 8"));
  EXPECT_GT(notes.events, 0);
  EXPECT_TRUE(read_journal(program_.string() + ".journal").finished);
}

TEST_F(SendJob, ADryRunWithoutAPortTouchesNothing) {
  SendOptions options;
  options.dry_run = true;
  JobWatcher nobody;
  const SendSummary summary = send_job(program_, options, nobody);
  EXPECT_FALSE(summary.result.has_value());
  EXPECT_EQ(summary.facts.lines, 8);
  EXPECT_GT(summary.facts.time.seconds, options.spin_up);
  EXPECT_EQ(folder_.file_count(), 1U);
}

/// What is said of a program without a controller.
std::vector<std::string> warnings_of(const std::filesystem::path& file, const std::string& program,
                                     SendOptions options = {}) {
  testing::write_bytes(file, program);
  options.dry_run = true;
  JobWatcher nobody;
  return send_job(file, options, nobody).findings.warnings;
}

constexpr const char* kCut = "G21 G90\nS12000 M3\nG0 X10 Y10 Z5\nG1 Z-1 F300\n";

TEST_F(SendJob, ADryRunAloneWarnsOfHowAProgramEnds) {
  const std::string cut = kCut;
  EXPECT_THAT(warnings_of(program_, cut + "M5\nM2\n"), IsEmpty());
  EXPECT_THAT(warnings_of(program_, cut + "M5\n"), ElementsAre(HasSubstr("no end")));
  EXPECT_THAT(warnings_of(program_, cut),
              ElementsAre(HasSubstr("ends with the spindle on"), HasSubstr("no end")));
  EXPECT_THAT(warnings_of(program_, "%\n" + cut + "%\n"),
              ElementsAre(HasSubstr("ends with the spindle on")));
}

TEST_F(SendJob, CommentsThatAControllerWouldActOnAreLeftOutAndSaid) {
  const std::string program = "(Fr\xC3\xA4ser!)\n" + std::string(kCut) + "M5 ;~\x18\nM2\n";
  EXPECT_THAT(warnings_of(program_, program),
              ElementsAre(HasSubstr("line 1 and 1 more have a comment with bytes on which")));
  JobWatcher nobody;
  const SendSummary summary = send_job(program_, simulated(), nobody);
  EXPECT_TRUE(summary.result->done()) << summary.result->reason;
  EXPECT_EQ(summary.result->executed, 7);
}

TEST_F(SendJob, AToolsNumberAloneIsSentToGrbl) {
  EXPECT_THAT(warnings_of(program_, "T1\n" + std::string(kCut) + "M5\nM2\n"), IsEmpty());
  JobWatcher nobody;
  EXPECT_TRUE(send_job(program_, simulated(), nobody).result->done());
}

TEST_F(SendJob, ACircleWithoutAnEndIsSentWithIt) {
  const std::string program = std::string(kCut) + "G2 I5 J0\nM5\nM2\n";
  for (const char* dialect : {"grbl", "grblhal"}) {
    SendOptions options;
    options.dialect = dialect;
    EXPECT_THAT(warnings_of(program_, program, options),
                ElementsAre(HasSubstr("line 5 has a circle without an end")));
    SendOptions send = simulated();
    send.port = std::string("sim:") + dialect;
    send.restart = true;
    JobWatcher nobody;
    const SendSummary summary = send_job(program_, send, nobody);
    EXPECT_TRUE(summary.result->done()) << summary.result->reason;
  }
}

TEST_F(SendJob, ASpindleThatIsSwitchedByHandNeedsNoM3) {
  const std::string program = "G21 G90\nG0 X10 Y10 Z5\nG1 Z-1 F300\nX50\nM2\n";
  EXPECT_THAT(message_of<InputError>([&] { warnings_of(program_, program); }),
              HasSubstr("line 3: moves at feed while the spindle is off; use --spindle-by-hand"));
  SendOptions by_hand;
  by_hand.spindle_by_hand = true;
  EXPECT_THAT(warnings_of(program_, program, by_hand), IsEmpty());
  SendOptions send = simulated();
  send.spindle_by_hand = true;
  JobWatcher nobody;
  const SendSummary summary = send_job(program_, send, nobody);
  EXPECT_TRUE(summary.result->done()) << summary.result->reason;
  EXPECT_THAT(summary.findings.warnings, Contains(HasSubstr("switched by hand")));
}

TEST_F(SendJob, WhatTheMachineCannotDoIsRefusedBeforeTheJournal) {
  testing::write_bytes(program_, "G21 G90\nS90000 M3\nG0 X900\nM5\nM2\n");
  JobWatcher nobody;
  EXPECT_THAT(message_of<InputError>([&] { send_job(program_, simulated(), nobody); }),
              HasSubstr("$30=24000"));
  EXPECT_EQ(folder_.file_count(), 1U);
}

TEST_F(SendJob, FilesOfTheCallerHaveToBeApartFromItsOwn) {
  Notes notes;
  notes.written = {{"--log", program_.string() + ".journal"}};
  EXPECT_THAT(message_of<InputError>([&] { send_job(program_, simulated(), notes); }),
              HasSubstr("is the same as --journal"));
  EXPECT_TRUE(notes.said.empty());
}

TEST_F(SendJob, OptionsThatExcludeEachOtherAreRefused) {
  JobWatcher nobody;
  EXPECT_THAT(message_of<InputError>([&] { send_job(program_, {}, nobody); }), HasSubstr("--port"));
  SendOptions options = simulated();
  options.resume = options.restart = true;
  EXPECT_THAT(message_of<InputError>([&] { send_job(program_, options, nobody); }),
              HasSubstr("--restart"));
  options = {};
  options.port = "/dev/ttyUSB0";
  options.spindle = "h100";
  options.spindle_by_hand = true;
  EXPECT_THAT(message_of<InputError>([&] { send_job(program_, options, nobody); }),
              HasSubstr("--spindle-by-hand and --spindle"));
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <fstream>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

/// Programs that no controller should get: each is refused in one line that names its line.
class HostileProgram : public Scenario {
 protected:
  void expect_refused(const std::string& program, const std::vector<std::string>& parts) {
    write(at("job.ngc"), program);
    std::vector<std::string> all = parts;
    all.emplace_back("job.ngc");
    expect_refusal(run({"send", path("job.ngc"), "--dry-run", "--quiet"}), 2, all);
  }
};

const std::string kHead = "G21 G90\nS1000 M3\nF100\n";

TEST_F(HostileProgram, OverlongLinesAreRefused) {
  expect_refused(kHead + "G1 X" + std::string(200, '1') + "\n", {"line 4"});
  expect_refused(kHead + "(" + std::string(5000, 'c') + ")\n", {"line 4"});
  expect_refused(kHead +
                     "G1 X1.23456789012 Y1.23456789012 Z1.23456789012 F100.000000000 "
                     "S1000.00000000 M8 G90 G94 G17\n",
                 {"line 4", "79"});
}

TEST_F(HostileProgram, ALineOfAGigabyteTakesNoMemory) {
  std::ofstream file(at("job.ngc"), std::ios::binary);
  file << kHead << "G1 X1";
  file.seekp(1LL << 30);  // Zero bytes in between, which no disk has to hold.
  file << "1\n";
  file.close();
  const Outcome outcome = run({"send", path("job.ngc"), "--dry-run", "--quiet"});
  expect_refusal(outcome, 2, {"line 4", "NUL"});
  std::ofstream digits(at("long.ngc"), std::ios::binary);
  digits << kHead << "G1 X1";
  const std::string piece(1 << 20, '1');
  for (int i = 0; i < 64; ++i) digits << piece;
  digits.close();
  expect_refusal(run({"send", path("long.ngc"), "--dry-run", "--quiet"}), 2, {"line 4"});
}

TEST_F(HostileProgram, BytesThatTheControllerActsOnAreRefused) {
  for (const char byte : {'?', '!', '\x18', '\x84'}) {
    expect_refused(kHead + "G1 X1" + byte + "\n", {"line 4", "realtime"});
  }
}

TEST_F(HostileProgram, CommentsAreNotSentWhateverBytesTheyHold) {
  for (const char byte : {'?', '!', '\x18', '\x84'}) {
    write(at("job.ngc"), kHead + "(a comment " + byte + ")\nG1 X1\nM5\nM2\n");
    const Outcome outcome = run({"send", path("job.ngc"), "--dry-run"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, ::testing::HasSubstr("comment"));
  }
}

TEST_F(HostileProgram, ControlBytesAndByteOrderMarksAreRefused) {
  expect_refused(kHead + std::string("G1 X1\0\n", 7), {"line 4", "NUL"});
  expect_refused(kHead + "G1 X1\x01\n", {"line 4"});
  expect_refused("\xef\xbb\xbf" + kHead, {"line 1", "byte order mark"});
}

TEST_F(HostileProgram, AnyLineEndIsTaken) {
  for (const char* end : {"\n", "\r\n", "\r"}) {
    std::string program;
    for (const char* line : {"G21 G90", "S1000 M3", "G1 X1 F100", "M5", "M2"}) {
      program.append(line).append(end);
    }
    write(at("job.ngc"), program);
    EXPECT_EQ(run({"send", path("job.ngc"), "--dry-run", "--quiet"}).exit_code, 0);
  }
  write(at("job.ngc"), kHead + "G1 X1\nM5\nM2");
  EXPECT_EQ(run({"send", path("job.ngc"), "--dry-run", "--quiet"}).exit_code, 0);
}

TEST_F(HostileProgram, MalformedLinesAreRefused) {
  for (const char* line :
       {"G1 X1 (nested (comment))", "G1 X1 (not closed", "G1 X1e3", "G1 X", "G1 X1 X2", "G1 X#1",
        "/G1 X1", "G5 X1", "M6 T1", "G92 X0", "$X", "G1 X99999999999"}) {
    expect_refused(kHead + line + "\n", {"line 4"});
  }
}

TEST_F(HostileProgram, MissingUnitsFeedAndSpindleAreRefused) {
  expect_refused("G90\nG0 X1\n", {"line 2"});
  expect_refused("G21 G90\nS1000 M3\nG1 X1\n", {"line 3"});
  expect_refused("G21 G90\nF100\nG1 X1\n", {"line 3", "spindle"});
}

TEST_F(HostileProgram, WhatIsNoFileIsRefused) {
  expect_refusal(run({"send", path("none.ngc"), "--dry-run"}), 2, {"none.ngc"});
  expect_refusal(run({"send", path("."), "--dry-run"}), 2, {"folder"});
}

}  // namespace
}  // namespace lensforge::scenario

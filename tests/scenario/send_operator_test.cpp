// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <thread>

#include "machine/stream/journal.h"
#include "scenario/mill.h"
#include "scenario/terminal_process.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

class SendOperator : public Scenario {
 protected:
  void SetUp() override { write(at("job.ngc"), zig_zag(8)); }
  [[nodiscard]] Arguments send() const {
    return {"send", path("job.ngc"), "--port", mill.path(), "--home"};
  }
  [[nodiscard]] std::string log() const { return content(at("job.ngc.log")); }
  bool logs(const std::string& text) const {
    return comes_true([&] { return log().find(text) != std::string::npos; });
  }

  Mill mill;
};

TEST_F(SendOperator, SeesWhatTheMachineDoes) {
  TerminalProcess process(send());
  EXPECT_TRUE(process.shows("keys: space or h holds"));
  ASSERT_TRUE(mill.cut(100));
  EXPECT_TRUE(process.shows("Run  X-19"));
  EXPECT_EQ(process.wait(), 0);
  for (const char* part : {" %  line ", " of 178  ", " left", "S12000 asked, 12000 reported",
                           "buffers planner ", "/15, receive ", "/128"}) {
    EXPECT_THAT(process.screen(), HasSubstr(part));
  }
}

TEST_F(SendOperator, HoldsAndGoesOnByKeys) {
  TerminalProcess process(send());
  ASSERT_TRUE(mill.cut(60));
  process.press("h");
  ASSERT_TRUE(logs("held by the operator"));
  ASSERT_TRUE(process.shows("Hold  X"));
  const std::size_t pieces = mill.pieces().size();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // Four seconds of the mill.
  EXPECT_EQ(mill.pieces().size(), pieces);
  process.press("r");
  EXPECT_EQ(process.wait(), 0);
  EXPECT_THAT(log(), HasSubstr("goes on after a hold of"));
}

TEST_F(SendOperator, OverridesByKeys) {
  TerminalProcess process(send());
  ASSERT_TRUE(mill.cut(20));
  for (const auto& [keys, percents] : std::vector<std::pair<std::string, std::string>>{
           {"-", "feed 90 %, rapids 100 %, spindle 100 %"},
           {"2", "feed 90 %, rapids 50 %, spindle 100 %"},
           {"<", "feed 90 %, rapids 50 %, spindle 90 %"},
           {"=1.x", "feed 100 %, rapids 100 %, spindle 100 %"}}) {
    process.press(keys);
    EXPECT_TRUE(logs("overrides: " + percents)) << keys;
  }
}

TEST_F(SendOperator, EndsTheJobByKey) {
  TerminalProcess process(send());
  ASSERT_TRUE(mill.cut(60));
  process.press("q");
  EXPECT_TRUE(mill.cut(80)) << "a small q is nothing";
  process.press("Q");
  EXPECT_EQ(process.wait(), 130);
  EXPECT_EQ(read_journal(at("job.ngc.journal")).status, "interrupted");
}

TEST_F(SendOperator, GetsTheTerminalBackWhateverEndsTheSender) {
  const std::vector<std::pair<int, int>> cases = {{SIGTERM, 130}, {SIGQUIT, 128 + SIGQUIT}};
  for (const auto& [signal, code] : cases) {
    Arguments arguments = send();
    arguments.insert(arguments.end(), {"--restart"});
    Mill own(50.0);
    arguments[3] = own.path();
    TerminalProcess process(arguments);
    EXPECT_TRUE(process.line_by_line() || process.shows("keys: "));
    ASSERT_TRUE(own.cut(10));
    ASSERT_FALSE(process.line_by_line());
    process.send(signal);
    EXPECT_EQ(process.wait(), code) << process.screen();
    EXPECT_TRUE(process.line_by_line()) << signal;
  }
}

TEST_F(SendOperator, GetsTheTerminalBackFromAThirdInterrupt) {
  TerminalProcess process(send());
  ASSERT_TRUE(mill.cut(10));
  for (int i = 0; i < 3; ++i) {
    process.send(SIGINT);
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
  EXPECT_EQ(process.wait(), 130);
  EXPECT_TRUE(process.line_by_line());
}

TEST_F(SendOperator, GetsTheTerminalBackWhileTheSenderIsStopped) {
  TerminalProcess process(send());
  ASSERT_TRUE(mill.cut(10));
  process.press("\x1a");  // Ctrl-Z is no way to leave a running machine.
  ASSERT_TRUE(mill.cut(30));
  EXPECT_FALSE(process.stopped());
  process.send(SIGTSTP);
  ASSERT_TRUE(comes_true([&] { return process.stopped(); }));
  EXPECT_TRUE(process.line_by_line());
  process.send(SIGCONT);
  EXPECT_TRUE(comes_true([&] { return !process.line_by_line(); }));
  EXPECT_EQ(process.wait(), 0);
  EXPECT_TRUE(process.line_by_line());
}

}  // namespace
}  // namespace lensforge::scenario

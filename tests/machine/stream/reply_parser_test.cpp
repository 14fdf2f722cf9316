// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/reply_parser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace lensforge {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Kind = Reply::Kind;

/// Every reply that any bytes give is as parse_reply() promises.
void expect_promises_kept(const std::string& bytes) {
  ReplyReader reader;
  std::int64_t count = 0;
  reader.feed(bytes, [&](const Reply& reply) {
    ++count;
    const bool coded = reply.kind == Reply::Kind::kError || reply.kind == Reply::Kind::kAlarm;
    ASSERT_LE(reply.text.size(), ReplyReader::kLongestLine) << reply.text;
    ASSERT_EQ(coded, reply.code != 0) << reply.text;
    ASSERT_EQ(reply.kind == Reply::Kind::kStatus, reply.status.has_value()) << reply.text;
    ASSERT_EQ(reply.kind == Reply::Kind::kOk, reply.text == "ok") << reply.text;
  });
  ASSERT_EQ(count, std::count(bytes.begin(), bytes.end(), '\n'));
}

std::vector<Kind> kinds_of(const std::string& bytes) {
  ReplyReader reader;
  std::vector<Kind> kinds;
  reader.feed(bytes, [&](const Reply& reply) { kinds.push_back(reply.kind); });
  return kinds;
}

TEST(ReplyParser, KnowsEverythingThatGrblAndGrblHalSay) {
  const std::vector<std::pair<std::string, Kind>> lines = {
      {"ok", Kind::kOk},
      {"error:22", Kind::kError},
      {"ALARM:1", Kind::kAlarm},
      {"", Kind::kEmpty},
      {"Grbl 1.1h ['$' for help]", Kind::kBanner},
      {"GrblHAL 1.1f ['$' or '$HELP' for help]", Kind::kBanner},
      {"[MSG:'$H'|'$X' to unlock]", Kind::kMessage},
      {"[MSG:Pgm End]", Kind::kMessage},
      {"[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]", Kind::kData},
      {"[VER:1.1h.20190830:]", Kind::kData},
      {"[OPT:V,15,128]", Kind::kData},
      {"[NEWOPT:ENUMS,RT+,HOME,ES,TC]", Kind::kData},
      {"[G54:0.000,0.000,0.000]", Kind::kData},
      {"[PRB:0.000,0.000,0.000:0]", Kind::kData},
      {"[TLO:0.000]", Kind::kData},
      {"[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]", Kind::kData},
      {"[echo:G1X0.540Y10.4F100]", Kind::kData},
      {"$110=500.000", Kind::kSetting},
      {"$N0=G54", Kind::kSetting},
      {"$N1=", Kind::kSetting},
      {">G54G20:ok", Kind::kStartup},
      {">:error:7", Kind::kStartup},
      {"<Idle|MPos:0.000,0.000,0.000|FS:0,0>", Kind::kStatus}};
  for (const auto& [line, kind] : lines) {
    EXPECT_EQ(parse_reply(line).kind, kind) << line;
    EXPECT_THAT(kinds_of(std::string(line).append("\r\n")), ElementsAre(kind)) << line;
  }
}

TEST(ReplyParser, ReadsCodesNamesAndValues) {
  EXPECT_EQ(parse_reply("error:9").code, 9);
  EXPECT_EQ(parse_reply("ALARM:11").code, 11);
  EXPECT_EQ(parse_reply("$110=500.000").name, "110");
  EXPECT_EQ(parse_reply("$110=500.000").value, "500.000");
  EXPECT_EQ(parse_reply("[OPT:VN,15,128]").value, "VN,15,128");
  EXPECT_EQ(parse_reply("[MSG:Check Door]").value, "Check Door");
}

TEST(ReplyParser, RefusesGarbledReplies) {
  for (const char* line : {"o",
                           "k",
                           "Ok",
                           "OK",
                           "okok",
                           "ook",
                           "ok ",
                           " ok",
                           "o\x01k",
                           "ok\x80",
                           "error",
                           "error:",
                           "error:0",
                           "error:x",
                           "error:-1",
                           "error:022",
                           "error:256",
                           "error:1 ",
                           "erorr:1",
                           "ALARM:",
                           "ALARM:0",
                           "alarm:1",
                           "[MSG:half",
                           "MSG:half]",
                           "[]",
                           "[:]",
                           "[MSG]",
                           "$=1",
                           "$x=1",
                           "$110",
                           "$1 0=5",
                           ">G54",
                           "Grbl",
                           "Grbl 1.1h ['$' for hel",
                           "<",
                           "<>",
                           "<Idle>",
                           "<Idle|",
                           "<Idle|MPos:0,0,0",
                           "Idle|MPos:0,0,0>",
                           "feed hold"}) {
    EXPECT_EQ(parse_reply(line).kind, Kind::kUnknown) << line;
  }
}

TEST(ReplyParser, EveryFlippedBitOfAnOkIsSeen) {
  for (std::size_t i = 0; i < 2; ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string line = "ok\r\n";
      line[i] = static_cast<char>(line[i] ^ (1 << bit));
      const std::vector<Kind> kinds = kinds_of(line);
      EXPECT_EQ(std::count(kinds.begin(), kinds.end(), Kind::kOk), 0) << i << " " << bit;
    }
  }
}

TEST(StatusReport, ReadsEveryField) {
  const auto report = parse_status_report(
      "<Hold:1|MPos:1.000,-2.500,3.125|Bf:15,128|Ln:99999|FS:500,8000|Pn:XDH|WCO:0.000,1.551,5.664"
      "|Ov:100,50,120|A:SF>");
  ASSERT_TRUE(report);
  EXPECT_EQ(report->state, ReportedState::kHold);
  EXPECT_EQ(report->sub_state, 1);
  EXPECT_EQ(*report->machine_position, Eigen::Vector3d(1.0, -2.5, 3.125));
  EXPECT_EQ(report->room->blocks, 15);
  EXPECT_EQ(report->room->bytes, 128);
  EXPECT_EQ(report->line, 99999);
  EXPECT_EQ(report->feed, 500.0);
  EXPECT_EQ(report->spindle_rpm, 8000.0);
  EXPECT_EQ(report->pins, "XDH");
  EXPECT_EQ(*report->work_offset, Eigen::Vector3d(0.0, 1.551, 5.664));
  EXPECT_EQ(*report->overrides, Eigen::Vector3i(100, 50, 120));
  EXPECT_EQ(report->accessories, "SF");
}

TEST(StatusReport, ReadsWhatGrblHalAdds) {
  const auto report = parse_status_report(
      "<Alarm:11|WPos:1.000,2.000,3.000,90.000|FS:500,8000,7990|H:0|T:1|TLR:0|MPG:0|WCS:G54>");
  ASSERT_TRUE(report);
  EXPECT_EQ(report->sub_state, 11);
  EXPECT_EQ(*report->work_position, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(report->measured_rpm, 7990.0);
  EXPECT_EQ(report->homed, false);
  EXPECT_THAT(report->others, ElementsAre("T:1", "TLR:0", "MPG:0", "WCS:G54"));
}

TEST(StatusReport, NamesItsStates) {
  for (const char* name :
       {"Idle", "Run", "Hold", "Jog", "Alarm", "Door", "Check", "Home", "Sleep", "Tool"}) {
    std::string line = "<";
    line.append(name).append("|MPos:0,0,0>");
    const auto report = parse_status_report(line);
    ASSERT_TRUE(report) << name;
    EXPECT_EQ(state_name(report->state), name);
  }
}

TEST(StatusReport, RefusesWhatIsNotWellFormed) {
  for (const char* line : {"<Idel|MPos:0,0,0>",
                           "<Idle|MPos:0,0>",
                           "<Idle|MPos:0,0,x>",
                           "<Idle|MPos:0,0,>",
                           "<Idle|MPos:0,0,1e3>",
                           "<Idle|MPos:0,0,inf>",
                           "<Idle|MPos:0,0,0|WPos:0,0,0>",
                           "<Idle|MPos:0,0,0|MPos:0,0,0>",
                           "<Idle|FS:0,0>",
                           "<Idle|MPos:0,0,0|>",
                           "<Idle||MPos:0,0,0>",
                           "<Idle|MPos:0,0,0|Bf:15>",
                           "<Idle|MPos:0,0,0|Bf:15,-1>",
                           "<Idle|MPos:0,0,0|Bf:15,128,3>",
                           "<Idle|MPos:0,0,0|Ln:-5>",
                           "<Idle|MPos:0,0,0|Ln:5.5>",
                           "<Idle|MPos:0,0,0|Ln>",
                           "<Idle|MPos:0,0,0|Pn:>",
                           "<Idle|MPos:0,0,0|Pn:x>",
                           "<Idle|MPos:0,0,0|Ov:100,100>",
                           "<Idle|MPos:0,0,0|FS:1,2,3,4>",
                           "<Idle|MPos:0,0,0|x:1>",
                           "<Hold:|MPos:0,0,0>",
                           "<Hold:x|MPos:0,0,0>",
                           "<Idle|MPos:0,0,0|<Run|MPos:0,0,0>",
                           "<Idle|MPos:0,0,0|H:2>"}) {
    EXPECT_FALSE(parse_status_report(line)) << line;
  }
}

TEST(ReplyReader, CutsLinesWhereverTheBytesAreCut) {
  const std::string bytes = "ok\r\nerror:3\r\n<Idle|MPos:0,0,0|FS:0,0>\r\nok\n";
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    ReplyReader reader;
    std::vector<Kind> kinds;
    const auto take = [&](const Reply& reply) { kinds.push_back(reply.kind); };
    reader.feed(bytes.substr(0, cut), take);
    reader.feed(bytes.substr(cut), take);
    EXPECT_THAT(kinds, ElementsAre(Kind::kOk, Kind::kError, Kind::kStatus, Kind::kOk)) << cut;
  }
}

TEST(ReplyReader, BoundsALineThatNeverEnds) {
  ReplyReader reader;
  std::vector<Reply> replies;
  const auto take = [&](const Reply& reply) { replies.push_back(reply); };
  const std::string piece(1 << 16, 'x');
  for (int i = 0; i < 1000; ++i) reader.feed(piece, take);
  EXPECT_TRUE(replies.empty());
  reader.feed("\nok\n", take);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].kind, Kind::kUnknown);
  EXPECT_LE(replies[0].text.size(), ReplyReader::kLongestLine);
  EXPECT_EQ(replies[1].kind, Kind::kOk);
}

TEST(ReplyReader, HoldsItsPromisesForMutatedBytes) {
  const std::string seed =
      "ok\r\nGrbl 1.1h ['$' for "
      "help]\r\n<Run:2|MPos:1.000,2.000,3.000|Bf:15,128|Ln:9|FS:500,80>\r\n"
      "error:9\r\nALARM:1\r\n[MSG:Reset to continue]\r\n[GC:G0 G54]\r\n$30=1000\r\n>G54:ok\r\n";
  std::mt19937_64 engine(7);
  const auto below = [&](std::size_t n) { return engine() % n; };
  for (int run = 0; run < 20000; ++run) {
    std::string bytes = seed;
    for (std::size_t i = 0, n = 1 + below(8); i < n; ++i) {
      const std::size_t at = below(bytes.size());
      switch (below(4)) {
        case 0:
          bytes[at] = static_cast<char>(engine());
          break;
        case 1:
          bytes.erase(at, 1 + below(6));
          break;
        case 2:
          bytes += bytes.substr(below(bytes.size()), below(20));
          break;
        default:
          bytes.insert(at, 1, static_cast<char>(engine()));
      }
      if (bytes.empty()) bytes.push_back('\n');
    }
    expect_promises_kept(bytes);
  }
}

TEST(ControllerCodes, AreSaidInWords) {
  EXPECT_THAT(explain_error(22), HasSubstr("no feed"));
  EXPECT_THAT(explain_alarm(1), HasSubstr("limit switch"));
  EXPECT_THAT(explain_error(250), HasSubstr("not documented"));
  EXPECT_THAT(explain_alarm(99), HasSubstr("not documented"));
}

}  // namespace
}  // namespace lensforge

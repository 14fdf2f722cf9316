// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <initializer_list>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "core/error.h"
#include "core/io/files.h"
#include "core/temp_folder.h"
#include "core/text/words.h"
#include "machine/gcode/program_seal.h"

namespace lensforge::gcode_seal_test {
namespace {

/// GCC 12 warns falsely (-Wrestrict) of a literal + a string.
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;

std::string hash_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

TEST(ProgramSeal, HoldsForWhatStandsBelowIt) {
  const TempFolder folder;
  const std::string body = "G21\nG0 Z5\nM2\n";
  const std::string seal = joined({"(", seal_text(hash_of(body)), ")\n"});
  write_bytes(folder / "a.ngc", joined({"(job)\n", seal, body}));
  EXPECT_EQ(check_seal(folder / "a.ngc"), true);
  write_bytes(folder / "a.ngc", joined({"(another job)\n", seal, body}));
  EXPECT_EQ(check_seal(folder / "a.ngc"), true);
  for (const std::string& changed : {std::string("G21\nG0 Z6\nM2\n"), body + "M2\n",
                                     body.substr(0, body.size() - 1), std::string()}) {
    write_bytes(folder / "a.ngc", joined({"(job)\n", seal, changed}));
    EXPECT_EQ(check_seal(folder / "a.ngc"), false);
  }
}

TEST(ProgramSeal, IsKnownInEitherCaseAndStyle) {
  const std::string hash = hash_of("x");
  std::string upper = joined({"(", seal_text(hash), ")"});
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  EXPECT_EQ(stated_hash(upper), hash);
  EXPECT_EQ(stated_hash(joined({";", seal_text(hash)})), hash);
  EXPECT_FALSE(stated_hash(joined({"(", seal_text(hash.substr(1)), ")"})));
  EXPECT_FALSE(stated_hash(joined({"(", seal_text(joined({"z", hash.substr(1)})), ")"})));
  EXPECT_FALSE(stated_hash(seal_text(hash)));
  EXPECT_FALSE(stated_hash(""));
}

TEST(ProgramSeal, StandsAloneOnItsLine) {
  const std::string hash = hash_of("x");
  const std::string seal = joined({"(", seal_text(hash), ")"});
  EXPECT_EQ(stated_hash(seal), hash);
  for (const char* more : {" G1 X50", "G1 X50", "()", " ", "\r", "0"}) {
    EXPECT_FALSE(stated_hash(joined({seal, more}))) << more;
    EXPECT_FALSE(stated_hash(joined({";", seal_text(hash), more}))) << more;
  }
  EXPECT_FALSE(stated_hash(joined({" ", seal})));
}

/// What check_seal() says of `head`, the seal of `body` and `body`.
std::optional<bool> seal_of(const std::string& head, const std::string& body,
                            const std::string& end = "\n") {
  std::istringstream program(joined({head, "(", seal_text(hash_of(body)), ")", end, body}));
  return check_seal(program);
}

TEST(ProgramSeal, OnlyCommentsMayStandAboveIt) {
  const std::string body = "G21\nG0 Z5\nM2\n";
  for (const char* head : {"", "\n", "  \t\n", "(job)\n", "; note\n", "(a) (b) ; c\n", "%\n(a)\n",
                           "%\r\nO1001 (JOB)\r\n(A; B)\r\n", "O7\n", "N10 (a)\nN20\n"}) {
    EXPECT_EQ(seal_of(head, body), true) << head;
  }
  for (const char* head : {"G0 Z-9\n",
                           "(a) G0 Z-9\n",
                           "(a) G0 Z-9 (b)\n",
                           "G0 Z-9 (a)\n",
                           "(a\n",
                           "(a (b))\n",
                           "a)\n",
                           "/(a)\n",
                           "(a)\rG0 Z-9\r(b)\n",
                           "(a)\rG0 Z-9\n",
                           "%\n%\n",
                           "(a)\n%\n",
                           "% G0 Z-9\n",
                           "O1\nO2\n",
                           "O1 G0 Z-9\n",
                           "N10 G0 Z-9\n",
                           "%\n; a\n",
                           "O1001\n(a) ;b\n",
                           "(caf\xc3\xa9)\n",
                           "\xef\xbb\xbf(a)\n",
                           "$H\n",
                           "!\n",
                           "(a)\x18\n",
                           "#1=2\n",
                           "o<x> call\n",
                           "M3"}) {
    EXPECT_EQ(seal_of(head, body), false) << head;
  }
  EXPECT_EQ(seal_of(std::string(2000, ' ') + "\n", body), false);
  EXPECT_EQ(seal_of(std::string(5000, '\n'), body), true) << "however far down it stands";
  EXPECT_EQ(seal_of("(a)\n", body, "\r\n"), true);
  EXPECT_EQ(seal_of("(a)\n", body, "\r"), false);
}

TEST(ProgramSeal, ThatIsGoneIsMissedInAProgramOfCam) {
  for (const char* mark :
       {"(units: mm; X0 Y0: lower left corner of the lens)\n",
        "(UNITS: MM; X0 Y0: LOWER LEFT CORNER OF THE LENS)\r\n", ";LensForge 0.3.1\n",
        "(made by lensforge 12)\n", "(sha256 below)\n", "G0 X1 (sha256 below 12ab)\n"}) {
    for (const char* before : {"", "G0 Z-9\n", "(a)\r"}) {
      std::istringstream program(joined({before, mark, "G21\nG0 Z5\nM2\n"}));
      EXPECT_EQ(check_seal(program), false) << before << mark;
    }
  }
  for (const char* text : {"(lensforge)\n", "(lens forge 1)\n", "G0 X1\n", "(units: mm)\n", ""}) {
    std::istringstream program(text);
    EXPECT_EQ(check_seal(program), std::nullopt) << text;
  }
}

TEST(ProgramSeal, NothingIsSaidOfAProgramWithoutOne) {
  const TempFolder folder;
  write_bytes(folder / "a.ngc", "G21\nM2\n");
  EXPECT_FALSE(check_seal(folder / "a.ngc"));
  write_bytes(folder / "b.ngc", std::string(5000, 'x'));
  EXPECT_FALSE(check_seal(folder / "b.ngc"));
  EXPECT_THROW((void)check_seal(folder / "none"), InputError);
}

}  // namespace
}  // namespace lensforge::gcode_seal_test

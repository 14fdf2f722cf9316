// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/post/post_description.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cam/post_plans.h"
#include "core/error.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::post_text_with;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(PostDescription, FiveAreBuiltIn) {
  EXPECT_THAT(builtin_posts(), ElementsAre("linuxcnc", "grbl", "grblhal", "fanuc", "weihong"));
  for (const std::string& name : builtin_posts()) {
    const PostDescription post = find_post(name, "--post");
    EXPECT_EQ(post.name, name);
    EXPECT_EQ(post.reader.name, name);
    EXPECT_LE(post.longest_line, 80U);
  }
  EXPECT_FALSE(find_post("grbl", "--post").changes_tools());
  EXPECT_TRUE(find_post("fanuc", "--post").percent);
}

TEST(PostDescription, ItsToolLinesTellWhetherTheyApplyTheLength) {
  const auto applies = [](const char* name) { return find_post(name, "--post").applies_length; };
  EXPECT_TRUE(applies("linuxcnc") && applies("fanuc"));
  EXPECT_FALSE(applies("grbl") || applies("grblhal") || applies("weihong"));
  EXPECT_FALSE(parse_post(post_text_with(", \"G43\"]", "]"), "f.toml").applies_length);
  EXPECT_TRUE(parse_post(post_text_with("\"G43\"]", "\"G43 H{tool}\"]"), "f.toml").applies_length);
}

TEST(PostDescription, AUsersFileIsReadByItsPath) {
  const TempFolder folder;
  write_bytes(folder / "mine.toml", post_text_with("name = \"linuxcnc\"", "name = \"mine\""));
  EXPECT_EQ(find_post((folder / "mine.toml").string(), "--post").name, "mine");
  EXPECT_THAT(message_of<InputError>([] { (void)find_post("haas", "--post"); }),
              AllOf(StartsWith("--post: 'haas' is none of linuxcnc, grbl, grblhal, fanuc, "),
                    HasSubstr(".toml file")));
  EXPECT_THAT(message_of<InputError>([] { (void)find_post("no/such.toml", "--post"); }),
              HasSubstr("no/such.toml: cannot be read"));
}

TEST(PostDescription, FaultsAreNamedWithFileKeyValueAndRule) {
  struct Fault {
    const char* from;
    const char* to;
    const char* message;
  };
  const Fault faults[] = {
      {"format = \"lensforge.post\"", "format = \"x\"", "f.toml: format: 'x': must be one of"},
      {"version = 1", "version = 2", "f.toml: version: 2: this program reads version 1"},
      {"extension = \"ngc\"", "extension = \"../x\"", "extension: '../x': must be 1 to 8 letters"},
      {"reader = \"linuxcnc\"", "reader = \"haas\"", "reader: 'haas': must be one of"},
      {"most_decimals = 6", "most_decimals = 7", "numbers.most_decimals: 7: must be in 0 to 6"},
      {"trailing_zeros = true", "trailing_zeros = 1", "numbers.trailing_zeros: 1: must be true"},
      {"feed_decimals = 3", "", "numbers.feed_decimals: missing: a post description needs"},
      {"longest = 80", "longest = 300", "lines.longest: 300: must be in 40 to 250"},
      {"longest = 80", "width = 80", "lines.longest: missing"},
      {"percent = false", "percent = false\ntilde = 1",
       "lines.tilde: 1: a post description: unknown key"},
      {"largest_file = 0", "largest_file = 99", "lines.largest_file: 99: must be 0 or at least"},
      {"largest_number = 99990", "largest_number = 5",
       "lines.largest_number: 5: must not be below"},
      {"open = \"(\"", "open = \"<\"", "comments.open: '<': must be one of"},
      {"close = \")\"", "", "comments.close: missing: must be )"},
      {"rapid = \"G0\"", "rapid = \"G2\"", "words.rapid: 'G2': 'G2 X1 F100': an arc without R"},
      {"reader = \"linuxcnc\"", "reader = \"weihong\"",
       "lines.feed_on_every_line: false: must be true for reader weihong"},
      {"clockwise = \"G2\"", "clockwise = \"G3\"",
       "words.clockwise: 'G3': is not the word of this"},
      {"plane_zx = \"G18\"", "plane_zx = \"G19\"",
       "words.plane_zx: 'G19': is not the word of this"},
      {"plane_xy = \"G17\"", "plane_xy = \"G90\"",
       "words.plane_xy: 'G90': is not the word of this"},
      {"flood = \"M8\"", "flood = \"M7\"", "words.flood: 'M7': does not do what the key says"},
      {"flood = \"M8\"", "flood = \"M88\"", "words.flood: 'M88': 'M88': M88 is not supported"},
      {"coolant_off = \"M9\"", "", "words.coolant_off: missing: is needed"},
      {"form = \"centre\"", "form = \"i\"", "arcs.form: 'i': must be one of"},
      {"\"G54\"", "\"G54\", \"G77\"", "program.start: an array: 'G77': G77 is not supported"},
      {"G21 G90 G17", "G20 G90 G17", "program.start: an array: must set millimetres"},
      {"G21 G90 G17", "G21 G91 G17", "program.start: an array: must set millimetres"},
      {"G21 G90 G17", "G21 G17", "program.start: an array: must set millimetres"},
      {"G90 G17 G94", "G90 G17", "program.start: an array: must set millimetres"},
      {"G90 G17 G94", "G90 G94", "program.start: an array: must set the plane of X and Y (G17)"},
      {"\"G54\", ", "", "program.start: an array: must choose a coordinate system (G54 ... G59)"},
      {"G40 G49 G80", "G40 G80", "program.start: an array: must cancel tool length offsets"},
      {"G40 G49 G80", "G40 G49", "program.start: an array: must cancel canned cycles"},
      {"G40 G49 G80", "G49 G80", "program.start: an array: must cancel cutter compensation"},
      {"T{tool} M6", "T{tool} M6 G55", "program.tool: an array: must leave millimetres"},
      {"T{tool} M6", "T{tool} M6 G18", "program.tool: an array: must leave millimetres"},
      {"T{tool} M6", "T{tol} M6", "program.tool: an array: 'T{tol} M6': unknown placeholder"},
      {"T{tool} M6", "T2 M6", "program.tool: an array: must name the tool"},
      {"T{tool} M6", "T{tool M6", "unknown placeholder"},
      {"S{rpm} M3", "S{rpm}", "program.spindle: an array: must start the spindle"},
      {"S{rpm} M3", "S900 M3", "program.spindle: an array: must start the spindle at S{rpm}"},
      {"S{rpm} M3", "S{rpm} M3 G0 Z9", "these lines must not move the machine"},
      {"tool_end = [\"M5\", ", "tool_end = [", "program.tool_end: an array: must stop"},
      {"\"G49\", \"M2\"]", "\"G49\"]", "program.end: an array: must end"},
      {"head = []", "head = [\"(what?)\"]", "characters must be printable ASCII but"},
      {"head = []", "head = [\"(\\u00e4)\"]", "characters must be printable ASCII but"},
      {"head = []", "head = [\"G21\"]", "'G21': the head is above the seal"},
      {"head = []", "head = [\"(a) M5\"]", "above the seal"},
      {"head = []", "head = [\"(open\"]", "program.head: an array: '(open': comment without"},
  };
  for (const Fault& fault : faults) {
    const std::string text = post_text_with(fault.from, fault.to);
    EXPECT_THAT(message_of<InputError>([&] { (void)parse_post(text, "f.toml"); }),
                AllOf(StartsWith("f.toml: "), HasSubstr(fault.message)))
        << fault.to;
  }
  EXPECT_THAT(message_of<InputError>([] { (void)parse_post("x = ", "f.toml"); }),
              HasSubstr("f.toml: line 1: not TOML"));
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <string>
#include <vector>

#include "core/image/image_io.h"
#include "core/stop_bound.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

/// Designs of drawings (SVG).
class Drawing : public Scenario {
 protected:
  void write_logo(const std::string& more = "") const {
    write(at("logo.svg"),
          "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 30 20'><rect width='30' "
          "height='20' fill='#444'/><circle cx='12' cy='9' r='6' fill='white'/>" +
              more + "</svg>");
  }

  /// Every command that takes the drawing, by the option that names it.
  [[nodiscard]] std::vector<std::pair<std::string, Arguments>> commands() const {
    const std::string logo = path("logo.svg");
    Arguments outline = small_design(picture("stripes.png"), path("lens"));
    Arguments source = outline;
    outline.insert(outline.end(), {"--outline", logo});
    source.insert(source.end(), {"--source-picture", logo, "--source-angle", "0.5"});
    return {{"", small_design(logo, path("lens"))},
            {"--outline ", outline},
            {"--source-picture ", source},
            {"--target ", {"render", path("old"), "--target", logo, "--out", path("a.png")}}};
  }
};

TEST_F(Drawing, IsDrawnAtTheWorkingSize) {
  write_logo();
  const Outcome done = run(small_design(path("logo.svg"), path("lens")));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("logo.svg: drawn at 32 x 21 pixels"));
  EXPECT_EQ(read_image(at("lens/target.exr")).image, read_image(at("logo.svg"), {}, 32).image);
}

TEST_F(Drawing, TheFontThatIsMissingIsNamed) {
  write_logo("<text y='12' fill='white' font-family='NoSuchFontAnywhere'>Light</text>");
  const Outcome done = run({"info", path("logo.svg")});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("256 x 171 pixels"));
  EXPECT_THAT(done.out, HasSubstr("'NoSuchFontAnywhere' is not installed"));
}

TEST_F(Drawing, WhatIsLeftOutOfItIsPrintedForEveryOption) {
  write_logo("<foreignObject/>");
  place_small_lens(at("old"));
  for (const auto& [option, command] : commands()) {
    const Outcome done = run(command);
    EXPECT_EQ(done.exit_code, 0) << option << done.err;
    EXPECT_THAT(done.err,
                HasSubstr(option + path("logo.svg") + ": left out a part that is not SVG"));
    fs::remove_all(at("lens"));
  }
  EXPECT_THAT(run({"info", path("logo.svg")}).out, HasSubstr("left out a part that is not SVG"));
}

TEST_F(Drawing, ThatCrashesTheLibrariesIsRefusedForEveryOption) {
  constexpr int kDeep = 20'000;
  std::string selector;
  for (int i = 0; i < kDeep; ++i) selector += ":not(";
  write_logo("<style>" + selector + ".a" + std::string(kDeep, ')') + "{fill:red}</style>");
  place_small_lens(at("old"));
  for (const auto& [option, command] : commands()) {
    expect_refusal(run(command), 2, {path("logo.svg"), "cannot be drawn"});
    EXPECT_FALSE(fs::exists(at("lens"))) << option;
  }
  expect_refusal(run({"info", path("logo.svg")}), 2, {path("logo.svg"), "cannot be drawn"});
}

TEST_F(Drawing, ThatTakesForEverEndsAtAnInterruptForEveryOption) {
  write_logo("<text y='12' fill='white'>" + std::string(2'000'000, 'x') + "</text>");
  place_small_lens(at("old"));
  for (const auto& [option, command] : commands()) {
    Process process(command);
    ASSERT_TRUE(process.runs_for(std::chrono::seconds(2))) << option << process.wait().err;
    process.send(SIGINT);
    EXPECT_EQ(process.wait(lensforge::testing::kStopBound).exit_code, 130) << option;
    EXPECT_FALSE(fs::exists(at("lens"))) << option;
  }
}

}  // namespace
}  // namespace lensforge::scenario

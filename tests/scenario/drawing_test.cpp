// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image/image_io.h"
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

}  // namespace
}  // namespace lensforge::scenario

// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/driver.h"
#include "scenario/small_disk.h"

namespace lensforge::scenario {
namespace {

constexpr unsigned long kKibibyte = 1024;

class FullDisk : public Scenario {
 protected:
  /// No partial file may be left; whatever is there was written whole.
  void expect_nothing_half_written(const fs::path& folder) const {
    for (const std::string& name : listing(folder)) {
      EXPECT_THAT(name, ::testing::Not(::testing::HasSubstr("partial")));
    }
    EXPECT_FALSE(fs::exists(folder / "lens.json"));
  }
};

TEST_F(FullDisk, DesignSaysSoBeforeItBegins) {
  const SmallDisk disk(at("disk"), "64k");
  if (!disk.mounted()) GTEST_SKIP() << "file systems can only be mounted by root";
  const Arguments design = small_design(picture("rings.png"), path("disk/lens"));
  expect_refusal(run(design), 2, {"--pixels 32: needs about", "on disk", "would fit"});
  EXPECT_FALSE(fs::exists(at("disk/lens")));
}

TEST_F(FullDisk, DesignUnderAFileSizeLimitFailsAndIsResumable) {
  Arguments design = small_design(picture("rings.png"), path("lens"));
  design.emplace_back("--quiet");
  expect_refusal(run(design, 8 * kKibibyte), 1, {"lens", "File too large"});
  expect_nothing_half_written(at("lens"));
  design.emplace_back("--resume");
  EXPECT_EQ(run(design).exit_code, 0);
}

TEST_F(FullDisk, WhatWasToBeSaidBesidesIsLeftOut) {
  place_small_lens(at("lens"));
  write(at("cube.off"),
        "OFF\n8 6 0\n0 0 0\n0 0 9\n0 9 0\n0 9 9\n9 0 0\n9 0 9\n9 9 0\n9 9 9\n"
        "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n4 0 2 6 4\n4 1 5 7 3\n");
  constexpr unsigned long kBytes = 100;
  // It would say that the mesh was remeshed.
  expect_refusal(run({"reflect", path("cube.off"), "--out", path("out"), "--faces", "60"}, kBytes),
                 1, {"reflect.checkpoint", "File too large"});
  // It would say what is white.
  ASSERT_EQ(run({"export", path("lens"), "--out", path("lens.stl")}).exit_code, 0);
  expect_refusal(run({"render", path("lens.stl"), "--out", path("a.png")}, kBytes), 1,
                 {"a.png", "File too large"});
}

TEST_F(FullDisk, CamUnderAFileSizeLimitLeavesNoProgram) {
  place_small_lens(at("lens"));
  expect_refusal(run({"cam", path("lens"), "--light-model", "rays", "--pitch", "2mm",
                      "--tool-diameter", "4mm", "--no-rough", "--no-semi", "--quiet"},
                     8 * kKibibyte),
                 1, {"finish.ngc", "File too large"});
  EXPECT_EQ(listing(at("lens/cam")), std::vector<std::string>{});
}

TEST_F(FullDisk, RenderUnderAFileSizeLimitLeavesNoPicture) {
  place_small_lens(at("lens"));
  expect_refusal(
      run({"render", path("lens"), "--out", path("big.exr"), "--pixels", "256", "--quiet"},
          8 * kKibibyte),
      1, {"big.exr", "File too large"});
  EXPECT_FALSE(fs::exists(at("big.exr")));
}

}  // namespace
}  // namespace lensforge::scenario

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/predict/prediction.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using ::testing::HasSubstr;

CamOptions drawn(int parts) {
  CamOptions options;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.remedies = false;
  options.tolerances = parts;
  return options;
}

CamResult run(const CamOptions& options, const TempFolder& folder, const RunControl& control = {}) {
  return make_cut(small_lens(), options, folder.path(), Executor::cpu(2), control);
}

TEST(ToleranceJob, ReportsWhatToExpect) {
  const TempFolder folder;
  const CamResult result = run(drawn(10), folder);
  ASSERT_TRUE(result.done()) << result.message;
  const ToleranceForecast& forecast = result.report.tolerances;
  EXPECT_EQ(forecast.parts, 10);
  EXPECT_EQ(forecast.causes.size(), kErrorCauses);
  EXPECT_LE(forecast.mae.p10, forecast.mae.median);
  EXPECT_LE(forecast.mae.median, forecast.mae.p90);
  EXPECT_EQ(forecast.deviation.size(), 12U * 8U);
  const auto report = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_EQ(report["tolerances"]["parts"], 10);
  EXPECT_EQ(report["tolerances"]["words"], tolerance_words(forecast));
  EXPECT_EQ(report["tolerances"]["causes"].size(), kErrorCauses);
  EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr("How sure is the forecast"));
}

TEST(ToleranceJob, ByDefaultAFewAreDrawnForTheRange) {
  const TempFolder folder;
  const ToleranceForecast forecast = run(drawn(0), folder).report.tolerances;
  EXPECT_GE(forecast.parts, 10);
  EXPECT_TRUE(forecast.causes.empty());
  const auto report = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_EQ(report["tolerances"]["mae"]["p90"], forecast.mae.p90);
  EXPECT_TRUE(report["tolerances"]["causes"].empty());
  EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr(" --tolerances 50"));
}

TEST(ToleranceJob, WithoutRangeNothingIsDrawn) {
  const TempFolder folder;
  CamOptions options = drawn(0);
  options.range = false;
  EXPECT_TRUE(run(options, folder).report.tolerances.empty());
  EXPECT_FALSE(nlohmann::json::parse(read_bytes(folder / "report.json")).contains("tolerances"));
  EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr(" --tolerances 50"));
}

TEST(ToleranceJob, WhatHasNoRangeIsCutWithoutOne) {
  CamOptions two = drawn(0);
  two.workshop.process.finish.large_tool = 2;
  EXPECT_EQ(part_draws(two, small_lens().setup).parts, 0);
  CamOptions raw = drawn(0);
  raw.workshop.polish.sigma = 0.0;
  EXPECT_EQ(part_draws(raw, small_lens().setup).parts, 0);
  CamOptions programs = drawn(0);
  programs.render = false;
  EXPECT_EQ(part_draws(programs, small_lens().setup).parts, 0);
}

TEST(ToleranceJob, AMouldsPartsAreThoseThatAreCastInIt) {
  const TempFolder folder;
  CamOptions options = drawn(10);
  options.part = PartKind::kMould;
  const CamResult result = run(options, folder);
  const ToleranceForecast& forecast = result.report.tolerances;
  const PictureQuality& part = result.report.leakage.part().quality;
  EXPECT_NEAR(forecast.nominal.mae, part.metrics.mae, std::max(5e-4, 0.1 * part.metrics.mae));
}

TEST(ToleranceJob, WhatIsStoppedWhilePartsAreDrawnWritesNothing) {
  const TempFolder folder;
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress& progress) {
    if (progress.stage == "tolerances") stop.request_stop();
  });
  EXPECT_FALSE(run(drawn(10), folder, control).done());
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(ToleranceJob, RefusesWhatHasNothingToDrawFrom) {
  const TempFolder folder;
  CamOptions options = drawn(20);
  options.render = false;
  EXPECT_THAT(message_of<InputError>([&] { run(options, folder); }),
              HasSubstr("--tolerances 20: needs the predicted picture"));
  CamOptions two = drawn(20);
  two.workshop.process.finish.large_tool = 2;  // A ball of 1 mm.
  EXPECT_THAT(message_of<InputError>([&] { run(two, folder); }),
              HasSubstr("--tolerances 20: draws parts of one finishing ball only"));
  EXPECT_THAT(
      message_of<InputError>([&] {
        compare_cuts(small_lens(), drawn(20), {{0.4}, {0.06}}, folder.path(), Executor::cpu(2), {});
      }),
      HasSubstr("--tolerances 20: --compare"));
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/coupon/coupon_job.h"

#include <gmock/gmock.h>

#include <numbers>
#include <stop_token>

#include "cam/coupon/coupon_fit.h"
#include "cam/post/program_reader.h"
#include "core/error.h"
#include "core/temp_folder.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::message_of;
using ::testing::Not;
using testing::read_bytes;
using testing::TempFolder;

CouponResult make(const TempFolder& folder, const CouponOptions& options = {},
                  const RunControl& control = {}) {
  return make_coupon(options, folder.path(), Executor::cpu(2), control);
}

CouponOptions with_ball(double diameter) {
  CouponOptions options;
  for (Tool& tool : options.workshop.tools) {
    if (tool.number == options.workshop.process.finish.tool) tool = resized(tool, diameter);
  }
  return options;
}

TEST(CouponJob, WritesProgramSheetAndFileOfReadings) {
  const TempFolder folder;
  const CouponResult result = make(folder);
  EXPECT_TRUE(result.done());
  EXPECT_THAT(result.faults, IsEmpty());
  std::vector<std::string> names;
  for (const auto& file : result.files) names.push_back(file.filename().string());
  EXPECT_THAT(names, ElementsAre("coupon.ngc", "coupon.html", "measured.toml"));
  EXPECT_EQ(folder.file_count(), names.size());
  EXPECT_GT(result.minutes, 1.0);
  EXPECT_TRUE(result.known.sigma.determined);
}

TEST(CouponJob, EveryDialectHasASealedProgramOfTheSameCut) {
  for (const std::string& post : builtin_posts()) {
    const TempFolder folder;
    CouponOptions options;
    options.post = find_post(post, "--post");
    const CouponResult result = make(folder, options);
    GcodeDialect reader = options.post.reader;
    const Eigen::Vector3d& rate = options.workshop.machine.max_rate;
    if (!reader.rapid_word) reader.rapid_feeds = {rate.z(), rate.head<2>().minCoeff()};
    const ProgramReading reading =
        read_program(result.files.front(), reader, [](const auto&, int) {}, {});
    EXPECT_EQ(reading.seal_holds, true) << post;
    EXPECT_NEAR(reading.cutting.min().z(), -0.16, 1e-9);
    EXPECT_NEAR(reading.cutting.max().y() - reading.cutting.min().y(), 40.0, 1e-9) << post;
  }
}

/// Passes of a pad lie exactly its pitch apart, and its borders are passes.
TEST(CouponJob, PassesLieWhereTheReadingsSay) {
  const TempFolder folder;
  const CouponResult result = make(folder);
  const CouponOptions options;
  std::vector<CouponPad> pads = result.layout.pads;
  pads.push_back(result.layout.flat);
  for (const CouponPad& pad : pads) {
    std::vector<double> rows;
    const auto take = [&](const GcodeMotion& motion, int) {
      const bool row = !motion.rapid && motion.start.y() == motion.end.y() &&
                       motion.end.x() != motion.start.x() &&
                       pad.box.contains(Eigen::Vector2d(pad.box.center().x(), motion.end.y())) &&
                       std::min(motion.start.x(), motion.end.x()) < pad.box.center().x() &&
                       std::max(motion.start.x(), motion.end.x()) > pad.box.center().x();
      if (row) rows.push_back(motion.end.y());
    };
    read_program(result.files.front(), options.post.reader, take, {});
    ASSERT_GT(rows.size(), 20U);
    for (std::size_t i = 1; i < rows.size(); ++i) {
      EXPECT_NEAR(rows[i] - rows[i - 1], pad.pitch, 2.1e-6) << i;
    }
    EXPECT_NEAR(rows.front(), pad.box.min().y(), 1e-6);
    EXPECT_NEAR(rows.back(), pad.box.max().y(), 1e-6);
  }
}

TEST(CouponJob, SameFilesForAnyThreads) {
  const TempFolder one;
  const TempFolder two;
  const CouponResult result = make_coupon({}, one.path(), Executor::serial(), {});
  make_coupon({}, two.path(), Executor::cpu(3), {});
  for (const auto& file : result.files) {
    EXPECT_EQ(read_bytes(file), read_bytes(two / file.filename().string()));
  }
}

TEST(CouponJob, BallsOfEverySizeHaveACoupon) {
  for (const double diameter : {0.2, 0.6, 1.0, 3.0}) {
    const TempFolder folder;
    CouponOptions options = with_ball(diameter);
    options.length = 80.0;
    const CouponResult result = make(folder, options);
    EXPECT_THAT(result.faults, IsEmpty()) << diameter;
    EXPECT_TRUE(result.known.diameter.determined) << diameter;
    EXPECT_TRUE(result.known.sigma.determined) << diameter;
    for (std::size_t i = 1; i < result.layout.pads.size(); ++i) {
      EXPECT_GT(result.layout.pads[i].pitch, result.layout.pads[i - 1].pitch);
      EXPECT_GT(result.layout.pads[i].box.min().x(),
                result.layout.pads[i - 1].box.max().x() + 2.0 * diameter);
    }
  }
}

/// Polish leaves less than a part in 1e8 of the ripples of the flat pad, which is not smaller than
/// 3 x 4 mm.
TEST(CouponJob, TheFlatPadIsFlatAfterPolishing) {
  for (const double sigma : {0.0, 0.002, 0.01, 0.03, 0.2}) {
    CouponOptions options;
    options.workshop.polish.sigma = sigma;
    options.depth = 0.2;
    const CouponPad flat = coupon_layout(options).flat;
    const double polished = sigma > 0.0 ? sigma : 0.03;
    EXPECT_LT(PolishTransfer{polished}.at(2.0 * std::numbers::pi / flat.pitch), 1e-8) << sigma;
    EXPECT_GE(flat.box.sizes().minCoeff(), 3.0 - 1e-9) << sigma;
    EXPECT_LE(flat.box.sizes().maxCoeff(), 4.1) << sigma;
    EXPECT_GE(flat.pitch, 0.001);
  }
}

TEST(CouponJob, WhatCannotBeCutIsRefused) {
  const TempFolder folder;
  const auto refusal = [&](const CouponOptions& options) {
    return message_of<InputError>([&] { make(folder, options); });
  };
  CouponOptions options;
  options.length = 10.0;
  EXPECT_THAT(refusal(options), HasSubstr("--length 10: must be at least"));
  options = {};
  options.depth = 0.02;
  EXPECT_THAT(refusal(options), HasSubstr("--depth 0.02: must be at least 0.043 mm"));
  options = {};
  options.depth = 0.9;
  EXPECT_THAT(refusal(options), HasSubstr("tool.flute_length 0.8"));
  options = with_ball(1.0);
  options.depth = 0.6;
  options.thickness = 0.5;
  EXPECT_THAT(refusal(options), HasSubstr("--thickness 0.5: must be above 0.6 mm"));
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CouponJob, ClampsInTheWayAreFound) {
  const TempFolder folder;
  CouponOptions options;
  options.workshop.keep_outs = {{"vice", {10.0, 20.0, 0.0}, {12.0, 22.0, 10.0}}};
  options.workshop.process.safe_height = 1.0;
  EXPECT_THAT(make(folder, options).faults, IsEmpty()) << "rapids pass above it";
  options.workshop.keep_outs[0] = {"vice", {10.0, 10.0, 0.0}, {12.0, 14.0, 6.0}};
  const CouponResult result = make(folder, options);
  EXPECT_THAT(result.faults, Not(IsEmpty()));
  EXPECT_THAT(result.faults.front(), HasSubstr("vice"));
  EXPECT_THAT(read_bytes(folder / "coupon.html"), HasSubstr("vice"));
}

TEST(CouponJob, AMachineThatIsTooSmallIsNamed) {
  const TempFolder folder;
  CouponOptions options;
  options.workshop.machine.travel = {300.0, 30.0, 100.0};
  EXPECT_THAT(make(folder, options).faults, ElementsAre(HasSubstr("travel: Y by")));
}

TEST(CouponJob, ReadingsAreNotWrittenOver) {
  const TempFolder folder;
  make(folder);
  make(folder);  // What nobody filled in is replaced.
  const auto readings = folder / "measured.toml";
  std::string text = read_bytes(readings);
  text.replace(text.find("# distance_mm ="), 15, "distance_mm = 40.02");
  testing::write_bytes(readings, text);
  EXPECT_THAT(message_of<InputError>([&] { make(folder); }),
              HasSubstr("measured.toml: holds readings"));
  EXPECT_EQ(read_bytes(readings), text);
  CouponOptions forced;
  forced.force = true;
  make(folder, forced);
  EXPECT_NE(read_bytes(readings), text);
}

TEST(CouponJob, ACouponInAnotherDialectTakesTheEarlierOnesPlace) {
  const TempFolder folder;
  make(folder);
  testing::write_bytes(folder / "mine.ngc", "M2\n");
  CouponOptions options;
  options.post = find_post("fanuc", "--post");
  make(folder, options);
  EXPECT_TRUE(std::filesystem::exists(folder / "coupon.nc"));
  EXPECT_FALSE(std::filesystem::exists(folder / "coupon.ngc"));
  EXPECT_TRUE(std::filesystem::exists(folder / "mine.ngc"));
}

TEST(CouponJob, AWorkshopThatDoesNotPolishHasACouponToo) {
  const TempFolder folder;
  CouponOptions options;
  options.workshop.polish.sigma = 0.0;
  const CouponResult result = make(folder, options);
  EXPECT_FALSE(result.known.sigma.determined);
  EXPECT_NEAR(result.known.diameter.value, 0.4, 1e-6);
}

TEST(CouponJob, OthersFilesAreKept) {
  const TempFolder folder;
  testing::write_bytes(folder / "coupon.ngc", "G21 (mine)\n");
  EXPECT_THAT(message_of<InputError>([&] { make(folder); }), HasSubstr("coupon.ngc"));
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(CouponJob, AnInterruptLeavesNothing) {
  const TempFolder folder;
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  EXPECT_FALSE(make(folder, {}, control).done());
  EXPECT_EQ(folder.file_count(), 0U);
}

/// A task that fits a coupon's own template with the marks' distance filled in.
class WorkshopFitTest : public ::testing::Test {
 protected:
  WorkshopFitTest() {
    make(folder_);
    std::string text = read_bytes(folder_ / "measured.toml");
    text.replace(text.find("# distance_mm ="), 15, "distance_mm = 40.02");
    testing::write_bytes(folder_ / "measured.toml", text);
    task_.readings = folder_ / "measured.toml";
    task_.out = folder_ / "fitted.toml";
  }
  TempFolder folder_;
  WorkshopFit task_;
};

TEST_F(WorkshopFitTest, TheFileDiffersInWhatWasFittedOnly) {
  task_.workshop.machine.name = "mine";
  const CouponFit fit = fit_workshop(task_);
  Workshop expected = task_.workshop;
  expected.process.finish.pitch_error = fit.pitch_error.value;
  EXPECT_NEAR(fit.pitch_error.value, 5e-4, 1e-9);
  EXPECT_EQ(read_workshop(task_.out), expected);
  const std::string text = read_bytes(task_.out);
  EXPECT_THAT(text, HasSubstr("finish.pitch_error = 0.0005 +- 0.00075"));
  EXPECT_THAT(text, HasSubstr("polish.sigma is not determined, left as it was"));
}

TEST_F(WorkshopFitTest, CommentsOfTheWorkshopStay) {
  task_.workshop_text = "# Anna's mill\n[finish]\npitch = 0.05  # fine\n";
  task_.workshop = parse_workshop(task_.workshop_text, "mine");
  fit_workshop(task_);
  const std::string once = read_bytes(task_.out);
  EXPECT_THAT(once,
              HasSubstr("# Anna's mill\n[finish]\npitch_error = 5e-04\npitch = 0.05  # fine"));
  // A fit of what was fitted before says only what it did itself.
  task_.workshop_text = once;
  task_.workshop = parse_workshop(once, "mine");
  fit_workshop(task_);
  EXPECT_EQ(read_bytes(task_.out), once);
}

/// The comments of a fit without haze are as they were before there was any.
TEST_F(WorkshopFitTest, HazeThatWasNotReadIsNotMentioned) {
  task_.workshop_text = "[finish]\npitch = 0.05\n";
  task_.workshop = parse_workshop(task_.workshop_text, "mine");
  fit_workshop(task_);
  const std::string text = read_bytes(task_.out);
  EXPECT_EQ(text.substr(text.find('\n') + 1), R"(#   polish.sigma is not determined, left as it was
#   polish.order is not determined, left as it was
#   polish.floor is not determined, left as it was
#   tool.diameter is not determined, left as it was
#   finish.pitch_error = 0.0005 +- 0.00075
[finish]
pitch_error = 5e-04
pitch = 0.05
)");
}

TEST_F(WorkshopFitTest, HazeGivesThePolishItsRoughness) {
  CouponReadings readings;
  for (const double angle : {1.0, 2.0, 3.0, 4.0}) {
    const HazePlace place{angle, 2.8e-5};
    CouponState state;
    state.roughness = {12.0, 6.0};
    const double ratio = state.haze_ratio(place, readings.light);
    readings.haze.push_back({place, Reading{ratio, 0.1 * ratio}});
  }
  std::string text = "[[haze]]\n";
  for (const HazeReadings& haze : readings.haze) {
    text += "angle_deg = " + shortest_text(haze.place.angle) + "\nsolid_angle_sr = 2.8e-5\n" +
            "light_ratio = " + shortest_text(haze.ratio->value) +
            "\nlight_ratio_uncertainty = " + shortest_text(haze.ratio->uncertainty) + "\n" +
            (&haze == &readings.haze.back() ? "" : "[[haze]]\n");
  }
  testing::write_bytes(task_.readings, text);
  task_.workshop_text = "[polish]\nroughness = 3  # a guess\n";
  task_.workshop = parse_workshop(task_.workshop_text, "mine");
  const CouponFit fit = fit_workshop(task_);
  EXPECT_NEAR(fit.roughness.value, 12.0, 1e-2);
  EXPECT_NEAR(fit.correlation.value, 6.0, 1e-2);
  EXPECT_EQ(read_workshop(task_.out), fit.applied_to(task_.workshop));
  const std::string written = read_bytes(task_.out);
  EXPECT_THAT(written, HasSubstr("\n#   polish.roughness = 12 +- "));
  EXPECT_THAT(written, HasSubstr("\n#   polish.correlation = 6 +- "));
  EXPECT_THAT(written, HasSubstr("  # a guess\n"));
}

TEST_F(WorkshopFitTest, AFileOfTheUsersIsKeptUnlessForced) {
  testing::write_bytes(task_.out, "# mine\n");
  EXPECT_THAT(message_of<InputError>([&] { fit_workshop(task_); }), HasSubstr("--force"));
  EXPECT_EQ(read_bytes(task_.out), "# mine\n");
  task_.force = true;
  fit_workshop(task_);
  fit_workshop(task_);
}

TEST_F(WorkshopFitTest, ReadingsThatTellNothingWriteNothing) {
  std::string text = read_bytes(task_.readings);
  const std::string stated = "distance_uncertainty_mm = 0.03";
  text.replace(text.find(stated), stated.size(), "distance_uncertainty_mm = 0.3");
  testing::write_bytes(task_.readings, text);
  EXPECT_THAT(message_of<InputError>([&] { fit_workshop(task_); }),
              HasSubstr("1 readings: determine neither"));
  EXPECT_FALSE(std::filesystem::exists(task_.out));
}

}  // namespace
}  // namespace lensforge

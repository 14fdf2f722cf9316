// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/job/nest_job.h"
#include "cam/post/program_reader.h"
#include "cam/rs274_interpreter.h"
#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/optics/front.h"
#include "core/temp_folder.h"
#include "core/text/number_text.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(NestLayout, RectanglesKeepTheirDistances) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> side(5.0, 60.0);
  for (int round = 0; round < 50; ++round) {
    std::vector<NestItem> items;
    items.reserve(9);
    for (int k = 0; k < 9; ++k) items.push_back({"", {side(random), side(random)}});
    const NestSheet sheet{{200.0, 400.0}, 0.1 * side(random), 0.1 * side(random)};
    const std::vector<Eigen::Vector2d> corners = place_in_rows(items, sheet);
    for (std::size_t i = 0; i < items.size(); ++i) {
      const Eigen::AlignedBox2d box(corners[i], Eigen::Vector2d(corners[i] + items[i].size));
      EXPECT_GE(box.min().minCoeff(), sheet.edge - 1e-9);
      EXPECT_GE((sheet.size - box.max()).minCoeff(), sheet.edge - 1e-9);
      const Eigen::Vector2d steps = corners[i] / kNestStep;
      EXPECT_NEAR(steps.x(), std::round(steps.x()), 1e-6);
      EXPECT_NEAR(steps.y(), std::round(steps.y()), 1e-6);
      for (std::size_t j = 0; j < i; ++j) {
        const Eigen::AlignedBox2d other(corners[j], Eigen::Vector2d(corners[j] + items[j].size));
        const Eigen::Array2d apart =
            (box.min() - other.max()).array().max((other.min() - box.max()).array());
        EXPECT_GE(apart.maxCoeff(), sheet.gap - 1e-9);
      }
    }
  }
}

TEST(NestLayout, RefusesWithASizeThatWouldDo) {
  const std::vector<NestItem> items(5, {"bee", {40.0, 30.0}});
  EXPECT_THAT(message_of<InputError>([&] {
                place_in_rows(items, {{100.0, 90.0}, 5.0, 4.0});
              }),
              AllOf(HasSubstr("--blank 100 x 90 mm"), HasSubstr("100 x 108 mm works")));
  EXPECT_EQ(place_in_rows(items, {{100.0, 108.0}, 5.0, 4.0}).size(), 5U);
  EXPECT_THAT(message_of<InputError>([&] {
                place_in_rows(items, {{45.0, 300.0}, 5.0, 4.0});
              }),
              HasSubstr("48 x 300 mm works"));
  EXPECT_EQ(place_in_rows(items, {{48.0, 300.0}, 5.0, 4.0}).size(), 5U);
}

/// Two lenses of different size and height, one of them round, the first twice.
class NestJob : public ::testing::Test {
 protected:
  NestJob() {
    disc_.setup.outline = circle_outline(disc_.setup.lens_size);
    disc_.surface.vertices.row(2).array() += 0.4;
    options_.blank = {60.0, 30.0};
    options_.cam.job = "nest";
    options_.cam.render = false;
    options_.cam.cut_outline = OutlineWish::kAlways;
    options_.cam.tabs = {2, 1.0, 0.5};
    options_.cam.workshop.process.rough.ramp_angle_deg = 20.0;
    lenses_ = {{"bee", &bee_}, {"disc", &disc_}, {"bee_2", &bee_}};
  }

  NestResult run() { return make_nest(lenses_, options_, folder_.path(), Executor::cpu(2), {}); }
  std::string refusal() {
    return message_of<InputError>([&] { plan_nest(lenses_, options_); });
  }

  [[nodiscard]] double needed_thickness() const { return least_thickness(lenses_, options_); }

  Lens bee_ = small_lens(4.0, 3.0);
  Lens disc_ = small_lens(6.0, 5.0);
  NestOptions options_;
  std::vector<NestLens> lenses_;
  TempFolder folder_;
};

TEST_F(NestJob, WritesOneProgramForEachOperationAndAReportForEachLens) {
  const NestResult result = run();
  ASSERT_TRUE(result.done());
  for (const NestedLens& lens : result.layout.lenses) {
    for (const LimitCheck& check : lens.report.verdict.checks) {
      EXPECT_TRUE(check.passes()) << lens.name << ' ' << check.key;
    }
  }
  EXPECT_TRUE(result.passes());
  EXPECT_EQ(result.tool_changes, 4);
  std::vector<std::string> names;
  for (const NestProgram& program : result.programs) names.push_back(program.file);
  EXPECT_THAT(names, ElementsAre("rough.ngc", "semi.ngc", "finish.ngc", "outline.ngc"));
  for (const std::string& name : names) {
    EXPECT_EQ(check_seal(folder_ / name), true) << name;
    const std::string text = read_bytes(folder_ / name);
    EXPECT_THAT(
        text, AllOf(HasSubstr("X0 Y0: lower left corner of the blank"), HasSubstr("lens 3 of 3")));
  }
  for (const char* lens : {"bee", "disc", "bee_2"}) {
    const auto report = nlohmann::json::parse(read_bytes(folder_ / lens / "report.json"));
    EXPECT_EQ(report["operations"].size(), 4U);
    EXPECT_EQ(report["operations"][2]["file"], "finish.ngc");
    EXPECT_TRUE(std::filesystem::exists(folder_ / lens / "report.html"));
  }
  const auto json = nlohmann::json::parse(read_bytes(folder_ / nest_file::kJson));
  EXPECT_EQ(json["lenses"].size(), 3U);
  EXPECT_THAT(read_bytes(folder_ / nest_file::kLayout),
              AllOf(HasSubstr("<svg"), HasSubstr(">bee_2<"), HasSubstr("X0 Y0")));
}

struct Way {
  std::vector<GcodeMotion> motions;

  /// Those at feed whose end lies in a box.
  static Way of(const std::filesystem::path& program, const GcodeDialect& dialect,
                const Eigen::AlignedBox2d& box) {
    Way way;
    read_program(program, dialect,
                 [&](const GcodeMotion& motion, int) {
                   if (!motion.rapid && box.contains(Eigen::Vector2d(motion.end.head<2>()))) {
                     way.motions.push_back(motion);
                   }
                 },
                 {});
    return way;
  }
};

TEST_F(NestJob, MovesAreThoseOfSingleCuts) {
  ASSERT_TRUE(run().done());
  const NestPlan plan = plan_nest(lenses_, options_);
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    const TempFolder alone;
    make_cut(*lenses_[k].lens, plan.cuts[k], alone.path(), Executor::cpu(2), {});
    const Eigen::AlignedBox2d& place = plan.layout.lenses[k].box;
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * plan.layout.gap);
    for (const char* name : {"rough.ngc", "semi.ngc", "finish.ngc", "outline.ngc"}) {
      const GcodeDialect& dialect = options_.cam.post.reader;
      const Way own =
          Way::of(alone / name, dialect, {Eigen::Vector2d(-99, -99), Eigen::Vector2d(99, 99)});
      const Way nested =
          Way::of(folder_ / name, dialect,
                  {Eigen::Vector2d(place.min() - half), Eigen::Vector2d(place.max() + half)});
      ASSERT_EQ(own.motions.size(), nested.motions.size()) << name << " of " << lenses_[k].name;
      double worst = 0.0;
      for (std::size_t i = 0; i < own.motions.size(); ++i) {
        Eigen::Vector3d end = nested.motions[i].end;
        end.head<2>() -= place.min();
        worst = std::max(worst, (end - own.motions[i].end).cwiseAbs().maxCoeff());
        EXPECT_EQ(nested.motions[i].feed, own.motions[i].feed);
        EXPECT_EQ(nested.motions[i].arc.has_value(), own.motions[i].arc.has_value());
      }
      EXPECT_LT(worst, 1e-9) << name << " of " << lenses_[k].name;
    }
  }
}

TEST_F(NestJob, PredictionIsThatOfTheSingleCut) {
  options_.cam.render = true;
  options_.cam.remedies = false;
  options_.cam.sample_spacing = 0.03;
  lenses_.pop_back();
  const NestResult result = run();
  ASSERT_TRUE(result.done());
  const NestPlan plan = plan_nest(lenses_, options_);
  for (std::size_t k = 0; k < lenses_.size(); ++k) {
    const TempFolder alone;
    const CamResult single =
        make_cut(*lenses_[k].lens, plan.cuts[k], alone.path(), Executor::cpu(2), {});
    const PictureQuality& nested = result.layout.lenses[k].report.leakage.part().quality;
    const PictureQuality& own = single.report.leakage.part().quality;
    EXPECT_NEAR(nested.leakage, own.leakage, 1e-9);
    EXPECT_NEAR(nested.metrics.mae, own.metrics.mae, 1e-9);
    EXPECT_TRUE(std::filesystem::exists(folder_ / lenses_[k].name / cam_file::kMilledMesh));
  }
}

/// Nothing is cut outside of the blank but by tools that stand on its edge, nor in another lens.
TEST_F(NestJob, AnotherInterpreterFindsTheSameExtents) {
  const auto rs274 = lensforge::testing::rs274_interpreter();
  if (!rs274) GTEST_SKIP() << "rs274 is not there: tests/cam/fetch_rs274.sh build/rs274";
  const NestResult result = run();
  for (const NestProgram& program : result.programs) {
    const auto reading = lensforge::testing::read_with_rs274(*rs274, folder_ / program.file);
    EXPECT_TRUE(reading.accepted) << reading.errors;
    Eigen::AlignedBox3d reach;
    for (const auto& motion : reading.motions) {
      if (motion.feed) reach.extend(motion.to);
    }
    EXPECT_GE(reach.min().head<2>().minCoeff(), 0.0);
    EXPECT_LE(reach.max().x(), result.layout.blank.x());
    EXPECT_LE(reach.max().y(), result.layout.blank.y());
    EXPECT_GE(reach.min().z(), -result.layout.blank.z() - 1e-4);
  }
}

TEST_F(NestJob, ASecondNestTakesTheFirstOnesPlace) {
  ASSERT_TRUE(run().done());
  lenses_.pop_back();
  options_.cam.workshop.process.semi.enabled = false;
  ASSERT_TRUE(run().done());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "bee_2"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "semi.ngc"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "disc" / "report.html"));
}

/// The first lens stays clear of a clamp that lies where the second one is.
TEST_F(NestJob, ClampsLieOnTheBlank) {
  const Eigen::AlignedBox2d place = plan_nest(lenses_, options_).layout.lenses[0].box;
  KeepOut clamp{"clamp", {0.0, 0.0, 0.0}, {0.0, 0.0, 20.0}};
  clamp.low.head<2>() = place.center();
  clamp.high.head<2>() = place.max();
  options_.cam.workshop.keep_outs = {clamp};
  const NestResult result = run();
  EXPECT_FALSE(result.passes());
  EXPECT_THAT(result.layout.lenses[0].report.warnings,
              ::testing::Contains(AllOf(HasSubstr("clamp"), HasSubstr("finish of bee"))));
  EXPECT_THAT(result.layout.lenses[1].report.warnings,
              Not(::testing::Contains(HasSubstr("finish of disc"))));
}

TEST_F(NestJob, RectanglesThatStayJoinedAreNamed) {
  options_.cam.cut_outline = OutlineWish::kIfShaped;
  const NestResult result = run();
  EXPECT_THAT(result.warnings, ::testing::ElementsAre(HasSubstr("bee: stays joined"),
                                                      HasSubstr("bee_2: stays joined")));
}

TEST_F(NestJob, WhatDoesNotFitOneBlankIsRefusedInOneLine) {
  options_.blank = {20.0, 10.0};
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--blank 20 x 10 mm"), HasSubstr("works")));
  options_.blank = {60.0, -1.0};
  EXPECT_THAT(refusal(), HasSubstr("both sides must be above 0"));
  options_.blank = {60.0, 30.0};
  options_.thickness = 5.0;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("a thickness of 5 mm is too little for disc"),
                               HasSubstr("must be at least")));
  options_.thickness.reset();
  options_.gap = 1.0;
  EXPECT_THAT(refusal(), AllOf(HasSubstr("--gap 1: must be at least"), HasSubstr("for the tools")));
  options_.gap = 0.0;
  options_.cam.z_zero = ZZero::kLens;
  EXPECT_THAT(refusal(), HasSubstr("--z-zero lens: lenses of one blank differ in height"));
  options_.cam.z_zero = ZZero::kStock;
  options_.cam.part = PartKind::kMould;
  EXPECT_THAT(refusal(), HasSubstr("--part mould"));
  options_.cam.part = PartKind::kLens;
  disc_.setup.ior = 1.53;
  EXPECT_THAT(refusal(), HasSubstr("disc: was designed for index 1.53, bee for 1.49"));
  disc_.setup.ior = bee_.setup.ior;
  disc_.setup.front = spherical_front(100.0, disc_.setup.lens_size);
  EXPECT_THAT(refusal(), HasSubstr("disc: has a curved front"));
  disc_.setup.front.reset();
  disc_.setup.body = MirrorBody{};
  EXPECT_THAT(refusal(), HasSubstr("disc: is a mirror, bee is a lens"));
  lenses_.clear();
  EXPECT_THAT(refusal(), HasSubstr("no lens folder is named"));
}

/// Nothing above its flutes may be in the blank, so what is named is as long as the blank is thick.
TEST_F(NestJob, AnOutlineToolThatIsTooShortIsNamedWithOneThatWouldDo) {
  Workshop& shop = options_.cam.workshop;
  const auto advice = [&] {
    const std::vector<std::string> all = run().warnings;
    const auto found = std::find_if(all.begin(), all.end(), [](const std::string& one) {
      return one.starts_with("--outline-tool");
    });
    return found == all.end() ? "" : *found;
  };
  const auto add_mill = [&](int number, double flutes) {
    Tool mill = shop.tool(3);
    mill.number = number;
    mill.flute_length = flutes;
    mill.sections = {{6.0, flutes, 40.0}};
    shop.tools.push_back(mill);
    options_.cam.outline_tool = number;
  };
  EXPECT_EQ(advice(), "");
  add_mill(7, 4.0);
  EXPECT_EQ(advice(), "--outline-tool 7: goes 4 mm deep at most, too short for a blank of " +
                          trimmed_decimal(needed_thickness(), 3) + " mm; --outline-tool 3 works");
  shop.tools.front().flute_length = 3.0;
  EXPECT_THAT(advice(), HasSubstr("a flat end mill with flutes of"));
  options_.thickness = 14.0;
  add_mill(8, 8.5);
  EXPECT_THAT(advice(), AllOf(HasSubstr("too short for a blank of 14 mm; --blank 60,30,"),
                              HasSubstr(" works")));
  options_.thickness.reset();
  EXPECT_EQ(advice(), "");
}

TEST_F(NestJob, ALensFolderIsNotWrittenInto) {
  lensforge::testing::write_bytes(folder_ / lens_file::kJson, "{}");
  EXPECT_THAT(message_of<InputError>([&] { run(); }), HasSubstr("is a lens folder"));
}

}  // namespace
}  // namespace lensforge

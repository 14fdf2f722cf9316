// SPDX-License-Identifier: GPL-3.0-or-later
// How tools get down into material, beside clamps and without: programs are judged by a reader and
// a removal simulation of the test's own, and by the command's reader.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/contact/profile_cutter.h"
#include "cam/dexel_stock.h"
#include "cam/path/collision.h"
#include "cam/path/rough.h"
#include "cam/plan/program_watch.h"
#include "cam/program_ways.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::DexelStock;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using lensforge::testing::Way;
using lensforge::testing::ways_of;
using lensforge::testing::write_bytes;
using ::testing::HasSubstr;

using Files = std::vector<std::filesystem::path>;

/// Rise over run that no test lens exceeds (lens_relief()), with a tool's allowance on it.
constexpr double kSteepest = 0.5;

/// What a tool may sink faster than that in material at the cutting feed, mm: where it rolls over
/// the lens's rim.
constexpr double kSlack = 0.25;

/// Effects of programs on a blank.
struct Deeds {
  double sunk = 0.0;                   ///< Most that a tool dived at more than its plunge feed, mm.
  std::map<std::string, double> into;  ///< By program: how deep a tool was in a clamp, mm.

  [[nodiscard]] double deepest(const std::string& program) const {
    const auto found = into.find(program);
    return found == into.end() ? 0.0 : found->second;
  }
};

/// Follows a program's ways in small steps.
class Judge {
 public:
  Judge(const Workshop& workshop, const Eigen::AlignedBox3d& blank, double z_offset)
      : workshop_(workshop), stock_(blank, 0.08), down_(0.0, 0.0, z_offset) {}

  Deeds run(const Files& files) {
    for (const std::filesystem::path& file : files) {
      if (file.extension() != ".ngc") continue;
      sunk_ = 0.0;
      for (const Way& way : ways_of(file)) take(way, file.stem().string());
    }
    return deeds_;
  }

 private:
  void take(const Way& way, const std::string& program) {
    const Eigen::Vector3d from = way.from - down_;
    const Eigen::Vector3d to = way.to - down_;
    if (from.hasNaN() || to.hasNaN()) return;
    const Tool& tool = workshop_.tool(way.tool);
    const auto steps = std::max(1.0, std::ceil((to - from).norm() / 0.05));
    for (double i = 1.0; i <= steps; ++i) {
      const Eigen::Vector3d begin = from + (i - 1.0) / steps * (to - from);
      const Eigen::Vector3d end = from + i / steps * (to - from);
      see_clamps(tool, end, program);
      if (!way.rapid) see_descent(way, tool, begin, end);
    }
    if (way.rapid) sunk_ = 0.0;
  }

  void see_clamps(const Tool& tool, const Eigen::Vector3d& tip, const std::string& program) {
    for (const KeepOut& clamp : workshop_.keep_outs) {
      const Eigen::AlignedBox3d box(clamp.low, clamp.high);
      for (const CutterProfile& part : whole_profile(tool)) {
        const double depth = profile_box_tip(part, tip.head<2>(), box) - tip.z();
        double& most = deeds_.into[program];
        most = std::max(most, depth);
      }
    }
  }

  void see_descent(const Way& way, const Tool& tool, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& to) {
    const double ramp = std::tan(workshop_.process.rough.ramp_angle_deg * std::numbers::pi / 180.0);
    const bool cuts = stock_.cut(cutting_profile(tool), from, to) > 0.02;
    const double down = cuts ? from.z() - to.z() : std::min(0.0, from.z() - to.z());
    const bool fast = way.feed > 1.01 * tool.plunge;
    const double run = (to - from).head<2>().norm();
    sunk_ = fast ? std::max(0.0, sunk_ + down - (kSteepest + ramp) * run) : 0.0;
    deeds_.sunk = std::max(deeds_.sunk, sunk_);
  }

  const Workshop& workshop_;
  DexelStock stock_;
  Eigen::Vector3d down_;
  double sunk_ = 0.0;
  Deeds deeds_;
};

/// Numbers for one case.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double pick(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  bool coin() { return engine_() % 2 == 0; }
  template <class T, std::size_t kCount>
  T one_of(const std::array<T, kCount>& all) {
    return all[engine_() % kCount];
  }

 private:
  std::mt19937 engine_;
};

/// A clamp that stands beside the part, on its margin, over a corner of it, or right across it.
KeepOut random_clamp(Random& random, const Eigen::Vector2d& size, double margin, double top) {
  const auto along = [&](double length) {
    const double middle = random.pick(-margin, length + margin);
    const double half = random.pick(0.2, 2.0);
    return Eigen::Vector2d(middle - half, middle + half);
  };
  const Eigen::Vector2d x = along(size.x());
  const Eigen::Vector2d y = random.coin() ? along(size.y()) : Eigen::Vector2d(-20.0, 20.0);
  const double high = random.coin() ? random.pick(0.3, top) : random.pick(top, top + 8.0);
  const bool turned = random.coin();
  return {"clamp",
          {turned ? y[0] : x[0], turned ? x[0] : y[0], 0.0},
          {turned ? y[1] : x[1], turned ? x[1] : y[1], high}};
}

CamOptions coarse_cut() {
  CamOptions options;
  options.render = false;
  options.arcs = false;
  FinishProcess& finish = options.workshop.process.finish;
  finish.pitch = 0.2;
  finish.slope_tolerance = 5e-3;
  finish.tolerance = 2e-3;
  return options;
}

CamOptions random_cut(Random& random) {
  constexpr std::array kStyles{PassStyle::kZigzag, PassStyle::kClimb, PassStyle::kConventional};
  constexpr std::array kAxes{PassAxis::kX, PassAxis::kY};
  constexpr std::array kEntries{EntryStyle::kRamp, EntryStyle::kHelix};
  CamOptions options = coarse_cut();
  Workshop& shop = options.workshop;
  shop.stock = {random.pick(0.45, 6.0), random.pick(0.2, 2.0)};
  shop.process.clearance = random.one_of(std::array{0.05, 0.3, 0.5});
  shop.process.rough.style = random.one_of(kStyles);
  shop.process.rough.along = random.one_of(kAxes);
  shop.process.rough.entry = random.one_of(kEntries);
  shop.process.semi.style = random.one_of(kStyles);
  shop.process.semi.along = random.one_of(kAxes);
  shop.process.semi.enabled = random.coin() || random.coin();
  for (Tool& tool : shop.tools) {
    if (tool.number != shop.process.rough.tool) continue;
    tool.shape = random.one_of(
        std::array{CutterShape::kFlat, CutterShape::kFlat, CutterShape::kBull, CutterShape::kBall});
    if (tool.shape == CutterShape::kBull) tool.corner_radius = 0.5;
    const double neck = random.pick(8.0, 12.0);
    tool.sections = {{random.pick(3.0, 6.0), 8.0, neck}, {random.pick(6.0, 19.0), neck, 50.0}};
  }
  return options;
}

bool passes(const ReportData& report, const std::string& key) {
  const auto& checks = report.verdict.checks;
  const auto found = std::find_if(checks.begin(), checks.end(),
                                  [&](const LimitCheck& check) { return check.key == key; });
  return found != checks.end() && found->passes();
}

TEST(MotionSafety, BesideClampsToolsComeDownAtTheirPlungeFeedAndTouchNone) {
  int crossed = 0;
  for (unsigned seed = 0; seed < 16; ++seed) {
    Random random(seed);
    const Lens lens = small_lens(random.pick(4.0, 8.0), random.pick(4.0, 8.0));
    CamOptions options = random_cut(random);
    Workshop& shop = options.workshop;
    const double top = lens.surface.vertices.row(2).maxCoeff() + shop.stock.allowance;
    const int count = 1 + static_cast<int>(random.pick(0.0, 3.0));
    for (int k = 0; k < count; ++k) {
      shop.keep_outs.push_back(
          random_clamp(random, lens.setup.lens_size, shop.stock.margin + 1.0, top));
    }
    const TempFolder folder;
    const CamResult result = make_cut(lens, options, folder.path(), Executor::cpu(2), {});
    const ReportData& report = result.report;
    const Deeds deeds = Judge(shop, report.setup.blank, report.z_offset).run(result.files);
    EXPECT_LT(deeds.sunk, kSlack) << seed;
    EXPECT_TRUE(passes(report, "descents")) << seed << ::testing::PrintToString(report.warnings);
    for (const char* program : {"rough", "semi"}) {
      EXPECT_LT(deeds.deepest(program), 1e-3) << program << seed;
    }
    if (deeds.deepest("finish") > 1e-3) {
      ++crossed;
      EXPECT_FALSE(passes(report, "collisions")) << seed;
    }
  }
  EXPECT_GT(crossed, 2);
}

TEST(MotionSafety, NormalCutsRaiseNoAlarm) {
  for (unsigned seed = 0; seed < 16; ++seed) {
    Random random(100 + seed);
    const Lens lens = small_lens(random.pick(3.0, 8.0), random.pick(3.0, 8.0));
    CamOptions options = random_cut(random);
    options.arcs = random.coin();
    options.part = random.coin() ? PartKind::kLens : PartKind::kMould;
    FinishProcess& finish = options.workshop.process.finish;
    finish.cross = random.coin();
    finish.pencil = random.coin();
    finish.style = random.coin() ? PassStyle::kZigzag : PassStyle::kClimb;
    const TempFolder folder;
    const ReportData report = make_cut(lens, options, folder.path(), Executor::cpu(2), {}).report;
    EXPECT_TRUE(passes(report, "descents")) << seed << ::testing::PrintToString(report.warnings);
  }
}

TEST(MotionSafety, ClampsBetweenNestedLensesAreNoExcuseToDive) {
  const Lens bee = small_lens(5.0, 4.0);
  const Lens disc = small_lens(6.0, 5.0);
  NestOptions options;
  options.cam = coarse_cut();
  options.blank = {45.0, 25.0};
  options.cam.workshop.keep_outs = {{"bar", {9.0, -5.0, 0.0}, {11.0, 7.0, 5.6}},
                                    {"post", {12.0, 7.5, 0.0}, {13.0, 8.5, 12.0}}};
  const TempFolder folder;
  const NestResult result =
      make_nest({{"bee", &bee}, {"disc", &disc}}, options, folder.path(), Executor::cpu(2), {});
  const Eigen::AlignedBox3d blank(Eigen::Vector3d::Zero(), result.layout.blank);
  const Deeds deeds = Judge(options.cam.workshop, blank, result.z_offset).run(result.files);
  EXPECT_LT(deeds.sunk, kSlack);
  EXPECT_LT(deeds.deepest("rough"), 1e-3);
  for (const NestedLens& lens : result.layout.lenses) {
    EXPECT_TRUE(passes(lens.report, "descents")) << ::testing::PrintToString(lens.report.warnings);
  }
}

/// Finds what `text`, a program for roughing with tool 3, does on a whole blank.
std::vector<SteepDescent> descents_in(const std::string& text) {
  const Lens lens = small_lens(12.0, 10.0);
  Workshop workshop;
  workshop.stock = {6.0, 0.5};
  const ProfileCutter surface(lens.surface);
  CollisionCheck collisions(surface, workshop, whole_blank(workshop, surface.bounds()));
  ProgramWatch watch(collisions, workshop.tools, 0.0, 20.0);
  const TempFolder folder;
  write_bytes(folder / "rough.ngc", text);
  const WatchedOperation rough{"rough", workshop.tool(3), descent_rule(workshop.process, "rough")};
  walk_program(folder / "rough.ngc", linuxcnc_dialect(),
               [&](const ProgramLine& line) { watch.take(rough, line); }, {});
  return collisions.descents();
}

const std::string kHead = "G21 G90 G17 G94\nG0 Z20\nT3 M6\nG0 Z20\nS12000 M3\n";
const std::string kTail = "G0 Z20\nM5\nM2\n";

/// As roughing once went over a clamp: up, across and down again at the cutting feed.
TEST(MotionSafety, AProgramThatDivesBehindAClampIsFoundWhoeverWroteIt) {
  const std::string lifted = "G0 X-4 Y3\nG0 Z10\nG1 X-1.1 Z10 F1400\n";
  const auto found = descents_in(kHead + lifted + "X-1.0 Z5.0\nX9\n" + kTail);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].first.line, 9);
  EXPECT_EQ(found[0].feed, 1400.0);
  EXPECT_GT(found[0].angle_deg, 88.0);
  EXPECT_NEAR(found[0].place.x(), -1.0, 0.05);
  EXPECT_NEAR(found[0].place.y(), 3.0, 1e-9);
  EXPECT_THAT(found[0].sentence("rough.ngc"),
              HasSubstr("rough.ngc line 9: in 'rough' tool 3 goes down into material at 89 degrees "
                        "and F1400"));
  EXPECT_TRUE(descents_in(kHead + lifted + "X-1.0 Z5.0 F400\nX9 F1400\n" + kTail).empty());
  const std::string again = "X-1.0 Z5.0 F400\nX9 F1400\nG0 Z12\nG0 X3\nG1 Z5.0 F1400\n";
  EXPECT_TRUE(descents_in(kHead + lifted + again + kTail).empty()) << "it is cut there";
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
// Programs as an operator runs them, read back by a reader and a removal simulation of the test's
// own: what they do that a machine must not, the report has to say.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/dexel_stock.h"
#include "cam/path/collision.h"
#include "cam/plan/finishing.h"
#include "cam/program_ways.h"
#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge::cut_safety_test {
namespace {

using lensforge::testing::DexelStock;
using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using lensforge::testing::Way;
using lensforge::testing::ways_of;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

/// Coordinates are rounded to 4 decimals at least.
constexpr double kRounding = 1e-4;

/// What a rapid may seem to touch: the lattice's and the stock map's cells, on slopes up to 1.
constexpr double kLattice = 0.15;

/// Actions of a cut's programs.
struct Deeds {
  double lowest = HUGE_VAL;    ///< Of any tip, mm, lens frame.
  double deepest_rapid = 0.0;  ///< Of a cutter in material, mm.
  Eigen::AlignedBox3d reached;
};

Deeds deeds_of(const CamResult& result, const CamOptions& options) {
  Deeds deeds;
  const SetupSheet& setup = result.report.setup;
  DexelStock stock(setup.blank, 0.05);
  const Eigen::Vector3d down(0.0, 0.0, result.report.z_offset);
  for (const auto& file : result.files) {
    if (file.extension() != ".ngc") continue;
    for (const Way& way : ways_of(file)) {
      const Eigen::Vector3d to = way.to - down;
      if (!std::isnan(to.z())) deeds.lowest = std::min(deeds.lowest, to.z());
      if (to.hasNaN()) continue;
      deeds.reached.extend(to);
      const Eigen::Vector3d from = way.from - down;
      if (from.hasNaN()) continue;
      const CutterProfile profile = cutting_profile(options.workshop.tool(way.tool));
      if (!way.rapid) {
        stock.cut(profile, from, to);
      } else if (to.z() < from.z() || to.head<2>() != from.head<2>()) {
        deeds.deepest_rapid = std::max(deeds.deepest_rapid, stock.touched(profile, from, to));
      }
    }
  }
  return deeds;
}

const LimitCheck& check_named(const CamResult& result, std::string_view key) {
  for (const LimitCheck& check : result.report.verdict.checks) {
    if (check.key == key) return check;
  }
  throw std::runtime_error("no check " + std::string(key));
}

/// A thin or thick lens of random relief.
Lens random_lens(std::mt19937& random) {
  const auto pick = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Lens lens = small_lens(pick(1.8, 3.0), pick(1.8, 2.6));
  const double thickness = std::exp(pick(std::log(0.02), std::log(4.0)));
  const double relief = pick(0.0, 0.3);
  for (std::int64_t v = 0; v < lens.surface.vertex_count(); ++v) {
    double& z = lens.surface.vertices(2, v);
    z = thickness + relief * (z - 5.4);
  }
  return lens;
}

CamOptions random_options(std::mt19937& random) {
  const auto pick = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto coin = [&] { return random() % 2 == 0; };
  CamOptions options;
  options.render = false;
  options.arcs = false;
  options.z_zero = std::array{ZZero::kStock, ZZero::kTable, ZZero::kLens}[random() % 3];
  options.grouping = std::array{ProgramGrouping::kOperation, ProgramGrouping::kTool,
                                ProgramGrouping::kAll}[random() % 3];
  Workshop& shop = options.workshop;
  for (Tool& tool : shop.tools) {
    if (tool.number == shop.process.finish.tool) tool = resized(tool, pick(0.3, 1.7));
    if (tool.number == shop.process.rough.tool && coin()) tool.shape = CutterShape::kBall;
  }
  const double apron = apron_to_cut(options);
  shop.stock = {coin() ? apron : pick(apron, 2.0 + apron), pick(0.0, 1.0)};
  shop.process.safe_height = pick(kMinSafeHeight, 3.0);
  shop.process.rough.enabled = coin();
  shop.process.semi.enabled = coin();
  FinishProcess& finish = shop.process.finish;
  finish.pitch = 0.3 * shop.tool(finish.tool).diameter;
  finish.slope_tolerance = 5e-3;
  finish.tolerance = 2e-3;
  finish.cross = coin();
  finish.pencil = coin();
  finish.style =
      std::array{PassStyle::kZigzag, PassStyle::kClimb, PassStyle::kConventional}[random() % 3];
  return options;
}

TEST(CutSafety, NoToolIsBelowTheTableAndNoRapidInTheBlankUnlessTheReportSaysSo) {
  int below = 0;
  int above = 0;
  for (unsigned seed = 0; seed < 24; ++seed) {
    std::mt19937 random(seed);
    const Lens lens = random_lens(random);
    const CamOptions options = random_options(random);
    const TempFolder folder;
    const CamResult result = make_cut(lens, options, folder.path(), Executor::cpu(2), RunControl());
    const Deeds deeds = deeds_of(result, options);
    const LimitCheck& table = check_named(result, "table");
    const LimitCheck& collisions = check_named(result, "collisions");
    (deeds.lowest < -kRounding ? below : above) += 1;
    EXPECT_EQ(table.passes(), deeds.lowest >= -kRounding) << seed << " " << deeds.lowest;
    EXPECT_NEAR(table.value, std::max(0.0, -deeds.lowest), kRounding) << seed;
    if (!table.passes()) {
      EXPECT_FALSE(collisions.passes()) << seed;
      EXPECT_THAT(result.report.warnings, Contains(HasSubstr(kTableObstacle))) << seed;
    }
    if (deeds.deepest_rapid > kLattice) {
      EXPECT_FALSE(collisions.passes()) << seed << " " << deeds.deepest_rapid;
    }
    for (int axis = 0; axis < 2; ++axis) {
      EXPECT_NEAR(check_named(result, std::string("travel_") + "xyz"[axis]).value,
                  deeds.reached.sizes()[axis], 1e-9)
          << seed;
    }
  }
  EXPECT_GT(below, 3);
  EXPECT_GT(above, 3);
}

CamOptions programs_only() {
  CamOptions options;
  options.render = false;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.finish.slope_tolerance = 5e-3;
  return options;
}

TEST(CutSafety, ABallThatIsLargerThanTheLensIsThickRunsIntoTheTable) {
  Lens lens = small_lens(3.0, 3.0);
  lens.surface.vertices.row(2).setConstant(0.05);
  CamOptions options = programs_only();
  for (Tool& tool : options.workshop.tools) {
    if (tool.number == 1) tool = resized(tool, 1.4);
  }
  for (const ZZero zero : {ZZero::kStock, ZZero::kTable, ZZero::kLens}) {
    options.z_zero = zero;
    const TempFolder folder;
    const CamResult result = make_cut(lens, options, folder.path(), Executor::serial(), {});
    EXPECT_FALSE(check_named(result, "table").passes()) << words_for(zero);
    EXPECT_THAT(result.message, HasSubstr("limits were missed"));
    EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr("below the blank"));
  }
}

TEST(CutSafety, ASurfaceBelowTheTableIsRefused) {
  Lens lens = small_lens();
  lens.surface.vertices.row(2).array() -= lens.surface.vertices.row(2).minCoeff() + 0.001;
  const TempFolder folder;
  EXPECT_THAT(message_of<InputError>(
                  [&] { make_cut(lens, programs_only(), folder.path(), Executor::serial(), {}); }),
              AllOf(HasSubstr("surface"), HasSubstr("below")));
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CutSafety, MotionBeyondTheMachinesTravelIsAMissedLimit) {
  CamOptions options = programs_only();
  const TempFolder folder;
  const Lens lens = small_lens();
  const auto cut = [&] { return make_cut(lens, options, folder.path(), Executor::serial(), {}); };
  const Eigen::Vector3d travel = options.workshop.machine.travel;
  const std::array keys{"travel_x", "travel_y", "travel_z"};
  for (int axis = 0; axis < 3; ++axis) {
    const double needed = check_named(cut(), keys[static_cast<std::size_t>(axis)]).value;
    EXPECT_GT(needed, 2.0);
    options.workshop.machine.travel[axis] = needed;
    EXPECT_TRUE(check_named(cut(), keys[static_cast<std::size_t>(axis)]).passes()) << axis;
    options.workshop.machine.travel[axis] = 0.99 * needed;
    const CamResult result = cut();
    EXPECT_FALSE(check_named(result, keys[static_cast<std::size_t>(axis)]).passes());
    EXPECT_THAT(result.report.warnings, Contains(HasSubstr("farther than the machine's travel")));
    options.workshop.machine.travel = travel;
  }
}

/// A description of the LinuxCNC kind with one of its lists of lines replaced.
PostDescription post_with(const std::string& key, const std::string& lines) {
  std::string text = read_bytes(LENSFORGE_POSTS "/linuxcnc.toml");
  const std::size_t begin = text.find("\n" + key + " = [");
  const std::size_t end = text.find(']', begin);
  text.replace(begin, end + 1 - begin, "\n" + key + " = [" + lines + "]");
  return parse_post(text, "mine.toml");
}

TEST(CutSafety, MotionsInThePostsOwnLinesAreLookedOver) {
  const std::string start = "\"G21 G90 G17 G94\", \"G40 G49 G80\", \"G54\"";
  const std::pair<std::string, std::string> bad[] = {
      {"start", start + ", \"G0 Z-1\""},
      {"start", start + ", \"G0 X1 Y1\""},
      {"start", start + ", \"G91\", \"G0 Z-30\", \"G90\""},
      {"start", start + ", \"G0 Z9\", \"G28\", \"G0 X1 Y1\", \"G0 Z-1\""},
      {"tool", "\"T{tool} M6\", \"G0 X1\""},
      {"tool", "\"G0 Z9\", \"G0 X1 Y1\", \"G0 Z-0.4\", \"T{tool} M6\""},
      {"tool_end", "\"G0 X1 Y1 Z-2\", \"M5\""},
      {"end", "\"G0 X1 Y1 Z-2\", \"M5\", \"M2\""},
      {"end", "\"G0 Z-30\", \"M5\", \"M2\""},
      {"end", "\"G90 G28 X0 Y0 Z-30\", \"M5\", \"M2\""}};
  CamOptions options = programs_only();
  options.grouping = ProgramGrouping::kAll;
  for (const auto& [key, lines] : bad) {
    options.post = post_with(key, lines);
    const TempFolder folder;
    const CamResult result = make_cut(small_lens(), options, folder.path(), Executor::serial(), {});
    EXPECT_FALSE(check_named(result, "collisions").passes()) << key << " " << lines;
  }
  const std::pair<std::string, std::string> good[] = {
      {"start", start + ", \"G91 G28 Z0\", \"G90\""},
      {"start", start + ", \"G53 G0 Z0\", \"G0 X0 Y0\""},
      {"tool", "\"G53 G0 Z0\", \"T{tool} M6\""},
      {"end", "\"G53 G0 Z0\", \"G28 X0 Y0\", \"M5\", \"M2\""},
      {"end", "\"G0 X0 Y0\", \"M5\", \"M2\""}};
  for (const auto& [key, lines] : good) {
    options.post = post_with(key, lines);
    const TempFolder folder;
    const CamResult result = make_cut(small_lens(), options, folder.path(), Executor::serial(), {});
    EXPECT_TRUE(check_named(result, "collisions").passes())
        << key << " " << lines << ::testing::PrintToString(result.report.warnings);
  }
}

/// True if a cut has missed the limit of this name; false without such a limit.
bool misses(const ReportData& report, const std::string& key) {
  const auto& checks = report.verdict.checks;
  return std::any_of(checks.begin(), checks.end(),
                     [&](const LimitCheck& check) { return check.key == key && !check.passes(); });
}

TEST(CutSafety, LimitsOfSafetyStandFirst) {
  const TempFolder folder;
  const CamResult result =
      make_cut(small_lens(), programs_only(), folder.path(), Executor::serial(), {});
  std::vector<std::string> keys;
  for (const LimitCheck& check : result.report.verdict.checks) keys.push_back(check.key);
  ASSERT_GT(keys.size(), 5U);
  keys.resize(5);
  EXPECT_THAT(keys,
              ::testing::ElementsAre("collisions", "table", "travel_x", "travel_y", "travel_z"));
}

TEST(CutSafety, AMaterialOfAnotherIndexIsAMissedLimit) {
  CamOptions options = programs_only();
  const TempFolder folder;
  const auto cut = [&] {
    return make_cut(small_lens(), options, folder.path(), Executor::serial(), {}).report;
  };
  EXPECT_FALSE(misses(cut(), "material_ior")) << "not stated";
  options.workshop.material.ior = 1.492;
  EXPECT_FALSE(misses(cut(), "material_ior"));
  options.workshop.material.ior = 1.586;
  const ReportData report = cut();
  EXPECT_TRUE(misses(report, "material_ior"));
  EXPECT_THAT(report.warnings, Contains("the workshop's material has index 1.586, the lens was "
                                        "designed for 1.49: it would project another picture"));
  options.part = PartKind::kMould;
  EXPECT_FALSE(misses(cut(), "material_ior")) << "light passes no mould";
}

TEST(CutSafety, AMirrorsMaterialAndUndersideDoNotConcernItsLight) {
  Lens mirror = small_lens();
  mirror.setup.body = MirrorBody{};
  mirror.setup.lamp = ParallelLight{{0.6, 0.0, -0.8}};
  CamOptions options = programs_only();
  options.workshop.material.ior = 1.586;
  const TempFolder folder;
  const ReportData report = make_cut(mirror, options, folder.path(), Executor::serial(), {}).report;
  EXPECT_FALSE(misses(report, "material_ior"));
  EXPECT_THAT(report.setup.up_words, ::testing::HasSubstr("underside down, which needs no polish"));
}

TEST(CutSafety, AControllerWithoutALimitOfLinesBearsAnyLoad) {
  CamOptions options = programs_only();
  const TempFolder folder;
  const auto cut = [&] {
    return make_cut(small_lens(), options, folder.path(), Executor::serial(), {}).report;
  };
  options.workshop.machine.lines_per_second = 1e-3;
  EXPECT_TRUE(misses(cut(), "block_rate"));
  options.workshop.machine.lines_per_second = 0.0;
  EXPECT_FALSE(misses(cut(), "block_rate"));
}

}  // namespace
}  // namespace lensforge::cut_safety_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/path/rough.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "cam/adversarial_meshes.h"
#include "cam/cam_meshes.h"
#include "cam/contact/profile_cutter.h"
#include "cam/dexel_stock.h"
#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kDexel = 0.06;  ///< mm

using Moves = std::vector<PathMove>;

MoveSink into(Moves& moves) {
  return [&moves](std::span<const PathMove> some) {
    moves.insert(moves.end(), some.begin(), some.end());
  };
}

/// What the simulation saw of a stream of moves.
struct Witnessed {
  double rapid_in_material = 0.0;   ///< Most material that a rapid move met, mm.
  double plunge_in_material = 0.0;  ///< Most material under a move straight down, mm.
  double link_in_material = 0.0;
  double deepest_cut = 0.0;
  double steepest_ramp = 0.0;  ///< Of plunging moves that meet material, rise over run.
  double near_clamps = HUGE_VAL;
};

/// Runs the moves through the simulated stock.
Witnessed simulate(const Moves& moves, const Tool& tool, testing::DexelStock& stock) {
  Witnessed seen;
  const CutterProfile profile = cutting_profile(tool);
  Eigen::Vector3d at = moves.front().end;
  for (const PathMove& move : moves) {
    if (move.kind == MoveKind::kRapid) {
      seen.rapid_in_material =
          std::max(seen.rapid_in_material, stock.touched(profile, at, move.end));
    } else {
      const double depth = stock.cut(profile, at, move.end);
      const double run = (move.end - at).head<2>().norm();
      const bool down = move.end.z() < at.z();
      if (down && run < 1e-9) seen.plunge_in_material = std::max(seen.plunge_in_material, depth);
      if (move.kind == MoveKind::kLink) {
        seen.link_in_material = std::max(seen.link_in_material, depth);
      }
      if (down && move.kind == MoveKind::kPlunge && depth > 1e-6 && run >= 1e-9) {
        seen.steepest_ramp = std::max(seen.steepest_ramp, (at.z() - move.end.z()) / run);
      }
      seen.deepest_cut = std::max(seen.deepest_cut, depth);
    }
    at = move.end;
  }
  return seen;
}

/// Least and most material on the surface, upwards.
struct Left {
  double least = HUGE_VAL;
  double most = -HUGE_VAL;
};

Left left_on(const ProfileCutter& surface, const testing::DexelStock& stock) {
  Left left;
  stock.each([&](const Eigen::Vector3d& top) {
    const CutterLocation under = surface.drop({}, top.head<2>());
    if (!under.rests()) return;
    left.least = std::min(left.least, top.z() - under.tip);
    left.most = std::max(left.most, top.z() - under.tip);
  });
  return left;
}

SurfaceMesh small_lens() {
  return testing::grid_mesh(81, 61, 12.0, 9.0, [](double x, double y) {
    return testing::lens_relief(x + 30.0, y + 20.0);
  });
}

/// Both operations on one surface, and their simulation.
struct Job {
  explicit Job(const SurfaceMesh& mesh, Workshop with = {})
      : workshop(std::move(with)),
        surface(mesh),
        stock(whole_blank(workshop, surface.bounds())),
        dexels(stock.blank(), kDexel) {}

  RoughResult rough() {
    moves.clear();
    RoughResult result =
        cut_rough({surface, workshop, stock}, Executor::serial(), into(moves), RunControl{});
    seen = simulate(moves, workshop.tool(result.summary.tool), dexels);
    return result;
  }
  RoughResult semi() {
    moves.clear();
    RoughResult result =
        cut_semi({surface, workshop, stock}, Executor::serial(), into(moves), RunControl{});
    seen = simulate(moves, workshop.tool(result.summary.tool), dexels);
    return result;
  }
  [[nodiscard]] Left left() const { return left_on(surface, dexels); }

  Workshop workshop;
  ProfileCutter surface;
  StockMap stock;
  testing::DexelStock dexels;
  Moves moves;
  Witnessed seen;
};

void expect_safe(const Witnessed& seen) {
  EXPECT_LE(seen.rapid_in_material, 1e-12);   // Rounding.
  EXPECT_LE(seen.plunge_in_material, 0.011);  // RoughLinks takes 0.01 mm for none.
  EXPECT_LE(seen.link_in_material, 1e-9);
}

TEST(Rough, LeavesTheAllowanceAndNoMoreThanItSays) {
  Job job(small_lens());
  const RoughResult rough = job.rough();
  const Left left = job.left();
  EXPECT_TRUE(rough.summary.complete);
  EXPECT_GE(left.least, job.workshop.process.rough.allowance - 1e-9);
  EXPECT_LE(left.most, rough.most_left.value + 0.03);
  EXPECT_LT(rough.most_left.value, 0.8);
  expect_safe(job.seen);
  EXPECT_LE(job.seen.deepest_cut, rough.deepest_cut.value + 0.06);
  EXPECT_LE(job.seen.deepest_cut, rough.summary.stepdown + 0.45);  // Ridges on slopes of 0.3.
  const double slope =
      0.35 + std::tan(job.workshop.process.rough.ramp_angle_deg * std::numbers::pi / 180.0);
  EXPECT_LE(job.seen.steepest_ramp, slope);
}

TEST(Semi, LeavesLittleForTheFinishingBall) {
  Job job(small_lens());
  (void)job.rough();
  const RoughResult semi = job.semi();
  const Left left = job.left();
  EXPECT_GE(left.least, job.workshop.process.semi.allowance - 1e-9);
  EXPECT_LE(left.most, semi.most_left.value + 0.03);
  EXPECT_LE(left.most, 0.1);
  expect_safe(job.seen);
  EXPECT_LT(job.seen.deepest_cut, 0.8);

  // The finishing ball, at any place over the lens and as far beyond as its raster turns.
  const CutterProfile ball{0.2, 0.2, 0.0};
  const TipFloor floor(job.surface, job.workshop.tool(1), 0.0, job.workshop.keep_outs, 0.5);
  TipFloor::Trace trace;
  double deepest = 0.0;
  for (double y = -0.2; y <= 9.2; y += 0.1) {
    for (double x = -0.2; x <= 12.2; x += 0.1) {
      const Eigen::Vector3d tip(x, y, floor.over({x, y}, 0.0, trace));
      deepest = std::max(deepest, job.dexels.touched(ball, tip, tip));
    }
  }
  EXPECT_LE(deepest, 0.2);
  EXPECT_GT(deepest, 0.03);
}

TEST(Rough, NeverGougesSpikes) {
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> height(5.0, 6.5);
  const SurfaceMesh mesh =
      testing::grid_mesh(17, 13, 8.0, 6.0, [&](double, double) { return height(engine); });
  Workshop workshop;
  workshop.tools[0].shape = CutterShape::kBull;
  workshop.tools[0].corner_radius = 0.5;
  workshop.process.rough.stepdown = 0.4;
  Job job(mesh, workshop);
  (void)job.rough();
  EXPECT_GE(job.left().least, 0.2 - 1e-9);
  expect_safe(job.seen);
  const RoughResult semi = job.semi();
  EXPECT_GE(job.left().least, 0.03 - 1e-9);
  EXPECT_LE(job.left().most, semi.most_left.value + 0.3);  // Slopes of 4.
  expect_safe(job.seen);
}

TEST(Rough, EveryStyleAndAxisIsSafe) {
  for (const PassStyle style : {PassStyle::kZigzag, PassStyle::kClimb, PassStyle::kConventional}) {
    for (const PassAxis along : {PassAxis::kX, PassAxis::kY}) {
      Workshop workshop;
      workshop.process.rough.style = style;
      workshop.process.rough.along = along;
      workshop.stock.margin = 8.0;  // A pocket in the blank.
      Job job(small_lens(), workshop);
      const RoughResult rough = job.rough();
      expect_safe(job.seen);
      EXPECT_GE(job.left().least, 0.2 - 1e-9);
      EXPECT_LT(rough.most_left.value, 0.8);
    }
  }
}

/// Moves into material that go round: along neither axis.
std::int64_t turning_entries(const Moves& moves) {
  std::int64_t turning = 0;
  Eigen::Vector3d at = moves.front().end;
  for (const PathMove& move : moves) {
    const Eigen::Vector2d way = (move.end - at).head<2>().cwiseAbs();
    turning += move.kind == MoveKind::kPlunge && way.minCoeff() > 1e-9 ? 1 : 0;
    at = move.end;
  }
  return turning;
}

TEST(Rough, AHelixIsAsSafeAsARampAndNoSteeper) {
  for (const PassStyle style : {PassStyle::kZigzag, PassStyle::kClimb}) {
    Workshop workshop;
    workshop.process.rough.style = style;
    workshop.process.rough.entry = EntryStyle::kHelix;
    workshop.process.semi.entry = EntryStyle::kHelix;
    workshop.stock.margin = 8.0;  // A pocket in the blank.
    Job job(small_lens(), workshop);
    const double slope =
        0.5 + std::tan(workshop.process.rough.ramp_angle_deg * std::numbers::pi / 180.0);
    for (const bool semi : {false, true}) {
      const RoughResult result = semi ? job.semi() : job.rough();
      expect_safe(job.seen);
      EXPECT_GT(turning_entries(job.moves), 20);
      EXPECT_LE(job.seen.steepest_ramp, slope);
      EXPECT_GE(job.left().least, result.summary.allowance - 1e-9);
    }
    EXPECT_LE(job.left().most, 0.1);
  }
}

/// Down a cylinder of the helix' own radius: the blank's top, left at the ramp's angle.
TEST(Rough, AHelixIsOneOnAFlatSurface) {
  Workshop workshop;
  workshop.process.rough.entry = EntryStyle::kHelix;
  workshop.process.rough.helix_radius = 1.2;
  workshop.process.rough.allowance = 0.0;  // A flat floor, at the rim, too.
  workshop.process.semi.enabled = false;
  workshop.stock.margin = 8.0;
  Job job(testing::grid_mesh(3, 3, 12.0, 9.0, [](double, double) { return 5.0; }), workshop);
  (void)job.rough();
  expect_safe(job.seen);
  const double angle = workshop.process.rough.ramp_angle_deg * std::numbers::pi / 180.0;
  EXPECT_LE(job.seen.steepest_ramp, std::tan(angle) * (1.0 + 1e-9));
  std::vector<Eigen::Vector3d> helix;
  for (const PathMove& move : job.moves) {
    if (move.kind == MoveKind::kPlunge) {
      helix.push_back(move.end);
    } else if (!helix.empty()) {
      break;
    }
  }
  ASSERT_GT(helix.size(), 12U);
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector3d& p : helix) box.extend(Eigen::Vector2d(p.head<2>()));
  EXPECT_NEAR(box.sizes().x(), 2.4, 0.01);
  const Eigen::Vector2d middle = box.center();
  for (const Eigen::Vector3d& p : helix) EXPECT_NEAR((p.head<2>() - middle).norm(), 1.2, 0.01);
}

/// Walls, noise, needles and loose triangles: nothing of the tool or its allowance goes into them,
/// whichever way it enters.
TEST(Rough, NeverGougesAdversarialMeshes) {
  for (const auto& [name, mesh] : testing::adversarial_meshes()) {
    if (name.starts_with("ridge") || name.starts_with("valley")) continue;  // Time.
    for (const EntryStyle entry : {EntryStyle::kRamp, EntryStyle::kHelix}) {
      Workshop workshop;
      workshop.stock.margin = 0.5;
      workshop.tools[0].shape = CutterShape::kBull;
      workshop.tools[0].diameter = 1.5;
      workshop.tools[0].corner_radius = 0.3;
      workshop.tools[0].sections = {{1.5, 8.0, 20.0}, {19.0, 20.0, 50.0}};
      workshop.process.rough.stepover = 0.6;
      workshop.process.rough.stepdown = 0.6;
      workshop.process.rough.entry = entry;
      workshop.process.rough.helix_radius = 0.5;
      workshop.process.semi.stepover = 0.4;
      workshop.process.semi.entry = entry;
      Job job(mesh, workshop);
      (void)job.rough();
      EXPECT_GE(job.left().least, 0.2 - 1e-9) << name;
      expect_safe(job.seen);
      (void)job.semi();
      EXPECT_GE(job.left().least, 0.03 - 1e-9) << name;
      expect_safe(job.seen);
    }
  }
}

TEST(Rough, ClimbKeepsTheUncutSideOnTheRight) {
  for (const PassAxis along : {PassAxis::kX, PassAxis::kY}) {
    Workshop workshop;
    workshop.process.rough.style = PassStyle::kClimb;
    workshop.process.rough.along = along;
    Job job(small_lens(), workshop);
    (void)job.rough();
    const int axis = along == PassAxis::kX ? 0 : 1;
    const double forward = along == PassAxis::kX ? -1.0 : 1.0;  // The next pass is at +y or +x.
    Eigen::Vector3d at = job.moves.front().end;
    for (const PathMove& move : job.moves) {
      if (move.kind == MoveKind::kCut) {
        EXPECT_GE(forward * (move.end - at)[axis], 0.0);
      }
      at = move.end;
    }
  }
}

TEST(Rough, WalksAroundClamps) {
  Workshop workshop;
  workshop.stock.margin = 2.0;
  workshop.keep_outs = {{"left clamp", {-6.0, 3.0, 0.0}, {1.5, 6.0, 12.0}}};
  Job job(small_lens(), workshop);
  const RoughResult rough = job.rough();
  expect_safe(job.seen);
  ASSERT_EQ(rough.summary.warnings.size(), 1u);
  EXPECT_THAT(rough.summary.warnings[0], ::testing::HasSubstr("'left clamp' keeps tool 3 from"));
  const Eigen::AlignedBox3d clamp(workshop.keep_outs[0].low, workshop.keep_outs[0].high);
  const std::vector<CutterProfile> parts = whole_profile(workshop.tool(3));
  Eigen::Vector3d at = job.moves.front().end;
  for (const PathMove& move : job.moves) {
    for (double part = 0.0; part <= 1.0; part += 0.02) {
      const Eigen::Vector3d tip = at + part * (move.end - at);
      for (const CutterProfile& profile : parts) {
        EXPECT_GE(tip.z(), profile_box_tip(profile, tip.head<2>(), clamp));
      }
    }
    at = move.end;
  }
}

TEST(Rough, SameMovesForAnyNumberOfThreads) {
  const SurfaceMesh mesh = small_lens();
  const Workshop workshop;
  std::vector<Moves> all;
  for (const int threads : {1, 2, 3}) {
    const ProfileCutter surface(mesh);
    StockMap stock = whole_blank(workshop, surface.bounds());
    Moves& moves = all.emplace_back();
    (void)cut_rough({surface, workshop, stock}, Executor::cpu(threads), into(moves), RunControl{});
  }
  for (const Moves& moves : all) {
    ASSERT_EQ(moves.size(), all[0].size());
    for (std::size_t i = 0; i < moves.size(); ++i) EXPECT_EQ(moves[i].end, all[0][i].end);
  }
}

TEST(Rough, StopsWhenAsked) {
  Job job(small_lens());
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW((void)cut_rough({job.surface, job.workshop, job.stock}, Executor::serial(),
                               into(job.moves), RunControl(stop.get_token(), {})),
               Interrupted);
}

TEST(StockMap, IsNeverBelowTheTrueMaterial) {
  std::mt19937_64 engine(2);
  std::uniform_real_distribution<double> place(0.0, 6.0);
  std::uniform_real_distribution<double> height(2.0, 5.0);
  const Eigen::AlignedBox3d blank(Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(6.0, 6.0, 5.0));
  for (const CutterProfile& profile :
       {CutterProfile{0.5, 0.5, 0.0}, CutterProfile{1.0, 0.2, 0.0}, CutterProfile{0.8, 0.0, 0.0}}) {
    StockMap map(blank, 0.1);
    testing::DexelStock dexels(blank, 0.04);
    Eigen::Vector3d at(3.0, 3.0, 5.0);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d to(place(engine), place(engine), height(engine));
      (void)map.cut(profile, at, to);
      (void)dexels.cut(profile, at, to);
      at = to;
    }
    double above = 0.0;
    dexels.each([&](const Eigen::Vector3d& top) {
      const auto cell = [&](double x) { return std::min(59, static_cast<int>(x / 0.1)); };
      const double bound = map.height(cell(top.x()), cell(top.y()));
      EXPECT_GE(bound, top.z() - 0.02);  // The simulation's own steps.
      above += bound - top.z();
    });
    EXPECT_LT(above / (151.0 * 151.0), 0.15);
    const CutterProfile shank{1.2, 0.0, 1.0};
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector2d p(place(engine), place(engine));
      double slow = kNoContact;
      for (int row = 0; row < 60; ++row) {
        for (int column = 0; column < 60; ++column) {
          const Eigen::AlignedBox3d cell(
              Eigen::Vector3d(0.1 * column, 0.1 * row, 0.0),
              Eigen::Vector3d(0.1 * column + 0.1, 0.1 * row + 0.1, map.height(column, row)));
          slow = std::max(slow, profile_box_tip(shank, p, cell));
        }
      }
      EXPECT_NEAR(map.drop(shank, p), slow, 1e-12);
    }
  }
}

}  // namespace
}  // namespace lensforge

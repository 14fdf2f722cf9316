// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/workshop/tool.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "cam/workshop/workshop.h"
#include "core/error.h"

namespace lensforge {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Tool tool_of(CutterShape shape, double diameter, double corner) {
  Tool tool;
  tool.shape = shape;
  tool.diameter = diameter;
  tool.corner_radius = corner;
  tool.flute_length = 5.0;
  tool.sections = {{diameter - 0.1, 5.0, 8.0}, {6.0, 8.0, 20.0}, {20.0, 20.0, 50.0}};
  return tool;
}

/// The message of the InputError that parsing `text` throws; empty if it throws none.
std::string refusal(const std::string& text) {
  try {
    (void)parse_workshop(text, "shop.toml");
  } catch (const InputError& e) {
    return e.what();
  }
  return {};
}

/// Height of the whole tool's lower silhouette above its tip at distance d from the axis, mm.
double silhouette_height(const Tool& tool, double d) {
  double lowest = kInfinite;
  for (const CutterProfile& part : whole_profile(tool)) lowest = std::min(lowest, part.height(d));
  return lowest;
}

TEST(CutterProfile, BallIsACircle) {
  const Tool ball = tool_of(CutterShape::kBall, 0.4, 0.0);
  for (const double d : {0.0, 0.05, 0.11, 0.19}) {
    EXPECT_NEAR(silhouette_height(ball, d), 0.2 - std::sqrt(0.04 - d * d), 1e-15);
  }
  EXPECT_EQ(silhouette_height(ball, 0.21), 8.0);  // The shank; the neck is thinner than the ball.
  EXPECT_EQ(silhouette_height(ball, 9.9), 20.0);
  EXPECT_EQ(silhouette_height(ball, 10.1), kInfinite);
}

TEST(CutterProfile, BullIsFlatThenRound) {
  const Tool bull = tool_of(CutterShape::kBull, 3.0, 0.5);
  EXPECT_EQ(silhouette_height(bull, 1.0), 0.0);
  EXPECT_NEAR(silhouette_height(bull, 1.3), 0.5 - 0.4, 1e-15);
  EXPECT_NEAR(silhouette_height(bull, 1.5), 0.5, 1e-15);
  const Tool flat = tool_of(CutterShape::kFlat, 3.0, 0.0);
  EXPECT_EQ(silhouette_height(flat, 1.5), 0.0);
  EXPECT_EQ(silhouette_height(flat, 1.51), 8.0);
}

TEST(Tool, AnotherDiameterKeepsTheShankThatItIsGroundOn) {
  Tool stub;  // No neck: the shank is the first part above the flutes.
  stub.diameter = 0.4;
  stub.flute_length = 1.0;
  stub.sections = {{4.0, 1.0, 30.0}};
  const Tool half = resized(stub, 0.2);
  EXPECT_EQ(half.sections[0].diameter, 4.0);
  EXPECT_DOUBLE_EQ(half.sections[0].from, half.flute_length);
  Tool necked = stub;
  necked.sections = {{0.3, 1.0, 6.0}, {4.0, 6.0, 30.0}};
  const Tool slim = resized(necked, 0.2);
  EXPECT_DOUBLE_EQ(slim.sections[0].diameter, 0.15);
  EXPECT_EQ(slim.sections[1].diameter, 4.0);
  EXPECT_DOUBLE_EQ(slim.sections[1].from, slim.sections[0].to);
}

TEST(CutterProfile, GrownIsTheOffsetCurve) {
  // Every point of the grown silhouette is `allowance` from the nearest point of the cutter's.
  const CutterProfile bull{1.5, 0.5, 0.0};
  const CutterProfile skin = grown(bull, 0.2);
  for (double d = 0.0; d <= 1.6; d += 0.05) {
    const double z = skin.height(d);
    double nearest = kInfinite;
    for (double e = 0.0; e <= 1.5; e += 1e-4) {
      nearest = std::min(nearest, std::hypot(d - e, z - bull.height(e)));
    }
    EXPECT_NEAR(nearest, 0.2, 1e-4) << d;
  }
}

TEST(CutterProfile, WidenedIsTheLowestOfAllShifts) {
  const CutterProfile bull{1.5, 0.5, 0.3};
  const CutterProfile wide = widened(bull, 0.25);
  for (double d = 0.0; d <= 1.75; d += 0.05) {
    EXPECT_NEAR(wide.height(d), bull.height(std::max(0.0, d - 0.25)), 1e-7);
  }
}

TEST(CutterProfile, WidestPartBelowAHeight) {
  const Tool ball = tool_of(CutterShape::kBall, 0.4, 0.0);
  EXPECT_EQ(widest_below(ball, 3.0), 0.2);
  EXPECT_EQ(widest_below(ball, 9.0), 3.0);
  EXPECT_EQ(widest_below(ball, 21.0), 10.0);
}

TEST(Workshop, DefaultsAreThePapersMachineToolAndAcrylic) {
  const Workshop shop;
  const Tool& ball = shop.tool(shop.process.finish.tool);
  EXPECT_EQ(ball.shape, CutterShape::kBall);
  EXPECT_EQ(ball.diameter, 0.4);
  EXPECT_EQ(ball.spindle_rpm, 23000.0);
  EXPECT_EQ(max_pitch(shop.process.finish, ball.radius(), 0.0), 0.06);
  EXPECT_EQ(shop.material.ior, 0.0) << "not stated";
  EXPECT_NO_THROW(validate(shop, "defaults"));
}

TEST(Workshop, PitchFollowsFromTheScallop) {
  FinishProcess finish;
  finish.scallop = 0.00225;  // Of a ball of 0.2 mm at 0.06 mm: 0.2 − √(0.2² − 0.03²) = 2.263 µm.
  const double pitch = max_pitch(finish, 0.2, 0.0);
  EXPECT_NEAR(0.2 - std::sqrt(0.04 - 0.25 * pitch * pitch), finish.scallop, 1e-15);
  EXPECT_NEAR(pitch, 0.06, 3e-4);
}

TEST(Workshop, ItsTomlIsThatOfEarlierVersions) {
  const std::string text = workshop_toml({});
  EXPECT_TRUE(text.starts_with(
      "# A workshop of lensforge cam: machine, blank, clamps, tools and process.\n\n"
      "# The mill. Sizes are millimetres.\n[machine]\nname = "));
  EXPECT_NE(
      text.find("\n[material]\nname = \"cast acrylic (PMMA)\"\n"
                "# ior =  # refractive index, checked against the lens's (Sun et al., Section 5: "
                "1.49)\n"),
      std::string::npos);
}

TEST(Workshop, WrittenTomlReadsBackEqual) {
  EXPECT_EQ(parse_workshop(workshop_toml({}), "defaults"), Workshop{});
  Workshop shop;
  shop.machine.name = "mill \"3\" \\ left";
  shop.machine.travel = {123.456, 0.1 + 0.2, 99.0};
  shop.machine.look_ahead = 15;
  shop.material.ior = 1.5168;
  shop.stock = {0.0, 1.0 / 3.0};
  shop.keep_outs = {{"left clamp", {-20.0, 10.0, 0.0}, {-1.0, 30.0, 15.5}},
                    {"right clamp", {101.0, 10.0, 0.0}, {120.0, 30.0, 15.5}}};
  shop.tools[0].shape = CutterShape::kBull;
  shop.tools[0].corner_radius = 0.5;
  shop.tools[1].sections.clear();
  shop.process.rough.enabled = false;
  shop.process.rough.style = PassStyle::kClimb;
  shop.process.semi.along = PassAxis::kY;
  shop.process.semi.entry = EntryStyle::kHelix;
  shop.process.semi.helix_radius = 0.45;
  shop.process.finish = {1,     0.04, 0.001, 2e-4, 5e-4,  PassStyle::kConventional, PassAxis::kY,
                         false, true, 4,     2,    -0.001};
  shop.polish = {0.041, 0.01, 2.5, 4, 0.07, 12.5, 7.5};
  shop.tolerances = {{{8.0, 0.5}}, 0.1,   20.0, 2.0, 3.0,  4.0, 0.2,  0.1,
                     0.15,         0.002, 2.5,  0.3, 1.25, 8.0, 9e-5, -1.2e-4};
  EXPECT_EQ(parse_workshop(workshop_toml(shop), "other"), shop);
}

TEST(Workshop, WavesOfAFileReplaceTheDefaults) {
  const Workshop shop = parse_workshop(
      "[tolerances]\nbacklash_um = 3\n[[tolerances.waviness]]\nwavelength = 5\nrms_um = 0.2\n",
      "shop.toml");
  EXPECT_EQ(shop.tolerances.waviness, (std::vector<WavinessBand>{{5.0, 0.2}}));
  EXPECT_EQ(shop.tolerances.backlash_um, 3.0);
  EXPECT_EQ(shop.tolerances.distance, Tolerances{}.distance);
}

TEST(Workshop, MissingKeysKeepTheirDefaults) {
  const Workshop shop = parse_workshop("[finish]\npitch = 0.05\n", "shop.toml");
  Workshop expected;
  expected.process.finish.pitch = 0.05;
  EXPECT_EQ(shop, expected);
  EXPECT_EQ(parse_workshop("", "shop.toml"), Workshop{});
}

TEST(Workshop, TextsAreOneShortLine) {
  for (const std::string& text :
       {std::string("a\\u0007b"), std::string("a\\nb"), std::string(201, 'a')}) {
    EXPECT_NE(refusal("[machine]\nname = \"" + text + "\"\n").find("must be one line"),
              std::string::npos);
  }
}

TEST(Workshop, AMaterialsIndexNeedsNotBeStated) {
  EXPECT_EQ(parse_workshop(workshop_toml({}), "shop.toml").material.ior, 0.0);
  EXPECT_EQ(parse_workshop("[material]\nior = 1.586\n", "shop.toml").material.ior, 1.586);
}

TEST(Workshop, RefusalsNameFileKeyValueAndRule) {
  EXPECT_EQ(refusal("[finish]\npitch = -0.5\n"),
            "shop.toml: finish.pitch: -0.5: must be in 1e-06 to 100");
  EXPECT_EQ(refusal("[finish]\npitsch = 0.5\n"),
            "shop.toml: finish.pitsch: 0.5: a workshop: unknown key; use pitch");
  EXPECT_EQ(refusal("[rough]\nstyle = \"spiral\"\n"),
            "shop.toml: rough.style: 'spiral': must be one of: zigzag, climb, conventional");
  EXPECT_EQ(refusal("[rough]\ntool = 9\n"), "shop.toml: rough.tool: 9: no tool has this number");
  EXPECT_EQ(refusal("[rough]\nstepover = 3.5\n"),
            "shop.toml: rough.stepover: 3.5: is wider than the tool, 3 mm");
  EXPECT_EQ(refusal("[semi]\nentry = \"helix\"\nhelix_radius = 0.6\n"),
            "shop.toml: semi.helix_radius: 0.6: is above half the tool's diameter, 0.5 mm");
  EXPECT_EQ(refusal("[polish]\norder = 3\n"),
            "shop.toml: polish.order: 3: must be 2 (pads and wheels) or 4 (a levelling film)");
  EXPECT_EQ(refusal("[polish]\nfloor = 1.0\n"), "shop.toml: polish.floor: 1: must be in 0 to 0.99");
  EXPECT_EQ(refusal("[polish]\nroughness = -1.0\n"),
            "shop.toml: polish.roughness: -1: must be in 0 to 1000");
  EXPECT_EQ(refusal("[polish]\ncorrelation = 0.0\n"),
            "shop.toml: polish.correlation: 0: must be above 0, at most 1000");
  EXPECT_EQ(refusal("[semi]\nallowance = 0.3\n"),
            "shop.toml: semi.allowance: 0.3: must not be above that of roughing, 0.2 mm");
  EXPECT_EQ(refusal("[finish]\ntool = 3\n"),
            "shop.toml: finish.tool: 3: the finishing tool has to be a ball");
  EXPECT_EQ(refusal("[finish]\nlarge_tool = 9\n"),
            "shop.toml: finish.large_tool: 9: no tool has this number");
  EXPECT_EQ(refusal("[finish]\nlarge_tool = 3\n"),
            "shop.toml: finish.large_tool: 3: the larger finishing tool has to be a ball");
  EXPECT_EQ(
      refusal("[finish]\nlarge_tool = 1\n"),
      "shop.toml: finish.large_tool: 1: its diameter must be above that of finish.tool, 0.4 mm");
  EXPECT_EQ(refusal("[finish]\nlarge_tool = 4\ncross = true\n"),
            "shop.toml: finish.large_tool: 4: cannot be used with finish.cross");
  EXPECT_EQ(
      refusal("[finish]\nlarge_tool = 4\nlarge_every = 4\n"),
      "shop.toml: finish.large_every: 4: the larger ball's scallops would be higher than those "
      "of finish.tool; at most 3");
  EXPECT_EQ(refusal("[finish]\nlarge_every = 2\n"),
            "shop.toml: finish.large_every: 2: there is no finish.large_tool");
  EXPECT_EQ(refusal("[machine]\nspindle_max_rpm = 20000\n"),
            "shop.toml: tool[0].spindle_rpm: 23000: the machine's spindle turns at 3000 to 20000");
  EXPECT_EQ(refusal("[stock]\nmargin = \"wide\"\n"),
            "shop.toml: stock.margin: 'wide': must be a finite number");
}

TEST(Workshop, RefusesToolsThatCannotBe) {
  const std::string tool =
      "[[tool]]\nnumber = 1\nshape = \"bull\"\ndiameter = 0.4\nflute_length = 1.0\nfeed = 500\n"
      "plunge = 150\n";
  const std::string off = "[rough]\nenabled = false\n[semi]\nenabled = false\n";
  EXPECT_EQ(refusal(tool + "corner_radius = 0.3\n" + off),
            "shop.toml: tool[0].corner_radius: 0.3: must not be above half the diameter");
  EXPECT_EQ(refusal(tool + tool + off), "shop.toml: tool[0].number: 1: two tools have this number");
  EXPECT_EQ(refusal(tool + "[[tool.section]]\ndiameter = 4.0\nfrom = 0.5\nto = 9.0\n" + off),
            "shop.toml: tool[0].section[0].from: 0.5: must not be below the end of the part "
            "before it, 1 mm");
  EXPECT_EQ(refusal("[[tool]]\nnumber = 1\n" + off),
            "shop.toml: tool[0].diameter: missing: a workshop needs this key");
  EXPECT_EQ(refusal("[[keep_out]]\nname = \"clamp\"\nlow_x = 1.0\n"),
            "shop.toml: keep_out[0].high: 0: must be above low in x");
}

}  // namespace
}  // namespace lensforge

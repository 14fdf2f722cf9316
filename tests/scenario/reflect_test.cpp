// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>

#include "core/mesh/mesh_files.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

/// The regular octahedron with a corner up.
constexpr const char* kOctahedron =
    "OFF\n6 8 0\n1 0 0\n-1 0 0\n0 1 0\n0 -1 0\n0 0 1\n0 0 -1\n"
    "3 0 2 4\n3 2 1 4\n3 1 3 4\n3 3 0 4\n3 2 0 5\n3 1 2 5\n3 3 1 5\n3 0 3 5\n";

class Reflect : public Scenario {
 protected:
  void SetUp() override { write(at("shape.off"), kOctahedron); }

  /// A run of a second or so.
  [[nodiscard]] Arguments quick(const Arguments& more = {}) const {
    Arguments arguments = {
        "reflect", path("shape.off"), "--out", path("out"),        "--faces", "60", "--rim-updates",
        "1",       "--face-updates",  "1",     "--direction-rows", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  void wait_for_checkpoint(Process& process, const std::string& out) const {
    while (!fs::exists(at(out) / "reflect.checkpoint")) {
      ASSERT_TRUE(process.runs_for(std::chrono::milliseconds(2))) << process.wait().err;
    }
  }

  /// @param mesh  the text of an OFF file.
  void expect_refused(const std::string& mesh, const Arguments& more,
                      const std::vector<std::string>& parts) const {
    write(at("bad.off"), mesh);
    Arguments arguments = {"reflect", path("bad.off"), "--out", path("bad")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_refusal(run(arguments), 2, parts);
    EXPECT_THAT(listing(at("bad")), ::testing::Not(::testing::Contains("surface.ply")));
  }
};

TEST_F(Reflect, WritesTheShapeItsPicturesAndItsFiguresTogether) {
  const Outcome outcome = run(quick({"--json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json result = outcome.json();
  EXPECT_EQ(result["status"], "done");
  EXPECT_EQ(result["updates"], 3);
  for (const char* name : {"surface.ply", "surface.stl", "reference.ply", "views.png",
                           "displacement.png", "convergence.csv", "report.html", "reflect.json"}) {
    EXPECT_TRUE(fs::exists(at("out") / name)) << name;
  }
  EXPECT_EQ(read_mesh(at("out/surface.ply")).triangle_count(), result["faces"]);
  EXPECT_EQ(read_mesh(at("out/surface.stl")).triangle_count(), result["faces"]);
}

/// The box around a shape, which sends light straight back.
constexpr const char* kCube =
    "OFF\n8 6 0\n0 0 0\n0 0 9\n0 9 0\n0 9 9\n9 0 0\n9 0 9\n9 9 0\n9 9 9\n"
    "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n4 0 2 6 4\n4 1 5 7 3\n";

TEST_F(Reflect, ARunThatGainsNextToNothingIsNoSuccess) {
  write(at("shape.off"), kCube);
  const Outcome outcome = run(quick({"--max-displacement", "0.0001", "--json"}));
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("warning: the energy went from 0.1"));
  EXPECT_THAT(outcome.err, HasSubstr("less than a tenth"));
  const nlohmann::json result = outcome.json();
  ASSERT_EQ(result["warnings"].size(), 1);
  EXPECT_THAT(result["warnings"][0].get<std::string>(), HasSubstr("less than a tenth"));
  EXPECT_EQ(content(at("out/report.html")).find("verdict good"), std::string::npos);
}

TEST_F(Reflect, ReadsPolygonsAndDropsFacesWithoutArea) {
  write(at("cube.obj"),
        "v 0 0 0\nv 0 0 9\nv 0 9 0\nv 0 9 9\nv 9 0 0\nv 9 0 9\nv 9 9 0\nv 9 9 9\n"
        "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\nf 1 2 2\n");
  const Outcome outcome = run({"reflect", path("cube.obj"), "--evaluate", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NEAR(outcome.json()["energy_direct"], 0.17045, 0.002);
  EXPECT_THAT(outcome.err, HasSubstr("cube.obj: 1 face without area removed"));
}

TEST_F(Reflect, EvaluatePrintsEnergiesAndWritesNothing) {
  const Outcome outcome = run({"reflect", path("shape.off"), "--evaluate", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NEAR(outcome.json()["energy_direct"], 8.27e-5, 1e-6);
  EXPECT_EQ(listing(at("")), std::vector<std::string>{"shape.off"});
}

/// Two cubes that share an edge.
constexpr const char* kTouchingCubes =
    "OFF\n14 12 0\n0 0 0\n0 0 9\n0 9 0\n0 9 9\n9 0 0\n9 0 9\n9 9 0\n9 9 9\n"
    "9 18 0\n9 18 9\n18 9 0\n18 9 9\n18 18 0\n18 18 9\n"
    "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n4 0 2 6 4\n4 1 5 7 3\n"
    "4 6 7 9 8\n4 10 12 13 11\n4 6 10 11 7\n4 8 9 13 12\n4 6 8 12 10\n4 7 11 13 9\n";

TEST_F(Reflect, EdgesWithMoreThanTwoFacesAreRemeshed) {
  expect_refused(kTouchingCubes, {}, {"from 9,9,0 to 9,9,9", "more than two faces", "--faces N"});
  const Outcome outcome =
      run({"reflect", path("bad.off"), "--faces", "400", "--evaluate", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("surfaces separated at edges with more than two faces"));
}

TEST_F(Reflect, RadarHasTwoPolarizations) {
  std::vector<double> means;
  for (const char* word : {"vv", "hh"}) {
    const Outcome outcome = run({"reflect", path("shape.off"), "--evaluate", "--json", "--radar",
                                 "1000", "--polarization", word});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json radar = outcome.json()["radar"];
    EXPECT_EQ(radar["polarization"], word);
    means.push_back(radar["mean_dbsm"]);
  }
  EXPECT_GT(std::abs(means[0] - means[1]), 0.1);
  expect_refused(kOctahedron, {"--polarization", "vh"}, {"--polarization", "vh"});
}

/// A wall of four panes that looks south (−y), 2 wide and 2 high.
constexpr const char* kWall =
    "OFF\n9 4 0\n-1 0.2 0\n0 0.3 0\n1 0.2 0\n-1 0.2 1\n0 0.3 1\n1 0.2 1\n-1 0.2 2\n0 0.3 2\n1 0.2 "
    "2\n"
    "4 0 1 4 3\n4 1 2 5 4\n4 3 4 7 6\n4 4 5 8 7\n";

class Glare : public Reflect {
 protected:
  void SetUp() override { write(at("wall.off"), kWall); }

  [[nodiscard]] Arguments wall(const Arguments& more) const {
    Arguments arguments = {"reflect", path("wall.off"), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  void expect_bad(const Arguments& more, const std::vector<std::string>& parts) const {
    Arguments arguments = {"reflect", path("wall.off"), "--out", path("bad")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    expect_refusal(run(arguments), 2, parts);
    EXPECT_THAT(listing(at("bad")), ::testing::Not(::testing::Contains("reflect.json")));
  }
};

TEST_F(Glare, IsEvaluatedAtAPlace) {
  const Outcome outcome =
      run(wall({"--evaluate", "--glare", "36.11,-115.17,-8", "--place", "0,-1,0.1", "--glare-limit",
                "50", "--glare-material", "aluminium"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json glare = outcome.json()["glare"];
  EXPECT_EQ(glare["zone"], -8.0);
  // Two panes at most mirror the sun to a place at once.
  EXPECT_GT(glare["maximum"], 700.0);
  EXPECT_LT(glare["maximum"], 2.1 * 1000.0);
  EXPECT_GT(glare["hours_above_limit"], 10.0);
  EXPECT_THAT(glare["time"].get<std::string>(), HasSubstr("2025-"));
  ASSERT_EQ(glare["monthly"].size(), 12);
  EXPECT_EQ(glare["monthly"][0].size(), 24);
}

TEST_F(Glare, IsWrittenBeforeAndAfter) {
  write(at("places.txt"), "0,-1,0.1\n0.3,-1,0.1\n");
  const Outcome outcome =
      run(wall({"--out", path("out"), "--goal", "deflect", "--glare", "51.51,-0.08", "--place",
                path("places.txt"), "--glare-limit", "20", "--no-split", "--rim-updates", "5"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json glare = outcome.json()["glare"];
  EXPECT_GT(glare["before"]["maximum"], 30.0);
  EXPECT_LT(glare["after"]["maximum"], glare["before"]["maximum"]);
  EXPECT_EQ(glare["before"]["places"].size(), 2);
  EXPECT_EQ(nlohmann::json::parse(content(at("out/reflect.json")))["glare"], glare);
  EXPECT_THAT(content(at("out/glare.csv")), HasSubstr("month,day,hour,before,after\n1,1,0,0,0\n"));
  EXPECT_THAT(content(at("out/glare.svg")), HasSubstr("before: at most"));
  const std::string report = content(at("out/report.html"));
  EXPECT_THAT(report, HasSubstr("Reflected sunlight"));
  EXPECT_THAT(report, HasSubstr("hours a year above 20"));
}

TEST_F(Glare, BadPlacesAndSitesAreRefused) {
  const Arguments deflect = {"--goal", "deflect", "--glare", "51.51,-0.08"};
  const auto with = [&](const Arguments& more) {
    Arguments all = deflect;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  expect_bad({"--glare", "91,0", "--place", "0,-1,0"}, {"--glare 91,0", "latitude"});
  expect_bad(with({}), {"--glare", "--place"});
  expect_bad(with({"--place", "0,1,0"}), {"--place 0,1,0", "behind"});
  expect_bad(with({"--place", "0,nan,0"}), {"--place 0,nan,0"});
  write(at("empty.txt"), "");
  expect_bad(with({"--place", path("empty.txt")}), {"empty.txt", "0 places"});
  expect_bad(with({"--place", path("none.txt")}), {"none.txt"});
  expect_bad({"--place", "0,-1,0"}, {"--place 0,-1,0", "--glare"});
  expect_bad({"--glare-limit", "500"}, {"--glare-limit", "--glare"});
  write(at("wall.off"), kCube);
  expect_bad(with({"--place", "4,4,4"}), {"--place 4,4,4", "inside"});
}

TEST_F(Reflect, TheSolidIsOfThisShape) {
  EXPECT_EQ(run(quick({"--step"})).exit_code, 0);
  const Outcome read = run({"info", path("out/surface.step"), "--json"});
  ASSERT_EQ(read.exit_code, 0) << read.err;
  EXPECT_EQ(run(quick()).exit_code, 0);
  EXPECT_FALSE(fs::exists(at("out/surface.step"))) << "of the shape before";
  expect_refusal(run({"reflect", path("shape.off"), "--evaluate", "--step"}), 2,
                 {"--step", "--evaluate"});
}

TEST_F(Reflect, ARadarsGoalIsDescendedAndReported) {
  // A sphere-like body of one wavelength.
  const Arguments arguments = {"reflect",  path("shape.off"), "--faces",   "100",         "--goal",
                               "radar",    "--out",           path("out"), "--frequency", "270,300",
                               "--sector", "-60,60,10",       "--json"};
  const Outcome outcome = run(arguments);
  ASSERT_THAT(outcome.exit_code, ::testing::AnyOf(0, 3)) << outcome.err;
  const nlohmann::json result = outcome.json();
  EXPECT_EQ(result["goal"], "radar");
  EXPECT_EQ(result["radar"]["ghz"], nlohmann::json({270, 300}));
  EXPECT_LE(result["radar"]["mean_dbsm_after"], result["radar"]["mean_dbsm_before"]);
  EXPECT_THAT(content(at("out/convergence.csv")), HasSubstr(",radar,"));
  EXPECT_THAT(content(at("out/report.html")), HasSubstr("On the horizon at 270,300 GHz"));
  EXPECT_THAT(content(at("out/radar.csv")), HasSubstr("\n-60.00,"));
  EXPECT_THAT(content(at("out/radar.svg")), HasSubstr("<polyline"));
}

TEST_F(Reflect, ARadarsGoalNeedsAFrequencyAndASector) {
  const auto refused = [&](Arguments more, const std::vector<std::string>& parts) {
    more.insert(more.begin(), {"--goal", "radar"});
    expect_refused(kOctahedron, more, parts);
  };
  refused({}, {"--frequency", "is missing"});
  refused({"--frequency", "0"}, {"--frequency 0", "0.01 to 1000 GHz"});
  refused({"--frequency", "12,8"}, {"--frequency 12,8", "ascending"});
  refused({"--frequency", "10", "--sector", "90,90,2"}, {"--sector 90,90,2", "TO above FROM"});
  refused({"--frequency", "10", "--sector", "90,0,2"}, {"--sector 90,0,2", "TO above FROM"});
  refused({"--frequency", "10", "--radar", "10"}, {"--radar", "--goal radar"});
  expect_refused(kOctahedron, {"--sector", "0,90,2"}, {"--sector 0,90,2", "is for --goal radar"});
  expect_refused(kOctahedron, {"--frequency", "10"}, {"--frequency 10", "is for --goal radar"});
}

TEST_F(Reflect, FilesOfOthersAreKeptUnlessForced) {
  fs::create_directory(at("out"));
  write(at("out/surface.ply"), "mine");
  expect_refusal(run(quick()), 2, {"surface.ply", "--force"});
  EXPECT_EQ(content(at("out/surface.ply")), "mine");
  EXPECT_EQ(run(quick({"--force"})).exit_code, 0);
}

TEST_F(Reflect, MeshesThatCannotBeShapedAreRefused) {
  const std::string open = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 0 1\n3 0 1 2\n";
  expect_refused(open, {"--keep-volume"}, {"--keep-volume", "is open", "--keep-box"});
  expect_refused(open, {"--min-thickness", "0.1"}, {"--min-thickness", "is open"});
  expect_refused("OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n", {}, {"no face has an area"});
  expect_refused("OFF\n3 1 0\n0 0 0\n1 0 nan\n0 0 1\n3 0 1 2\n", {}, {"bad.off"});
  expect_refused("OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n3 0 1 2\n3 0 1 3\n3 0 1 4\n", {},
                 {"more than two faces"});
  expect_refused(open, {"--symmetry", "x"}, {"has no mirror image"});
}

TEST_F(Reflect, OptionsThatContradictEachOtherAreRefused) {
  expect_refused(kOctahedron, {"--fix-box=-9,-9,-9,9,9,9"}, {"hold all 6 vertices"});
  expect_refused(kOctahedron, {"--fix-plane", "0,0,0,1"}, {"--fix-plane 0,0,0,1", "0,0,1,0"});
  expect_refused(kOctahedron, {"--fix-vertices", path("none.txt")}, {"none.txt"});
  expect_refused(kOctahedron, {"--place", "1,2,3"}, {"--place", "1,2,3"});
  expect_refused(kOctahedron, {"--goal", "point"}, {"--place"});
  expect_refused(kOctahedron, {"--light", "0,0,0"}, {"--light", "0,0,0"});
  write(at("numbers.txt"), "6\n");
  expect_refused(kOctahedron, {"--planar-faces", path("numbers.txt"), "--faces", "100"},
                 {"--planar-faces", "--faces makes another mesh"});
  expect_refusal(run({"reflect", path("shape.off")}), 2, {"--out", "--evaluate"});
}

TEST_F(Reflect, TakesSolids) {
  ASSERT_EQ(run(small_design(picture("stripes.png"), path("lens"))).exit_code, 0);
  // Not as near to the picture as is asked for by default, which is no matter here.
  ASSERT_EQ(run({"export", path("lens"), "--out", path("lens.step")}).exit_code, 3);
  const Outcome outcome = run({"reflect", path("lens.step"), "--evaluate", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GT(outcome.json()["energy"], 0.0);
  write(at("bad.step"), "solid");
  expect_refusal(run({"reflect", path("bad.step"), "--evaluate"}), 2, {"bad.step"});
}

TEST_F(Reflect, AnInterruptedRunKeepsItsShapeAndSaysSo) {
  Process process({"reflect", path("shape.off"), "--out", path("out"), "--method", "paper",
                   "--rim-updates", "10000"});
  // A run that has its folder but nothing begun yet ends without a result.
  wait_for_checkpoint(process, "out");
  process.send(SIGINT);
  EXPECT_EQ(process.wait().exit_code, 130);
  const nlohmann::json result = nlohmann::json::parse(content(at("out/reflect.json")));
  EXPECT_EQ(result["status"], "interrupted");
  EXPECT_TRUE(result["after"].is_null());
  EXPECT_EQ(read_mesh(at("out/surface.ply")).triangle_count(), 8);
}

/// A run of a few seconds with all stages.
class ReflectResume : public Reflect {
 protected:
  [[nodiscard]] Arguments run_into(const std::string& out, const Arguments& more = {}) const {
    Arguments arguments = {"reflect",
                           path("shape.off"),
                           "--out",
                           path(out),
                           "--faces",
                           "200",
                           "--rim-updates",
                           "8",
                           "--face-updates",
                           "8",
                           "--direction-rows",
                           "4",
                           "--anchor",
                           "0.03"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  void expect_same_shape(const std::string& a, const std::string& b) const {
    for (const char* file : {"surface.ply", "surface.stl", "reference.ply", "views.png"}) {
      EXPECT_TRUE(content(at(a) / file) == content(at(b) / file)) << file;
    }
    EXPECT_EQ(listing(at(a)), listing(at(b)));
  }
};

TEST_F(ReflectResume, KilledAtAnyMomentAndResumedGivesTheSameShape) {
  const Outcome whole = run(run_into("whole"));
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  for (const double share : {0.1, 0.5, 0.9}) {
    const std::string out = "killed" + std::to_string(share);
    Process process(run_into(out));
    const auto time = std::chrono::milliseconds(static_cast<int>(1000.0 * share * whole.seconds));
    if (process.runs_for(time)) process.send(SIGKILL);
    process.wait();
    const Outcome resumed = run(run_into(out, {"--resume", "--threads", "1"}));
    ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
    expect_same_shape("whole", out);
  }
}

TEST_F(ReflectResume, CtrlCKeepsACheckpointThatOnlyTheSameRunTakes) {
  ASSERT_EQ(run(run_into("whole")).exit_code, 0);
  Process process(run_into("out"));
  wait_for_checkpoint(process, "out");
  process.send(SIGINT);
  const Outcome stopped = process.wait();
  ASSERT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_THAT(stopped.err, HasSubstr("--resume"));
  expect_refusal(run(run_into("out")), 2, {"unfinished run", "--resume", "--force"});
  expect_refusal(run(run_into("out", {"--resume", "--seed", "2"})), 2,
                 {"reflect.checkpoint", "other options"});
  ASSERT_EQ(run(run_into("out", {"--resume"})).exit_code, 0);
  expect_same_shape("whole", "out");
}

TEST_F(ReflectResume, AFinishedRunHasNothingToResume) {
  ASSERT_EQ(run(quick()).exit_code, 0);
  const auto written = fs::last_write_time(at("out/reflect.json"));
  const Outcome again = run(quick({"--resume"}));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("finished"));
  EXPECT_EQ(fs::last_write_time(at("out/reflect.json")), written);
}

TEST_F(ReflectResume, ADamagedCheckpointIsRefusedAndKept) {
  fs::create_directory(at("out"));
  write(at("out/reflect.checkpoint"), "no checkpoint");
  expect_refusal(run(quick({"--resume"})), 2, {"reflect.checkpoint"});
  EXPECT_EQ(content(at("out/reflect.checkpoint")), "no checkpoint");
  EXPECT_EQ(run(quick({"--force"})).exit_code, 0);
  EXPECT_FALSE(fs::exists(at("out/reflect.checkpoint")));
}

TEST_F(ReflectResume, ADamagedCheckpointIsRefusedBeforeAMinuteOfRemeshing) {
  fs::create_directory(at("out"));
  write(at("out/reflect.checkpoint"), "no checkpoint");
  const Outcome outcome =
      run({"reflect", path("shape.off"), "--out", path("out"), "--faces", "400000", "--resume"});
  expect_refusal(outcome, 2, {"reflect.checkpoint"});
  EXPECT_LT(outcome.seconds, 10.0);
}

/// CGAL's remeshing, a minute of it, does not look for interrupts.
TEST_F(Reflect, InterruptedWhileItRemeshesWritesNothing) {
  for (const Arguments& what : {Arguments{"--out", path("out")}, Arguments{"--evaluate"}}) {
    Arguments arguments = {"reflect", path("shape.off"), "--faces", "400000"};
    arguments.insert(arguments.end(), what.begin(), what.end());
    Process process(arguments);
    ASSERT_TRUE(process.runs_for(std::chrono::milliseconds(3000))) << process.wait().err;
    process.send(SIGINT);
    const Outcome outcome = process.wait();
    EXPECT_EQ(outcome.exit_code, 130);
    EXPECT_THAT(outcome.err, HasSubstr("nothing was written"));
    EXPECT_EQ(listing(at("")), std::vector<std::string>{"shape.off"});
  }
}

}  // namespace
}  // namespace lensforge::scenario

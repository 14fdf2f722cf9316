// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "core/image/image_io.h"
#include "core/mesh/mesh_files.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Export : public Scenario {
 protected:
  void SetUp() override { place_small_lens(at("lens")); }

  void expect_refused(const Arguments& options, const std::vector<std::string>& parts) {
    Arguments arguments = {"export", path("lens"), "--quiet"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    expect_refusal(run(arguments), 2, parts);
  }

  void move_vertex(Eigen::Index vertex, const Eigen::Vector3d& by) {
    SurfaceMesh mesh = read_mesh(at("lens/surface.ply"));
    mesh.vertices.col(vertex) += by;
    write_ply(mesh, at("lens/surface.ply"));
  }
};

TEST_F(Export, EveryMeshFormatHoldsAClosedSolid) {
  for (const char* name : {"lens.stl", "lens.obj", "lens.ply", "lens.3mf", "lens.glb"}) {
    const Outcome outcome = run({"export", path("lens"), "--out", path(name), "--json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json result = outcome.json();
    EXPECT_EQ(result["bytes"], fs::file_size(at(name)));
    EXPECT_GT(result["volume_mm3"], 5.0 * 100.0 * 60.0);
    EXPECT_TRUE(result["metrics"].contains("smooth"));
    if (at(name).extension() == ".3mf" || at(name).extension() == ".glb") continue;
    EXPECT_EQ(result["triangles"], read_mesh(at(name)).triangle_count());
  }
}

TEST_F(Export, StepIsOneSolidWithACertificateForEveryPatch) {
  const Outcome outcome = run({"export", path("lens"), "--out", path("lens.step"), "--json",
                               "--author", "A. Turner", "--schema", "ap242"});
  ASSERT_EQ(outcome.exit_code, 3) << outcome.err;  // A coarse mesh has creases of a facet's width.
  const nlohmann::json result = outcome.json();
  EXPECT_FALSE(result["within_tolerance"]);
  EXPECT_GT(result["normal_error_rad"], 1e-4);
  EXPECT_GE(result["normal_error_rad"], result["least_possible_normal_error_rad"]);
  EXPECT_LT(result["share_within_tolerance"], 1.0);
  EXPECT_LE(result["worst_normal_at_mm"][0], 100.0);
  EXPECT_EQ(result["faces"], result["patches"].size() + 5);
  for (const nlohmann::json& patch : result["patches"]) {
    EXPECT_LE(patch["height_error_mm"], result["height_error_mm"]);
    EXPECT_LE(patch["normal_error_rad"], result["normal_error_rad"]);
  }
  EXPECT_TRUE(result["metrics"].contains("solid"));
  const std::string step = content(at("lens.step"));
  EXPECT_THAT(step, HasSubstr("A. Turner"));
  EXPECT_THAT(step, HasSubstr("AP242"));
  EXPECT_THAT(step, HasSubstr("sha256:"));
}

/// More control points do not help where no surface has all of a mesh's normals; another model
/// does.
TEST_F(Export, MissedTolerancesNameAModelThatHasNone) {
  const Outcome meshed = run({"export", path("lens"), "--out", path("lens.step")});
  ASSERT_EQ(meshed.exit_code, 3);
  EXPECT_THAT(meshed.err, HasSubstr("normals of the mesh contradict each other"));
  EXPECT_THAT(meshed.err, HasSubstr("design --model spline"));
  EXPECT_THAT(meshed.err, Not(HasSubstr("--max-points")));
  Arguments design = small_design(picture("stripes.png"), path("spline"));
  *std::find(design.begin(), design.end(), "facet") = "spline";
  ASSERT_EQ(run(design).exit_code, 0);
  const Outcome exact = run({"export", path("spline"), "--out", path("spline.step")});
  EXPECT_EQ(exact.exit_code, 0) << exact.err;
  EXPECT_THAT(exact.err, Not(HasSubstr("tolerances")));
}

/// Written, read back and rendered, the solid throws what export said that its splines throw.
TEST_F(Export, RenderedStepFileIsThePictureThatExportPrinted) {
  const nlohmann::json written =
      run({"export", path("lens"), "--out", path("lens.step"), "--json"}).json();
  const nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  const int pixels = std::max(lens["pixels"][0].get<int>(), lens["pixels"][1].get<int>());
  const Outcome outcome =
      run({"render", path("lens.step"), "--target", path("lens/target.exr"), "--pixels",
           std::to_string(pixels), "--focal", std::to_string(lens["focal_length"].get<double>()),
           "--ior", std::to_string(lens["ior"].get<double>()), "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json rendered = outcome.json();
  EXPECT_EQ(rendered["model"], "smooth");
  EXPECT_THAT(outcome.err, HasSubstr("optical surface"));
  const double printed = written["metrics"]["solid"]["mae"];
  EXPECT_NEAR(rendered["metrics"]["smooth"]["mae"].get<double>(), printed, 1e-4);
  EXPECT_LE(printed, written["metrics"]["smooth"]["mae"].get<double>() + 1e-4);
}

TEST_F(Export, IgesIsOneSolid) {
  const Outcome outcome = run({"export", path("lens"), "--out", path("lens.igs"), "--json",
                               "--normal-tolerance", "0.1", "--tolerance", "0.5mm"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["format"], "iges");
  EXPECT_EQ(outcome.json()["faces"], outcome.json()["patches"].size() + 5);
  expect_refused({"--out", path("lens.igs"), "--schema", "ap242"}, {"--schema", "iges"});
}

TEST_F(Export, RenderRefusesWhatIsNoSolid) {
  write(at("part.step"), "ISO-10303-21;\nHEADER;\nENDSEC;\n");
  expect_refusal(run({"render", path("part.step"), "--quiet"}), 2, {"part.step"});
  expect_refusal(run({"render", path("none.step"), "--quiet"}), 2, {"none.step", "No such file"});
}

TEST_F(Export, StepMeetsTolerancesThatItsMeshAllows) {
  const Outcome outcome = run({"export", path("lens"), "--out", path("lens.stp"), "--json",
                               "--tolerance", "0.5mm", "--normal-tolerance", "0.1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(outcome.json()["within_tolerance"]);
  EXPECT_EQ(outcome.json()["format"], "step");
}

TEST_F(Export, SameLensGivesTheSameStepBytes) {
  run({"export", path("lens"), "--out", path("a.step"), "--max-points", "2000", "--threads", "1"});
  run({"export", path("lens"), "--out", path("b.step"), "--max-points", "2000", "--threads", "2"});
  EXPECT_TRUE(content(at("a.step")) == content(at("b.step")));
  EXPECT_GT(content(at("a.step")).size(), 1000U);
}

TEST_F(Export, HeightMapsHaveTheAskedSize) {
  for (const char* name : {"lens.exr", "lens.png"}) {
    const Outcome outcome =
        run({"export", path("lens"), "--out", path(name), "--pixels", "64", "--json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(read_image(at(name)).image.columns(), 64);
    EXPECT_EQ(outcome.json()["pixels"][0], 64);
  }
}

/// What stands in for the cut is the design, 0.1 mm higher.
TEST_F(Export, EveryFormatTakesTheMilledSurface) {
  SurfaceMesh mesh = read_mesh(at("lens/surface.ply"));
  const double area = mesh.vertices.row(0).maxCoeff() * mesh.vertices.row(1).maxCoeff();
  mesh.vertices.row(2).array() += 0.1;
  fs::create_directory(at("lens/cam"));
  write_ply(mesh, at("lens/cam/milled.ply"));
  for (const std::string name : {"a.stl", "a.obj", "a.ply", "a.3mf", "a.step", "a.igs", "a.png"}) {
    Arguments arguments{"export", path("lens"), "--out", path(name), "--json"};
    if (name == "a.step" || name == "a.igs") {
      arguments.insert(arguments.end(), {"--max-points", "1000"});
    }
    const nlohmann::json designed = run(arguments).json();
    fs::remove(at(name));
    arguments.insert(arguments.end(), {"--surface", "milled"});
    const nlohmann::json milled = run(arguments).json();
    if (name == "a.png") {
      EXPECT_NEAR(milled["black_mm"].get<double>() - designed["black_mm"].get<double>(), 0.1, 1e-6);
      continue;
    }
    const double risen = milled["volume_mm3"].get<double>() - designed["volume_mm3"].get<double>();
    EXPECT_NEAR(risen, 0.1 * area, 0.01 * area) << name;
  }
}

TEST_F(Export, WhatIsNoLensIsRefusedAndNothingIsWritten) {
  for (const char* name : {"out.step", "out.igs", "out.stl", "out.exr"}) {
    const Outcome outcome = run({"export", path("nowhere"), "--out", path(name), "--quiet"});
    expect_refusal(outcome, 2, {"nowhere"});
  }
  const nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  move_vertex(lens["grid"][0].get<int>() * 3 + 5, {20.0, 0.0, 0.0});
  expect_refused({"--out", path("out.step")}, {"surface.ply", "triangle"});
  EXPECT_EQ(listing(at("")), std::vector<std::string>{"lens"});
}

TEST_F(Export, FormatGoesBeforeTheExtension) {
  ASSERT_EQ(run({"export", path("lens"), "--out", path("part.obj"), "--format", "stl"}).exit_code,
            0);
  EXPECT_EQ((fs::file_size(at("part.obj")) - 84) % 50, 0U);
}

TEST_F(Export, BadOptionsAreRefused) {
  expect_refused({"--out", path("lens.dwg")}, {"lens.dwg", ".stl"});
  expect_refused({"--out", path("lens"), "--format", "stl"}, {"--out", "folder"});
  expect_refused({"--out", path("lens.stl"), "--format", "dwg"}, {"--format", "dwg"});
  expect_refused({"--out", path("lens.stl"), "--pixels", "100"}, {"--pixels", "stl"});
  expect_refused({"--out", path("lens.png"), "--pixels", "1"}, {"--pixels", "1"});
  expect_refused({"--out", path("lens.stl"), "--surface", "milled"}, {"milled.ply"});
  expect_refused({"--out", path("lens.step"), "--tolerance", "0"}, {"--tolerance", "0"});
  expect_refused({"--out", path("lens.step"), "--tolerance", "5cm"}, {"--tolerance", "5cm"});
  expect_refused({"--out", path("lens.step"), "--normal-tolerance", "nan"}, {"--normal-tolerance"});
  expect_refused({"--out", path("lens.stl"), "--tolerance", "1um"}, {"--tolerance", "stl"});
  expect_refused({"--out", path("lens.step"), "--schema", "ap203"}, {"--schema", "ap203"});
  expect_refused({}, {"--out"});
}

TEST_F(Export, TargetThatCannotBeWrittenIsRefused) {
  expect_refused({"--out", "/proc/nowhere/lens.stl"}, {"/proc/nowhere"});
}

TEST_F(Export, FoldedMeshIsRefused) {
  const nlohmann::json lens = nlohmann::json::parse(content(at("lens/lens.json")));
  const int columns = lens["grid"][0];
  move_vertex(columns * 3 + 5, {20.0, 0.0, 0.0});
  expect_refused({"--out", path("lens.stl")}, {"surface.ply", "triangle"});
  EXPECT_FALSE(fs::exists(at("lens.stl")));
}

TEST_F(Export, SurfaceBelowTheBackIsRefused) {
  move_vertex(40, {0.0, 0.0, -100.0});
  expect_refused({"--out", path("lens.stl")}, {"surface.ply", "at 0"});
}

TEST_F(Export, FileSizeLimitLeavesNothing) {
  for (const char* name : {"lens.stl", "lens.3mf", "lens.exr", "lens.step", "lens.igs"}) {
    const Outcome outcome = run({"export", path("lens"), "--out", path(name), "--quiet"}, 2048);
    expect_refusal(outcome, 1, {name, "File too large"});
    EXPECT_FALSE(fs::exists(at(name)));
  }
  EXPECT_EQ(listing(at("")), std::vector<std::string>{"lens"});
}

}  // namespace
}  // namespace lensforge::scenario

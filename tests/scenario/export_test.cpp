// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/image_io.h"
#include "core/mesh_io.h"
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;

class Export : public Scenario {
 protected:
  void SetUp() override {
    ASSERT_EQ(run(small_design(picture("stripes.png"), path("lens"))).exit_code, 0);
  }

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
  for (const char* name : {"lens.stl", "lens.obj", "lens.ply", "lens.3mf"}) {
    const Outcome outcome = run({"export", path("lens"), "--out", path(name), "--json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json result = outcome.json();
    EXPECT_EQ(result["bytes"], fs::file_size(at(name)));
    EXPECT_GT(result["volume_mm3"], 5.0 * 100.0 * 60.0);
    EXPECT_TRUE(result["metrics"].contains("smooth"));
    if (std::string(name) == "lens.3mf") continue;
    EXPECT_EQ(result["triangles"], read_mesh(at(name)).triangle_count());
  }
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
  for (const char* name : {"lens.stl", "lens.3mf", "lens.exr"}) {
    const Outcome outcome = run({"export", path("lens"), "--out", path(name), "--quiet"}, 2048);
    expect_refusal(outcome, 1, {name, "File too large"});
    EXPECT_FALSE(fs::exists(at(name)));
  }
  EXPECT_EQ(listing(at("")), std::vector<std::string>{"lens"});
}

}  // namespace
}  // namespace lensforge::scenario

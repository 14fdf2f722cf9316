// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <numeric>

#include "core/error.h"
#include "core/temp_folder.h"
#include "design/reflect/input.h"
#include "design/reflect/mesh/faces.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using testing::TempFolder;

std::string refusal(const SurfaceMesh& mesh, const ReflectOptions& options) {
  try {
    prepared_input(mesh, "m.stl", options);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

int fixed_count(const ReflectOptions& options) {
  const ReflectInput input = prepared_input(shapes::icosphere(2), "m.stl", options);
  return std::accumulate(input.fixed.begin(), input.fixed.end(), 0);
}

TEST(ReflectInput, BoxPlaneAndFileHoldVertices) {
  ReflectOptions options;
  EXPECT_EQ(fixed_count(options), 0);
  options.fix_plane = "0,0,1,0";
  const int below = fixed_count(options);
  EXPECT_GT(below, 70);
  EXPECT_LT(below, 100);
  options.fix_plane = "";
  options.fix_box = "-2,-2,0.9,2,2,2";
  EXPECT_GT(fixed_count(options), 0);
  EXPECT_LT(fixed_count(options), below);
  const TempFolder folder;
  testing::write_bytes(folder / "v.txt", "0 1\n5\n");
  options.fix_box = "";
  options.fix_vertices = (folder / "v.txt").string();
  EXPECT_EQ(fixed_count(options), 3);
}

TEST(ReflectInput, RefusesWhatContradictsItself) {
  ReflectOptions options;
  options.fix_box = "-2,-2,-2,2,2,2";
  EXPECT_THAT(refusal(shapes::icosphere(2), options), HasSubstr("hold all 162 vertices"));
  options.fix_box = "1,2";
  EXPECT_THAT(refusal(shapes::icosphere(2), options),
              StartsWith("--fix-box 1,2: must be 6 finite numbers"));
  options = {};
  options.keep_volume = true;
  EXPECT_THAT(refusal(shapes::trihedral(2), options), StartsWith("--keep-volume: m.stl is open"));
  options = {};
  options.min_thickness = 1.0;
  EXPECT_THAT(refusal(shapes::trihedral(2), options), StartsWith("--min-thickness: m.stl is open"));
  options = {};
  options.symmetry = Symmetry::kX;
  EXPECT_THAT(refusal(shapes::dihedral(2.0, 2, 2), options), HasSubstr("has no mirror image"));
}

TEST(ReflectInput, RemeshingLeavesNoFaceWithoutArea) {
  ReflectOptions options;
  options.faces = 400;  // Far fewer than the rocket's creases need.
  const ReflectInput input = prepared_input(shapes::rocket(), "rocket", options);
  EXPECT_GT(measure_faces(input.mesh).area.minCoeff(), 0.0);
  EXPECT_TRUE(input.closed);
}

TEST(ReflectInput, RefusesNumbersThatTheMeshDoesNotHave) {
  const TempFolder folder;
  ReflectOptions options;
  options.fix_vertices = (folder / "v.txt").string();
  for (const char* text : {"162", "-1", "1.5", "a", ""}) {
    testing::write_bytes(folder / "v.txt", text);
    EXPECT_NE(refusal(shapes::icosphere(2), options), "") << text;
  }
  options.faces = 500;
  EXPECT_THAT(refusal(shapes::icosphere(2), options), HasSubstr("--faces makes another mesh"));
}

TEST(ReflectInput, RemeshesToAboutTheFacesAskedFor) {
  ReflectOptions options;
  options.faces = 1000;
  for (const auto& [mesh, tolerance] :
       {std::pair(shapes::icosphere(4), 100.0), std::pair(shapes::cube(4), 250.0)}) {
    const ReflectInput input = prepared_input(mesh, "m", options);
    EXPECT_NEAR(static_cast<double>(input.mesh.triangle_count()), 1000.0, tolerance);
    EXPECT_TRUE(make_edges(input.mesh).is_closed());
    EXPECT_NEAR(signed_volume(input.mesh), signed_volume(mesh), 0.02 * signed_volume(mesh));
  }
}

}  // namespace
}  // namespace lensforge::reflect

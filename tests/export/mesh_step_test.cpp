// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <Eigen/Core>
#include <filesystem>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/temp_folder.h"
#include "export/solid/solid_files.h"
#include "export/solid/solid_reading.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

const StepHeader kMeshHeader{"mesh", "a mesh", "", "lensforge", "2026-01-01T00:00:00"};

/// A box with a corner at `low`, looking outwards.
SurfaceMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& size) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 8);
  for (int v = 0; v < 8; ++v) {
    const Eigen::Vector3d at(v & 1, (v >> 1) & 1, (v >> 2) & 1);
    mesh.vertices.col(v) = low + at.cwiseProduct(size);
  }
  mesh.triangles.resize(3, 12);
  mesh.triangles << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,                //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return mesh;
}

SurfaceMesh both(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh all = a;
  all.vertices.conservativeResize(3, a.vertices.cols() + b.vertices.cols());
  all.vertices.rightCols(b.vertices.cols()) = b.vertices;
  all.triangles.conservativeResize(3, a.triangles.cols() + b.triangles.cols());
  all.triangles.rightCols(b.triangles.cols()) =
      b.triangles.array() + static_cast<int>(a.vertices.cols());
  return all;
}

class MeshStep : public ::testing::Test {
 protected:
  TempFolder folder_;
  std::filesystem::path path_ = folder_ / "mesh.step";
};

TEST_F(MeshStep, AClosedPieceIsASolidWithItsVolume) {
  write_mesh_step(box({1, 2, 3}, {2, 3, 4}), kMeshHeader, path_);
  const SolidContent read = inspect_step(path_);
  EXPECT_TRUE(read.is_one_solid());
  EXPECT_EQ(12, read.faces);
  EXPECT_NEAR(24.0, read.volume, 1e-9);
  EXPECT_NEAR(3.0, read.high[0], 1e-6);
  EXPECT_EQ(12, read_solid_mesh(path_).triangle_count());
}

TEST_F(MeshStep, PiecesAreSolidsOfTheirOwn) {
  const SolidContent written = write_mesh_step(
      both(box({0, 0, 0}, {1, 1, 1}), box({5, 0, 0}, {2, 2, 2})), kMeshHeader, path_);
  EXPECT_EQ(2, written.solids);
  EXPECT_EQ(24, written.faces);
  EXPECT_TRUE(written.closed);
  EXPECT_NEAR(9.0, written.volume, 1e-9);
}

TEST_F(MeshStep, AnOpenPieceIsAShell) {
  SurfaceMesh open = box({0, 0, 0}, {1, 1, 1});
  open.triangles.conservativeResize(3, 10);
  const SolidContent written =
      write_mesh_step(both(open, box({5, 0, 0}, {2, 2, 2})), kMeshHeader, path_);
  EXPECT_EQ(1, written.solids);
  EXPECT_EQ(22, written.faces);
  EXPECT_TRUE(written.valid);
  EXPECT_FALSE(written.closed);
}

TEST_F(MeshStep, SidesWithoutLengthAreRefusedAndLeaveNothing) {
  SurfaceMesh thin = box({0, 0, 0}, {1, 1, 1e-9});
  try {
    write_mesh_step(thin, kMeshHeader, path_);
    FAIL() << "written";
  } catch (const RunError& error) {
    EXPECT_THAT(error.what(), HasSubstr("mesh.step: cannot be written"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace lensforge::testing

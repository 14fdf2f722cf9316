// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/mesh_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "core/error.h"
#include "core/full_disk.h"
#include "core/temp_folder.h"
#include "core/test_meshes.h"
#include "core/text/version.h"

namespace lensforge::mesh_files_test {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::FullDisk;
using lensforge::testing::grid_mesh;
using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

SurfaceMesh rough_grid(int columns, int rows) {
  SurfaceMesh mesh = grid_mesh(columns, rows, 0.1);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 0.01);
  for (double& value : mesh.vertices.reshaped()) value += normal(random);
  return mesh;
}

std::string refusal(const fs::path& path) {
  ::testing::internal::CaptureStderr();
  std::string message = message_of<InputError>([&] { read_mesh(path); });
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << path;
  EXPECT_THAT(message, StartsWith(path.string() + ": "));
  return message;
}

/// A quarter of a unit square's triangles in each text format, with 0.1 as a coordinate.
constexpr const char* kTextPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
    "property double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0.1\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
constexpr const char* kObj =
    "v 0 0 0.1\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n";
constexpr const char* kOff = "OFF\n4 2 0\n0 0 0.1\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
constexpr const char* kTextStl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0.1\nvertex 1 0 0\nvertex 1 1 0\n"
    "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0.1\nvertex 1 1 0\n"
    "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n";

std::string binary_stl() {
  std::string bytes(80, ' ');
  const auto append = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  append(std::uint32_t{2});
  for (const auto& triangle : std::vector<std::array<float, 9>>{{0, 0, 0.1F, 1, 0, 0, 1, 1, 0},
                                                                {0, 0, 0.1F, 1, 1, 0, 0, 1, 0}}) {
    append(std::array<float, 3>{0, 0, 1});
    append(triangle);
    append(std::uint16_t{0});
  }
  return bytes;
}

const std::vector<std::pair<std::string, std::string>>& samples() {
  static const std::vector<std::pair<std::string, std::string>> all{{"a.ply", kTextPly},
                                                                    {"a.obj", kObj},
                                                                    {"a.off", kOff},
                                                                    {"text.stl", kTextStl},
                                                                    {"binary.stl", binary_stl()}};
  return all;
}

TEST(MeshIo, OurPlyComesBackBitForBit) {
  const TempFolder folder;
  SurfaceMesh mesh = rough_grid(37, 23);
  mesh.vertices(2, 5) = -0.0;
  mesh.vertices(0, 6) = std::numeric_limits<double>::denorm_min();
  mesh.vertices(0, 7) = std::nextafter(100.0, 101.0);
  write_ply(mesh, folder / "m.ply");
  const SurfaceMesh read = read_mesh(folder / "m.ply");
  ASSERT_EQ(read.vertex_count(), mesh.vertex_count());
  EXPECT_EQ(read.triangles, mesh.triangles);
  EXPECT_EQ(std::memcmp(read.vertices.data(), mesh.vertices.data(),
                        static_cast<std::size_t>(mesh.vertices.size()) * sizeof(double)),
            0);
  EXPECT_FALSE(read.grid.is_grid());
}

TEST(MeshIo, OurPlyHasTheFormOfTheInterface) {
  const TempFolder folder;
  write_ply(grid_mesh(2, 2), folder / "m.ply");
  const std::string bytes = read_bytes(folder / "m.ply");
  EXPECT_THAT(bytes, StartsWith("ply\nformat binary_little_endian 1.0\ncomment " + program_mark() +
                                "\nelement vertex 4\n"
                                "property double x\nproperty double y\nproperty double z\n"
                                "element face 2\nproperty list uchar int vertex_indices\n"
                                "end_header\n"));
  EXPECT_EQ(bytes.size(), bytes.find("end_header\n") + 11 + 4 * 24 + 2 * 13);
}

TEST(MeshIo, OurPlyWithoutAMarkComesBackBitForBit) {
  const TempFolder folder;
  const SurfaceMesh mesh = rough_grid(5, 4);
  write_ply(mesh, folder / "m.ply");
  std::string bytes = read_bytes(folder / "m.ply");
  const std::string mark = "comment " + program_mark() + "\n";
  bytes.erase(bytes.find(mark), mark.size());
  write_bytes(folder / "m.ply", bytes);
  EXPECT_EQ(read_mesh(folder / "m.ply").vertices, mesh.vertices);
}

TEST(MeshIo, ReadsEveryFormat) {
  const TempFolder folder;
  for (const auto& [name, content] : samples()) {
    write_bytes(folder / name, content);
    const SurfaceMesh mesh = read_mesh(folder / name);
    ASSERT_EQ(mesh.vertex_count(), 4) << name;
    ASSERT_EQ(mesh.triangle_count(), 2) << name;
    EXPECT_NEAR(mesh.corner(0, 0).z(), 0.1, 1e-8) << name;
    EXPECT_EQ(mesh.corner(0, 1), Eigen::Vector3d(1, 0, 0)) << name;
    EXPECT_EQ(mesh.corner(1, 2), Eigen::Vector3d(0, 1, 0)) << name;
    EXPECT_EQ(mesh.triangles(0, 0), mesh.triangles(0, 1)) << name;
  }
}

TEST(MeshIo, WhatIsNoManifoldIsReadAsItIs) {
  const TempFolder folder;
  write_bytes(folder / "a.off",
              "OFF\n5 3 0\n0 0 0\n1 0 0\n0 1 0\n0 -1 0\n0 0 1\n3 0 1 2\n3 0 1 3\n3 0 1 4\n");
  const SurfaceMesh mesh = read_mesh(folder / "a.off");
  EXPECT_EQ(mesh.vertex_count(), 5);
  EXPECT_EQ(mesh.triangles.col(2), Eigen::Vector3i(0, 1, 4));
}

TEST(MeshIo, RefusesMissingFolderAndEmpty) {
  const TempFolder folder;
  fs::create_directory(folder / "d.ply");
  write_bytes(folder / "e.ply", "");
  EXPECT_THAT(refusal(folder / "none.ply"), HasSubstr("No such file or directory"));
  EXPECT_THAT(refusal(folder / "d.ply"), HasSubstr("is a folder"));
  EXPECT_THAT(refusal(folder / "e.ply"), HasSubstr("is empty"));
}

TEST(MeshIo, RefusesWhatIsNoMeshUnderAnyName) {
  const TempFolder folder;
  for (const std::string name : {"t.ply", "t.obj", "t.stl", "t.off", "t.txt", "t"}) {
    write_bytes(folder / name, "This is a letter and not a mesh.\n");
    refusal(folder / name);
  }
}

TEST(MeshIo, RefusesOurPlyCutAnywhere) {
  const TempFolder folder;
  write_ply(rough_grid(9, 7), folder / "m.ply");
  const std::string bytes = read_bytes(folder / "m.ply");
  for (std::size_t cut = 1; cut < bytes.size(); cut += 37) {
    write_bytes(folder / "c.ply", std::string_view(bytes).substr(0, cut));
    refusal(folder / "c.ply");
  }
  write_bytes(folder / "c.ply", std::string_view(bytes).substr(0, bytes.size() - 1));
  EXPECT_THAT(refusal(folder / "c.ply"), HasSubstr("truncated"));
}

TEST(MeshIo, RefusesOtherMeshesThatAreCutAnywhere) {
  const TempFolder folder;
  for (const auto& [name, content] : samples()) {
    if (name == "a.obj") continue;  // A shorter OBJ file is a smaller mesh.
    // Behind the last number nothing is missing that could be told.
    const std::size_t last = name == "binary.stl" ? content.size() : content.size() - 12;
    for (std::size_t cut = 1; cut < last; ++cut) {
      write_bytes(folder / name, std::string_view(content).substr(0, cut));
      EXPECT_THROW(read_mesh(folder / name), InputError) << name << " cut to " << cut;
    }
  }
}

TEST(MeshIo, ReadsPolygonsAsTriangles) {
  const TempFolder folder;
  const std::string points = "0 0 0\n2 0 0\n2 2 0\n1 1 0\n0 2 0\n";  // Hollow at vertex 3.
  write_bytes(folder / "p.off", "OFF\n5 1 0\n" + points + "5 0 1 2 3 4\n");
  write_bytes(folder / "p.obj", "f 1 2 3 4 5\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 1 0\nv 0 2 0\n");
  write_bytes(folder / "p.ply",
              "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
              "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
              "end_header\n" +
                  points + "5 0 1 2 3 4\n");
  for (const std::string name : {"p.off", "p.obj", "p.ply"}) {
    const SurfaceMesh mesh = read_mesh(folder / name);
    ASSERT_EQ(mesh.triangle_count(), 3) << name;
    double area = 0.0;
    for (int t = 0; t < 3; ++t) {
      const Corners c = mesh.corners(t);
      const double z = (c.v1 - c.v0).cross(c.v2 - c.v0).z();
      EXPECT_GT(z, 0.0) << name;
      area += 0.5 * z;
    }
    EXPECT_DOUBLE_EQ(area, 3.0) << name;
  }
}

TEST(MeshIo, RefusesFacesOfTwoCorners) {
  const TempFolder folder;
  write_bytes(folder / "e.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n2 0 1\n");
  write_bytes(folder / "e.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n");
  for (const std::string name : {"e.off", "e.obj"}) {
    EXPECT_THAT(refusal(folder / name), HasSubstr("face 0 has 2 corners: it must have 3"));
  }
}

TEST(MeshIo, RefusesPolygonsWithIndicesOutOfRange) {
  const TempFolder folder;
  write_bytes(folder / "p.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 9\n");
  EXPECT_THAT(refusal(folder / "p.off"), HasSubstr("triangle 1 uses vertex 9"));
}

TEST(MeshIo, RefusesIndicesOutOfRange) {
  const TempFolder folder;
  write_bytes(folder / "i.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 7\n");
  write_bytes(folder / "i.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n");
  write_bytes(folder / "z.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 0 1 2\n");
  for (const std::string name : {"i.off", "i.obj", "z.obj"}) refusal(folder / name);
  SurfaceMesh mesh = grid_mesh(2, 2);
  mesh.triangles(1, 1) = 4;
  write_ply(mesh, folder / "i.ply");
  EXPECT_THAT(refusal(folder / "i.ply"),
              HasSubstr("triangle 1 uses vertex 4: there are only 0 ... 3"));
}

TEST(MeshIo, RefusesCoordinatesThatAreNotFinite) {
  const TempFolder folder;
  SurfaceMesh mesh = grid_mesh(2, 2);
  mesh.vertices(1, 2) = std::numeric_limits<double>::quiet_NaN();
  write_ply(mesh, folder / "n.ply");
  EXPECT_THAT(refusal(folder / "n.ply"), HasSubstr("vertex 2 is at (0, nan, 5)"));
  write_bytes(folder / "n.obj", "v 0 0 nan\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
  refusal(folder / "n.obj");
}

TEST(MeshIo, RefusesAMeshWithoutTriangles) {
  const TempFolder folder;
  write_bytes(folder / "e.obj", "v 0 0 0\nv 1 0 0\n");
  write_ply(SurfaceMesh{}, folder / "e.ply");
  for (const std::string name : {"e.obj", "e.ply"}) {
    EXPECT_THAT(refusal(folder / name), HasSubstr("holds no triangles"));
  }
}

TEST(MeshIo, AHeaderThatAsksForTooMuchIsRefusedWithoutAllocating) {
  const TempFolder folder;
  write_bytes(folder / "h.ply",
              "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\n"
              "property float y\nproperty float z\nelement face 4000000000\n"
              "property list uchar int vertex_indices\nend_header\n0 0 0\n");
  refusal(folder / "h.ply");
}

TEST(MeshIo, APipeAndADeviceAreRefusedWithoutWaiting) {
  const TempFolder folder;
  ASSERT_EQ(::mkfifo((folder / "p.ply").c_str(), 0600), 0);
  refusal(folder / "p.ply");
  refusal("/dev/zero");
}

TEST(MeshIo, RefusesAnExtensionOfNoMesh) {
  const TempFolder folder;
  write_bytes(folder / "a.om", "OM");
  EXPECT_THAT(refusal(folder / "a.om"), HasSubstr(".ply, .obj, .stl and .off are read"));
}

TEST(MeshIo, AFullDiskNamesFileAndReasonAndLeavesNothing) {
  const TempFolder folder;
  const SurfaceMesh mesh = rough_grid(200, 100);
  const FullDisk full(10'000);
  EXPECT_THAT(message_of<RunError>([&] { write_ply(mesh, folder / "m.ply"); }),
              AllOf(StartsWith((folder / "m.ply").string() + ": "), HasSubstr("File too large")));
  EXPECT_EQ(folder.file_count(), 0U);
}

}  // namespace
}  // namespace lensforge::mesh_files_test

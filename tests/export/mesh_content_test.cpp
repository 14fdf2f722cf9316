// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <zip.h>

#include <filesystem>
#include <random>
#include <string>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "core/temp_folder.h"
#include "core/text/words.h"
#include "export/files/closed_solid.h"
#include "export/files/mesh_formats.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Inspect = MeshContent (*)(const fs::path&);

class MeshContentTest : public ::testing::Test {
 protected:
  MeshContentTest() : solid_(closed_solid(surface_, "lens")) {}

  [[nodiscard]] fs::path glb() const {
    ClosedMesh part;
    part.solid = solid_;
    part.normals = vertex_area_normals(surface_);
    part.surface_triangles = surface_.triangle_count();
    write_glb(part, "my lens", folder_ / "a.glb");
    return folder_ / "a.glb";
  }
  [[nodiscard]] fs::path threemf() const {
    write_3mf(solid_, "my <lens>", folder_ / "a.3mf");
    return folder_ / "a.3mf";
  }

  void expect_of_solid(const MeshContent& content) const {
    EXPECT_EQ(content.meshes, 1);
    EXPECT_EQ(content.triangles, solid_.triangle_count());
    EXPECT_FALSE(content.moved);
    const Eigen::Vector3d low = solid_.vertices.rowwise().minCoeff();
    const Eigen::Vector3d high = solid_.vertices.rowwise().maxCoeff();
    EXPECT_LT((content.box.min() - low).norm(), 1e-5 * high.norm());
    EXPECT_LT((content.box.max() - high).norm(), 1e-5 * high.norm());
  }

  /// A package with this text as its model.
  [[nodiscard]] fs::path package(const std::string& model) const {
    fs::path path = folder_ / "b.3mf";
    int error = 0;
    zip_t* zip = zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error);
    zip_file_add(zip, "other/part.model", zip_source_buffer(zip, model.data(), model.size(), 0), 0);
    EXPECT_EQ(zip_close(zip), 0);
    return path;
  }

  /// A GLB file with this text as its description.
  [[nodiscard]] fs::path scene(std::string json) const {
    json.append((4 - json.size() % 4) % 4, ' ');
    const auto number = [](std::size_t value) {
      const auto whole = static_cast<std::uint32_t>(value);
      return std::string(reinterpret_cast<const char*>(&whole), sizeof whole);
    };
    write_bytes(folder_ / "b.glb", "glTF" + number(2) + number(20 + json.size()) +
                                       number(json.size()) + "JSON" + json);
    return folder_ / "b.glb";
  }

  /// Every cut and every changed byte is a mesh or one printable line.
  void expect_mutants_are_harmless(const fs::path& good, Inspect inspect) const {
    const std::string bytes = read_bytes(good);
    std::mt19937_64 random(5);
    for (int run = 0; run < 600; ++run) {
      std::string mutant = bytes;
      if (run % 3 == 0) mutant.resize(random() % mutant.size());
      for (int change = 0; change < run % 3 && !mutant.empty(); ++change) {
        mutant[random() % std::min<std::size_t>(mutant.size(), 1500)] =
            static_cast<char>(random() & 0xFFU);
      }
      write_bytes(folder_ / "m", mutant);
      try {
        inspect(folder_ / "m");
      } catch (const InputError& error) {
        EXPECT_EQ(printable_line(error.what()), error.what());
      }
    }
  }

  TempFolder folder_;
  SurfaceMesh surface_ = smooth_lens(11);
  SurfaceMesh solid_;
};

std::string refusal(Inspect inspect, const fs::path& path) {
  return message_of<InputError>([&] { inspect(path); });
}

TEST_F(MeshContentTest, KnowsWhatWasExported) {
  const MeshContent scene = inspect_glb(glb());
  EXPECT_EQ(scene.format, "glTF 2.0");
  EXPECT_EQ(scene.title, "my lens");
  expect_of_solid(scene);
  const MeshContent package = inspect_3mf(threemf());
  EXPECT_EQ(package.format, "3MF");
  EXPECT_EQ(package.title, "my <lens>");
  EXPECT_EQ(package.vertices, solid_.vertex_count());
  expect_of_solid(package);
}

TEST_F(MeshContentTest, UnitsOfPackagesBecomeMillimetres) {
  const MeshContent content = inspect_3mf(package(
      "<model unit='inch' xmlns:p='x'><resources><object><mesh><vertices><vertex x='0' y='-1' "
      "z='0'/><vertex x='1' y='0' z='2'/></vertices><triangles><triangle/></triangles></mesh>"
      "</object></resources><build><item transform='1 0 0 0 1 0 0 0 1 5 5 5'/></build></model>"));
  EXPECT_EQ(content.box.max(), Eigen::Vector3d(25.4, 0.0, 50.8));
  EXPECT_TRUE(content.moved);
}

TEST_F(MeshContentTest, PackagesThatAreNoneAreRefused) {
  write_bytes(folder_ / "t.3mf", "letter");
  EXPECT_THAT(refusal(inspect_3mf, folder_ / "t.3mf"), HasSubstr("no zip archive"));
  EXPECT_THAT(refusal(inspect_3mf, folder_ / "none.3mf"), HasSubstr("No such file"));
  ASSERT_EQ(::mkfifo((folder_ / "p.3mf").c_str(), 0600), 0);
  refusal(inspect_3mf, folder_ / "p.3mf");
  EXPECT_THAT(refusal(inspect_3mf, package("<model>")), HasSubstr("cannot be read to its end"));
  EXPECT_THAT(refusal(inspect_3mf, package("<model/>")), HasSubstr("holds no triangles"));
  EXPECT_THAT(refusal(inspect_3mf, package("<model unit='ell'/>")), HasSubstr("unit 'ell'"));
  EXPECT_THAT(refusal(inspect_3mf, package("<model><vertex x='nan' y='0' z='0'/></model>")),
              HasSubstr("x of a vertex is 'nan'"));
}

TEST_F(MeshContentTest, ScenesThatAreNoneAreRefused) {
  write_bytes(folder_ / "t.glb", "letter");
  EXPECT_THAT(refusal(inspect_glb, folder_ / "t.glb"), HasSubstr("its header is another"));
  EXPECT_THAT(refusal(inspect_glb, folder_ / "none.glb"), HasSubstr("No such file"));
  EXPECT_THAT(refusal(inspect_glb, scene("{}")), HasSubstr("field 'asset' is missing"));
  EXPECT_THAT(refusal(inspect_glb, scene("{\"asset\":{\"version\":\"1.0\"}}")),
              HasSubstr("version '1.0'"));
  const std::string head = "{\"asset\":{\"version\":\"2.0\"},";
  EXPECT_THAT(refusal(inspect_glb, scene(head + "\"nodes\":[]}")), HasSubstr("no triangles"));
  EXPECT_THAT(refusal(inspect_glb, scene(head + "\"meshes\":[{\"primitives\":[{\"attributes\":{"
                                                "\"POSITION\":3}}]}]}")),
              HasSubstr("there is no such accessor"));
}

TEST_F(MeshContentTest, TrianglesOfStripsAndOfVerticesInTurnAreCounted) {
  const std::string head =
      "{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"scale\":[2,2,2]}],\"accessors\":[{\"count\":"
      "9,"
      "\"min\":[0,0,0],\"max\":[1,2,3]}],\"meshes\":[{\"primitives\":[{\"attributes\":{"
      "\"POSITION\":0}},{\"mode\":5,\"attributes\":{\"POSITION\":0}},{\"mode\":1,\"attributes\":{"
      "\"POSITION\":0}}]}]}";
  const MeshContent content = inspect_glb(scene(head));
  EXPECT_EQ(content.triangles, 3 + 7);
  EXPECT_EQ(content.vertices, 9);
  EXPECT_EQ(content.box.max(), Eigen::Vector3d(1000, 2000, 3000));
  EXPECT_TRUE(content.moved);
}

TEST_F(MeshContentTest, MutantsAreHarmless) {
  expect_mutants_are_harmless(glb(), inspect_glb);
  expect_mutants_are_harmless(threemf(), inspect_3mf);
}

}  // namespace
}  // namespace lensforge::testing

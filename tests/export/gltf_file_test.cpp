// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <array>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/mesh/surface_mesh.h"
#include "core/temp_folder.h"
#include "export/files/closed_solid.h"
#include "export/files/mesh_formats.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

/// A GLB file taken apart by its specification.
struct Glb {
  nlohmann::json json;
  std::string binary;

  static std::uint32_t number(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  }

  explicit Glb(const std::string& bytes) {
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(number(bytes, 4), 2U);
    EXPECT_EQ(number(bytes, 8), bytes.size());
    const std::size_t length = number(bytes, 12);
    EXPECT_EQ(length % 4, 0U);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    json = nlohmann::json::parse(bytes.substr(20, length));
    EXPECT_EQ(number(bytes, 20 + length), bytes.size() - length - 28);
    EXPECT_EQ(bytes.substr(24 + length, 4), std::string("BIN\0", 4));
    binary = bytes.substr(28 + length);
  }

  /// The numbers of an accessor, one column an item.
  template <class Scalar, int kRows>
  [[nodiscard]] Eigen::Matrix<Scalar, kRows, Eigen::Dynamic> values(std::size_t accessor) const {
    const nlohmann::json& about = json["accessors"][accessor];
    const nlohmann::json& view = json["bufferViews"][about["bufferView"].get<std::size_t>()];
    Eigen::Matrix<Scalar, kRows, Eigen::Dynamic> all(kRows, about["count"].get<Eigen::Index>());
    const std::size_t bytes = sizeof(Scalar) * static_cast<std::size_t>(all.size());
    EXPECT_EQ(view["byteLength"], bytes);
    EXPECT_LE(view["byteOffset"].get<std::size_t>() + bytes, binary.size());
    std::memcpy(all.data(), binary.data() + view["byteOffset"].get<std::size_t>(), bytes);
    return all;
  }
  [[nodiscard]] auto positions() const { return values<float, 3>(0); }
  [[nodiscard]] auto normals() const { return values<float, 3>(1); }
  [[nodiscard]] auto triangles() const {
    const auto flat = values<std::uint32_t, 1>(2);
    return Eigen::MatrixXi(flat.cast<int>().reshaped(3, flat.size() / 3));
  }
};

class GltfFile : public ::testing::Test {
 protected:
  GltfFile() {
    part_.solid = closed_solid(surface_, "lens");
    part_.normals = vertex_area_normals(surface_);
    part_.surface_triangles = surface_.triangle_count();
    part_.ior = 1.52;
  }

  [[nodiscard]] Glb written() const {
    write_glb(part_, "lens", folder_ / "lens.glb");
    return Glb(read_bytes(folder_ / "lens.glb"));
  }

  TempFolder folder_;
  SurfaceMesh surface_ = noisy_lens();
  ClosedMesh part_;
};

TEST_F(GltfFile, HoldsTheSolidInMetres) {
  const Glb glb = written();
  SurfaceMesh back;
  back.vertices = 1e3 * glb.positions().cast<double>();
  back.triangles = glb.triangles();
  EXPECT_EQ(back.triangle_count(), part_.solid.triangle_count());
  for (std::int64_t t = 0; t < back.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_LT((back.corner(t, k) - part_.solid.corner(t, k)).norm(), 1e-5);
    }
  }
  EXPECT_NEAR(enclosed_volume(back), enclosed_volume(part_.solid), 1e-2);
}

TEST_F(GltfFile, IsClosed) {
  const Glb glb = written();
  const auto places = glb.positions();
  const auto corner = [&](int v) { return std::array{places(0, v), places(1, v), places(2, v)}; };
  std::map<std::pair<std::array<float, 3>, std::array<float, 3>>, int> edges;
  const Eigen::MatrixXi triangles = glb.triangles();
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto a = corner(triangles(k, t));
      const auto b = corner(triangles((k + 1) % 3, t));
      ++edges[{a, b}];
      --edges[{b, a}];
    }
  }
  for (const auto& [edge, count] : edges) ASSERT_EQ(count, 0);
}

TEST_F(GltfFile, TheSurfaceHasItsOwnNormalsAndTheWallsTheirs) {
  const Glb glb = written();
  const auto normals = glb.normals();
  const Eigen::MatrixXi triangles = glb.triangles();
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d wanted =
          t < part_.surface_triangles ? part_.normals.col(part_.solid.triangles(k, t)).normalized()
                                      : area_normal(part_.solid, t).normalized();
      ASSERT_LT((normals.col(triangles(k, t)).cast<double>() - wanted).norm(), 1e-6);
    }
  }
}

TEST_F(GltfFile, StatesTheBoxOfItsPositions) {
  const Glb glb = written();
  const Eigen::Vector3f least = glb.positions().rowwise().minCoeff();
  const Eigen::Vector3f largest = glb.positions().rowwise().maxCoeff();
  const nlohmann::json& about = glb.json["accessors"][0];
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(about["min"][k].get<float>(), least[static_cast<Eigen::Index>(k)]);
    EXPECT_EQ(about["max"][k].get<float>(), largest[static_cast<Eigen::Index>(k)]);
  }
}

TEST_F(GltfFile, ALensIsClearAndAMirrorMetal) {
  const Glb lens = written();
  const nlohmann::json clear = lens.json["materials"][0];
  EXPECT_EQ(clear["extensions"]["KHR_materials_ior"]["ior"], 1.52);
  EXPECT_EQ(clear["extensions"]["KHR_materials_transmission"]["transmissionFactor"], 1.0);
  EXPECT_NEAR(clear["extensions"]["KHR_materials_volume"]["thicknessFactor"],
              1e-3 * surface_.vertices.row(2).maxCoeff(), 1e-12);
  EXPECT_EQ(lens.json["extensionsUsed"].size(), 3U);
  part_.mirror = true;
  const Glb mirror = written();
  EXPECT_EQ(mirror.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"], 1.0);
  EXPECT_FALSE(mirror.json.contains("extensionsUsed"));
}

TEST_F(GltfFile, ACurvedBackIsShadedSmoothly) {
  const SphericalFront front{.radius = 60.0, .apex = {15.0, 12.0, -5.0}};
  part_.solid = closed_solid(surface_, "lens", front);
  part_.curved_back = surface_.triangle_count();
  const Glb glb = written();
  const auto places = glb.positions();
  const auto normals = glb.normals();
  const Eigen::Vector3d centre(15.0, 12.0, front.apex.z() + front.radius);
  const Eigen::MatrixXi triangles = glb.triangles().rightCols(part_.curved_back);
  for (Eigen::Index t = 0; t < triangles.cols(); ++t) {
    const int v = triangles(0, t);
    const Eigen::Vector3d out = (1e3 * places.col(v).cast<double>() - centre).normalized();
    ASSERT_GT(normals.col(v).cast<double>().dot(out), 0.99);
  }
}

TEST_F(GltfFile, TheSameSolidGivesTheSameBytesWithTheProgramsMark) {
  write_glb(part_, "lens", folder_ / "a.glb");
  write_glb(part_, "lens", folder_ / "b.glb");
  EXPECT_TRUE(read_bytes(folder_ / "a.glb") == read_bytes(folder_ / "b.glb"));
  EXPECT_TRUE(written_by_lensforge(folder_ / "a.glb"));
}

TEST_F(GltfFile, ATargetThatCannotBeWrittenIsNamed) {
  const auto target = folder_ / "missing" / "lens.glb";
  EXPECT_THAT(message_of<RunError>([&] { write_glb(part_, "lens", target); }),
              ::testing::HasSubstr(target.string()));
}

}  // namespace
}  // namespace lensforge::testing

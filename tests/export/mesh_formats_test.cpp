// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/files/mesh_formats.h"

#include <gmock/gmock.h>
#include <zip.h>

#include <sstream>

#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/mesh/mesh_files.h"
#include "core/temp_folder.h"
#include "export/files/closed_solid.h"
#include "export/sample_surfaces.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

std::string zip_member(const std::filesystem::path& path, const char* name) {
  zip_t* zip = zip_open(path.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, nullptr);
  if (zip == nullptr) return {};
  zip_stat_t about;
  std::string content;
  if (zip_stat(zip, name, 0, &about) == 0) {
    content.resize(about.size);
    zip_file_t* file = zip_fopen(zip, name, 0);
    EXPECT_EQ(zip_fread(file, content.data(), about.size), static_cast<zip_int64_t>(about.size));
    zip_fclose(file);
  }
  zip_discard(zip);
  return content;
}

/// The numbers between quotes in every element that starts with `element`.
std::vector<double> attributes(const std::string& xml, const std::string& element) {
  std::vector<double> numbers;
  for (std::size_t at = xml.find(element); at != std::string::npos; at = xml.find(element, at)) {
    for (int k = 0; k < 3; ++k) {
      at = xml.find("=\"", at) + 2;
      numbers.push_back(std::stod(xml.substr(at, 32)));
    }
  }
  return numbers;
}

class MeshFormats : public ::testing::Test {
 protected:
  TempFolder folder_;
  SurfaceMesh solid_ = closed_solid(noisy_lens(), "lens");
};

TEST_F(MeshFormats, StlReadsBackAsTheSameSolid) {
  write_stl(solid_, "lensforge", folder_ / "lens.stl");
  EXPECT_EQ(std::filesystem::file_size(folder_ / "lens.stl"),
            84U + 50U * static_cast<unsigned>(solid_.triangle_count()));
  const SurfaceMesh back = read_mesh(folder_ / "lens.stl");
  EXPECT_EQ(back.triangle_count(), solid_.triangle_count());
  EXPECT_EQ(back.vertex_count(), solid_.vertex_count());
  EXPECT_NEAR(enclosed_volume(back), enclosed_volume(solid_), 1e-6 * enclosed_volume(solid_));
}

TEST_F(MeshFormats, StlHeaderNeverLooksLikeTextStl) {
  write_stl(solid_, "solid lens", folder_ / "lens.stl");
  EXPECT_FALSE(read_bytes(folder_ / "lens.stl").starts_with("solid"));
}

TEST_F(MeshFormats, ObjHoldsTheSameDoubles) {
  write_obj(solid_, "lensforge", folder_ / "lens.obj");
  std::istringstream text(read_bytes(folder_ / "lens.obj"));
  Eigen::Index vertices = 0;
  Eigen::Index faces = 0;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      std::string x, y, z;
      words >> x >> y >> z;
      const Eigen::Vector3d p(std::stod(x), std::stod(y), std::stod(z));
      ASSERT_EQ(p, solid_.vertices.col(vertices++));
    } else if (kind == "f") {
      Eigen::Vector3i f;
      words >> f[0] >> f[1] >> f[2];
      ASSERT_EQ(f, (solid_.triangles.col(faces++).array() + 1).matrix());
    }
  }
  EXPECT_EQ(vertices, solid_.vertex_count());
  EXPECT_EQ(faces, solid_.triangle_count());
}

TEST_F(MeshFormats, ThreeMfHoldsTheSolidInMillimetres) {
  write_3mf(solid_, "a <lens> & more", folder_ / "lens.3mf");
  const std::string model = zip_member(folder_ / "lens.3mf", "3D/3dmodel.model");
  EXPECT_THAT(model, HasSubstr("unit=\"millimeter\""));
  EXPECT_THAT(model, HasSubstr("a &lt;lens&gt; &amp; more"));
  const std::vector<double> points = attributes(model, "<vertex ");
  const std::vector<double> corners = attributes(model, "<triangle ");
  ASSERT_EQ(points.size(), static_cast<std::size_t>(solid_.vertices.size()));
  ASSERT_EQ(corners.size(), static_cast<std::size_t>(solid_.triangles.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(points[i], solid_.vertices.data()[i], 1e-9);
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    EXPECT_EQ(corners[i], solid_.triangles.data()[i]);
  }
  EXPECT_THAT(zip_member(folder_ / "lens.3mf", "_rels/.rels"), HasSubstr("/3D/3dmodel.model"));
  EXPECT_THAT(zip_member(folder_ / "lens.3mf", "[Content_Types].xml"), HasSubstr("\"model\""));
}

TEST_F(MeshFormats, TheSameSolidGivesTheSameBytes) {
  write_3mf(solid_, "lens", folder_ / "a.3mf");
  write_3mf(solid_, "lens", folder_ / "b.3mf");
  EXPECT_TRUE(read_bytes(folder_ / "a.3mf") == read_bytes(folder_ / "b.3mf"));
}

TEST_F(MeshFormats, EveryFormatSaysThatLensforgeWroteIt) {
  for (const auto& write : {write_stl, write_obj, write_3mf}) {
    write(solid_, "lensforge 1.2.3 lens", folder_ / "lens.x");
    EXPECT_TRUE(written_by_lensforge(folder_ / "lens.x"));
  }
}

TEST_F(MeshFormats, TargetThatCannotBeWrittenIsNamed) {
  const auto target = folder_ / "missing" / "lens.x";
  for (const auto& write : {write_stl, write_obj, write_3mf}) {
    EXPECT_THAT(message_of<RunError>([&] { write(solid_, "lens", target); }),
                HasSubstr(target.string()));
  }
  EXPECT_EQ(folder_.file_count(), 0U);
}

}  // namespace
}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <array>
#include <cstdio>

#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/lens/smooth_surface.h"
#include "core/temp_folder.h"
#include "export/files/closed_solid.h"
#include "export/part21.h"
#include "export/sample_surfaces.h"
#include "export/solid/solid_files.h"
#include "export/spline/spline_fit.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

class StepFile : public ::testing::Test {
 protected:
  SplineNet fitted(const SurfaceMesh& mesh, std::int64_t points = 4000) {
    FitOptions options;
    options.max_control_points = points;
    return fit_spline_net(SmoothSurface(mesh), options, Executor::serial(), RunControl());
  }

  SolidContent write(const SplineNet& net, StepSchema schema = StepSchema::kAp214) {
    return write_step(net, {"part 7", "sha256:0123", "N. N.", "lensforge 9", "2020-02-02T02:02:02"},
                      schema, path_);
  }

  TempFolder folder_;
  std::filesystem::path path_ = folder_ / "lens.step";
};

/// Below the smooth surface: cubics over the thirds of triangles, for which Stroud's rule of four
/// points is exact.
double volume_below(const SmoothSurface& surface) {
  const Eigen::Vector3d middle = Eigen::Vector3d::Constant(1.0 / 3.0);
  double volume = 0.0;
  for (Eigen::Index t = 0; t < surface.mesh().triangle_count(); ++t) {
    const Eigen::Vector3d a = surface.mesh().corner(t, 1) - surface.mesh().corner(t, 0);
    const Eigen::Vector3d b = surface.mesh().corner(t, 2) - surface.mesh().corner(t, 0);
    double mean = 0.0;
    for (int k = 0; k < 3; ++k) {
      const std::array<Eigen::Vector3d, 3> corner{Eigen::Vector3d::Unit(k),
                                                  Eigen::Vector3d::Unit((k + 1) % 3), middle};
      const Eigen::Vector3d center = (corner[0] + corner[1] + corner[2]) / 3.0;
      mean -= 27.0 / 48.0 / 3.0 * surface.in_triangle(t, center).z;
      for (const Eigen::Vector3d& c : corner) {
        mean += 25.0 / 48.0 / 3.0 * surface.in_triangle(t, 0.4 * c + 0.6 * center).z;
      }
    }
    volume += 0.5 * a.cross(b).z() * mean;
  }
  return volume;
}

/// Facets have another volume than the smooth surface through them; the solid has the latter's.
TEST_F(StepFile, HasTheVolumeBelowTheSmoothSurface) {
  for (const SurfaceMesh& mesh : {smooth_lens(71), creased_lens(), noisy_lens(), crowded_lens()}) {
    const double volume = volume_below(SmoothSurface(mesh));
    EXPECT_NEAR(write(fitted(mesh)).volume, volume, 1e-6 * volume);
  }
}

TEST_F(StepFile, ReadsBackAsOneClosedSolidOfTheSameVolume) {
  for (const SurfaceMesh& mesh : {smooth_lens(71), creased_lens(), noisy_lens()}) {
    const SplineNet net = fitted(mesh);
    const SolidContent content = write(net);
    EXPECT_TRUE(content.valid);
    EXPECT_TRUE(content.closed);
    EXPECT_EQ(content.solids, 1);
    EXPECT_EQ(content.faces, static_cast<int>(net.patches.size()) + 5);
    EXPECT_NEAR(content.volume, net.volume(), 1e-6 * net.volume());
    const double facets = enclosed_volume(closed_solid(mesh, "mesh"));
    EXPECT_NEAR(content.volume, facets, 2e-4 * facets);
  }
}

/// Without OpenCASCADE: the file's own numbers give the net's surface.
TEST_F(StepFile, SplinesEvaluatedByAnIndependentReaderAreTheSurface) {
  const SurfaceMesh mesh = noisy_lens();
  const SmoothSurface surface(mesh);
  const SplineNet net = fitted(mesh, 3000);
  write(net);
  const Part21File file = parse_part21(read_bytes(path_));
  int optical = 0;
  for (const int face : file.all("ADVANCED_FACE")) {
    if (!file.records.at(face).parameters.starts_with("('optical surface'")) continue;
    ++optical;
    const Part21Surface s = surface_of_face(file, face);
    for (int i = 0; i <= 12; ++i) {
      for (int j = 0; j <= 12; ++j) {
        const double u = std::lerp(s.knots_u.front(), s.knots_u.back(), i / 12.0);
        const double v = std::lerp(s.knots_v.front(), s.knots_v.back(), j / 12.0);
        const Eigen::Vector3d p = s.at(u, v);
        const SplinePoint fitted_point = net.at({u, v});
        EXPECT_LT((p.head<2>() - fitted_point.xy).norm(), 1e-9);
        EXPECT_NEAR(p.z(), fitted_point.surface.z, 1e-9);
        const auto truth = surface.at(nearest_inside(surface.box(), p.head<2>()));
        ASSERT_TRUE(truth);
        EXPECT_NEAR(p.z(), truth->z, net.error().height + 1e-7);
      }
    }
  }
  EXPECT_EQ(optical, static_cast<int>(net.patches.size()));
}

TEST_F(StepFile, FacesAreNamedAndEveryEdgeHasTwoFaces) {
  write(fitted(smooth_lens(71)));
  const Part21File file = parse_part21(read_bytes(path_));
  std::map<std::string, int> names;
  for (const int face : file.all("ADVANCED_FACE")) {
    ++names[split_parameters(file.records.at(face).parameters).front()];
  }
  EXPECT_EQ(names.size(), 3U);
  EXPECT_EQ(names["'side wall'"], 4);
  EXPECT_EQ(names["'back'"], 1);
  std::map<std::string, std::string> senses;
  for (const int oriented : file.all("ORIENTED_EDGE")) {
    const auto parts = split_parameters(file.records.at(oriented).parameters);
    senses[parts.at(3)] += parts.at(4);
  }
  EXPECT_EQ(senses.size(), file.all("EDGE_CURVE").size());
  for (const auto& [edge, sense] : senses) {
    EXPECT_TRUE(sense == ".T..F." || sense == ".F..T.") << edge << ' ' << sense;
  }
}

TEST_F(StepFile, HeaderNamesAuthorProgramAndSource) {
  write(fitted(smooth_lens()));
  const std::string header = parse_part21(read_bytes(path_)).header;
  for (const char* part : {"'part 7'", "'sha256:0123'", "'N. N.'", "'lensforge 9'",
                           "'2020-02-02T02:02:02'", "AUTOMOTIVE_DESIGN"}) {
    EXPECT_THAT(header, HasSubstr(part));
  }
}

TEST_F(StepFile, LengthsAreMillimetres) {
  write(fitted(smooth_lens()));
  EXPECT_THAT(read_bytes(path_), HasSubstr("SI_UNIT(.MILLI.,.METRE.)"));
}

TEST_F(StepFile, Ap242IsAnOption) {
  EXPECT_TRUE(write(fitted(smooth_lens()), StepSchema::kAp242).is_one_solid());
  EXPECT_THAT(parse_part21(read_bytes(path_)).header, HasSubstr("AP242"));
}

/// Output of a shell command.
std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen(command.c_str(), "r");
  std::array<char, 256> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) text += part.data();
  ::pclose(pipe);
  return text;
}

/// The volume that another program prints after "solids 1 volume "; it runs in `folder`.
double volume_by(const std::string& command, const std::filesystem::path& folder) {
  const std::string said = output_of("cd '" + folder.string() + "' && " + command);
  const std::string start = "solids 1 volume ";
  EXPECT_THAT(said, HasSubstr(start));
  const std::size_t at = said.find(start);
  return at == std::string::npos ? 0.0 : std::stod(said.substr(at + start.size()));
}

/// Both integrate with a few points a face: to 1e-6 where x and y are even in the parameters, to
/// 1e-4 where knots follow moved vertices (ReadsBackAsOneClosedSolidOfTheSameVolume is exact
/// there).
TEST_F(StepFile, GmshReadsOneSolidOfTheSameVolume) {
  if (output_of("command -v gmsh").empty()) GTEST_SKIP() << "gmsh is not installed";
  const SplineNet net = fitted(smooth_lens());
  write(net);
  write_bytes(folder_ / "volume.geo", R"(SetFactory("OpenCASCADE");
v() = ShapeFromFile("lens.step");
m = Mass Volume {v(0)};
Printf("solids %g volume %.12g", #v(), m);
)");
  const double volume = volume_by("gmsh -v 3 volume.geo -parse_and_exit", folder_.path());
  EXPECT_NEAR(volume, net.volume(), 1e-6 * net.volume());
}

TEST_F(StepFile, FreeCadReadsOneSolidOfTheSameVolume) {
  if (output_of("command -v freecadcmd").empty()) GTEST_SKIP() << "freecadcmd is not installed";
  const SplineNet net = fitted(smooth_lens());
  write(net);
  write_bytes(folder_ / "volume.py", R"(import Part
s = Part.Shape()
s.read("lens.step")
if s.isValid():
    print("solids %d volume %.12g" % (len(s.Solids), s.Volume))
)");
  const double volume = volume_by("freecadcmd volume.py </dev/null 2>&1", folder_.path());
  EXPECT_NEAR(volume, net.volume(), 1e-6 * net.volume());
}

TEST_F(StepFile, TargetThatCannotBeWrittenIsNamed) {
  path_ = folder_ / "missing" / "lens.step";
  const SplineNet net = fitted(smooth_lens(), 500);
  EXPECT_THAT(message_of<RunError>([&] { write(net); }), HasSubstr(path_.string()));
  EXPECT_EQ(folder_.file_count(), 0U);
}

TEST_F(StepFile, WhatIsNoStepFileIsRefused) {
  EXPECT_THAT(message_of<InputError>([&] { inspect_step(folder_ / "none.step"); }),
              HasSubstr("none.step"));
  write_bytes(path_, "solid lens\nendsolid\n");
  EXPECT_THAT(message_of<InputError>([&] { inspect_step(path_); }), HasSubstr("lens.step"));
}

TEST_F(StepFile, InspectionTellsSizeAndEntities) {
  const SplineNet net = fitted(smooth_lens(31));
  write(net);
  const SolidContent content = inspect_step(path_);
  EXPECT_TRUE(content.is_one_solid());
  EXPECT_GT(content.entities, 100);
  EXPECT_NEAR(content.low[0], 0.0, 1e-5);
  EXPECT_NEAR(content.high[0], 30.0, 1e-5);
  EXPECT_NEAR(content.high[1], 24.0, 1e-5);
  EXPECT_NEAR(content.low[2], 0.0, 1e-5);
}

TEST_F(StepFile, StopRequestLeavesNothingWritten) {
  const SplineNet net = fitted(smooth_lens(31));
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  EXPECT_THROW(
      write_step(net, {"lens", "", "", "lensforge 9", ""}, StepSchema::kAp214, path_, control),
      Interrupted);
  EXPECT_EQ(folder_.file_count(), 0U);
}

TEST_F(StepFile, SaysThatLensforgeWroteIt) {
  write(fitted(smooth_lens(31)));
  EXPECT_TRUE(written_by_lensforge(path_));
}

}  // namespace
}  // namespace lensforge::testing

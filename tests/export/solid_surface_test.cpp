// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <BRepAlgoAPI_Common.hxx>
#include <BRepAlgoAPI_Cut.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRep_Builder.hxx>
#include <TopoDS_Compound.hxx>
#include <cstdlib>

#include "core/error.h"
#include "core/lens/smooth_surface.h"
#include "core/temp_folder.h"
#include "export/foreign_step.h"
#include "export/sample_surfaces.h"
#include "export/solid/opencascade_io.h"
#include "export/solid/solid_files.h"
#include "export/solid/solid_reading.h"
#include "export/spline/spline_fit.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

class SolidSurfaceOf : public ::testing::Test {
 protected:
  SolidSurface read(double points = 2000) {
    return read_solid_surface(path_, points, Executor::serial());
  }

  void write(const TopoDS_Shape& shape) { write_foreign_step(shape, path_); }

  void expect_refused(const char* why) {
    EXPECT_THAT(message_of<InputError>([&] { read(); }),
                ::testing::AllOf(HasSubstr("solid.step"), HasSubstr(why)));
  }

  TempFolder folder_;
  std::filesystem::path path_ = folder_ / "solid.step";
};

const gp_Ax2 kUpright(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1));

/// A plano-convex lens: what a cylinder of radius 12 cuts out of a sphere of radius 50.
TopoDS_Shape lens_of_a_sphere() {
  const TopoDS_Shape sphere = BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, -45), 50.0).Shape();
  const TopoDS_Shape cylinder = BRepPrimAPI_MakeCylinder(kUpright, 12.0, 20.0).Shape();
  return BRepAlgoAPI_Common(sphere, cylinder).Shape();
}

TEST_F(SolidSurfaceOf, SphereIsRoundAndHasItsHeights) {
  write(lens_of_a_sphere());
  const SolidSurface surface = read();
  EXPECT_EQ(surface.faces, 1);
  EXPECT_FALSE(surface.by_name);
  EXPECT_GT(surface.samples.mesh.vertex_count(), 1400);  // π/4 of the raster.
  EXPECT_LT(surface.samples.mesh.vertex_count(), 1700);
  for (Eigen::Index v = 0; v < surface.samples.mesh.vertex_count(); ++v) {
    const Eigen::Vector3d p = surface.samples.mesh.vertices.col(v);
    EXPECT_NEAR(p.z(), std::sqrt(2500.0 - p.head<2>().squaredNorm()) - 45.0, 1e-6);
    const Eigen::Vector3d outwards = (p + Eigen::Vector3d(0.0, 0.0, 45.0)) / 50.0;
    EXPECT_LT((surface.samples.normals.col(v).normalized() - outwards).norm(), 1e-6);
  }
}

TEST_F(SolidSurfaceOf, InchesBecomeMillimetres) {
  write_foreign_step_in_inches(lens_of_a_sphere(), path_);
  EXPECT_NEAR(read().samples.mesh.vertices.row(0).maxCoeff(), 12.0, 0.8);
}

SplineNet written_net(const std::filesystem::path& path) {
  FitOptions options;
  options.max_control_points = 3000;
  SplineNet net =
      fit_spline_net(SmoothSurface(smooth_lens(71)), options, Executor::serial(), RunControl());
  write_step(net, {"lens", "", "", "lensforge", "2020-02-02T02:02:02"}, StepSchema::kAp214, path);
  return net;
}

void expect_surface_is(const SplineNet& net, const SolidSurface& surface) {
  EXPECT_EQ(surface.faces, static_cast<int>(net.patches.size()));
  for (Eigen::Index v = 0; v < surface.samples.mesh.vertex_count(); ++v) {
    const Eigen::Vector3d p = surface.samples.mesh.vertices.col(v);
    const auto uv = net.parameters_of(p.head<2>(), p.head<2>());
    ASSERT_TRUE(uv);
    const SurfacePoint point = net.at(*uv).surface;
    EXPECT_NEAR(p.z(), point.z, 2e-7);
    const Eigen::Vector3d normal(-point.slope.x(), -point.slope.y(), 1.0);
    EXPECT_LT((surface.samples.normals.col(v).normalized() - normal.normalized()).norm(), 1e-6);
  }
}

TEST_F(SolidSurfaceOf, OurOwnFileIsFoundByNameAndIsTheNet) {
  const SplineNet net = written_net(path_);
  const SolidSurface surface = read(5000);
  EXPECT_TRUE(surface.by_name);
  expect_surface_is(net, surface);
}

/// Another program's file: FreeCAD reads ours and writes it anew.
TEST_F(SolidSurfaceOf, WhatFreeCadWritesAnewIsStillTheNet) {
  if (std::system("command -v freecadcmd > /dev/null") != 0) {
    GTEST_SKIP() << "freecadcmd is not installed";
  }
  const SplineNet net = written_net(folder_ / "lens.step");
  write_bytes(folder_ / "anew.py", R"(import Part
s = Part.Shape()
s.read("lens.step")
s.exportStep("solid.step")
)");
  const std::string command =
      "cd '" + folder_.path().string() + "' && freecadcmd anew.py < /dev/null > freecad.log 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_THAT(read_bytes(path_), HasSubstr("FreeCAD"));
  expect_surface_is(net, read(5000));
}

TEST_F(SolidSurfaceOf, BoxShowsItsTop) {
  write(BRepPrimAPI_MakeBox(gp_Pnt(1, 2, 3), gp_Pnt(11, 12, 8)).Shape());
  const SolidSurface surface = read();
  EXPECT_EQ(surface.faces, 1);
  EXPECT_LT((surface.samples.mesh.vertices.row(2).array() - 8.0).abs().maxCoeff(), 1e-9);
}

TEST_F(SolidSurfaceOf, WhatIsNoLensIsRefusedInWords) {
  write_bytes(path_, "ISO-10303-21;\nnonsense");
  expect_refused("no");
  write(BRepPrimAPI_MakeBox(5.0, 5.0, 5.0).Shell());
  expect_refused("no solid");
  TopoDS_Compound two;
  BRep_Builder builder;
  builder.MakeCompound(two);
  builder.Add(two, BRepPrimAPI_MakeBox(5.0, 5.0, 5.0).Shape());
  builder.Add(two, BRepPrimAPI_MakeBox(gp_Pnt(9, 0, 0), gp_Pnt(12, 5, 5)).Shape());
  write(two);
  expect_refused("2 solids");
  write(BRepPrimAPI_MakeSphere(5.0).Shape());
  expect_refused("looks up");
  write(BRepPrimAPI_MakeBox(50000.0, 50000.0, 5.0).Shape());
  expect_refused("unit of length");
  const TopoDS_Shape slot = BRepPrimAPI_MakeBox(gp_Pnt(2, -1, 2), gp_Pnt(9, 9, 3)).Shape();
  write(BRepAlgoAPI_Cut(BRepPrimAPI_MakeBox(5.0, 5.0, 5.0).Shape(), slot).Shape());
  expect_refused("above one another");
}

}  // namespace
}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRep_Builder.hxx>
#include <TopoDS_Compound.hxx>
#include <algorithm>
#include <fstream>
#include <map>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/temp_folder.h"
#include "export/foreign_step.h"
#include "export/solid/solid_reading.h"

namespace lensforge::testing {
namespace {

using ::testing::HasSubstr;

class SolidMesh : public ::testing::Test {
 protected:
  SurfaceMesh read() { return read_solid_mesh(path_); }

  void write(const TopoDS_Shape& shape) { write_foreign_step(shape, path_); }

  TempFolder folder_;
  std::filesystem::path path_ = folder_ / "solid.step";
};

/// By the divergence theorem; only of a closed mesh that looks outwards it is what the solid has.
double volume_of(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (Eigen::Index t = 0; t < mesh.triangle_count(); ++t) {
    volume += mesh.corner(t, 0).dot(mesh.corner(t, 1).cross(mesh.corner(t, 2))) / 6.0;
  }
  return volume;
}

/// True if every edge is used once in each direction.
bool is_closed(const SurfaceMesh& mesh) {
  std::map<std::pair<int, int>, int> runs;
  for (Eigen::Index t = 0; t < mesh.triangle_count(); ++t) {
    for (int k = 0; k < 3; ++k) ++runs[{mesh.triangles(k, t), mesh.triangles((k + 1) % 3, t)}];
  }
  return std::all_of(runs.begin(), runs.end(), [&](const auto& run) {
    const auto back = runs.find({run.first.second, run.first.first});
    return run.second == 1 && back != runs.end() && back->second == 1;
  });
}

TEST_F(SolidMesh, BoxHasItsCornersOnceAndLooksOutwards) {
  write(BRepPrimAPI_MakeBox(gp_Pnt(1, 2, 3), gp_Pnt(4, 6, 8)).Shape());
  const SurfaceMesh mesh = read();
  EXPECT_EQ(mesh.vertex_count(), 8);
  EXPECT_EQ(mesh.triangle_count(), 12);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(volume_of(mesh), 60.0, 1e-9);
}

TEST_F(SolidMesh, SphereIsClosedAtItsSeamAndPoles) {
  write(BRepPrimAPI_MakeSphere(gp_Pnt(1, 2, 3), 5.0).Shape());
  const SurfaceMesh mesh = read();
  EXPECT_TRUE(is_closed(mesh));
  const Eigen::Vector3d centre(1, 2, 3);
  const double diagonal = 10.0 * std::numbers::sqrt3;
  for (Eigen::Index t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d middle =
        (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3.0;
    EXPECT_NEAR((mesh.corner(t, 0) - centre).norm(), 5.0, 1e-9);
    EXPECT_NEAR((middle - centre).norm(), 5.0, 2.0 * kSolidDeflection * diagonal);
  }
  EXPECT_NEAR(volume_of(mesh) / (500.0 * std::numbers::pi / 3.0), 1.0, 0.02);
}

TEST_F(SolidMesh, FacesWithHolesMeetAtTheirEdges) {
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(10, 10, 4)).Shape();
  const gp_Ax2 axis(gp_Pnt(5, 5, -1), gp_Dir(0, 0, 1));
  write(BRepAlgoAPI_Cut(box, BRepPrimAPI_MakeCylinder(axis, 3.0, 6.0).Shape()).Shape());
  const SurfaceMesh mesh = read();
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(volume_of(mesh), 400.0 - 36.0 * std::numbers::pi, 1.0);
}

TEST_F(SolidMesh, MovedAndMirroredSolidsStayWhereTheyAreAndLookOutwards) {
  gp_Trsf mirror;
  mirror.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)));
  const TopoDS_Shape box = BRepPrimAPI_MakeBox(gp_Pnt(1, 0, 0), gp_Pnt(2, 3, 4)).Shape();
  TopoDS_Compound both;
  BRep_Builder builder;
  builder.MakeCompound(both);
  builder.Add(both, box);
  builder.Add(both, BRepBuilderAPI_Transform(box, mirror).Shape());
  write(both);
  const SurfaceMesh mesh = read();
  EXPECT_EQ(mesh.vertex_count(), 16);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(volume_of(mesh), 24.0, 1e-9);
  EXPECT_NEAR(mesh.vertices.row(0).minCoeff(), -2.0, 1e-9);
}

TEST_F(SolidMesh, InchesBecomeMillimetres) {
  write_foreign_step_in_inches(
      BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), gp_Pnt(25.4, 25.4, 50.8)).Shape(), path_);
  EXPECT_NEAR(read().vertices.row(2).maxCoeff(), 50.8, 1e-6);
}

TEST_F(SolidMesh, RefusesWhatIsNoSolid) {
  const auto refusal = [&] { return message_of<InputError>([&] { read(); }); };
  EXPECT_THAT(refusal(), HasSubstr("solid.step"));
  std::ofstream(path_) << "no STEP file\n";
  EXPECT_THAT(refusal(), HasSubstr("solid.step"));
}

}  // namespace
}  // namespace lensforge::testing

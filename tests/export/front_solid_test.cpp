// SPDX-License-Identifier: GPL-3.0-or-later
// Solids of lenses whose front is a part of a sphere or a height map.
#include <gmock/gmock.h>

#include <cmath>
#include <string>

#include "core/lens/smooth_surface.h"
#include "core/optics/front.h"
#include "core/optics/height_fronts.h"
#include "core/temp_folder.h"
#include "export/files/closed_solid.h"
#include "export/part21.h"
#include "export/sample_surfaces.h"
#include "export/solid/solid_files.h"
#include "export/spline/spline_fit.h"
#include "export/spline/spline_net.h"

namespace lensforge::testing {
namespace {

const Eigen::Vector2d kSize(30.0, 24.0);

/// Convex and hollow, hardly larger than the lens, usual, and almost flat; the apex aside.
SphericalFront front_of(double radius) { return spherical_front(radius, kSize); }
SphericalFront aside(double radius) {
  SphericalFront front = front_of(radius);
  front.apex += Eigen::Vector3d(3.0, -2.0, 0.0);
  return front;
}
const SphericalFront kFronts[] = {front_of(20.0), front_of(-20.0), front_of(150.0),
                                  front_of(-1e5), aside(60.0),     aside(-60.0)};

/// By the rule of midpoints, which errs by a square of the cells' size.
double volume_by_midpoints(const Front& front, const Eigen::AlignedBox2d& box, int cells) {
  const FrontSurface surface(front);
  const Eigen::Vector2d cell = box.sizes() / cells;
  double sum = 0.0;
  for (int k = 0; k < cells * cells; ++k) {
    const int row = k / cells;
    const Eigen::Vector2d share(k % cells + 0.5, row + 0.5);
    sum += surface.height(box.min() + cell.cwiseProduct(share));
  }
  return sum * cell.prod();
}

TEST(FrontVolume, VolumeBelowAFrontIsItsIntegral) {
  const Eigen::AlignedBox2d box(Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(20.0, 17.0));
  for (const SphericalFront& front : kFronts) {
    const double coarse = volume_by_midpoints(front, box, 100);
    const double fine = volume_by_midpoints(front, box, 200);
    EXPECT_NEAR(volume_below(front, box), fine + (fine - coarse) / 3.0, 1e-5 * box.volume());
  }
}

class FrontSolid : public ::testing::Test {
 protected:
  static const SplineNet& flat_net() {
    static const SplineNet net = [] {
      FitOptions options;
      options.max_control_points = 500;
      return fit_spline_net(SmoothSurface(smooth_lens()), options, Executor::serial(),
                            RunControl());
    }();
    return net;
  }
  static SplineNet net_on(const Front& front) {
    SplineNet net = flat_net();
    net.front = front;
    return net;
  }
  [[nodiscard]] SolidContent step_on(const Front& front) const {
    return write_step(net_on(front), {"lens", "", "", "lensforge 9", ""}, StepSchema::kAp214,
                      folder_ / "lens.step");
  }

  TempFolder folder_;
};

/// The volume that OpenCASCADE finds is that of the mesh between both faces.
void expect_solid(const SolidContent& content, const SphericalFront& front, int patches) {
  EXPECT_TRUE(content.is_one_solid()) << front.radius;
  EXPECT_EQ(content.faces, patches + 5);
  const double facets = enclosed_volume(closed_solid(smooth_lens(121), "mesh", front));
  EXPECT_NEAR(content.volume, facets, 1e-4 * facets) << front.radius;
  const double deepest = front.radius > 0.0 ? front.apex.z() : content.low[2];
  EXPECT_NEAR(content.low[2], deepest, 1e-5) << front.radius;
}

TEST_F(FrontSolid, StepReadsBackAsOneClosedSolidOfTheSameVolume) {
  for (const SphericalFront& front : kFronts) {
    const SolidContent content = step_on(front);
    expect_solid(content, front, static_cast<int>(flat_net().patches.size()));
    EXPECT_NEAR(content.volume, net_on(front).volume(), 1e-6 * content.volume);
  }
}

TEST_F(FrontSolid, IgesReadsBackAsOneClosedSolidOfTheSameVolume) {
  for (const SphericalFront& front : kFronts) {
    const SolidContent content =
        write_iges(net_on(front), {"lens", "", "", "lensforge 9", ""}, folder_ / "lens.igs");
    expect_solid(content, front, static_cast<int>(flat_net().patches.size()));
    EXPECT_NEAR(content.volume, net_on(front).volume(), 1e-6 * content.volume);
  }
}

/// Waves, whose samples are no whole number of patches apart.
HeightFront wavy() {
  return height_front(kSize, {34, 21}, [](const Eigen::Vector2d& at) {
    return -0.6 + 0.5 * std::sin(0.5 * at.x() + 0.3) * std::cos(0.4 * at.y());
  });
}

TEST(FrontVolume, VolumeBelowAHeightMapIsItsIntegral) {
  const HeightFront front = wavy();
  for (const Eigen::AlignedBox2d& box :
       {Eigen::AlignedBox2d(Eigen::Vector2d(0.0, 0.0), kSize),
        Eigen::AlignedBox2d(Eigen::Vector2d(-2.0, 1.3), Eigen::Vector2d(20.1, 27.0))}) {
    const double coarse = volume_by_midpoints(front, box, 200);
    const double fine = volume_by_midpoints(front, box, 400);
    EXPECT_NEAR(volume_below(front, box), fine + (fine - coarse) / 3.0, 1e-6 * box.volume());
  }
}

TEST(FrontPatch, AHeightMapAsAPatchIsTheSameSurface) {
  const HeightFront front = wavy();
  const FrontSurface surface(front);
  const SplinePatch patch = patch_of(front);
  for (int k = 0; k <= 60 * 60; ++k) {
    const Eigen::Vector2d at =
        kSize.cwiseProduct(Eigen::Vector2d(k % 61, k / 61) / 60.0).cwiseMin(kSize);
    const SplinePoint point = patch.at(at);
    EXPECT_LT((point.xy - at).norm(), 1e-12);
    EXPECT_NEAR(point.surface.z, surface.height(at), 1e-12);
  }
}

/// Without OpenCASCADE, too: the back is a spline surface, turned to face down.
TEST_F(FrontSolid, AHeightMapIsTheBackOfAClosedSolid) {
  const HeightFront front = wavy();
  const double facets = enclosed_volume(closed_solid(smooth_lens(121), "mesh", front));
  const auto patches = static_cast<int>(flat_net().patches.size());
  const SolidContent step = step_on(front);
  const SolidContent iges =
      write_iges(net_on(front), {"lens", "", "", "lensforge 9", ""}, folder_ / "lens.igs");
  for (const SolidContent& content : {step, iges}) {
    EXPECT_TRUE(content.is_one_solid());
    EXPECT_EQ(content.faces, patches + 5);
    EXPECT_NEAR(content.volume, facets, 1e-4 * facets);
    EXPECT_NEAR(content.volume, net_on(front).volume(), 1e-6 * content.volume);
    EXPECT_NEAR(content.low[2], -1.1, 0.02);
  }
  const Part21File file = parse_part21(read_bytes(folder_ / "lens.step"));
  for (const int face : file.all("ADVANCED_FACE")) {
    const auto parts = split_parameters(file.records.at(face).parameters);
    if (parts.at(0) != "'back'") continue;
    EXPECT_EQ(parts.at(3), ".F.");
  }
}

/// Without OpenCASCADE: the face called "back" is a sphere of the radius, every corner of the back
/// lies on it, and every edge has a face on both sides.
TEST_F(FrontSolid, TheBackIsTheSphereItself) {
  for (const double radius : {150.0, -60.0}) {
    (void)step_on(front_of(radius));
    const Part21File file = parse_part21(read_bytes(folder_ / "lens.step"));
    const std::vector<int> spheres = file.all("SPHERICAL_SURFACE");
    ASSERT_EQ(spheres.size(), 1U);
    const auto sphere = split_parameters(file.records.at(spheres[0]).parameters);
    EXPECT_NEAR(std::stod(sphere.at(2)), std::abs(radius), 1e-9);
    int backs = 0;
    for (const int face : file.all("ADVANCED_FACE")) {
      const auto parts = split_parameters(file.records.at(face).parameters);
      if (parts.at(0) != "'back'") continue;
      ++backs;
      EXPECT_EQ(parts.at(2), "#" + std::to_string(spheres[0]));
      EXPECT_EQ(parts.at(3), radius > 0.0 ? ".T." : ".F.");
    }
    EXPECT_EQ(backs, 1);
    EXPECT_EQ(file.all("CIRCLE").size(), 4U);
  }
}

}  // namespace
}  // namespace lensforge::testing

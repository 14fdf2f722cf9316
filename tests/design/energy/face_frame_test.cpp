// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <vector>

#include "design/energy/smoothness.h"
#include "design/random_corners.h"

namespace lensforge {
namespace {

using testing::Random;

TEST(FaceFrame, StandsOnTheTriangle) {
  Random random(3);
  for (int k = 0; k < 50; ++k) {
    const Corners t = testing::random_corners(random);
    const FaceFrame frame = face_frame(t);
    EXPECT_NEAR(frame.n.norm(), 1.0, 1e-14);
    EXPECT_NEAR(frame.n.dot(t.v2 - t.v0), 0.0, 1e-13);
    EXPECT_NEAR(frame.n.dot(t.v1 - t.v0), 0.0, 1e-13);
    EXPECT_NEAR(frame.n.dot(t.v2 - frame.c), 0.0, 1e-13);
  }
}

TEST(TangentBasis, IsOrthonormalAndTurnsLeftSeenAgainstTheNormal) {
  Random random(4);
  std::vector<Eigen::Vector3d> normals{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}};
  for (int k = 0; k < 200; ++k) normals.push_back(random.near_z(0.5));
  for (const Eigen::Vector3d& n : normals) {
    const TangentBasis basis(n);
    EXPECT_NEAR(basis.e1.norm(), 1.0, 1e-14);
    EXPECT_NEAR(basis.e1.dot(n), 0.0, 1e-14);
    EXPECT_LT((n.cross(basis.e1) - basis.e2).norm(), 1e-14);
  }
}

TEST(TangentBasis, LocalCoordinatesLeadBackToTheTangentPart) {
  Random random(5);
  for (int k = 0; k < 50; ++k) {
    const Eigen::Vector3d n = random.near_z(0.5);
    const Eigen::Vector3d v = random.vector3();
    const TangentBasis basis(n);
    EXPECT_LT((basis.world(basis.local(v)) - (v - n.dot(v) * n)).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace lensforge

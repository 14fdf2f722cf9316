// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/face_frame.h"

#include <gtest/gtest.h>

#include "design/finite_difference.h"
#include "design/random_corners.h"

namespace lensforge {
namespace {

using testing::Random;

TEST(FaceFrame, IsOrthonormal) {
  Random random(3);
  for (int k = 0; k < 50; ++k) {
    const Corners t = testing::random_corners(random);
    const FaceFrame frame = face_frame(t);
    EXPECT_NEAR(frame.n.norm(), 1.0, 1e-14);
    EXPECT_NEAR(frame.e1.norm(), 1.0, 1e-14);
    EXPECT_NEAR(frame.n.dot(frame.e1), 0.0, 1e-13);
    EXPECT_NEAR(frame.n.dot(t.v2 - frame.c), 0.0, 1e-13);
    EXPECT_GT(frame.n.cross(frame.e1).dot(t.v2 - t.v0), 0.0);
  }
}

TEST(FaceFrame, AdjointEqualsCentralDifferences) {
  Random random(4);
  for (int k = 0; k < 200; ++k) {
    const Corners t = testing::random_corners(random);
    const FaceFrame bar{random.vector3(), random.vector3(), random.vector3()};
    const auto f = [&](const Eigen::VectorXd& x) {
      const FaceFrame frame = face_frame(testing::unpack_corners(x));
      return bar.n.dot(frame.n) + bar.e1.dot(frame.e1) + bar.c.dot(frame.c);
    };
    Corners grad;
    face_frame_adjoint(t, face_frame(t), bar, grad);
    EXPECT_LT(testing::plateau_error(testing::pack(grad), f, testing::pack(t), 5e-4), 1e-8);
  }
}

}  // namespace
}  // namespace lensforge

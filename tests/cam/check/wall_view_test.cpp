// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/wall_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "cam/check/virtual_wall.h"
#include "core/error.h"
#include "core/image/color.h"

namespace lensforge::wall_view_test {
namespace {

constexpr int kSide = 96;
constexpr int kMargin = 12;

/// A picture without symmetry on a dark wall. @param seed  moves its spots.
WallPicture spots(int seed = 0) {
  WallPicture wall{Image(kSide + 2 * kMargin, kSide + 2 * kMargin), kMargin};
  for (int r = 0; r < kSide; ++r) {
    for (int c = 0; c < kSide; ++c) {
      const double x = (c + 0.5) / kSide;
      const double y = (r + 0.5) / kSide;
      double light = 0.3;
      for (int k = 0; k < 7; ++k) {
        const double a = 0.5 + 0.45 * std::sin(2.3 * k + 1.7 * seed + 0.4);
        const double b = 0.5 + 0.45 * std::cos(3.1 * k * k + 0.9 * seed);
        light += (1.0 + 0.4 * k) *
                 std::exp(-((x - a) * (x - a) + (y - b) * (y - b)) / (0.004 + 0.0015 * k));
      }
      wall.light.at(c + kMargin, r + kMargin) = static_cast<float>(light);
    }
  }
  return wall;
}

virtual_wall::WallLight light_of(const WallPicture& wall) {
  const double side = static_cast<double>(wall.light.columns()) / kSide;
  return {wall.light, {side, side}};
}

Photograph shot(const WallPicture& wall, const virtual_wall::Camera& camera) {
  return photograph(virtual_wall::photograph(light_of(wall), {1.0, 1.0}, camera), {}, "wall.jpg");
}

std::string refusal(const Photograph& photo, const WallPicture& wall) {
  try {
    find_picture(photo, wall);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

Image flipped(const Image& image, bool across, bool down) {
  Image result(image.columns(), image.rows());
  for (int r = 0; r < image.rows(); ++r) {
    for (int c = 0; c < image.columns(); ++c) {
      result.at(c, r) =
          image.at(across ? image.columns() - 1 - c : c, down ? image.rows() - 1 - r : r);
    }
  }
  return result;
}

Image turned(const Image& image) {
  Image result(image.rows(), image.columns());
  for (int r = 0; r < result.rows(); ++r) {
    for (int c = 0; c < result.columns(); ++c) result.at(c, r) = image.at(r, image.rows() - 1 - c);
  }
  return result;
}

TEST(WallView, DerivativesAreThoseOfDifferences) {
  const WallPicture wall = spots();
  const Photograph photo = shot(wall, virtual_wall::any_camera(5));
  const Eigen::VectorXd view = find_picture(photo, wall);
  const SeenPixels pixels(photo, view, 0.9);
  const Eigen::MatrixXd known = pixels.derivatives(view, wall);
  for (Eigen::Index k = 0; k < view.size(); ++k) {
    constexpr double kStep = 1e-5;
    Eigen::VectorXd more = view;
    Eigen::VectorXd less = view;
    more[k] += kStep;
    less[k] -= kStep;
    const Eigen::VectorXd change =
        (pixels.shown(more, wall) - pixels.shown(less, wall)) / (2.0 * kStep);
    // Of light by the pixel's middle: some hundredths.
    EXPECT_LT((known.col(k) - change).norm(), 0.03 * change.norm()) << k;
  }
}

/// Noise of pixels is not shared, what the model misses is.
TEST(WallView, ToldApartFromNoiseByNeighbours) {
  const WallPicture wall = spots();
  const Photograph photo = shot(wall, virtual_wall::Camera{});
  const SeenPixels pixels(photo, find_picture(photo, wall), 0.9);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0.0, 0.01);
  Eigen::VectorXd noise(pixels.size());
  for (double& value : noise) value = normal(random);
  EXPECT_LT(pixels.shared_by_neighbours(noise), 0.0015);
  const Eigen::VectorXd missed = Eigen::VectorXd::Constant(pixels.size(), 0.006) + noise;
  EXPECT_NEAR(pixels.shared_by_neighbours(missed), 0.006, 6e-4);
}

/// From any side up to 30°, distorted, vignetted, in a lit room.
TEST(WallView, FindsThePictureFromAnySide) {
  const WallPicture wall = spots();
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    const Photograph photo = shot(wall, virtual_wall::any_camera(seed));
    const Eigen::VectorXd view = find_picture(photo, wall);
    // Within the rim: it is sharper than pixels, and what is beyond it nearly black.
    const SeenPixels pixels(photo, view, 0.95);
    EXPECT_GT(pixels.correlation(view, wall), 0.99);
    const double rms = (pixels.shown(view, wall) - pixels.seen()).norm() /
                       std::sqrt(static_cast<double>(pixels.size()));
    EXPECT_LT(rms, 0.02);
  }
}

TEST(WallView, RefusesWhatIsNoPhotographOfThePicture) {
  const WallPicture wall = spots();
  const virtual_wall::Camera camera;
  const Photograph photo = shot(wall, camera);
  EXPECT_EQ(refusal(photo, wall), "");
  Photograph other = photo;
  other.light = flipped(photo.light, true, false);
  EXPECT_NE(refusal(other, wall).find("is mirrored"), std::string::npos) << refusal(other, wall);
  other.light = flipped(photo.light, true, true);
  EXPECT_NE(refusal(other, wall).find("is upside down"), std::string::npos) << refusal(other, wall);
  other.light = turned(photo.light);
  EXPECT_NE(refusal(other, wall).find("is turned by a quarter"), std::string::npos)
      << refusal(other, wall);
  EXPECT_NE(refusal(shot(spots(3), camera), wall).find("another picture"), std::string::npos);
  other.light = Image(camera.columns, camera.rows, 0.3F);
  EXPECT_NE(refusal(other, wall).find("shows no picture"), std::string::npos);
  other.light = Image(camera.columns, camera.rows, 0.004F);
  EXPECT_NE(refusal(other, wall).find("is too dark"), std::string::npos) << refusal(other, wall);
  virtual_wall::Camera over = camera;
  over.white = 4.0;
  EXPECT_NE(refusal(shot(wall, over), wall).find("is clipped"), std::string::npos);
  for (const std::string& line : {refusal(other, wall), refusal(shot(wall, over), wall)}) {
    EXPECT_EQ(line.rfind("wall.jpg: ", 0), 0U);
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
}

/// Three exposures, of which the longest clips the picture and the shortest hardly shows its dark.
TEST(WallView, ExposuresAreOnePhotograph) {
  const WallPicture wall = spots();
  std::vector<Photograph> all;
  const virtual_wall::Camera even;
  const double usual = decode(even.white);
  for (const double factor : {1.0, 4.0, 0.3}) {
    virtual_wall::Camera camera = even;
    camera.white = encode(factor * usual);
    camera.jpeg = 0;
    all.push_back(shot(wall, camera));
  }
  EXPECT_NE(std::count(all[1].usable.begin(), all[1].usable.end(), 0), 0);
  const Photograph one = bracketed(all);
  EXPECT_EQ(std::count(one.usable.begin(), one.usable.end(), 0), 0);
  const Eigen::VectorXd view = find_picture(one, wall);
  EXPECT_GT(SeenPixels(one, view, 1.1).correlation(view, wall), 0.99);
}

TEST(WallView, ADarkPhotographTakesTheRoomsLightAway) {
  const WallPicture wall = spots();
  virtual_wall::Camera camera;
  camera.ambient = 0.1;
  camera.slope = 0.8;
  const Image lit = virtual_wall::photograph(light_of(wall), {1.0, 1.0}, camera);
  const Image dark = virtual_wall::photograph(light_of(wall), {1.0, 1.0}, camera, false);
  const auto error = [&](const Photograph& photo) {
    const Eigen::VectorXd view = find_picture(photo, wall);
    const SeenPixels pixels(photo, view, 1.1);
    return (pixels.shown(view, wall) - pixels.seen()).norm();
  };
  EXPECT_LT(std::abs(find_picture(photograph(lit, dark, "wall.jpg"), wall)[view::kAmbient]), 0.01);
  EXPECT_GT(find_picture(photograph(lit, {}, "wall.jpg"), wall)[view::kAmbient], 0.05);
  EXPECT_THROW(photograph(lit, Image(3, 3), "wall.jpg"), InputError);
  EXPECT_GT(error(photograph(lit, {}, "wall.jpg")), 0.0);
}

/// A barrel so strong that the picture's corners are nowhere in the photograph: steps towards them
/// have no end.
TEST(WallView, AStronglyDistortedViewIsFollowedBack) {
  constexpr int kPlaces = 24;
  constexpr double kReach = 0.55;  // The fold is at 0.69.
  const Photograph photo{Image(120, 90, 0.5F), {}, "wall.jpg"};
  Eigen::VectorXd view = Eigen::VectorXd::Zero(view::kCount);
  view.head(8) << 2.2, 0.05, 0.1, -0.03, 2.2, 0.02, 0.15, -0.2;
  view.segment(view::kDistortion, 2) << -0.3, -0.5;
  const WallToPhoto seen(photo, view);
  for (int k = 0; k < kPlaces * kPlaces; ++k) {
    const Eigen::Vector2d cell(k % kPlaces, static_cast<int>(k / kPlaces));
    const Eigen::Vector2d share = (cell.array() + 0.5) / kPlaces - 0.5;
    const Eigen::Vector2d beyond = seen.at(3.0 * share);
    ASSERT_TRUE(beyond.allFinite()) << share.transpose();
    EXPECT_LT(place_in(photo.light, beyond).norm(), 2.1) << share.transpose();
    const Eigen::Vector2d place = 2.0 * kReach * share;
    if (place.norm() > kReach) continue;
    const Eigen::Vector2d found = place_in(photo.light, seen.at(wall_of(view, place)));
    EXPECT_LT((found - place).norm(), 1e-6) << place.transpose();
  }
}

}  // namespace
}  // namespace lensforge::wall_view_test

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <ostream>
#include <string>
#include <vector>

#include "design/flux/flux_triangle.h"
#include "design/random_input.h"

namespace lensforge::testing {

/// Size of the pictures that random triangles are made for.
inline constexpr int kColumns = 17;
inline constexpr int kRows = 13;

inline double longest_extent(const ImageTriangle& t) {
  const Eigen::Vector2d low = t.p0.cwiseMin(t.p1).cwiseMin(t.p2);
  const Eigen::Vector2d high = t.p0.cwiseMax(t.p1).cwiseMax(t.p2);
  return (high - low).maxCoeff();
}

inline double area_of(const ImageTriangle& t) {
  return 0.5 * std::fabs(doubled_area(t.p0, t.p1, t.p2));
}

/// A kind of random triangle, by name.
struct TriangleClass {
  std::string name;
  std::function<ImageTriangle(Random&)> make;

  friend std::ostream& operator<<(std::ostream& out, const TriangleClass& c) {
    return out << c.name;
  }
};

/// Corners up to `size` away from a centre.
inline ImageTriangle triangle_around(Random& random, const Eigen::Vector2d& centre, double size) {
  return {centre + size * random.vector2(), centre + size * random.vector2(),
          centre + size * random.vector2(), 1.0};
}

inline Eigen::Vector2d point_in_picture(Random& random) {
  return {random.between(0.0, kColumns), random.between(0.0, kRows)};
}

inline Eigen::Vector2d pixel_corner(Random& random, int margin) {
  return {random.below(kColumns + 2 * margin + 1) - margin,
          random.below(kRows + 2 * margin + 1) - margin};
}

/// A triangle of `size` about a point of one of the picture's four borders.
inline ImageTriangle triangle_on_border(Random& random, double size) {
  Eigen::Vector2d centre = point_in_picture(random);
  const int side = random.below(4);
  centre[side % 2] = side < 2 ? 0.0 : (side == 2 ? kColumns : kRows);
  return triangle_around(random, centre, size);
}

/// A right-angled triangle whose legs lie along pixel borders.
inline ImageTriangle axis_aligned(Random& random) {
  const Eigen::Vector2d corner = pixel_corner(random, 2);
  const double across = random.between(-6.0, 6.0);
  const double along = random.below(2) == 0 ? random.below(7) - 3.0 : random.between(-6.0, 6.0);
  return {corner, corner + Eigen::Vector2d(across, 0.0), corner + Eigen::Vector2d(0.0, along), 1.0};
}

/// Corners on the sides of pixels.
inline ImageTriangle on_pixel_sides(Random& random) {
  const auto corner = [&random] {
    Eigen::Vector2d p = pixel_corner(random, 2);
    p[random.below(2)] += random.between(0.0, 1.0);
    return p;
  };
  return {corner(), corner(), corner(), 1.0};
}

/// Beyond one side of the picture, but for reaching in by a little now and then.
inline ImageTriangle beyond(Random& random, const Eigen::Vector2d& side) {
  const Eigen::Vector2d half(0.5 * kColumns, 0.5 * kRows);
  const Eigen::Vector2d along(side.y(), side.x());
  const double reach = random.between(1.0, 8.0);
  const Eigen::Vector2d centre = half + half.cwiseProduct(side + random.vector2().x() * along) +
                                 random.between(0.2, 1.5) * reach * side;
  return triangle_around(random, centre, reach);
}

inline std::vector<TriangleClass> generic_classes() {
  const auto around_picture = [](double low, double high) {
    return
        [=](Random& r) { return triangle_around(r, point_in_picture(r), r.magnitude(low, high)); };
  };
  const auto beside = [](double x, double y) {
    return [=](Random& r) { return beyond(r, {x, y}); };
  };
  return {{"SmallerThanAPixel", around_picture(1e-4, 0.4)},
          {"PixelSize", around_picture(0.4, 2.0)},
          {"SeveralPixels", around_picture(2.0, 9.0)},
          {"LargerThanThePicture", around_picture(20.0, 1e4)},
          {"OnTheBorder", [](Random& r) { return triangle_on_border(r, r.magnitude(1e-3, 6.0)); }},
          {"BeyondTheLeft", beside(-1.0, 0.0)},
          {"BeyondTheRight", beside(1.0, 0.0)},
          {"BeyondTheTop", beside(0.0, -1.0)},
          {"BeyondTheBottom", beside(0.0, 1.0)}};
}

/// Triangles with corners or sides on the pixel grid.
inline std::vector<TriangleClass> aligned_classes() {
  return {{"OnPixelCorners",
           [](Random& r) {
             return ImageTriangle{pixel_corner(r, 3), pixel_corner(r, 3), pixel_corner(r, 3), 1.0};
           }},
          {"OnPixelSides", on_pixel_sides},
          {"AxisAligned", axis_aligned}};
}

/// One of a class that has some width, with as much flux as an image triangle may have.
inline ImageTriangle next_triangle(const TriangleClass& kind, Random& random) {
  ImageTriangle t;
  double share = 0.0;
  do {
    t = kind.make(random);
    const double extent = longest_extent(t);
    share = extent > 0.0 ? area_of(t) / (extent * extent) : 0.0;
  } while (share < 1e-4);
  const bool may_be_needle = longest_extent(t) > 1.0;
  const double most = may_be_needle ? std::min(1.0, 0.5 * kMaxDensity * area_of(t)) : 1.0;
  t.flux = most * random.between(0.1, 1.0);
  return t;
}

}  // namespace lensforge::testing

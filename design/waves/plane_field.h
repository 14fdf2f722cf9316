// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

namespace lensforge {

/// A field on a plane z = const and its way to a parallel one.
struct FieldPlan {
  double wavelength = 550e-6;        ///< mm
  double distance = 0.0;             ///< Between the planes, mm, > 0.
  Eigen::Vector2d centre{0.0, 0.0};  ///< Of the first plane's nodes, mm.
  Eigen::Vector2d cosine{0.0, 0.0};  ///< Direction of the mean ray, along x and y.
  Eigen::Vector2d step{0.0, 0.0};    ///< Of the nodes, mm.
  int columns = 0, rows = 0;
  /// Components that go farther aside than this on their way are dropped, mm: they would come back
  /// on the other side of the nodes.
  Eigen::Vector2d reach{HUGE_VAL, HUGE_VAL};
  /// Points along x and y by which a node's cell is known to be lit: more than one where the field
  /// has a hard edge across that axis.
  Eigen::Vector2i points{1, 1};

  /// Column and row of the centre.
  [[nodiscard]] Eigen::Vector2i centre_node() const { return Eigen::Vector2i(columns, rows) / 2; }
  [[nodiscard]] Eigen::Vector2d middle() const { return centre_node().cast<double>(); }
  [[nodiscard]] Eigen::Vector2d slope() const {
    return cosine / std::sqrt(1.0 - cosine.squaredNorm());
  }
  /// Where the mean ray from the centre meets the other plane, mm.
  [[nodiscard]] Eigen::Vector2d far_centre() const { return centre + distance * slope(); }
};

/// The next size of 2, 3, 5 and 7 from `least` up, even: fast to transform.
int transform_size(double least);

/// Light of a rectangle of pixels.
struct PixelLight {
  Eigen::Vector2i first{0, 0};  ///< Column and row.
  int columns = 0, rows = 0;
  std::vector<double> light;  ///< Row by row.
  double whole = 0.0;         ///< All that the field has, on these pixels or not.
  /// Light that came as rays: pixels of the picture, row by row, and shares.
  std::vector<std::pair<int, double>> rays;
};

/// A scalar field without the phase of its mean ray, on as many nodes as its steepest rays ask for.
class PlaneField {
 public:
  /// A ray on the plane.
  struct Vertex {
    Eigen::Vector2d place;   ///< mm
    Eigen::Vector2d cosine;  ///< Direction along x and y.
    double path = 0.0;       ///< Optical, mm.
    double amplitude = 0.0;  ///< √(light per mm²)
  };

  explicit PlaneField(const FieldPlan& plan);

  /// Adds the field of a triangle of neighbouring rays at the nodes of which a point is inside it.
  /// The path is the quadratic through the vertices with their directions as slopes; a triangle
  /// that is turned over is beyond a fold, where the phase is π/2 less. Points on a common side of
  /// two triangles belong to one of them.
  void add(const std::array<Vertex, 3>& vertices);

  /// Goes to the other plane by the angular spectrum: nodes are then around far_centre().
  void propagate();

  /// Light of the nodes on pixels, each spread evenly over its cell.
  /// @param centre  pixel coordinates of the plane's centre. @param by_mm  their derivatives.
  [[nodiscard]] PixelLight spread(const Eigen::Vector2d& centre, const Eigen::Matrix2d& by_mm,
                                  const Eigen::Vector2i& pixels) const;

  [[nodiscard]] const FieldPlan& plan() const { return plan_; }
  /// Node (i, j), (0, 0) the lowest.
  [[nodiscard]] const std::complex<double>& at(int i, int j) const {
    return values_[static_cast<std::size_t>(j) * static_cast<std::size_t>(plan_.columns) +
                   static_cast<std::size_t>(i)];
  }
  [[nodiscard]] std::complex<double>& at(int i, int j) {
    return values_[static_cast<std::size_t>(j) * static_cast<std::size_t>(plan_.columns) +
                   static_cast<std::size_t>(i)];
  }

 private:
  FieldPlan plan_;
  std::vector<std::complex<double>> values_;
};

}  // namespace lensforge

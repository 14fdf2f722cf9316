// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/transport_start.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <vector>

#include "core/cubic.h"
#include "core/image_plane.h"
#include "design/optimize/cosine_transform.h"
#include "design/transport/monge_ampere.h"

namespace lensforge {

namespace {

/// Gradient of the surface that gives parallel light along +z the slope m: the refracted direction
/// b lies in the plane of n and +z with b − ηz parallel to −n (Snell's law).
Eigen::Vector2d surface_gradient(const Eigen::Vector2d& m, double eta) {
  const Eigen::Vector3d b = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
  return b.head<2>() / (eta - b.z());
}

/// Heights on the pixels' corners, unit spacing.
class HeightGrid {
 public:
  HeightGrid(int columns, int rows) : columns_(columns), rows_(rows), transform_(columns, rows) {}

  /// Fits heights to wanted slopes (2 × nodes, per pixel), across the borders slope 0: Δz = div p
  /// with p taken between nodes as the mean of both.
  void integrate(const Eigen::Matrix2Xd& slope) {
    const auto values = transform_.values();
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        values[static_cast<std::size_t>(index(c, r))] =
            divergence(slope, 0, c, columns_, index(c, r), 1) +
            divergence(slope, 1, r, rows_, index(c, r), columns_);
      }
    }
    transform_.solve_poisson();
    heights_.assign(values.begin(), values.end());
  }

  /// Height at continuous node coordinates, cubic between nodes.
  [[nodiscard]] double at(double u, double v) const {
    const int c = std::clamp(static_cast<int>(u), 0, columns_ - 2);
    const int r = std::clamp(static_cast<int>(v), 0, rows_ - 2);
    return interpolate_cubic(r, v - r, rows_ - 1, [&](int row) {
      return interpolate_cubic(c, u - c, columns_ - 1, [&](int column) {
        return heights_[static_cast<std::size_t>(index(column, row))];
      });
    });
  }

 private:
  [[nodiscard]] Eigen::Index index(int c, int r) const {
    return static_cast<Eigen::Index>(r) * columns_ + c;
  }

  /// Difference of the mid-interval slopes on both sides of a node; mirrored at the borders.
  static double divergence(const Eigen::Matrix2Xd& slope, int k, int i, int n, Eigen::Index node,
                           Eigen::Index stride) {
    const double here = slope(k, node);
    const double ahead = i + 1 < n ? 0.5 * (here + slope(k, node + stride)) : 0.0;
    const double behind = i > 0 ? 0.5 * (here + slope(k, node - stride)) : 0.0;
    if (i == 0) return 2.0 * ahead;
    return i + 1 == n ? -2.0 * behind : ahead - behind;
  }

  int columns_;
  int rows_;
  CosineTransform transform_;
  std::vector<double> heights_;
};

}  // namespace

bool start_from_transport(const Image& picture, const OpticalSetup& setup,
                          const RunControl& control, SurfaceMesh& mesh) {
  const MongeAmpereResult map = solve_monge_ampere(picture, MongeAmpereOptions{}, control);
  if (map.stopped) return false;
  const ImagePlane plane(setup);
  const double distance = setup.focal_length - mesh.vertices.row(2).mean();
  const Eigen::Vector2d mm_per_pixel = plane.pixels_per_mm().cwiseInverse();
  Eigen::Matrix2Xd slope(2, map.displacement.cols());
  for (Eigen::Index i = 0; i < slope.cols(); ++i) {
    const Eigen::Vector2d m = map.displacement.col(i).cwiseProduct(mm_per_pixel) / distance;
    slope.col(i) = surface_gradient(m, setup.ior).cwiseProduct(mm_per_pixel);
  }
  HeightGrid heights(map.columns, map.rows);
  heights.integrate(slope);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector2d pixel = plane.to_pixels(mesh.vertices.col(v).head<2>());
    mesh.vertices(2, v) += heights.at(pixel.x(), pixel.y());
  }
  return true;
}

}  // namespace lensforge

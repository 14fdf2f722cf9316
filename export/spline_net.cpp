// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/spline_net.h"

#include <algorithm>
#include <cmath>

#include "core/surface/cubic_spline.h"
#include "export/front_solid.h"
#include "export/outline_volume.h"

namespace lensforge {
namespace {

double angle_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d m = Eigen::Vector3d(-a.x(), -a.y(), 1.0).normalized();
  const Eigen::Vector3d n = Eigen::Vector3d(-b.x(), -b.y(), 1.0).normalized();
  return 2.0 * std::asin(std::min(1.0, 0.5 * (m - n).norm()));
}

std::vector<double> raster(int from_cell, int to_cell, int density) {
  std::vector<double> points;
  for (int i = from_cell * density; i <= to_cell * density; ++i) {
    points.push_back(static_cast<double>(i) / density);
  }
  return points;
}

/// Gauss–Legendre nodes in every cell: exact to the ninth degree, one more than a volume has.
struct Gauss {
  static constexpr int kNodes = 5;
  static constexpr std::array<double, kNodes> kNode{0.046910077030668, 0.230765344947158, 0.5,
                                                    0.769234655052842, 0.953089922969332};
  static constexpr std::array<double, kNodes> kWeight{0.118463442528095, 0.239314335249683,
                                                      0.284444444444444, 0.239314335249683,
                                                      0.118463442528095};

  static std::vector<double> points(int cells) {
    std::vector<double> result;
    for (int i = 0; i < cells; ++i) {
      for (const double node : kNode) result.push_back(i + node);
    }
    return result;
  }
};

/// x, y, z of a patch and their derivatives on a tensor grid of points (in cells), one row per u.
class PatchTable {
 public:
  PatchTable(const SplinePatch& patch, const std::vector<double>& u, const std::vector<double>& v) {
    const Eigen::Vector2d cell = patch.box.sizes().cwiseQuotient(patch.cells());
    const Eigen::MatrixXd across = basis_matrix(v, patch.cells_v, false).transpose();
    const Eigen::MatrixXd bent = basis_matrix(v, patch.cells_v, true).transpose() / cell.y();
    const auto along = basis_matrix(u, patch.cells_u, false);
    const auto steep = basis_matrix(u, patch.cells_u, true);
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::MatrixXd rows = along * patch.coefficients[k];
      value_[k] = rows * across;
      by_u_[k] = (steep * patch.coefficients[k]) * across / cell.x();
      by_v_[k] = rows * bent;
    }
  }

  [[nodiscard]] Eigen::Index rows() const { return value_[0].rows(); }
  [[nodiscard]] Eigen::Index columns() const { return value_[0].cols(); }
  [[nodiscard]] SplinePoint at(Eigen::Index i, Eigen::Index j) const {
    return spline_point(take(value_, i, j), take(by_u_, i, j), take(by_v_, i, j));
  }
  /// That a unit of the parameters covers, seen from above.
  [[nodiscard]] double area(Eigen::Index i, Eigen::Index j) const {
    return by_u_[0](i, j) * by_v_[1](i, j) - by_u_[1](i, j) * by_v_[0](i, j);
  }
  [[nodiscard]] double volume(Eigen::Index i, Eigen::Index j) const {
    return value_[2](i, j) * area(i, j);
  }

 private:
  using Table = std::array<Eigen::MatrixXd, 3>;
  static Eigen::Vector3d take(const Table& table, Eigen::Index i, Eigen::Index j) {
    return {table[0](i, j), table[1](i, j), table[2](i, j)};
  }
  Table value_, by_u_, by_v_;
};

int interval_of(const std::vector<double>& lines, double at) {
  const auto above = std::upper_bound(lines.begin(), lines.end(), at);
  const auto count = static_cast<int>(lines.size()) - 1;
  return std::clamp(static_cast<int>(above - lines.begin()) - 1, 0, count - 1);
}

}  // namespace

SplinePoint spline_point(const Eigen::Vector3d& p, const Eigen::Vector3d& du,
                         const Eigen::Vector3d& dv) {
  const double area = du.x() * dv.y() - dv.x() * du.y();
  return {p.head<2>(),
          {p.z(),
           Eigen::Vector2d(du.z() * dv.y() - dv.z() * du.y(), dv.z() * du.x() - du.z() * dv.x()) /
               area}};
}

PatchFrame SplinePatch::frame(const Eigen::Vector2d& uv) const {
  const Eigen::Array2d share = (uv - box.min()).array() / box.sizes().array();
  const Eigen::Array2d t = (share * cells().array()).max(0.0).min(cells().array());
  const CubicBasis bu = cubic_basis(t.x(), cells_u);
  const CubicBasis bv = cubic_basis(t.y(), cells_v);
  const Eigen::Vector2d scale = cells().cwiseQuotient(box.sizes());
  PatchFrame frame;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      const int row = bu.first + static_cast<int>(i);
      const int column = bv.first + static_cast<int>(j);
      const Eigen::Vector3d c(coefficients[0](row, column), coefficients[1](row, column),
                              coefficients[2](row, column));
      frame.point += c * (bu.value[i] * bv.value[j]);
      frame.by_u += c * (bu.slope[i] * bv.value[j] * scale.x());
      frame.by_v += c * (bu.value[i] * bv.slope[j] * scale.y());
    }
  }
  return frame;
}

SplinePoint SplinePatch::at(const Eigen::Vector2d& uv) const {
  const PatchFrame f = frame(uv);
  return spline_point(f.point, f.by_u, f.by_v);
}

double SplinePatch::volume() const {
  const PatchTable table(*this, Gauss::points(cells_u), Gauss::points(cells_v));
  double sum = 0.0;
  for (Eigen::Index i = 0; i < table.rows(); ++i) {
    for (Eigen::Index j = 0; j < table.columns(); ++j) {
      sum += Gauss::kWeight[static_cast<std::size_t>(i % Gauss::kNodes)] *
             Gauss::kWeight[static_cast<std::size_t>(j % Gauss::kNodes)] * table.volume(i, j);
    }
  }
  return sum * box.volume() / cells().prod();
}

FitError SplineNet::error() const {
  const double area = (u.back() - u.front()) * (v.back() - v.front());
  FitError worst;
  for (const SplinePatch& patch : patches) {
    worst.raise(patch.error);
    worst.area += patch.error.area;
    worst.area_within += patch.error.area_within;
    const double share = patch.box.volume() / area;
    worst.height_rms += share * patch.error.height_rms * patch.error.height_rms;
    worst.normal_rms += share * patch.error.normal_rms * patch.error.normal_rms;
  }
  worst.height_rms = std::sqrt(worst.height_rms);
  worst.normal_rms = std::sqrt(worst.normal_rms);
  return worst;
}

double SplineNet::volume() const {
  if (outline) return outlined_volume(*this);
  double sum = 0.0;
  for (const SplinePatch& patch : patches) sum += patch.volume();
  if (!front) return sum;
  return sum - volume_below(*front, {Eigen::Vector2d(u.front(), v.front()),
                                     Eigen::Vector2d(u.back(), v.back())});
}

std::int64_t SplineNet::control_points() const {
  std::int64_t count = 0;
  for (const SplinePatch& patch : patches) count += patch.coefficients[0].size();
  return count;
}

int SplineNet::patch_at(const Eigen::Vector2d& uv) const {
  return interval_of(v, uv.y()) * columns + interval_of(u, uv.x());
}

SplinePoint SplineNet::at(const Eigen::Vector2d& uv) const {
  return patches[static_cast<std::size_t>(patch_at(uv))].at(uv);
}

std::optional<Eigen::Vector2d> SplineNet::parameters_of(const Eigen::Vector2d& xy,
                                                        const Eigen::Vector2d& start) const {
  constexpr int kMaxSteps = 30;
  constexpr double kNear = 1e-9;  // mm
  const Eigen::Vector2d low(u.front(), v.front());
  const Eigen::Vector2d high(u.back(), v.back());
  Eigen::Vector2d uv = start.cwiseMax(low).cwiseMin(high);
  for (int step = 0; step < kMaxSteps; ++step) {
    const PatchFrame f = patches[static_cast<std::size_t>(patch_at(uv))].frame(uv);
    const Eigen::Vector2d miss = xy - f.point.head<2>();
    if (miss.norm() < kNear) return uv;
    Eigen::Matrix2d derivative;
    derivative << f.by_u.head<2>(), f.by_v.head<2>();
    uv = (uv + derivative.inverse() * miss).cwiseMax(low).cwiseMin(high);
  }
  return std::nullopt;
}

SampledSurface sampled(const SplineNet& net, const GridShape& shape) {
  SampledSurface result = make_samples(shape);
  const Eigen::Vector2d low(net.u.front(), net.v.front());
  const Eigen::Vector2d size = Eigen::Vector2d(net.u.back(), net.v.back()) - low;
  for (int r = 0; r < shape.rows; ++r) {
    for (int c = 0; c < shape.columns; ++c) {
      const Eigen::Array2d share(static_cast<double>(c) / (shape.columns - 1),
                                 static_cast<double>(r) / (shape.rows - 1));
      const SplinePoint point = net.at(low + (share * size.array()).matrix());
      const int at = r * shape.columns + c;
      result.mesh.vertices.col(at) << point.xy, point.surface.z;
      result.normals.col(at) << -point.surface.slope, 1.0;
    }
  }
  return result;
}

void FitError::raise(const FitError& other) {
  if (other.height > height) {
    height = other.height;
    height_at = other.height_at;
  }
  if (other.normal > normal) {
    normal = other.normal;
    normal_at = other.normal_at;
  }
}

void FitError::add(FitError other, const Eigen::Vector2d& at) {
  other.height_at = other.normal_at = at;
  raise(other);
  height_rms += other.height * other.height;
  normal_rms += other.normal * other.normal;
  area += other.area;
  area_within += other.area_within;
}

void FitError::divide(double points, double unit_area) {
  height_rms = std::sqrt(height_rms / points);
  normal_rms = std::sqrt(normal_rms / points);
  area *= unit_area / points;
  area_within *= unit_area / points;
}

FitError difference(const SurfacePoint& a, const SurfacePoint& b) {
  return {.height = std::abs(a.z - b.z), .normal = angle_between(a.slope, b.slope)};
}

bool holds(const FitError& error, const FitOptions& options) {
  return error.height <= options.tolerance && error.normal <= options.normal_tolerance;
}

FitError measure_patch(const SplinePatch& patch, const SmoothSurface& surface,
                       const FitOptions& options, int density) {
  FitError error;
  double points = 0.0;
  const std::vector<double> across = raster(0, patch.cells_v, density);
  for (int cell = 0; cell < patch.cells_u; ++cell) {
    const PatchTable table(patch, raster(cell, cell + 1, density), across);
    for (Eigen::Index i = 0; i < table.rows(); ++i) {
      for (Eigen::Index j = 0; j < table.columns(); ++j) {
        const SplinePoint at = table.at(i, j);
        const auto model = surface.model_at(nearest_inside(surface.box(), at.xy));
        if (!model) continue;
        FitError found = difference(at.surface, *model);
        found.area = table.area(i, j);
        found.area_within = holds(found, options) ? found.area : 0.0;
        error.add(found, at.xy);
        points += 1.0;
      }
    }
  }
  error.divide(std::max(points, 1.0), patch.box.volume());
  return error;
}

}  // namespace lensforge

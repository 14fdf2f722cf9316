// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar_curvature.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace lensforge::reflect {
namespace {

using Complex = std::complex<double>;
using Eigen::Vector3d;
using std::numbers::pi;

/// Above this kρ both shares differ from 1 by less than 1 %, and the surface counts as flat.
constexpr double kLargeRadius = 50.0;

/// ∫_τ^∞ e^{iu²} du e^{−iτ²} along u = τ + e^{iπ/4} s, where the integrand decays as e^{−s²}:
/// Simpson's rule, error below 1e-8.
Complex fresnel_tail(double tau) {
  constexpr int kSteps = 200;
  const double step = std::min(6.0, 20.0 / tau) / kSteps;
  const Complex rate = std::numbers::sqrt2 * tau * Complex(-1.0, 1.0);
  Complex sum = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double s = i * step;
    const double weight = i == 0 || i == kSteps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    sum += weight * std::exp(rate * s - s * s);
  }
  return std::polar(step / 3.0, 0.25 * pi) * sum;
}

ParabolicShares shares_of(double curvature, double wave_number) {
  if (curvature * kLargeRadius <= wave_number) return {1.0, 1.0};
  return parabolic_shares(wave_number / curvature);
}

/// Least squares of the second fundamental form (a, b; b, c) over the sides of a face.
Eigen::Matrix2d second_form(const Corners& c, const std::array<Vector3d, 3>& normal,
                            const Vector3d& u, const Vector3d& v) {
  const std::array p{c.v0, c.v1, c.v2};
  Eigen::Matrix<double, 6, 3> rows = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 1> turns;
  for (int k = 0; k < 3; ++k) {
    const auto from = static_cast<std::size_t>(k);
    const auto to = static_cast<std::size_t>((k + 1) % 3);
    const Vector3d side = p[to] - p[from];
    const Vector3d turn = normal[to] - normal[from];
    rows.row(2 * k) << side.dot(u), side.dot(v), 0.0;
    rows.row(2 * k + 1) << 0.0, side.dot(u), side.dot(v);
    turns.segment<2>(2 * k) << turn.dot(u), turn.dot(v);
  }
  const Vector3d form = rows.colPivHouseholderQr().solve(turns);
  return (Eigen::Matrix2d() << form[0], form[1], form[1], form[2]).finished();
}

}  // namespace

ParabolicShares parabolic_shares(double k_rho) {
  const double tau = std::sqrt(k_rho);
  const Complex w = Complex(0.0, -2.0 * tau) * fresnel_tail(tau);
  return {1.0 / w, 1.0 / (2.0 - w)};
}

Complex CurvedFace::of(const Vector3d& polarization, const Vector3d& n) const {
  const double a = polarization.dot(along);
  const double b = polarization.dot(n.cross(along));
  const double both = a * a + b * b;
  return both > 0.0 ? (a * a * share + b * b * other) / both : 1.0;
}

std::vector<CurvedFace> curved_faces(const SurfaceMesh& mesh, const std::vector<bool>& creased,
                                     double wavelength) {
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh).colwise().normalized();
  const double wave_number = 2.0 * pi / wavelength;
  std::vector<CurvedFace> faces;
  for (std::int64_t k = 0; k < mesh.triangle_count(); ++k) {
    const Eigen::Vector3i corner = mesh.triangles.col(k);
    CurvedFace face{Vector3d::UnitX(), 1.0, 1.0};
    const bool smooth = std::none_of(corner.begin(), corner.end(),
                                     [&](int v) { return creased[static_cast<std::size_t>(v)]; });
    if (smooth) {
      const Vector3d n = area_normal(mesh, k).normalized();
      const Vector3d u = n.unitOrthogonal();
      const Vector3d v = n.cross(u);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal(second_form(
          mesh.corners(k), {normals.col(corner[0]), normals.col(corner[1]), normals.col(corner[2])},
          u, v));
      const ParabolicShares one = shares_of(principal.eigenvalues()[0], wave_number);
      const ParabolicShares two = shares_of(principal.eigenvalues()[1], wave_number);
      const Eigen::Vector2d axis = principal.eigenvectors().col(0);
      face = {axis[0] * u + axis[1] * v, one.across * two.along, one.along * two.across};
    }
    faces.push_back(face);
  }
  return faces;
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/vertex_spread.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/optics/light_path.h"
#include "design/flux/flux_image.h"
#include "design/flux/flux_triangle.h"
#include "design/transport/monge_ampere.h"

namespace lensforge {

namespace {

/// Most vertices per mean cell: what lies between black and bright may serve any image area.
constexpr double kMaxDense = 30.0;

/// Area that a triangle keeps at least, a third of what kMaxDense leaves it. The transport map is
/// monotone, but its differences over a pixel need not be where the density jumps: a step to the
/// sixtyfold folded triangles over.
constexpr double kMinShrinkage = 0.01;

/// Most passes of smoothing against that; one is enough for that step.
constexpr int kMaxSmoothing = 8;

/// See favour_dark().
constexpr double kDarkPower = 0.3;
constexpr double kDarkCost = 0.1;
constexpr int kDarkHalvings = 10;  ///< Of the interval that p is sought in.

/// Wanted density of vertices on the lens, drawn on a grid of setup.pixels.
Image vertex_density(const ServedAreas& served, double share, const OpticalSetup& setup,
                     const Executor& executor) {
  const double all = served.areas.sum();
  const Eigen::Vector2d scale = setup.pixels.cast<double>().cwiseQuotient(setup.lens_size);
  const double lens_pixels = setup.pixels.cast<double>().prod();
  const auto triangle = [&](std::int64_t f) {
    const auto corner = [&](int k) -> Eigen::Vector2d {
      return served.mesh.corner(f, k).head<2>().cwiseProduct(scale);
    };
    ImageTriangle t{.p0 = corner(0), .p1 = corner(1), .p2 = corner(2), .flux = 0.0};
    const double even = 0.5 * doubled_area(t.p0, t.p1, t.p2) / lens_pixels;
    t.flux = (1.0 - share) * even + share * served.areas[f] / all;
    return t;
  };
  FluxImage flux(setup.pixels.x(), setup.pixels.y());
  const auto values = flux.render(executor, served.mesh.triangle_count(), triangle);
  Image density(setup.pixels.x(), setup.pixels.y());
  std::transform(values.begin(), values.end(), density.values().begin(), [&](double v) {
    return static_cast<float>(std::min(v * lens_pixels, kMaxDense));
  });
  return density;
}

/// A vector field on the pixels' corners, bilinear between them.
Eigen::Vector2d sample(const MongeAmpereResult& map, const Eigen::Vector2d& p) {
  const int c = std::clamp(static_cast<int>(p.x()), 0, map.columns - 2);
  const int r = std::clamp(static_cast<int>(p.y()), 0, map.rows - 2);
  const double fx = p.x() - c;
  const double fy = p.y() - r;
  const Eigen::Index i = static_cast<Eigen::Index>(r) * map.columns + c;
  const auto& d = map.displacement;
  return (1.0 - fy) * ((1.0 - fx) * d.col(i) + fx * d.col(i + 1)) +
         fy * ((1.0 - fx) * d.col(i + map.columns) + fx * d.col(i + map.columns + 1));
}

/// One pass of the binomial filter along rows and columns, mirrored at the borders.
void smooth(Image& density) {
  const Image before = density;
  for (int r = 0; r < density.rows(); ++r) {
    for (int c = 0; c < density.columns(); ++c) {
      double sum = 0.0;
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) {
          const int column = std::clamp(c + dc, 0, density.columns() - 1);
          const int row = std::clamp(r + dr, 0, density.rows() - 1);
          sum += (dr == 0 ? 2.0 : 1.0) * (dc == 0 ? 2.0 : 1.0) *
                 static_cast<double>(before.at(column, row));
        }
      }
      density.at(c, r) = static_cast<float>(sum / 16.0);
    }
  }
}

SurfaceMesh moved_by(const MongeAmpereResult& map, const OpticalSetup& setup, SurfaceMesh mesh) {
  const Eigen::Vector2d scale = setup.pixels.cast<double>().cwiseQuotient(setup.lens_size);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector2d at = mesh.vertices.col(v).head<2>().cwiseProduct(scale);
    mesh.vertices.col(v).head<2>() += sample(map, at).cwiseQuotient(scale);
  }
  return mesh;
}

/// True if every triangle has kept its orientation and some of its area.
bool in_order(const SurfaceMesh& moved, const SurfaceMesh& before) {
  for (Eigen::Index f = 0; f < moved.triangles.cols(); ++f) {
    if (moved.plan_area(f) < kMinShrinkage * before.plan_area(f)) return false;
  }
  return true;
}

}  // namespace

Eigen::VectorXd favour_dark(const ServedAreas& served, const OpticalSetup& setup) {
  const Eigen::Index faces = served.areas.size();
  const LightPath path(setup);
  Eigen::ArrayXd light(faces);
  for (Eigen::Index f = 0; f < faces; ++f) {
    light[f] = path.intake(served.mesh.corners(f));
  }
  const double all = served.areas.sum();
  const Eigen::ArrayXd brightness =
      light / light.sum() / (served.areas.array() / all).max(std::numeric_limits<double>::min());
  const auto favoured = [&](double power) -> Eigen::VectorXd {
    return served.areas.array() * brightness.pow(-power);
  };
  const double most = (1.0 + kDarkCost) * all;
  double low = 0.0;
  double high = kDarkPower;
  if (favoured(high).sum() <= most) low = high;
  for (int k = 0; low < high && k < kDarkHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (favoured(middle).sum() <= most ? low : high) = middle;
  }
  return favoured(low);
}

bool spread_vertices(const ServedAreas& served, double share, const OpticalSetup& setup,
                     const Executor& executor, const RunControl& control, SurfaceMesh& mesh) {
  Image density = vertex_density(served, share, setup, executor);
  MongeAmpereOptions options;
  options.floor = 0.0;  // The even share is floor enough.
  for (int pass = 0; pass <= kMaxSmoothing; ++pass) {
    const MongeAmpereResult map = solve_monge_ampere(density, options, control);
    if (map.stopped) return false;
    SurfaceMesh moved = moved_by(map, setup, mesh);
    if (in_order(moved, mesh)) {
      mesh = std::move(moved);
      return true;
    }
    smooth(density);
  }
  return true;
}

}  // namespace lensforge

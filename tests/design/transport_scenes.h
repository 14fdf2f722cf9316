// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <vector>

#include "core/image/image.h"
#include "core/mesh/surface_mesh.h"
#include "design/clip_reference.h"
#include "design/random_input.h"
#include "design/transport/power_cells.h"
#include "design/transport/power_cells_on.h"
#include "design/transport/power_diagram.h"

namespace lensforge::testing {

/// White shapes on pure black; about seven tenths of the pixels are exactly 0.
inline Image logo_picture(int pixels) {
  Image image(pixels, pixels);
  for (int r = 0; r < pixels; ++r) {
    for (int c = 0; c < pixels; ++c) {
      const double x = (c + 0.5) / pixels;
      const double y = (r + 0.5) / pixels;
      const double ring = std::hypot(x - 0.3, y - 0.35);
      const bool letter = (x > 0.6 && x < 0.7 && y > 0.12 && y < 0.9) ||
                          (x > 0.6 && x < 0.9 && y > 0.12 && y < 0.2) ||
                          (x > 0.6 && x < 0.85 && y > 0.45 && y < 0.53);
      const bool dots = std::hypot(x - 0.3, y - 0.78) < 0.12 ||
                        std::hypot(x - 0.85, y - 0.75) < 0.055 ||
                        std::fabs(x - 0.48) + std::fabs(y - 0.62) < 0.06;
      const bool bar = x > 0.07 && x < 0.5 && y > 0.93 && y < 0.96;
      const bool white = (ring < 0.2 && ring > 0.09) || letter || dots || bar;
      image.at(c, r) = white ? 1.0F : 0.0F;
    }
  }
  return image;
}

/// Face centroids of the grid mesh of columns × 1.15 columns cells over a square picture, pixels.
inline Eigen::Matrix2Xd face_sites(int columns, int pixels) {
  const double side = pixels;
  const SurfaceMesh mesh = make_grid_mesh({side, side}, {columns + 1, columns * 115 / 100 + 1}, 0);
  Eigen::Matrix2Xd sites(2, mesh.triangle_count());
  for (Eigen::Index t = 0; t < sites.cols(); ++t) {
    sites.col(t) = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)).head<2>() / 3.0;
  }
  return sites;
}

/// Sites over the picture and a margin of `outside` of its size around it.
inline Eigen::Matrix2Xd random_sites(int count, const Eigen::Vector2d& size, double outside,
                                     Random& random) {
  Eigen::Matrix2Xd sites(2, count);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d share(random.between(-outside, 1.0 + outside),
                                random.between(-outside, 1.0 + outside));
    sites.col(i) = size.cwiseProduct(share);
  }
  return sites;
}

inline std::vector<int> numbers(Eigen::Index count) {
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

/// A power diagram in a stage, under one density.
template <class Exec>
struct MeasuredDiagram {
  CellEdges edges;
  CellStageOn<Exec> stage;

  MeasuredDiagram(const PowerDiagram& diagram, const SummedDensity& density, const Exec& executor)
      : edges(cell_edges(diagram, density.columns(), density.rows(), Executor::serial())),
        stage(diagram.sites(), executor) {
    stage.set_density(std::make_shared<SummedDensity>(density));
  }
  PowerCells cells() { return stage.measure(edges); }
  std::vector<Moments> moments() { return stage.moments(edges); }
};

inline PowerCells measure_cells(const PowerDiagram& diagram, const SummedDensity& density,
                                const Executor& executor) {
  return MeasuredDiagram(diagram, density, executor).cells();
}

inline std::vector<Moments> cell_moments(const PowerDiagram& diagram, const SummedDensity& density,
                                         const Executor& executor) {
  return MeasuredDiagram(diagram, density, executor).moments();
}

/// H(w) = Σ (−∫ (|x − c|² − w) ρ dx − wanted·w), convex; its gradient by w is mass − wanted
/// (Sun et al., 3.4 and Appendix C).
inline double transport_energy(const PowerDiagram& diagram, const std::vector<Moments>& cells,
                               const Eigen::VectorXd& wanted) {
  double energy = 0.0;
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    const Moments& m = cells[static_cast<std::size_t>(i)];
    const Eigen::Vector2d c = diagram.sites().col(i);
    const double w = diagram.weights()[i];
    const double cost = m.second - 2.0 * (c.x() * m.x + c.y() * m.y) + c.squaredNorm() * m.mass;
    energy += w * (m.mass - wanted[i]) - cost;
  }
  return energy;
}

/// The slow way to a power cell: the picture's rectangle cut by every half-plane.
inline Polygon power_cell(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& weights,
                          Eigen::Index i, int columns, int rows) {
  Polygon cell = {{0, 0}, {Real(columns), 0}, {Real(columns), Real(rows)}, {0, Real(rows)}};
  for (Eigen::Index j = 0; j < sites.cols() && !cell.empty(); ++j) {
    if (j == i) continue;
    cell = clip(cell, [&](const Point& p) {
      const auto power = [&](Eigen::Index k) {
        const Real x = p.x - sites(0, k);
        const Real y = p.y - sites(1, k);
        return x * x + y * y - weights[k];
      };
      return power(j) - power(i);
    });
  }
  return cell;
}

/// ∫x, ∫y and ∫(x² + y²) over a polygon, and its area, by triangles from the first corner.
inline Moments polygon_moments(const Polygon& polygon) {
  Moments sum;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
    const Polygon t = {polygon[0], polygon[k], polygon[k + 1]};
    const Real area = signed_area(t);
    // The three edge midpoints integrate quadratics exactly (Strang & Fix 1973).
    for (std::size_t e = 0; e < 3; ++e) {
      const Real x = 0.5L * (t[e].x + t[(e + 1) % 3].x);
      const Real y = 0.5L * (t[e].y + t[(e + 1) % 3].y);
      const Real share = area / 3.0L;
      sum += {double(share), double(share * x), double(share * y), double(share * (x * x + y * y))};
    }
  }
  return sum;
}

/// The slow way to what a cell holds: cut with every pixel.
inline Moments slow_moments(const Polygon& cell, const SummedDensity& density) {
  Moments sum;
  for (int r = 0; r < density.rows(); ++r) {
    const Polygon strip = clip_to_row(cell, r);
    if (strip.empty()) continue;
    for (int c = 0; c < density.columns(); ++c) {
      const Moments part = polygon_moments(clip_to_column(strip, c));
      const double value = density.view().pixel(c, r).value;
      sum += {value * part.mass, value * part.x, value * part.y, value * part.second};
    }
  }
  return sum;
}

}  // namespace lensforge::testing

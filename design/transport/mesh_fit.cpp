// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/mesh_fit.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/image/image.h"
#include "core/optics/light_path.h"
#include "design/flux/flux_image.h"
#include "design/flux/flux_triangle.h"
#include "design/optimize/grid_preconditioner.h"

namespace lensforge {
namespace {

/// Notation: φ = u − |x|²/2 on a grid of nodes with unit spacing, mirrored at the borders.
class Iteration {
 public:
  Iteration(const Image& picture, double floor)
      : columns_(picture.columns() + 1),
        rows_(picture.rows() + 1),
        picture_(picture),
        phi_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0.0),
        transform_(columns_, rows_) {
    const double mean = picture.total() / static_cast<double>(picture.values().size());
    scale_ = (1.0 - floor) / mean;
    floor_ = floor;
  }

  /// One step of the fixed-point iteration; returns the largest change of a landing point.
  double step() {
    const auto right = transform_.values();
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) right[index(c, r)] = laplacian_to_be(c, r) - 2.0;
    }
    transform_.solve_poisson();
    double change = 0.0;
    const std::vector<double> before = std::exchange(phi_, {right.begin(), right.end()});
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        change = std::max(change, (gradient(phi_, c, r) - gradient(before, c, r)).norm());
      }
    }
    return change;
  }

  [[nodiscard]] MongeAmpereResult result() const {
    MongeAmpereResult result;
    result.columns = columns_;
    result.rows = rows_;
    result.displacement.resize(2, static_cast<Eigen::Index>(phi_.size()));
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        result.displacement.col(static_cast<Eigen::Index>(index(c, r))) = gradient(phi_, c, r);
      }
    }
    return result;
  }

 private:
  [[nodiscard]] std::size_t index(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(c);
  }
  [[nodiscard]] static int mirror(int i, int n) {
    const int positive = std::abs(i);
    return positive < n ? positive : 2 * (n - 1) - positive;
  }
  [[nodiscard]] double at(const std::vector<double>& f, int c, int r) const {
    return f[index(mirror(c, columns_), mirror(r, rows_))];
  }
  [[nodiscard]] Eigen::Vector2d gradient(const std::vector<double>& f, int c, int r) const {
    return {0.5 * (at(f, c + 1, r) - at(f, c - 1, r)), 0.5 * (at(f, c, r + 1) - at(f, c, r - 1))};
  }

  /// Density of mean 1 with its floor at a point in pixel coordinates, bilinear between pixel
  /// centres.
  [[nodiscard]] double density(const Eigen::Vector2d& y) const {
    return floor_ + scale_ * bilinear(picture_, y);
  }

  [[nodiscard]] double laplacian_to_be(int c, int r) const {
    const double centre = at(phi_, c, r);
    const double xx = 1.0 + at(phi_, c + 1, r) - 2.0 * centre + at(phi_, c - 1, r);
    const double yy = 1.0 + at(phi_, c, r + 1) - 2.0 * centre + at(phi_, c, r - 1);
    const double xy = 0.25 * (at(phi_, c + 1, r + 1) - at(phi_, c - 1, r + 1) -
                              at(phi_, c + 1, r - 1) + at(phi_, c - 1, r - 1));
    const Eigen::Vector2d landing = Eigen::Vector2d(c, r) + gradient(phi_, c, r);
    return std::sqrt(xx * xx + yy * yy + 2.0 * xy * xy + 2.0 / density(landing));
  }

  int columns_;
  int rows_;
  const Image& picture_;
  double scale_;
  double floor_;
  std::vector<double> phi_;
  CosineTransform transform_;
};

}  // namespace

MongeAmpereResult solve_monge_ampere(const Image& picture, const MongeAmpereOptions& options,
                                     const RunControl& control) {
  Iteration iteration(picture, options.floor);
  double change = 0.0;
  int done = 0;
  bool converged = false;
  while (done < options.max_iterations && !converged && !control.stop_requested()) {
    change = iteration.step();
    ++done;
    converged = change <= options.tolerance;
    control.report({"transport", static_cast<double>(done),
                    static_cast<double>(options.max_iterations), "step " + std::to_string(done)});
  }
  MongeAmpereResult result = iteration.result();
  result.converged = converged;
  result.stopped = control.stop_requested();
  result.iterations = done;
  result.last_change = change;
  return result;
}

namespace {

/// Maximum density of vertices, in vertices per mean cell: the pixels between black and bright may
/// serve any image area.
constexpr double kMaxDense = 30.0;

/// Minimum share of its area that a triangle keeps, a third of what kMaxDense leaves. The transport
/// map is monotone, but its differences over a pixel may not be where the density jumps: a step to
/// the sixtyfold folded triangles over.
constexpr double kMinShrinkage = 0.01;

/// Maximum number of smoothing passes against that; one is enough for that step.
constexpr int kMaxSmoothing = 8;

/// See favour_dark().
constexpr double kDarkPower = 0.3;
constexpr double kDarkCost = 0.1;
constexpr int kDarkHalvings = 10;  ///< Halvings of the interval of p.

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

/// Samples a vector field on the pixels' corners, bilinear between them.
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

namespace {

/// A face's gradients of the three hat functions, 1/mm, and its projected area.
struct Hats {
  Eigen::Matrix<double, 2, 3> gradient;
  double area;
};

Hats hats(const SurfaceMesh& mesh, Eigen::Index face) {
  const auto corner = [&](int k) -> Eigen::Vector2d {
    return mesh.vertices.col(mesh.triangles(k % 3, face)).head<2>();
  };
  Hats result{.gradient = {}, .area = mesh.plan_area(face)};
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d opposite = corner(k + 2) - corner(k + 1);
    result.gradient.col(k) = Eigen::Vector2d(-opposite.y(), opposite.x()) / (2.0 * result.area);
  }
  return result;
}

using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

struct System {
  Matrix matrix;
  Eigen::VectorXd right;
};

System assemble(const SurfaceMesh& mesh, const Eigen::Matrix2Xd& gradients) {
  const Eigen::Index n = mesh.vertices.cols();
  System system{.matrix = Matrix(n, n), .right = Eigen::VectorXd::Zero(n)};
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(9 * mesh.triangles.cols()));
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    const Hats h = hats(mesh, f);
    const auto t = mesh.triangles.col(f);
    for (int i = 0; i < 3; ++i) {
      system.right[t[i]] += h.area * h.gradient.col(i).dot(gradients.col(f));
      for (int j = 0; j < 3; ++j) {
        entries.emplace_back(t[i], t[j], h.area * h.gradient.col(i).dot(h.gradient.col(j)));
      }
    }
  }
  system.matrix.setFromTriplets(entries.begin(), entries.end());
  return system;
}

/// Inverse Laplacian of the even grid, free of the mean. A node on the border stands for half a
/// cell; dividing by that makes the mirrored differences of the transform symmetric.
class EvenGridPoisson {
 public:
  explicit EvenGridPoisson(const GridShape& shape)
      : transform_(shape.columns, shape.rows),
        cells_(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(shape.columns) * shape.rows)) {
    auto grid = cells_.reshaped(shape.columns, shape.rows);
    grid.row(0) *= 0.5;
    grid.row(shape.columns - 1) *= 0.5;
    grid.col(0) *= 0.5;
    grid.col(shape.rows - 1) *= 0.5;
  }

  void apply(const Eigen::VectorXd& r, Eigen::VectorXd& z) {
    const auto values = transform_.values();
    Eigen::Map<Eigen::VectorXd> data(values.data(), r.size());
    data = -r.cwiseQuotient(cells_);
    transform_.solve_poisson();
    z = data.array() - data.mean();
  }

 private:
  CosineTransform transform_;
  Eigen::VectorXd cells_;  ///< Share of a cell that a node stands for.
};

/// Share of the way from a residual of 1 to the tolerance, on a logarithmic scale, 0 … 1.
double share_of_fit(double residual, double tolerance) {
  if (residual <= tolerance) return 1.0;
  const double share = std::log(residual) / std::log(tolerance);
  return share > 0.0 ? std::min(share, 1.0) : 0.0;
}

}  // namespace

HeightFitSummary fit_face_gradients(const Eigen::Matrix2Xd& gradients,
                                    const HeightFitOptions& options, const Executor& executor,
                                    SurfaceMesh& mesh, const RunControl& control) {
  const System system = assemble(mesh, gradients);
  const Eigen::Index n = system.right.size();
  EvenGridPoisson preconditioner(mesh.grid);
  const double mean = mesh.vertices.row(2).mean();
  Eigen::VectorXd x = mesh.vertices.row(2).transpose().array() - mean;
  Eigen::VectorXd product(n);
  const auto multiply = [&](const Eigen::VectorXd& v) {
    parallel_for(executor, "height fit", n,
                 [&](std::int64_t i) { product[i] = system.matrix.row(i).dot(v); });
  };
  multiply(x);
  const double scale = std::max(system.right.norm(), product.norm());
  Eigen::VectorXd r = system.right - product;
  Eigen::VectorXd z(n);
  preconditioner.apply(r, z);
  Eigen::VectorXd p = z;
  double rz = r.dot(z);
  HeightFitSummary summary;
  const auto measure = [&] {
    summary.residual = scale > 0.0 ? r.norm() / scale : 0.0;
    summary.converged = summary.residual <= options.tolerance;
    control.report({"heights", share_of_fit(summary.residual, options.tolerance), 1.0, ""});
  };
  measure();
  while (!summary.converged && summary.iterations < options.max_iterations) {
    multiply(p);
    const double alpha = rz / p.dot(product);
    x += alpha * p;
    r -= alpha * product;
    preconditioner.apply(r, z);
    const double before = rz;
    rz = r.dot(z);
    p = z + (rz / before) * p;
    ++summary.iterations;
    measure();
  }
  mesh.vertices.row(2) = (x.array() - x.mean() + mean).transpose();
  return summary;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// A two-dimensional cosine transform of the first kind (DCT-I) of a grid of nodes, in place, in a
/// buffer of its own. It diagonalises differences with mirrored ends (Neumann borders). DCT-I
/// because its lengths, 2(n − 1), are smooth numbers for our grids, while n is often prime (641).
/// Plans without timing, so every run uses the same algorithm and gives the same bits.
class CosineTransform {
 public:
  /// @pre columns, rows ≥ 2.
  CosineTransform(int columns, int rows);
  ~CosineTransform();
  CosineTransform(const CosineTransform&) = delete;
  CosineTransform& operator=(const CosineTransform&) = delete;

  /// The buffer, row by row.
  [[nodiscard]] std::span<double> values();
  /// Transforms the buffer. Two runs multiply it by inverse_scale()⁻¹.
  void run();
  /// 1 / (4 (columns − 1) (rows − 1)).
  [[nodiscard]] double inverse_scale() const;

  /// Replaces f in the buffer by the solution φ, of mean zero, of Δφ = f − mean(f): second
  /// differences at unit spacing, mirrored at the borders.
  void solve_poisson();

  /// Eigenvalue of the negative second difference along n nodes: (2 − 2 cos(πk/(n − 1)))/spacing².
  static double eigenvalue(int k, int n, double spacing);
  /// All n eigenvalues.
  static std::vector<double> eigenvalues(int n, double spacing);

 private:
  struct Plan;
  std::unique_ptr<Plan> plan_;
  int columns_;
  int rows_;
};

/// The same transform along rows only, in place, for planes of one size. Rows and then columns make
/// the transform of a plane.
class CosineRows {
 public:
  /// @pre length ≥ 2, rows ≥ 0.
  CosineRows(int length, int rows);
  ~CosineRows();
  CosineRows(const CosineRows&) = delete;
  CosineRows& operator=(const CosineRows&) = delete;

  /// Transforms rows · length values, row by row. Thread-safe for different planes.
  void run(double* plane) const;

 private:
  struct Plan;
  std::unique_ptr<Plan> plan_;
};

/// Three cosine transforms of one size, one per coordinate, in the memory of an executor. Executors
/// have their own implementations: FFTW on the CPU, cuFFT on a GPU.
template <class Exec>
class GridTransforms;

template <>
class GridTransforms<Executor> {
 public:
  /// @pre columns, rows ≥ 2.
  GridTransforms(int columns, int rows, const Executor& executor)
      : executor_(executor),
        transforms_{CosineTransform(columns, rows), CosineTransform(columns, rows),
                    CosineTransform(columns, rows)} {}

  /// Values of coordinate k, row by row.
  [[nodiscard]] double* plane(int k) {
    return transforms_[static_cast<std::size_t>(k)].values().data();
  }
  /// Transforms all three planes in place.
  void run() {
    parallel_for(
        executor_, "cosine transform", 3,
        [this](std::int64_t k) { transforms_[static_cast<std::size_t>(k)].run(); }, 1);
  }

 private:
  Executor executor_;
  std::array<CosineTransform, 3> transforms_;
};

/// Three grids and their even extensions: a grid of n nodes is mirrored to 2(n − 1) nodes, whose
/// discrete Fourier transform is real and equals the cosine transform (DCT-I) of the n nodes.
struct EvenExtension {
  int columns;
  int rows;

  [[nodiscard]] LF_HD int extended_columns() const { return 2 * (columns - 1); }
  [[nodiscard]] LF_HD int extended_rows() const { return 2 * (rows - 1); }
  [[nodiscard]] LF_HD std::int64_t nodes() const {
    return static_cast<std::int64_t>(columns) * rows;
  }
  [[nodiscard]] LF_HD std::int64_t extended_nodes() const {
    return static_cast<std::int64_t>(extended_columns()) * extended_rows();
  }
  /// Number of complex coefficients that a transform of real values stores for an extended grid:
  /// half of every row and its middle, `columns` per row.
  [[nodiscard]] LF_HD std::int64_t coefficients() const {
    return static_cast<std::int64_t>(columns) * extended_rows();
  }
  /// Node of the grid that node i of the extended grid mirrors.
  [[nodiscard]] LF_HD static int mirrored(int i, int n) { return i < n ? i : 2 * (n - 1) - i; }
};

/// Fills a node of an extended grid.
struct ExtendNode {
  EvenExtension size;
  const double* planes;
  double* extended;

  LF_HD void operator()(std::int64_t i) const {
    const std::int64_t plane = i / size.extended_nodes();
    const auto node = static_cast<int>(i % size.extended_nodes());
    const int c = EvenExtension::mirrored(node % size.extended_columns(), size.columns);
    const int r = EvenExtension::mirrored(node / size.extended_columns(), size.rows);
    extended[i] = planes[plane * size.nodes() + static_cast<std::int64_t>(r) * size.columns + c];
  }
};

/// Extracts a cosine coefficient from the extended grid's complex coefficients.
struct TakeCoefficient {
  EvenExtension size;
  const double* coefficients;  ///< Real and imaginary parts in turn.
  double* planes;

  LF_HD void operator()(std::int64_t i) const {
    const std::int64_t plane = i / size.nodes();
    const std::int64_t node = i % size.nodes();  // The first rows of both have the same length.
    planes[i] = coefficients[2 * (plane * size.coefficients() + node)];
  }
};

/// GridTransforms by Fourier transforms of the even extensions, for executors whose library has no
/// cosine transform. @tparam Fourier  constructed from (extension, planes, executor); run(in, out)
/// transforms `planes` extended grids of real values into complex coefficients.
template <class Exec, class Fourier>
class ExtendedTransforms {
 public:
  /// @pre columns, rows ≥ 2.
  ExtendedTransforms(int columns, int rows, const Exec& executor)
      : executor_(executor),
        size_{columns, rows},
        planes_(count(size_.nodes())),
        extended_(count(size_.extended_nodes())),
        coefficients_(2 * count(size_.coefficients())),
        fourier_(size_, kPlanes, executor) {}

  [[nodiscard]] double* plane(int k) { return planes_.data() + k * size_.nodes(); }

  void run() {
    parallel_for(executor_, "extend evenly", kPlanes * size_.extended_nodes(),
                 ExtendNode{size_, planes_.data(), extended_.data()});
    fourier_.run(extended_.data(), coefficients_.data());
    parallel_for(executor_, "take coefficients", kPlanes * size_.nodes(),
                 TakeCoefficient{size_, coefficients_.data(), planes_.data()});
  }

 private:
  using Vector = typename Exec::template Buffer<double>;
  static constexpr int kPlanes = 3;

  static std::size_t count(std::int64_t per_plane) {
    return static_cast<std::size_t>(kPlanes * per_plane);
  }

  Exec executor_;
  EvenExtension size_;
  Vector planes_;
  Vector extended_;
  Vector coefficients_;
  Fourier fourier_;
};

/// A preconditioner's factor for one coordinate, a function of the grid Laplacian's eigenvalue λ
/// (1/cell², cells of the mesh's columns). All parameters are ≥ 0.
struct GridSymbol {
  double scale = 1.0;   ///< s
  double floor = 0.0;   ///< μ
  double power = 2.0;   ///< p
  double growth = 0.0;  ///< γ: the symbol is s / ((μ + λ)^p (1 + γλ)).
};

/// Arguments of the preconditioner's kernels: raw arrays in the memory of an executor. The planes
/// hold one coordinate each, row by row, in the basis in which the transform is orthogonal.
struct PreconditionerView {
  int columns;
  int rows;
  const double* movable;  ///< 3 × V
  const double* reach;    ///< 3 × V
  const double* eigen_x;  ///< Eigenvalues of the second differences along a row.
  const double* eigen_y;
  GridSymbol symbols[3];  ///< Of x, y and z.
  double exponent;        ///< Power of the preconditioner to apply.
  double* planes[3];
  std::int64_t first_row = 0;  ///< First row in the arrays, if they hold a part of the grid.

  [[nodiscard]] LF_HD int row(std::int64_t v) const {
    return static_cast<int>(first_row) + static_cast<int>(v) / columns;
  }
  [[nodiscard]] LF_HD int column(std::int64_t v) const { return static_cast<int>(v) % columns; }

  /// √ of the end weights ½, 1, …, 1, ½ in which the cosine transform is orthogonal.
  [[nodiscard]] LF_HD static double root_end_weight(int i, int n) {
    return i == 0 || i == n - 1 ? std::numbers::sqrt2 / 2.0 : 1.0;
  }
  [[nodiscard]] LF_HD double weight(std::int64_t v) const {
    return root_end_weight(column(v), columns) * root_end_weight(row(v), rows);
  }
  /// Factor on coordinate k of a vertex, 0 if it is held.
  [[nodiscard]] LF_HD double freedom(std::int64_t v, int k) const {
    const double far = reach[3 * v + k];
    return movable[3 * v + k] * (exponent == 1.0 ? far : std::pow(far, exponent));
  }
};

/// Gradient of a vertex → planes.
struct EnterPlanes {
  PreconditionerView p;
  const double* g;

  LF_HD void operator()(std::int64_t v) const {
    for (int k = 0; k < 3; ++k) p.planes[k][v] = p.freedom(v, k) * g[3 * v + k] / p.weight(v);
  }
};

/// Multiplies a coefficient of every transformed plane by its symbol.
struct ScaleCoefficient {
  PreconditionerView p;
  double normalize[3];  ///< s^exponent, and the scale of the transform and its inverse.

  LF_HD void operator()(std::int64_t v) const {
    const double lambda = p.eigen_x[p.column(v)] + p.eigen_y[p.row(v)];
    for (int k = 0; k < 3; ++k) {
      const GridSymbol& symbol = p.symbols[k];
      const double decay = inverse_power(symbol.floor + lambda, symbol.power * p.exponent);
      const double growth = inverse_power(1.0 + symbol.growth * lambda, p.exponent);
      p.planes[k][v] *= normalize[k] * decay * growth;
    }
  }

 private:
  /// base^−power. Common powers avoid std::pow(), which takes 5 % of an iteration.
  LF_HD static double inverse_power(double base, double power) {
    if (base == 1.0) return 1.0;
    if (power == 1.0) return 1.0 / base;
    return power == 2.0 ? 1.0 / (base * base) : std::pow(base, -power);
  }
};

/// Planes → step of a vertex.
struct LeavePlanes {
  PreconditionerView p;
  double* r;

  LF_HD void operator()(std::int64_t v) const {
    for (int k = 0; k < 3; ++k) r[3 * v + k] = p.freedom(v, k) * p.planes[k][v] * p.weight(v);
  }
};

/// Approximate inverse Hessian P on a grid mesh, diagonal under the discrete cosine transform: for
/// the heights (Δ + μ)⁻², since brightness is to first order a second derivative of height; for x
/// and y a weaker smoothing. Symmetric positive definite on the coordinates that may move. Vectors
/// have 3 V numbers, x y z of each vertex in turn, in the executor's memory.
template <class Exec>
class GridPreconditionerOn {
 public:
  /// @param aspect  cell height ÷ cell width. @param movable  3 × V of ones and zeros.
  GridPreconditionerOn(const GridShape& shape, double aspect, const Eigen::Matrix3Xd& movable,
                       const Exec& executor)
      : shape_(shape),
        executor_(executor),
        movable_(buffer_of(
            executor,
            std::span<const double>(movable.data(), static_cast<std::size_t>(movable.size())))),
        reach_(static_cast<std::size_t>(movable.size())),
        eigen_x_(eigenvalues(shape.columns, 1.0, executor)),
        eigen_y_(eigenvalues(shape.rows, aspect, executor)),
        transforms_(shape.columns, shape.rows, executor) {
    set_reach(Eigen::Matrix3Xd::Ones(3, movable.cols()));
  }

  GridSymbol xy;
  GridSymbol z;

  /// Relative step of each coordinate of each vertex, 3 × V factors > 0, initially 1: a step that
  /// suits a large cell turns a small one over. In the caller's memory.
  void set_reach(const Eigen::Matrix3Xd& reach) {
    upload(executor_, std::span<const double>(reach.data(), reach_.size()),
           std::span<double>(reach_.data(), reach_.size()));
  }

  /// Coordinates that may move, 3 × V of 1 and 0, from the caller's memory.
  void set_movable(const Eigen::Matrix3Xd& movable) {
    upload(executor_, std::span<const double>(movable.data(), movable_.size()),
           std::span<double>(movable_.data(), movable_.size()));
  }

  /// r ← P^exponent g; for an exponent other than 1 it is exact only if no coordinate is held and
  /// all factors of set_reach() are equal.
  void apply(std::span<const double> g, double exponent, std::span<double> r) {
    const PreconditionerView p = view(exponent);
    const std::int64_t vertices = static_cast<std::int64_t>(reach_.size() / 3);
    parallel_for(executor_, "enter planes", vertices, EnterPlanes{p, g.data()});
    transforms_.run();
    const double scale_xy = std::pow(xy.scale, exponent) * inverse_scale();
    const double scale_z = std::pow(z.scale, exponent) * inverse_scale();
    parallel_for(executor_, "scale coefficients", vertices,
                 ScaleCoefficient{p, {scale_xy, scale_xy, scale_z}});
    transforms_.run();
    parallel_for(executor_, "leave planes", vertices, LeavePlanes{p, r.data()});
  }

 private:
  using Vector = typename Exec::template Buffer<double>;

  static Vector eigenvalues(int n, double spacing, const Exec& executor) {
    const std::vector<double> values = CosineTransform::eigenvalues(n, spacing);
    return buffer_of(executor, std::span<const double>(values));
  }
  /// Scale of a transform and its inverse.
  [[nodiscard]] double inverse_scale() const {
    return 1.0 / (4.0 * (shape_.columns - 1.0) * (shape_.rows - 1.0));
  }
  [[nodiscard]] PreconditionerView view(double exponent) {
    return {shape_.columns,
            shape_.rows,
            movable_.data(),
            reach_.data(),
            eigen_x_.data(),
            eigen_y_.data(),
            {xy, xy, z},
            exponent,
            {transforms_.plane(0), transforms_.plane(1), transforms_.plane(2)}};
  }

  GridShape shape_;
  Exec executor_;
  Vector movable_;
  Vector reach_;
  Vector eigen_x_;
  Vector eigen_y_;
  GridTransforms<Exec> transforms_;
};

extern template class GridPreconditionerOn<Executor>;

/// Vertices on each side over which levelling_factors() averages. With a radius of 1 the means
/// follow the probes' noise (128² portrait, facets, MAE after 600 iterations: 0.0030; with 2 to 8:
/// 0.0021 to 0.0024).
inline constexpr int kLevellingRadius = 6;

/// Maximum of the factors and of their inverses.
inline constexpr double kMaxLevelling = 3.0;

/// Factors on the vertices' reach (GridPreconditionerOn::set_reach()) that make the preconditioned
/// curvature about the same everywhere on a grid. Reach enters that curvature squared.
/// @param squares  V squares, ≥ 0, of preconditioned curvatures from random probes. They are
///                 averaged over (2 kLevellingRadius + 1)² vertices, fewer at the border.
/// @return V factors around 1.
Eigen::ArrayXd levelling_factors(const Eigen::VectorXd& squares, const GridShape& shape);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"

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

}  // namespace lensforge

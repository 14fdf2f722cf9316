// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"

namespace lensforge {

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
  /// Complex coefficients that a transform of real values keeps of an extended grid: half of every
  /// row and its middle, which is columns of them.
  [[nodiscard]] LF_HD std::int64_t coefficients() const {
    return static_cast<std::int64_t>(columns) * extended_rows();
  }
  /// Node of the grid that node i of n extended ones mirrors.
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

/// Takes a cosine coefficient out of the extended grid's complex ones.
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
/// cosine transform. @tparam Fourier  made from (extension, planes, executor); run(in, out) then
/// transforms that many extended grids of real values into complex coefficients.
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

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <vector>

namespace lensforge {

/// A two-dimensional cosine transform of the first kind (DCT-I) of a grid of nodes, in place, in a
/// buffer of its own. It diagonalises differences with mirrored ends (Neumann borders). DCT-I
/// because its lengths, 2(n − 1), are smooth numbers for our grids, while n is often prime (641).
/// Plans without timing, so that every run takes the same path and gives the same bits.
class CosineTransform {
 public:
  /// @pre columns, rows ≥ 2.
  CosineTransform(int columns, int rows);
  ~CosineTransform();
  CosineTransform(const CosineTransform&) = delete;
  CosineTransform& operator=(const CosineTransform&) = delete;

  /// The buffer, row by row.
  [[nodiscard]] std::span<double> values();
  /// Transforms the buffer. Doing it twice multiplies by inverse_scale()⁻¹.
  void run();
  /// 1 / (4 (columns − 1) (rows − 1)).
  [[nodiscard]] double inverse_scale() const;

  /// Replaces f in the buffer by the solution of Δφ = f − mean(f) of mean zero: second differences
  /// at unit spacing, mirrored at the borders.
  void solve_poisson();

  /// Eigenvalue of the negative second difference along n nodes: (2 − 2 cos(πk/(n − 1)))/spacing².
  static double eigenvalue(int k, int n, double spacing);
  /// All n of them.
  static std::vector<double> eigenvalues(int n, double spacing);

 private:
  struct Plan;
  std::unique_ptr<Plan> plan_;
  int columns_;
  int rows_;
};

/// The same transform along rows only, each for itself, in place, of planes of one size. Rows, then
/// columns make the transform of a plane.
class CosineRows {
 public:
  /// @pre length ≥ 2, rows ≥ 0.
  CosineRows(int length, int rows);
  ~CosineRows();
  CosineRows(const CosineRows&) = delete;
  CosineRows& operator=(const CosineRows&) = delete;

  /// Transforms rows · length values, row by row. May run for several planes at the same time.
  void run(double* plane) const;

 private:
  struct Plan;
  std::unique_ptr<Plan> plan_;
};

}  // namespace lensforge

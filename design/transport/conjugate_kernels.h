// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>

#include "core/compute/host_device.h"
#include "design/transport/cell_kernels.h"

/// Conjugate gradients on the graph of cells, scaled by the diagonal: one cell of each step.
/// Notation: L x = b; r = b − L x; D the diagonal of L; p the search direction, q = L p.
namespace lensforge {

/// An edge's weight in L, for both of its cells; and D⁻¹, 0 for a cell without any.
struct FillRow {
  const std::int32_t* first;
  const CellSide* sides;
  const EdgeMeasure* edges;
  double even;  ///< Density that is added everywhere.
  double* weights;
  double* inverse_diagonal;

  LF_HD void operator()(std::int64_t i) const {
    double sum = 0.0;
    for (std::int32_t k = first[i]; k < first[i + 1]; ++k) {
      const EdgeMeasure& edge = edges[sides[k].edge()];
      weights[k] = edge.coupling + even * edge.even_coupling;
      sum += weights[k];
    }
    inverse_diagonal[i] = sum > 0.0 ? 1.0 / sum : 0.0;
  }
};

/// L by rows.
struct GraphRows {
  const std::int32_t* first;
  const CellSide* sides;
  const double* weights;
};

/// Terms of r·r and r·D⁻¹r.
struct ResidualSizes {
  const double* r;
  const double* inverse_diagonal;

  LF_HD std::array<double, 2> operator()(std::int64_t i) const {
    return {r[i] * r[i], r[i] * r[i] * inverse_diagonal[i]};
  }
};

/// p ← D⁻¹r + turn p
struct TurnDirection {
  const double* r;
  const double* inverse_diagonal;
  double turn;
  double* p;

  LF_HD void operator()(std::int64_t i) const { p[i] = inverse_diagonal[i] * r[i] + turn * p[i]; }
};

/// q ← L p; the term of p·q.
struct MultiplyRow {
  GraphRows rows;
  const double* p;
  double* q;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    double sum = 0.0;
    for (std::int32_t k = rows.first[i]; k < rows.first[i + 1]; ++k) {
      sum += rows.weights[k] * (p[i] - p[rows.sides[k].neighbour]);
    }
    q[i] = sum;
    return {p[i] * sum};
  }
};

/// x ← x + step p, r ← r − step q; the terms of the new r·r and r·D⁻¹r.
struct TakeStep {
  double step;
  const double* p;
  const double* q;
  const double* inverse_diagonal;
  double* x;
  double* r;

  LF_HD std::array<double, 2> operator()(std::int64_t i) const {
    x[i] += step * p[i];
    r[i] -= step * q[i];
    return ResidualSizes{r, inverse_diagonal}(i);
  }
};

}  // namespace lensforge

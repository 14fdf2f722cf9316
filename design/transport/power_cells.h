// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/image/image.h"
#include "design/transport/power_diagram.h"

namespace lensforge {

/// Mass and moments of a part of a picture: ∫ρ, ∫ρx, ∫ρy and ∫ρ(x² + y²), x and y in pixels.
struct Moments {
  double mass = 0.0;
  double x = 0.0;
  double y = 0.0;
  double second = 0.0;

  LF_HD Moments& operator+=(const Moments& other) {
    mass += other.mass;
    x += other.x;
    y += other.y;
    second += other.second;
    return *this;
  }
  LF_HD Moments& operator-=(const Moments& other) {
    mass -= other.mass;
    x -= other.x;
    y -= other.y;
    second -= other.second;
    return *this;
  }
};

/// A pixel's ρ and, at its left side, ∫ρ dx, ∫ρx dx and ∫ρx² dx from the left border.
struct DensityPixel {
  double value = 0.0;
  double mass = 0.0;
  double first = 0.0;
  double second = 0.0;
};

/// ∫ over heights y0 … y1 of a row whose integrals over all of x are `row`.
LF_HD inline Moments density_strip(const DensityPixel& row, double y0, double y1) {
  const double height = y1 - y0;
  const double middle = 0.5 * (y0 + y1);
  const double squares = height * (middle * middle + height * height / 12.0);
  return {row.mass * height, row.first * height, row.mass * height * middle,
          row.second * height + row.mass * squares};
}

/// A SummedDensity's arrays, for kernels.
struct DensityView {
  int columns;
  int rows;
  const DensityPixel* pixels;    ///< Row by row.
  const DensityPixel* row_ends;  ///< Per row: the integrals at x = columns.
  const Moments* border;         ///< right_border() at every whole y, rows + 1 of them.

  [[nodiscard]] LF_HD double total() const { return border[rows].mass; }
  [[nodiscard]] LF_HD const DensityPixel& pixel(int column, int row) const {
    return pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                  static_cast<std::size_t>(column)];
  }
  /// ∮ along the right border from y = 0 to `y`: everything between those heights.
  /// @pre 0 ≤ y ≤ rows.
  [[nodiscard]] LF_HD Moments right_border(double y) const {
    int row = static_cast<int>(y);
    row = row < 0 ? 0 : (row >= rows ? rows - 1 : row);
    Moments sum = border[row];
    sum += density_strip(row_ends[row], row, y);
    return sum;
  }
};

/// A density ρ, constant on every pixel [c, c+1] × [r, r+1] and zero outside the picture, with its
/// integrals along rows from the left border. By Green's theorem they give the integral over a
/// polygon by a walk along its edges, ∫ρ dA = ∮ F dy with F(x, y) = ∫₀ˣ ρ(x′, y) dx′.
class SummedDensity {
 public:
  /// Scales `picture` so that its integral is `total`.
  /// @pre all values are finite and not negative; their sum and `total` are positive.
  SummedDensity(const Image& picture, double total);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  /// Integral over the whole picture.
  [[nodiscard]] double total() const { return border_.back().mass; }

  /// The arrays of DensityView.
  [[nodiscard]] std::span<const DensityPixel> pixels() const { return pixels_; }
  [[nodiscard]] std::span<const DensityPixel> row_ends() const { return row_ends_; }
  [[nodiscard]] std::span<const Moments> border() const { return border_; }
  [[nodiscard]] DensityView view() const {
    return {columns_, rows_, pixels_.data(), row_ends_.data(), border_.data()};
  }

 private:
  int columns_;
  int rows_;
  std::vector<DensityPixel> pixels_;
  std::vector<DensityPixel> row_ends_;
  std::vector<Moments> border_;
};

/// One of a cell's edges.
struct CellSide {
  std::int32_t code;       ///< The edge's number; its complement if the cell is on the right.
  std::int32_t neighbour;  ///< The cell on the other side.

  [[nodiscard]] LF_HD bool on_left() const { return code >= 0; }
  [[nodiscard]] LF_HD std::int32_t edge() const { return code >= 0 ? code : ~code; }
};

/// Edges of a power diagram and their assignment to cells: all that a device needs of it.
struct CellEdges {
  std::vector<DualEdge> edges;
  /// Cell i has sides first[i] … first[i + 1] − 1, in the order of the edges.
  std::vector<std::int32_t> first;
  std::vector<CellSide> sides;
  /// The cell at (columns, rows), the right border's far end. Green's theorem leaves that border
  /// out, so a cell's part of it is known only where edges cross it.
  int corner = 0;
};

/// Returns the edges for measuring under densities of columns × rows pixels.
CellEdges cell_edges(const PowerDiagram& diagram, int columns, int rows, const Executor& executor);

/// Crossing of an edge that leaves (+1) or enters (−1) the half-plane left of the picture's right
/// border.
struct BorderCrossing {
  int direction = 0;
  double y = 0.0;
};

/// Ends on the border count as outside, so that the edges that share an end agree.
LF_HD inline BorderCrossing right_crossing(const DualEdge& edge, double columns) {
  const bool from_inside = edge.from.x() < columns;
  const bool to_inside = edge.to.x() < columns;
  if (from_inside == to_inside) return {};
  const double share = (columns - edge.from.x()) / (edge.to.x() - edge.from.x());
  return {from_inside ? 1 : -1, edge.from.y() + share * (edge.to.y() - edge.from.y())};
}

/// Contents of the cells of a power diagram cut to the picture.
struct PowerCells {
  std::vector<double> mass;  ///< Per site, ∫ρ over its cell.
  std::vector<double> area;  ///< Per site, the part of the picture in its cell, pixels².
};

/// The numerical half of transport on one device, for fixed sites: everything but the
/// triangulation, which needs exact predicates and runs on the CPU. Each diagram's edges go to the
/// device; numbers of the cells come back.
class CellStage {
 public:
  CellStage() = default;
  virtual ~CellStage() = default;
  CellStage(const CellStage&) = delete;
  CellStage& operator=(const CellStage&) = delete;

  /// Sets the density to measure; called first.
  virtual void set_density(std::shared_ptr<const SummedDensity> density) = 0;
  [[nodiscard]] virtual const SummedDensity& density() const = 0;

  /// Masses and areas. The same bits for any number of threads.
  virtual PowerCells measure(const CellEdges& edges) = 0;

  /// Mass, first and second moments of every cell, for centroids and the energy.
  virtual std::vector<Moments> moments(const CellEdges& edges) = 0;

  /// Change of the weights that changes the masses by `residual` to first order: solves L δ =
  /// residual, L = ∂mass/∂w, to kDirectionTolerance of the residual.
  /// @pre `edges` were the last to be measured. @return not finite if it cannot be found.
  virtual Eigen::VectorXd newton_direction(const CellEdges& edges,
                                           const Eigen::VectorXd& residual) = 0;
};

/// Residual of an iterated Newton direction. It takes as many steps as exact directions (58,880
/// sites: 31 on a photograph, 56 on the logo); a tenth of it costs a third more time.
inline constexpr double kDirectionTolerance = 1e-2;

/// Number of sites above which Newton directions are iterated instead of factorised, and a GPU is
/// worth its transfers. Processor seconds of a Newton system on 2 cores, iterated against CHOLMOD:
/// equal at 14,720 sites, 0.08 against 0.2 at 58,880, 1.1 against 4 at 942,080.
inline constexpr int kDirectLimit = 12000;

/// The stage on the executor's device; few sites stay on the CPU.
/// @param sites  2 × n, pixels. @throw RunError if a GPU's memory is too small.
std::unique_ptr<CellStage> make_cell_stage(const Eigen::Matrix2Xd& sites, const Executor& executor);

#if defined(LENSFORGE_CUDA)
std::unique_ptr<CellStage> make_cuda_cell_stage(const Eigen::Matrix2Xd& sites,
                                                const Executor& executor);
#endif

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/error.h"
#include "design/flux/flux_triangle.h"
#include "design/transport/power_cells.h"

namespace lensforge {

// Contribution of one edge of a power diagram to its two cells, and each cell's sum of them. An
// edge is walked through the pixels that it crosses; no cell is ever cut with a pixel. Every cell
// adds up its own edges in their order, so all executors give the same bits.

/// Contribution of an edge to the cell on its left; the cell on its right gets the opposite. During
/// the walk `coupling` is ∫ρ dℓ and `even_coupling` is ∫dℓ.
struct EdgeMeasure {
  double mass = 0.0;
  double area = 0.0;
  double coupling = 0.0;  ///< −∂mass_left/∂w_right = ∫ρ dℓ / (2 |c_left − c_right|).
  double even_coupling = 0.0;  ///< `coupling` for a density of 1.

  LF_HD void add_piece(const DensityPixel& pixel, const EdgePiece& piece) {
    const double dx = piece.x1 - piece.x0;
    const double dy = piece.y1 - piece.y0;
    const double middle = 0.5 * (piece.x0 + piece.x1) - piece.column;
    mass += dy * (pixel.mass + pixel.value * middle);
    area += dy * (piece.column + middle);
    const double piece_length = std::sqrt(dx * dx + dy * dy);
    even_coupling += piece_length;
    coupling += pixel.value * piece_length;
  }
  LF_HD void add_border(const DensityView& density, double y, double sign) {
    mass += sign * density.right_border(y).mass;
    area += sign * density.columns * y;
  }
};

struct EdgeMoments {
  Moments moments;

  /// F ρ-integrals at x within the pixel, times dy; two Gauss points are exact for these cubics.
  LF_HD void add_piece(const DensityPixel& pixel, const EdgePiece& piece) {
    const double half = 0.5 * (piece.y1 - piece.y0);
    constexpr double kGauss = 0.57735026918962576451;
    for (const double node : {-kGauss, kGauss}) {
      const double share = 0.5 * (1.0 + node);
      const double x = piece.x0 + share * (piece.x1 - piece.x0);
      const double y = piece.y0 + share * (piece.y1 - piece.y0);
      const double c = piece.column;
      const double mass = pixel.mass + pixel.value * (x - c);
      const double first = pixel.first + 0.5 * pixel.value * (x - c) * (x + c);
      const double second =
          pixel.second + pixel.value * (x - c) * (x * x + x * c + c * c) * (1.0 / 3.0);
      moments += {half * mass, half * first, half * mass * y, half * (second + mass * y * y)};
    }
  }
  LF_HD void add_border(const DensityView& density, double y, double sign) {
    const Moments border = density.right_border(y);
    if (sign > 0.0) {
      moments += border;
    } else {
      moments -= border;
    }
  }
};

template <class Contribution>
LF_HD Contribution walk_cell_edge(const DualEdge& edge, const DensityView& density) {
  Contribution sum;
  const double columns = density.columns;
  if (edge.from.x() >= columns && edge.to.x() >= columns) return sum;
  walk_edge(edge.from, edge.to, density.columns, density.rows, [&](const EdgePiece& piece) {
    if (piece.column >= 0) sum.add_piece(density.pixel(piece.column, piece.row), piece);
  });
  // The left cell of an edge that leaves begins there on the border; its neighbour ends.
  const BorderCrossing crossing = right_crossing(edge, columns);
  if (crossing.direction != 0 && crossing.y >= 0.0 && crossing.y < density.rows) {
    sum.add_border(density, crossing.y, -crossing.direction);
  }
  return sum;
}

/// A power diagram and its density in the memory of an executor.
struct CellView {
  const double* sites;  ///< 2 × cells
  const DualEdge* edges;
  const std::int32_t* first;
  const CellSide* sides;
  int corner;
  DensityView density;
};

struct MeasureEdge {
  CellView cells;
  EdgeMeasure* out;

  LF_HD void operator()(std::int64_t e) const {
    const DualEdge& edge = cells.edges[e];
    auto sum = walk_cell_edge<EdgeMeasure>(edge, cells.density);
    if (sum.even_coupling > 0.0) {
      const double* left = cells.sites + 2 * static_cast<std::int64_t>(edge.left);
      const double* right = cells.sites + 2 * static_cast<std::int64_t>(edge.right);
      const double dx = left[0] - right[0];
      const double dy = left[1] - right[1];
      const double scale = 0.5 / std::sqrt(dx * dx + dy * dy);
      sum.coupling *= scale;
      sum.even_coupling *= scale;
    }
    out[e] = sum;
  }
};

struct MeasureCell {
  CellView cells;
  const EdgeMeasure* edges;
  double* mass;
  double* area;

  LF_HD void operator()(std::int64_t i) const {
    const bool corner = i == cells.corner;
    double mass_sum = corner ? cells.density.total() : 0.0;
    double area_sum =
        corner ? static_cast<double>(cells.density.columns) * cells.density.rows : 0.0;
    for (std::int32_t k = cells.first[i]; k < cells.first[i + 1]; ++k) {
      const CellSide side = cells.sides[k];
      const EdgeMeasure& edge = edges[side.edge()];
      mass_sum += side.on_left() ? edge.mass : -edge.mass;
      area_sum += side.on_left() ? edge.area : -edge.area;
    }
    mass[i] = mass_sum;
    area[i] = area_sum;
  }
};

struct FindEdgeMoments {
  CellView cells;
  EdgeMoments* out;

  LF_HD void operator()(std::int64_t e) const {
    out[e] = walk_cell_edge<EdgeMoments>(cells.edges[e], cells.density);
  }
};

struct FindCellMoments {
  CellView cells;
  const EdgeMoments* edges;
  Moments* out;

  LF_HD void operator()(std::int64_t i) const {
    Moments sum;
    if (i == cells.corner) sum += cells.density.right_border(cells.density.rows);
    for (std::int32_t k = cells.first[i]; k < cells.first[i + 1]; ++k) {
      const CellSide side = cells.sides[k];
      const Moments& edge = edges[side.edge()].moments;
      if (side.on_left()) {
        sum += edge;
      } else {
        sum -= edge;
      }
    }
    out[i] = sum;
  }
};

// Conjugate gradients on the graph of cells, scaled by the diagonal: one cell of each step.
// Notation: L x = b; r = b − L x; D the diagonal of L; p the search direction, q = L p.

/// Weights of a cell's edges in L, and D⁻¹; 0 for a cell without weights.
struct FillRow {
  const std::int32_t* first;
  const CellSide* sides;
  const EdgeMeasure* edges;
  double even;  ///< Density added everywhere.
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

/// Share of the mass that is spread evenly over the density for L. Borders within black do not
/// couple their cells, and whole groups of cells would be disconnected from the others. Masses are
/// not affected; only a step's direction depends on it.
inline constexpr double kCouplingFloor = 1e-9;

/// Newton direction by factorisation, from edges in the caller's memory.
Eigen::VectorXd factorised_direction(std::span<const DualEdge> edges,
                                     std::span<const EdgeMeasure> measures, double even,
                                     const Eigen::VectorXd& right);

/// Newton directions on an executor. The CPU factorises or uses multigrid, whose set-up runs from
/// node to node and whose coarse levels are small. Other executors use conjugate gradients scaled
/// by the diagonal, which need no set-up and consist of sums over long vectors: 400 iterations on
/// average for the 51,200 sites of a 128² design.
template <class Exec>
class NewtonSystem {
 public:
  NewtonSystem(std::size_t cells, const Exec& executor)
      : executor_(executor),
        inverse_diagonal_(cells),
        solution_(cells),
        residual_(cells),
        direction_(cells),
        image_(cells) {}

  /// @param edges  in the caller's memory; `measures` and `cells` are in the executor's.
  Eigen::VectorXd solve(const CellView& cells, std::span<const DualEdge> edges,
                        std::span<const EdgeMeasure> measures, double even,
                        const Eigen::VectorXd& right) {
    if (weights_.size() < 2 * edges.size()) weights_ = Vector(2 * edges.size());
    each_cell("newton rows", FillRow{cells.first, cells.sides, measures.data(), even,
                                     weights_.data(), inverse_diagonal_.data()});
    fill_zero(executor_, solution_);
    fill_zero(executor_, direction_);
    upload(executor_, numbers(right), std::span<double>(residual_.data(), residual_.size()));
    if (!iterate(GraphRows{cells.first, cells.sides, weights_.data()})) {
      // For disconnected cells; no Newton step meets them.
      std::vector<EdgeMeasure> here(measures.size());
      download(executor_, measures, std::span<EdgeMeasure>(here));
      return factorised_direction(edges, here, even, right);
    }
    Eigen::VectorXd result(right.size());
    download(executor_, std::span<const double>(solution_.data(), solution_.size()),
             std::span<double>(result.data(), solution_.size()));
    return result;
  }

 private:
  using Vector = typename Exec::template Buffer<double>;

  /// Residual of a direction. Conjugate gradients leave a smooth error, which a picture shows: the
  /// MAE of a 128² design (two rounds of 30 iterations) is 0.0055 with 1e-2 and 0.0029 with 1e-4;
  /// 0.0027 with multigrid, whose 1e-2 is rough.
  static constexpr double kTolerance = 1e-4;
  /// Maximum number of iterations, in √cells; the largest number so far is 4.3.
  static constexpr double kMaxIterations = 20.0;

  [[nodiscard]] static std::span<const double> numbers(const Eigen::VectorXd& v) {
    return {v.data(), static_cast<std::size_t>(v.size())};
  }
  [[nodiscard]] std::int64_t count() const { return static_cast<std::int64_t>(solution_.size()); }
  template <class Functor>
  void each_cell(const char* kernel, const Functor& functor) const {
    parallel_for(executor_, kernel, count(), functor);
  }

  /// Conjugate gradients from 0. @return true if they converged.
  bool iterate(const GraphRows& rows) {
    const auto sizes = pending_sum<2>(executor_, "newton residual", count(),
                                      ResidualSizes{residual_.data(), inverse_diagonal_.data()})
                           .get();
    const double goal = kTolerance * kTolerance * sizes[0];
    double size = sizes[0];
    double scaled_size = sizes[1];
    double turn = 0.0;
    const double most = kMaxIterations * std::sqrt(static_cast<double>(count()));
    for (int i = 0; size > goal && i < most; ++i) {
      each_cell("newton turn",
                TurnDirection{residual_.data(), inverse_diagonal_.data(), turn, direction_.data()});
      const double energy = pending_sum<1>(executor_, "newton product", count(),
                                           MultiplyRow{rows, direction_.data(), image_.data()})
                                .get()[0];
      if (!(energy > 0.0)) return false;
      const auto next =
          pending_sum<2>(executor_, "newton step", count(),
                         TakeStep{scaled_size / energy, direction_.data(), image_.data(),
                                  inverse_diagonal_.data(), solution_.data(), residual_.data()})
              .get();
      turn = next[1] / scaled_size;
      size = next[0];
      scaled_size = next[1];
    }
    return size <= goal;
  }

  Exec executor_;
  Vector weights_;
  Vector inverse_diagonal_;
  Vector solution_;
  Vector residual_;
  Vector direction_;
  Vector image_;
};

template <>
class NewtonSystem<Executor> {
 public:
  NewtonSystem(std::size_t /*cells*/, const Executor& executor) : executor_(executor) {}

  [[nodiscard]] Eigen::VectorXd solve(const CellView& cells, std::span<const DualEdge> edges,
                                      std::span<const EdgeMeasure> measures, double even,
                                      const Eigen::VectorXd& right) const;

 private:
  Executor executor_;
};

/// CellStage on any executor. Its buffers stay for as long as the sites do.
template <class Exec>
class CellStageOn final : public CellStage {
 public:
  /// @param sites  2 × n; must outlive the stage.
  CellStageOn(const Eigen::Matrix2Xd& sites, const Exec& executor)
      : executor_(executor),
        mass_(static_cast<std::size_t>(sites.cols())),
        area_(mass_.size()),
        system_(mass_.size(), executor) {
    sites_.send(executor_, {sites.data(), static_cast<std::size_t>(sites.size())});
  }

  void set_density(std::shared_ptr<const SummedDensity> density) override {
    measured_ = nullptr;
    density_ = std::move(density);
    pixels_.send(executor_, density_->pixels());
    row_ends_.send(executor_, density_->row_ends());
    border_.send(executor_, density_->border());
  }
  [[nodiscard]] const SummedDensity& density() const override { return *density_; }

  PowerCells measure(const CellEdges& edges) override {
    measured_ = nullptr;
    const CellView view = send(edges);
    fit(measures_, edges.edges.size());
    parallel_for(executor_, "power cells", static_cast<std::int64_t>(edges.edges.size()),
                 MeasureEdge{view, measures_.data()});
    parallel_for(executor_, "gather cells", static_cast<std::int64_t>(mass_.size()),
                 MeasureCell{view, measures_.data(), mass_.data(), area_.data()});
    measured_ = sent_;
    return {fetched(mass_, mass_.size()), fetched(area_, area_.size())};
  }

  std::vector<Moments> moments(const CellEdges& edges) override {
    const CellView view = send(edges);
    const std::size_t cells = mass_.size();
    typename Exec::template Buffer<EdgeMoments> along(edges.edges.size());
    typename Exec::template Buffer<Moments> sums(cells);
    parallel_for(executor_, "power moments", static_cast<std::int64_t>(edges.edges.size()),
                 FindEdgeMoments{view, along.data()});
    parallel_for(executor_, "gather moments", static_cast<std::int64_t>(cells),
                 FindCellMoments{view, along.data(), sums.data()});
    return fetched(sums, cells);
  }

  Eigen::VectorXd newton_direction(const CellEdges& edges,
                                   const Eigen::VectorXd& residual) override {
    LF_CHECK(sent_ == edges.edges.data() && measured_ == sent_, "another diagram was measured");
    const SummedDensity& rho = *density_;
    const double even = kCouplingFloor * rho.total() / rho.columns() / rho.rows();
    const std::span<const EdgeMeasure> measures(measures_.data(), edges.edges.size());
    return system_.solve(view(edges), edges.edges, measures, even, residual);
  }

  /// Contributions of the edges measured last, in the caller's memory.
  [[nodiscard]] std::vector<EdgeMeasure> edge_measures(const CellEdges& edges) const {
    return fetched(measures_, edges.edges.size());
  }

 private:
  template <class T>
  using Buffer = typename Exec::template Buffer<T>;

  [[nodiscard]] CellView view(const CellEdges& edges) const {
    return {
        sites_.data(),
        edges_.data(),
        first_.data(),
        sides_.data(),
        edges.corner,
        {density_->columns(), density_->rows(), pixels_.data(), row_ends_.data(), border_.data()}};
  }
  CellView send(const CellEdges& edges) {
    LF_CHECK(edges.first.size() == mass_.size() + 1, std::to_string(edges.first.size()));
    sent_ = edges.edges.data();
    edges_.send(executor_, edges.edges);
    first_.send(executor_, edges.first);
    sides_.send(executor_, edges.sides);
    return view(edges);
  }
  template <class T>
  static void fit(Buffer<T>& buffer, std::size_t size) {
    if (buffer.size() >= size) return;
    buffer = {};
    buffer = Buffer<T>(size + size / 16);  // The next diagram has a few more edges.
  }
  template <class T>
  [[nodiscard]] std::vector<T> fetched(const Buffer<T>& from, std::size_t size) const {
    std::vector<T> here(size);
    download(executor_, std::span<const T>(from.data(), size), std::span<T>(here));
    return here;
  }

  Exec executor_;
  std::shared_ptr<const SummedDensity> density_;
  KernelInput<double, Exec> sites_;
  KernelInput<DensityPixel, Exec> pixels_;
  KernelInput<DensityPixel, Exec> row_ends_;
  KernelInput<Moments, Exec> border_;
  KernelInput<DualEdge, Exec> edges_;
  KernelInput<std::int32_t, Exec> first_;
  KernelInput<CellSide, Exec> sides_;
  Buffer<EdgeMeasure> measures_;
  Buffer<double> mass_;
  Buffer<double> area_;
  NewtonSystem<Exec> system_;
  const DualEdge* sent_ = nullptr;      ///< Diagram whose edges the device has,
  const DualEdge* measured_ = nullptr;  ///< and whose measures.
};

}  // namespace lensforge

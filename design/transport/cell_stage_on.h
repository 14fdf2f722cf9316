// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/error.h"
#include "design/transport/cell_kernels.h"
#include "design/transport/cell_stage.h"
#include "design/transport/newton_system.h"

namespace lensforge {

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

  /// What the edges that were measured last contribute, in the caller's memory.
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
    buffer = Buffer<T>(size + size / 16);  // The next diagram has a few edges more.
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
  const DualEdge* sent_ = nullptr;      ///< Whose edges the device has,
  const DualEdge* measured_ = nullptr;  ///< and whose measures.
};

}  // namespace lensforge

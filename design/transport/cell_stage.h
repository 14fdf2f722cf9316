// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/compute/executor.h"
#include "design/transport/cell_edges.h"
#include "design/transport/summed_density.h"

namespace lensforge {

/// What is held by the cells of a power diagram cut to the picture.
struct PowerCells {
  std::vector<double> mass;  ///< Per site, ∫ρ over its cell.
  std::vector<double> area;  ///< Per site, the part of the picture in its cell, pixels².
};

/// The numerical half of transport on one device, for sites that stay: all but the triangulation,
/// which needs exact predicates and is the CPU's. Per diagram its edges go to the device; back come
/// numbers of the cells.
class CellStage {
 public:
  CellStage() = default;
  virtual ~CellStage() = default;
  CellStage(const CellStage&) = delete;
  CellStage& operator=(const CellStage&) = delete;

  /// What is measured from now on; to be called first.
  virtual void set_density(std::shared_ptr<const SummedDensity> density) = 0;
  [[nodiscard]] virtual const SummedDensity& density() const = 0;

  /// Masses and areas. The same bits for any number of threads.
  virtual PowerCells measure(const CellEdges& edges) = 0;

  /// Mass, first and second moments of every cell, for centroids and the energy.
  virtual std::vector<Moments> moments(const CellEdges& edges) = 0;

  /// Change of the weights by which the masses change by `residual` to first order: solves
  /// L δ = residual, L = ∂mass/∂w, up to kDirectionTolerance of the residual.
  /// @pre `edges` were the last to be measured. @return not finite where it cannot be found.
  virtual Eigen::VectorXd newton_direction(const CellEdges& edges,
                                           const Eigen::VectorXd& residual) = 0;
};

/// Residual of an iterated Newton direction. Steps are as many as with exact directions (58,880
/// sites: 31 on a photograph, 56 on the logo, both ways); a tenth of it costs a third more time.
inline constexpr double kDirectionTolerance = 1e-2;

/// Sites above which Newton directions are iterated instead of factorised, and a GPU is worth its
/// transfers. Processor seconds for a Newton system on 2 cores (CHOLMOD, supernodal, on OpenBLAS),
/// logo on black: equal at 14,720 sites, 0.08 against 0.2 at 58,880, 1.1 against 4 at 942,080;
/// black pixels take no more iterations than grey ones.
inline constexpr int kDirectLimit = 12000;

/// The stage on the executor's device; few sites stay on the CPU.
/// @param sites  2 × n, pixels. @throw RunError if a GPU's memory does not suffice.
std::unique_ptr<CellStage> make_cell_stage(const Eigen::Matrix2Xd& sites, const Executor& executor);

#if defined(LENSFORGE_CUDA)
std::unique_ptr<CellStage> make_cuda_cell_stage(const Eigen::Matrix2Xd& sites,
                                                const Executor& executor);
#endif

}  // namespace lensforge

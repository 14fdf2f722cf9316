// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/executor.h"
#include "design/transport/power_diagram.h"
#include "design/transport/summed_density.h"

namespace lensforge {

/// What is held by the cells of a power diagram cut to the picture, and how it changes with the
/// weights. Everything comes from one walk over the dual edges through the pixels they cross; no
/// cell is ever cut with a pixel.
struct PowerCells {
  std::vector<double> mass;  ///< Per site, ∫ρ over its cell.
  std::vector<double> area;  ///< Per site, the part of the picture in its cell, pixels².
  struct Border {
    int left;
    int right;
    double mass;  ///< ∂mass_left/∂w_right = −this: ∫ρ dℓ / (2 |c_left − c_right|).
    double area;  ///< The same for a density of 1: ∫dℓ / (2 |c_left − c_right|).
  };
  std::vector<Border> borders;  ///< Of cells whose common border crosses the picture.
};

/// Masses, areas and their derivatives. The same bits for any number of threads.
PowerCells measure_cells(const PowerDiagram& diagram, const SummedDensity& density,
                         const Executor& executor);

/// Mass, first and second moments of every cell, for centroids and the energy.
std::vector<Moments> cell_moments(const PowerDiagram& diagram, const SummedDensity& density,
                                  const Executor& executor);

/// H(w) = Σ (−∫ (|x − c|² − w) ρ dx − wanted·w), convex; its gradient by w is mass − wanted
/// (Sun et al., 3.4 and Appendix C).
double transport_energy(const PowerDiagram& diagram, const std::vector<Moments>& cells,
                        const Eigen::VectorXd& wanted);

}  // namespace lensforge

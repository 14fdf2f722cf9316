// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bench/markdown_table.h"
#include "core/compute/executor.h"

namespace lensforge::bench {

/// Names of the figures of Tojo et al. that reflect_figures() knows.
const std::vector<std::string>& figure_names();

/// One row for each variant that a figure compares, on drawn shapes.
/// @param names   some of figure_names().
/// @param plots   where energies over time of Fig. 14 are drawn (energy_over_time.svg); may be
/// empty.
MarkdownTable reflect_figures(const std::vector<std::string>& names,
                              const std::filesystem::path& plots, const Executor& executor);

/// The derivative of every drawn shape's energy along a descent direction: by normals alone and of
/// the whole shape.
MarkdownTable slope_table(const Executor& executor);

}  // namespace lensforge::bench

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/sampling_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace lensforge {
namespace {

GridWindow with_half_the_spacing(const GridWindow& grid) {
  GridWindow fine = grid;
  fine.spacing *= 0.5;
  fine.columns = 2 * (grid.columns - 1) + 1;
  fine.rows = 2 * (grid.rows - 1) + 1;
  return fine;
}

/// The same cells on that grid.
CellRange halved(const CellRange& cells) {
  return {2 * cells.column, 2 * cells.row, 2 * cells.columns, 2 * cells.rows};
}

struct Stretch {
  std::int64_t begin;
  std::int64_t count;
};

/// The middle of the `index`th of kSamplingWindows equal parts of a side of `cells` cells.
Stretch stretch(std::int64_t cells, int pixels, std::int64_t index) {
  const double window = kWindowPixels / pixels * static_cast<double>(cells);
  const std::int64_t part = std::max<std::int64_t>(1, cells / kSamplingWindows);
  const std::int64_t count = std::clamp<std::int64_t>(std::llround(window), 1, part);
  const std::int64_t middle = (2 * index + 1) * cells / (2 * kSamplingWindows);
  return {std::clamp<std::int64_t>(middle - count / 2, 0, cells - count), count};
}

std::vector<CellRange> windows_of(const FieldRenderSetup& setup) {
  const CellRange all = all_cells(setup.grid);
  std::vector<CellRange> windows;
  for (std::int64_t j = 0; j < kSamplingWindows; ++j) {
    for (std::int64_t i = 0; i < kSamplingWindows; ++i) {
      const Stretch x = stretch(all.columns, setup.optics.pixels.x(), i);
      const Stretch y = stretch(all.rows, setup.optics.pixels.y(), j);
      windows.push_back({x.begin, y.begin, x.count, y.count});
    }
  }
  return windows;
}

double area_of(const CellRange& cells) { return static_cast<double>(cells.columns * cells.rows); }

double mae_of(const FluxPicture& picture, const Image& target) {
  return compare(picture.image(target.total()), target).mae;
}

}  // namespace

SamplingCheck check_sampling(const SurfaceField& designed, const SurfaceField& part,
                             const LeakageResult& result, const Image& target,
                             const FieldRenderSetup& setup, const Executor& executor,
                             const RunControl& control) {
  const RunControl silent(control.stop_token(), {});
  FieldRenderSetup fine_setup = setup;
  fine_setup.grid = with_half_the_spacing(setup.grid);
  const std::vector<CellRange> windows = windows_of(setup);
  const auto with_fine_windows = [&](const SurfaceField& field, FluxPicture picture) {
    for (const CellRange& window : windows) {
      const FluxPicture coarse = render_cells(field, setup, window, executor, silent);
      const FluxPicture fine = render_cells(field, fine_setup, halved(window), executor, silent);
      for (std::size_t i = 0; i < picture.flux.size(); ++i) {
        picture.flux[i] += fine.flux[i] - coarse.flux[i];
      }
    }
    return picture;
  };
  const FluxPicture& before = result.part().picture;
  const FluxPicture now = with_fine_windows(part, before);
  const FluxPicture& design_before = result.designed.picture;
  const FluxPicture design_now = with_fine_windows(designed, design_before);
  double cells = 0.0;
  for (const CellRange& window : windows) cells += area_of(window);
  const double scale = area_of(all_cells(setup.grid)) / cells;
  return {setup.grid.spacing.minCoeff(),
          scale * (leakage_share(now, design_now) - leakage_share(before, design_before)),
          scale * (mae_of(now, target) - mae_of(before, target))};
}

}  // namespace lensforge

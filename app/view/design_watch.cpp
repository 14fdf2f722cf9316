// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/design_watch.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "core/image/error_image.h"
#include "core/image/image_io.h"
#include "core/image/metrics.h"
#include "core/page/decade_plot.h"
#include "core/page/html_text.h"
#include "core/surface/control_net.h"
#include "design/render_lens.h"
#include "design/schedule/checkpoint.h"

namespace lensforge {
namespace {

/// Points of the curve of errors: more than a screen has columns.
constexpr std::size_t kMostPoints = 2000;
constexpr const char* kSplineStage = "spline";

bool is_spline(const Checkpoint& saved) {
  return !saved.convergence.empty() && saved.convergence.back().stage == kSplineStage;
}

Image picture_of(const Checkpoint& saved, const DesignGoalView& goal, const Executor& executor) {
  Image picture;
  if (is_spline(saved)) {
    const SampledSurface nodes = spline_nodes({saved.mesh.grid, saved.mesh.vertices}, kMeshSamples);
    evaluate(nodes.mesh, nodes.normals, goal.setup, goal.target, &picture, executor);
    return picture;
  }
  const bool facets = goal.model == SurfaceModel::kFacet;
  evaluate(saved.mesh, goal.setup, facets ? SurfaceModel::kFacet : SurfaceModel::kSmooth,
           goal.target, &picture, executor);
  return picture;
}

/// MAE over seconds, of the steps that have a picture.
std::string plot_of(const Checkpoint& saved) {
  PlotCurve curve{"", {}};
  const std::size_t step = 1 + saved.convergence.size() / kMostPoints;
  for (std::size_t i = 0; i < saved.convergence.size(); i += step) {
    const ConvergenceRow& row = saved.convergence[i];
    if (row.mae > 0.0) curve.points.emplace_back(row.seconds, row.mae);
  }
  return decade_plot({curve}, "Mean absolute error over seconds of the design");
}

std::size_t rounds_of(const Checkpoint& saved) {
  std::set<std::pair<int, int>> rounds;
  for (const ConvergenceRow& row : saved.convergence) rounds.emplace(row.level, row.round);
  return rounds.size();
}

std::string bytes_of(const ColorImage& image) {
  const std::vector<unsigned char> png = encode_png(image);
  return {png.begin(), png.end()};
}

}  // namespace

LiveState state_of_design(const std::filesystem::path& checkpoint, const DesignGoalView& goal,
                          std::int64_t number, const Executor& executor) {
  const Checkpoint saved = read_checkpoint(checkpoint);
  const Image picture = picture_of(saved, goal, executor);
  const std::size_t rounds = rounds_of(saved);
  const nlohmann::json state{{"number", number},
                             {"rounds", rounds},
                             {"mae", compare(picture, goal.target).mae},
                             {"plot", plot_of(saved)},
                             {"words", "round " + std::to_string(rounds + 1) + " at work, " +
                                           duration_text(saved.seconds / 60.0) + " so far"}};
  return {number, state.dump(), bytes_of(grey_picture(picture)),
          bytes_of(error_image(picture, goal.target))};
}

}  // namespace lensforge

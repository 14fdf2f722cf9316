// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace lensforge {

/// Which normals send the light: one per triangle (the paper's model), or one per vertex (what a
/// polished, smooth part does).
enum class SurfaceModel { kFacet, kSmooth, kSpline };

/// All of them, in the order in which files and commands list them.
inline constexpr std::array kSurfaceModels{SurfaceModel::kFacet, SurfaceModel::kSmooth};

/// As files and options call a model.
inline std::string model_name(SurfaceModel model) {
  return model == SurfaceModel::kFacet ? "facet" : "smooth";
}

/// Every model with its name.
inline std::vector<std::pair<std::string, SurfaceModel>> named_models() {
  std::vector<std::pair<std::string, SurfaceModel>> models;
  for (const SurfaceModel model : kSurfaceModels) models.emplace_back(model_name(model), model);
  return models;
}

}  // namespace lensforge

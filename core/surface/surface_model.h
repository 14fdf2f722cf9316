// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace lensforge {

/// The normals that direct the light: one per triangle (the paper's model), one per vertex (a
/// polished, smooth part), or those of one C² spline, which is then the surface itself.
enum class SurfaceModel { kFacet, kSmooth, kSpline };

/// All of them, in the order in which files and commands list them.
inline constexpr std::array kSurfaceModels{SurfaceModel::kFacet, SurfaceModel::kSmooth,
                                           SurfaceModel::kSpline};
/// The models that a mesh alone can represent.
inline constexpr std::array kMeshModels{SurfaceModel::kFacet, SurfaceModel::kSmooth};

/// A model's name in files and options.
inline std::string model_name(SurfaceModel model) {
  switch (model) {
    case SurfaceModel::kFacet:
      return "facet";
    case SurfaceModel::kSmooth:
      break;
    case SurfaceModel::kSpline:
      return "spline";
  }
  return "smooth";
}

/// Some models with their names.
template <class Models>
std::vector<std::pair<std::string, SurfaceModel>> named(const Models& some) {
  std::vector<std::pair<std::string, SurfaceModel>> models;
  for (const SurfaceModel model : some) models.emplace_back(model_name(model), model);
  return models;
}

/// Every model with its name.
inline std::vector<std::pair<std::string, SurfaceModel>> named_models() {
  return named(kSurfaceModels);
}

}  // namespace lensforge

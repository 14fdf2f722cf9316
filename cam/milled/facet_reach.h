// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "core/compute/executor.h"

namespace lensforge {

/// Which triangles of a mesh a ball that is tangent to a facet may cut: for most facets none, for
/// those beside valleys a few.
class FacetReach {
 public:
  /// @param grid  must outlive this.
  FacetReach(const FacetGrid& grid, double radius, const Executor& executor);

  /// True if the ball around `centre` that is tangent to the facet certainly cuts no triangle.
  [[nodiscard]] bool surely_free(std::int32_t facet, const Eigen::Vector3d& centre) const;

 private:
  /// n·x = level
  struct Plane {
    Eigen::Vector3d normal;
    double level;
  };

  [[nodiscard]] std::vector<std::int32_t> suspects_of(const FacetGrid& grid,
                                                      std::int32_t facet) const;

  double radius_;
  std::vector<Plane> planes_;  ///< Of the facets.
  /// Of facet f: suspects_[begin_[f] … begin_[f + 1]).
  std::vector<std::int64_t> begin_;
  std::vector<std::int32_t> suspects_;
};

}  // namespace lensforge

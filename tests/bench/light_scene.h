// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

#include "core/mesh/surface_mesh.h"

namespace lensforge::bench {

/// Number of rays traced together: neighbours, which visit the same branches of the tree.
inline constexpr int kLanes = 16;

/// Places on the lens, mm; one column each.
using Places = Eigen::Matrix<double, 2, kLanes>;

/// Up to kLanes rays; points in mm, unit directions.
struct RayPacket {
  void add(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
    origins[static_cast<std::size_t>(size)] = origin;
    directions[static_cast<std::size_t>(size)] = direction;
    ++size;
  }

  std::array<Eigen::Vector3d, kLanes> origins;
  std::array<Eigen::Vector3d, kLanes> directions;
  int size = 0;
};

/// The lens's surface as Embree's tree of triangles. Safe to ask from several threads.
class LightScene {
 public:
  /// @throw RunError with Embree's reason if it cannot be started.
  explicit LightScene(const SurfaceMesh& mesh);
  ~LightScene();
  LightScene(const LightScene&) = delete;
  LightScene& operator=(const LightScene&) = delete;

  /// The triangle that a ray up +z from each of the first `count` places (mm) meets; −1 for none.
  [[nodiscard]] std::array<int, kLanes> triangles_above(const Places& places, int count) const;

  /// Number of these rays that meet the surface again, farther than kClearance from their origin.
  [[nodiscard]] int blocked(const RayPacket& rays) const;

  /// mm; a hundred times the rounding of Embree's single precision at 100 mm, a hundredth of a
  /// facet.
  static constexpr float kClearance = 1e-3F;

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace lensforge::bench

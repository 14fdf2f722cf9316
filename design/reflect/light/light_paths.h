// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/light/directions.h"
#include "design/reflect/light/goal.h"
#include "design/reflect/light/light_lanes.h"
#include "design/reflect/mesh/faces.h"

namespace lensforge::reflect {

/// Light that reaches a face by way of another one.
struct PathHit {
  Eigen::Vector3f w;  ///< From the face towards the other one.
  std::int32_t face;  ///< The other one.
};

/// Directions per half sphere along which light from other faces is gathered: on a right-angled
/// dihedral their mean differs from the closed form by less than 0.1 %.
inline constexpr int kGatherDirections = 128;

/// All that depends on where faces stand and not on how their normals are turned: which face is lit
/// and seen in which direction, and which other faces it sees. Cached, so that energies and
/// gradients of one shape are sums without noise.
///
/// Visibility is asked at one point of the face per direction; the points of all directions cover
/// the face evenly (the R2 sequence, Roberts 2018).
class LightPaths {
 public:
  static constexpr std::uint8_t kLit = 1;
  static constexpr std::uint8_t kSeen = 2;

  /// @param gather  directions per half sphere for light by way of another face; 0: direct only.
  /// @throw Interrupted
  LightPaths(const SurfaceMesh& mesh, const Goal& goal, DirectionSet directions, int gather,
             const Executor& executor);

  [[nodiscard]] const Faces& faces() const { return faces_; }
  [[nodiscard]] const DirectionSet& directions() const { return directions_; }
  [[nodiscard]] Eigen::Vector3d light(Eigen::Index d) const { return directions_.light.col(d); }
  [[nodiscard]] bool has_place() const { return to_place_.cols() > 0; }
  /// Where the sensor stands as seen from the face.
  [[nodiscard]] Eigen::Vector3d sensor(Eigen::Index face, Eigen::Index d) const {
    return has_place() ? Eigen::Vector3d(to_place_.col(face)) : light(d);
  }
  /// Directions towards the light, padded().
  [[nodiscard]] const LaneVectors<double>& light_lanes() const { return light_lanes_; }
  /// Of a face one byte for every direction, padded(): kLit and kSeen.
  [[nodiscard]] const std::uint8_t* flags(Eigen::Index face) const {
    return flags_.data() + slot(face, 0);
  }
  [[nodiscard]] bool lit(Eigen::Index face, Eigen::Index d) const {
    return (flags_[slot(face, d)] & kLit) != 0;
  }
  [[nodiscard]] bool seen(Eigen::Index face, Eigen::Index d) const {
    return (flags_[slot(face, d)] & kSeen) != 0;
  }
  [[nodiscard]] std::span<const PathHit> hits(Eigen::Index face) const {
    const auto begin = static_cast<std::size_t>(face * gather_);
    return {hits_.data() + begin,
            static_cast<std::size_t>(hit_count_[static_cast<std::size_t>(face)])};
  }
  /// Solid angle that every hit stands for, sr.
  [[nodiscard]] double hit_angle() const {
    return gather_ > 0 ? 2.0 * std::numbers::pi / gather_ : 0.0;
  }

 private:
  [[nodiscard]] std::size_t slot(Eigen::Index face, Eigen::Index d) const {
    return static_cast<std::size_t>(face * light_lanes_.rows() + d);
  }
  class Caster;

  Faces faces_;
  DirectionSet directions_;
  LaneVectors<double> light_lanes_;
  Eigen::Matrix3Xd to_place_;  ///< Of a goal that has a place, else empty.
  std::vector<std::uint8_t> flags_;
  int gather_;
  std::vector<PathHit> hits_;  ///< `gather_` slots per face.
  std::vector<std::int32_t> hit_count_;
};

}  // namespace lensforge::reflect

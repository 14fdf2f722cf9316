// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "core/mesh/surface_mesh.h"

namespace lensforge::reflect {

/// Goal for the reflected light (Tojo et al., 4.1 and Fig. 12).
enum class GoalKind {
  kStealth,  ///< As little as possible goes back to where the light comes from.
  kPoint,    ///< As much as possible goes to a point.
  kLine,     ///< As much as possible goes to the nearest point of a line.
  kDeflect,  ///< As little as possible goes to a point.
};

/// A goal with its place, in the units of the mesh.
struct Goal {
  GoalKind kind = GoalKind::kStealth;
  Eigen::Vector3d from{0.0, 0.0, 0.0};  ///< The point, or an end of the line.
  Eigen::Vector3d to{0.0, 0.0, 0.0};    ///< The line's other end.

  /// True if the sensor has a fixed place, instead of being where the light comes from.
  [[nodiscard]] bool has_place() const { return kind != GoalKind::kStealth; }
  [[nodiscard]] bool maximizes() const {
    return kind == GoalKind::kPoint || kind == GoalKind::kLine;
  }

  /// The place that light leaving `p` should reach or avoid: on a line q1 + s·d it is s = clamp((p
  /// − q1)·d/|d|², 0, 1). @pre has_place()
  [[nodiscard]] Eigen::Vector3d place(const Eigen::Vector3d& p) const {
    if (kind != GoalKind::kLine) return from;
    const Eigen::Vector3d d = to - from;
    return from + std::clamp((p - from).dot(d) / d.squaredNorm(), 0.0, 1.0) * d;
  }
};

/// Directions towards the light with the weights of a quadrature over them.
struct DirectionSet {
  Eigen::Matrix3Xd light;  ///< Unit vectors.
  Eigen::VectorXd weight;  ///< They sum to 1.

  [[nodiscard]] Eigen::Index count() const { return light.cols(); }
};

/// Sampling of a band of directions.
struct BandSampling {
  int rows = 6;       ///< Heights: Gauss points in z.
  int columns = 48;   ///< Azimuths of a row; neighbouring rows are staggered.
  double turn = 0.0;  ///< Turns all about z, in distances between azimuths.
};

/// Samples the band |elevation| ≤ `elevation` about the z axis with equal weight per solid angle
/// (Tojo et al., 4.1): exact for polynomials in z of degree 2·rows − 1.
/// @param elevation  rad, above 0, at most π/2. @pre rows, columns ≥ 1
DirectionSet band_directions(double elevation, const BandSampling& sampling);

/// Direction towards the sun on its half circle from east (+x, angle 0) over noon, (0, −1, 1)/√2,
/// to west.
Eigen::Vector3d sun_direction(double angle);

/// `count` directions of the sun at even angles, none of them on the horizon. @pre count ≥ 1
DirectionSet sun_directions(int count);

/// Directions as given, with equal weights. @pre none has length 0
DirectionSet listed_directions(const Eigen::Matrix3Xd& towards_light);

/// Unit directions spread evenly over the half sphere z > 0: a Fibonacci lattice (González 2010).
/// 3 × count.
Eigen::Matrix3Xd hemisphere_directions(int count);

/// Directions of the light, and its goal.
struct LightField {
  Goal goal;
  std::optional<Eigen::Matrix3Xd> listed;  ///< --light
  double elevation = 0.0;                  ///< rad
  int rows = 0;
  int sun_positions = 0;

  /// Directions of an update. A band is turned by a golden share of its azimuths from one update to
  /// the next, so that a shape cannot hide between directions.
  [[nodiscard]] DirectionSet directions(int update) const;
  /// Draws a direction from the whole band, the sun's half circle or the list by two numbers in 0 …
  /// 1.
  [[nodiscard]] Eigen::Vector3d random_direction(double u, double v) const;
  /// Finer directions, for energies that are reported: the band average of a face is exact to 0.1
  /// %.
  [[nodiscard]] DirectionSet evaluation_directions() const;
};

/// Reflected energy 5·½ Σ a_k ⟨L² V⟩ of a shape, by one reflection alone and by one and two.
struct Energies {
  double direct = 0.0;
  double total = 0.0;
};

struct ReflectOptions;

/// @throw InputError naming --place or --light, the value and the rule.
LightField make_light_field(const ReflectOptions& options);

/// Reads numbers separated by commas. @throw InputError "option text: must be …"
Eigen::VectorXd number_list(const std::string& option, const std::string& text, int count);

/// Diagonal of the bounding box that the paper's parameters are stated for (Tojo et al., 4.6).
inline constexpr double kUnitDiagonal = 3.0;

/// Maps a mesh to a bounding box of that diagonal about the origin, and back.
class UnitFrame {
 public:
  explicit UnitFrame(const SurfaceMesh& mesh);

  [[nodiscard]] double to_unit(double length) const { return length * scale_; }
  [[nodiscard]] Eigen::Vector3d to_unit(const Eigen::Vector3d& p) const {
    return scale_ * (p - centre_);
  }
  [[nodiscard]] SurfaceMesh to_unit(SurfaceMesh mesh) const;
  [[nodiscard]] LightField to_unit(LightField field) const;
  [[nodiscard]] SurfaceMesh from_unit(SurfaceMesh mesh) const;

 private:
  Eigen::Vector3d centre_;
  double scale_;
};

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <BRepAdaptor_Surface.hxx>
#include <BRepTopAdaptor_FClass2d.hxx>
#include <Eigen/Core>
#include <TopoDS_Face.hxx>
#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace lensforge {

/// How near Newton's method must come, and what counts as inside at an edge, mm.
inline constexpr double kNearFace = 1e-6;

/// A point of a face and the normal there, z > 0.
struct FacePoint {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
};

/// One face and how it is evaluated. Not for use by two threads at once.
class FaceSampler {
 public:
  explicit FaceSampler(const TopoDS_Face& face);

  [[nodiscard]] bool is_flat() const { return surface_.GetType() == GeomAbs_Plane; }

  /// Least and largest z of the outward normals at the probes that lie on the face.
  [[nodiscard]] std::pair<double, double> normal_range() const;

  /// The face above a point, or nothing where it is not.
  [[nodiscard]] std::optional<FacePoint> above(const Eigen::Vector2d& xy);

  /// Knot cells along u and v; nothing unless the face is a spline over its whole rectangle.
  [[nodiscard]] std::optional<std::array<int, 2>> knot_cells() const;

  /// The point at these shares of the way along u and v.
  [[nodiscard]] FacePoint at(double share_u, double share_v) const;

 private:
  struct Parameters {
    double u = 0.0;
    double v = 0.0;
  };
  struct Probe {
    Parameters at;
    Eigen::Vector2d xy;
  };

  [[nodiscard]] bool contains(const Parameters& at) const;
  [[nodiscard]] Parameters nearest_probe(const Eigen::Vector2d& xy) const;
  [[nodiscard]] FacePoint point_at(const Parameters& at) const;
  [[nodiscard]] std::optional<FacePoint> newton(Parameters at, const Eigen::Vector2d& xy);

  BRepAdaptor_Surface surface_;
  BRepTopAdaptor_FClass2d inside_;
  bool reversed_;
  Parameters low_;
  Parameters high_;
  std::vector<Probe> probes_;
  std::optional<Parameters> last_;
};

}  // namespace lensforge

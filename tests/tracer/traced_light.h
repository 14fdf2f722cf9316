// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "tracer/height_map.h"
#include "tracer/lens_files.h"

namespace tracer {

/// A ray on its way to a point of the surface.
struct Ray {
  Vec3 from;  ///< Point of entry into the lens; for a mirror the point itself.
  Vec3 way;   ///< Unit direction in which it comes to the point.
};

/// The light of a lens.json, followed ray by ray. Millimetres.
class TracedLight {
 public:
  /// @param folder  of the lens, where a front's heights lie.
  /// @throw std::runtime_error if the file tells of something that is not followed.
  TracedLight(const nlohmann::json& lens, const std::string& folder);

  /// The ray that enters a lens above this place; none where no light enters.
  [[nodiscard]] std::optional<Ray> ray_at(const Vec2& entry) const;

  /// The ray to a point of the surface; none where no light comes to it.
  [[nodiscard]] std::optional<Ray> ray_to(const Vec3& p) const;

  /// Light through a small triangle, on any scale that is the same for all of them.
  [[nodiscard]] double light_through(const Ray& a, const Ray& b, const Ray& c) const;

  /// Landing point of a ray that meets a surface of unit normal n at p, in columns and rows of the
  /// picture; empty if it misses the screen.
  [[nodiscard]] std::optional<Vec2> landing(const Ray& ray, const Vec3& p, const Vec3& n) const;

 private:
  /// A point of the front face and its normal, towards the inside.
  struct Front {
    Vec3 place;
    Vec3 normal;
  };
  [[nodiscard]] std::optional<Front> front_at(const Vec2& place) const;
  /// Offset from p of the light that enters at `entry`, at p's height.
  [[nodiscard]] std::optional<Vec2> miss(const Vec2& entry, const Vec3& p, Ray& ray) const;
  [[nodiscard]] std::optional<Ray> through_front(const Vec3& p) const;

  bool mirror_;
  double ior_ = 1.0;
  std::optional<Vec3> source_;  ///< Set for light from a point.
  Vec3 direction_;              ///< For parallel light.
  std::optional<Vec3> axis_;    ///< Set for a flat source.
  double radius_ = 0.0;         ///< Radius of a spherical front; else 0.
  std::optional<HeightMap> heights_;
  Vec3 apex_;
  Vec3 centre_;  ///< Centre of the screen.
  Vec3 right_;
  Vec3 up_;
  Vec2 size_;
  Vec2 pixels_;
};

}  // namespace tracer

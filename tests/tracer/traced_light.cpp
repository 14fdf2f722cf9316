// SPDX-License-Identifier: GPL-3.0-or-later
#include "tracer/traced_light.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tracer {
namespace {

using nlohmann::json;

Vec2 vec2(const json& values) { return {values.at(0).get<double>(), values.at(1).get<double>()}; }
Vec3 vec3(const json& values) {
  return {values.at(0).get<double>(), values.at(1).get<double>(), values.at(2).get<double>()};
}

/// Snell's law by the part of a direction along the face, which is multiplied by the ratio of the
/// indices; none where light is reflected totally. @param n  to the side that it goes to.
std::optional<Vec3> refracted(const Vec3& a, const Vec3& n, double ratio) {
  const Vec3 along = ratio * (a - n.dot(a) * n);
  const double across = 1.0 - along.squaredNorm();
  if (!(n.dot(a) > 0.0) || !(across > 0.0)) return std::nullopt;
  return along + std::sqrt(across) * n;
}

void refuse_unless(bool known, const std::string& what) {
  if (!known) throw std::runtime_error(what + " is not followed here");
}

}  // namespace

TracedLight::TracedLight(const json& lens, const std::string& folder)
    : mirror_(lens.at("mode") == "reflect"),
      direction_(Vec3::UnitZ()),
      apex_(Vec3::Zero()),
      centre_(vec3(lens.at("screen").at("centre"))),
      right_(vec3(lens.at("screen").at("right"))),
      up_(vec3(lens.at("screen").at("up"))),
      size_(vec2(lens.at("screen").at("size"))),
      pixels_(vec2(lens.at("pixels"))) {
  const json& source = lens.at("source");
  refuse_unless(!source.contains("angle_mrad") && !source.contains("size_mm"), "a wide source");
  refuse_unless(!lens.value("fresnel", false), "light that faces reflect");
  refuse_unless(!lens.contains("outline"), "an outline");
  if (source.at("type") == "point") {
    source_ = vec3(source.at("position"));
    const Vec2 middle = 0.5 * vec2(lens.at("lens_size"));
    const Vec3 to_middle = Vec3(middle.x(), middle.y(), 0.0) - *source_;
    if (source.at("emission") == "lambertian") axis_ = to_middle.normalized();
  } else {
    direction_ = vec3(source.at("direction"));
  }
  if (mirror_) return;
  ior_ = lens.at("ior");
  if (lens.contains("spectrum")) {
    const json& spectrum = lens.at("spectrum");
    const json& colors = spectrum.at("wavelengths_nm");
    refuse_unless(colors.size() == 1, "light of several colours");
    // Cauchy's two terms through the lines d, F and C.
    const auto per_square = [](double nm) { return 1.0 / (nm * nm); };
    const double bend = (ior_ - 1.0) / spectrum.at("abbe").get<double>() /
                        (per_square(486.13) - per_square(656.27));
    ior_ += bend * (per_square(colors.at(0)) - per_square(587.56));
  }
  const json& front = lens.at("front");
  if (front.at("type") == "sphere") {
    radius_ = front.at("radius");
    apex_ = vec3(front.at("apex"));
  } else if (front.at("type") == "heights") {
    const std::string file = folder + "/" + front.at("file").get<std::string>();
    heights_ = HeightMap(read_picture(file), vec2(front.at("size")));
  } else {
    refuse_unless(front.at("type") == "flat", "this front");
    apex_.z() = front.at("z");
  }
}

std::optional<TracedLight::Front> TracedLight::front_at(const Vec2& place) const {
  if (heights_) {
    const HeightMap::Point p = heights_->at(place);
    return Front{{place.x(), place.y(), p.z}, Vec3(-p.slope.x(), -p.slope.y(), 1.0).normalized()};
  }
  if (radius_ == 0.0) return Front{{place.x(), place.y(), apex_.z()}, Vec3::UnitZ()};
  const Vec3 middle = apex_ + Vec3(0.0, 0.0, radius_);
  const double rest = radius_ * radius_ - (place - middle.head<2>()).squaredNorm();
  if (!(rest > 0.0)) return std::nullopt;
  const Vec3 e(place.x(), place.y(), middle.z() - std::copysign(std::sqrt(rest), radius_));
  return Front{e, (middle - e) / radius_};
}

std::optional<Ray> TracedLight::ray_at(const Vec2& entry) const {
  const std::optional<Front> front = front_at(entry);
  if (!front) return std::nullopt;
  const Vec3 before = source_ ? Vec3((front->place - *source_).normalized()) : direction_;
  const std::optional<Vec3> way = refracted(before, front->normal, 1.0 / ior_);
  if (!way || !(way->z() > 0.0)) return std::nullopt;
  return Ray{front->place, *way};
}

std::optional<Vec2> TracedLight::miss(const Vec2& entry, const Vec3& p, Ray& ray) const {
  const std::optional<Ray> there = ray_at(entry);
  if (!there) return std::nullopt;
  ray = *there;
  const Vec3 at = ray.from + (p.z() - ray.from.z()) / ray.way.z() * ray.way;
  return at.head<2>() - p.head<2>();
}

std::optional<Ray> TracedLight::through_front(const Vec3& p) const {
  constexpr int kSteps = 60;
  constexpr double kShift = 1e-5;  // mm, of the difference quotients.
  constexpr double kNear = 1e-10;  // mm
  Vec2 entry = p.head<2>();
  Ray ray;
  for (int step = 0; step < kSteps; ++step) {
    const std::optional<Vec2> off = miss(entry, p, ray);
    if (!off) return std::nullopt;
    if (off->norm() < kNear) return ray;
    Eigen::Matrix2d slopes;
    Ray beside;
    for (int k = 0; k < 2; ++k) {
      const std::optional<Vec2> moved = miss(entry + kShift * Vec2::Unit(k), p, beside);
      if (!moved) return std::nullopt;
      slopes.col(k) = (*moved - *off) / kShift;
    }
    entry -= slopes.inverse() * *off;
  }
  return std::nullopt;
}

std::optional<Ray> TracedLight::ray_to(const Vec3& p) const {
  if (!mirror_) return through_front(p);
  return Ray{p, source_ ? Vec3((p - *source_).normalized()) : direction_};
}

double TracedLight::light_through(const Ray& a, const Ray& b, const Ray& c) const {
  const Vec3 area = 0.5 * (b.from - a.from).cross(c.from - a.from);
  if (!source_) return std::abs(area.dot(direction_));
  // Of a small triangle the solid angle is area × cosine / distance².
  const Vec3 way = (a.from + b.from + c.from) / 3.0 - *source_;
  const double even = std::abs(area.dot(way.normalized())) / way.squaredNorm();
  return axis_ ? even * axis_->dot(way.normalized()) : even;
}

std::optional<Vec2> TracedLight::landing(const Ray& ray, const Vec3& p, const Vec3& n) const {
  std::optional<Vec3> way;
  if (!mirror_) {
    way = refracted(ray.way, n, ior_);
  } else if (n.dot(ray.way) < 0.0) {
    way = ray.way - 2.0 * n.dot(ray.way) * n;
  }
  const Vec3 normal = right_.cross(up_);
  if (!way || !(way->z() > 0.0)) return std::nullopt;
  const double distance = normal.dot(centre_ - p) / normal.dot(*way);
  if (!(distance > 0.0)) return std::nullopt;
  const Vec3 at = p + distance * *way - centre_;
  return Vec2((at.dot(right_) / size_.x() + 0.5) * pixels_.x(),
              (0.5 - at.dot(up_) / size_.y()) * pixels_.y());
}

}  // namespace tracer

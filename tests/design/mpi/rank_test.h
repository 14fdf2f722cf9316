// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "core/optics/front.h"
#include "core/optics/height_fronts.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "design/mpi/ranks.h"
#include "design/mpi/session.h"
#include "design/objective_setups.h"

/// Every rank runs every test. on_first_rank() runs a part on rank 0 while the others serve it.
namespace lensforge::testing {

inline void on_first_rank(const std::function<void()>& body) {
  if (Ranks::world().is_first()) {
    body();
    dismiss_ranks();
  } else {
    serve_rank();
  }
}

/// A kind of light, of screen or of lens.
struct NamedSetup {
  std::string name;
  OpticalSetup setup;

  friend void PrintTo(const NamedSetup& named, std::ostream* out) { *out << named.name; }
};

/// kSetup changed for a kind; its picture is moved to where the light goes.
inline NamedSetup changed(const std::string& name,
                          const std::function<void(OpticalSetup&)>& change) {
  OpticalSetup setup = kSetup;
  change(setup);
  const Eigen::Vector2d middle =
      0.5 * setup.lens_size + (setup.focal_length - 5.0) * LightPath(setup).chief_slope(5.0);
  setup.image_origin = middle - 0.5 * setup.image_size;
  return {name, setup};
}

inline void lit_from_a_point(OpticalSetup& setup) {
  setup.lamp = PointSource{{0.5 * setup.lens_size.x() + 5.0, 0.5 * setup.lens_size.y(), -150.0},
                           Emission::kLambertian};
}

/// A setup with every part that an OpticalSetup can hold.
inline std::vector<NamedSetup> all_setups() {
  const auto oblique = [](OpticalSetup& s) {
    s.lamp = ParallelLight{Eigen::Vector3d(0.25, -0.15, 1.0).normalized()};
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
    s.screen_x = turn.col(0);
    s.screen_y = turn.col(1);
    s.view = ViewSide::kRear;
  };
  const auto mirror = [](OpticalSetup& s) {
    s.body = MirrorBody{};
    s.lamp = ParallelLight{Eigen::Vector3d(0.5, 0.0, -std::sqrt(0.75))};
  };
  const auto wavy = [](OpticalSetup& s) {
    lit_from_a_point(s);
    s.front = height_front(s.lens_size, {49, 41}, [](const Eigen::Vector2d& at) {
      return -0.25 + 0.25 * std::sin(0.3 * at.x()) * std::cos(0.25 * at.y() + 0.3);
    });
  };
  const auto spectrum = [](OpticalSetup& s) {
    s.spectrum = {{480.0, 550.0, 620.0}, {1.0, 0.5, 2.0}, 12.0};
    s.fresnel = true;
  };
  const auto outlined_point = [](OpticalSetup& s) {
    lit_from_a_point(s);
    s.spectrum = {{480.0, 620.0}, {}, 20.0};
    s.outline = rounded_outline(s.lens_size, 6.0);
  };
  return {changed("Parallel", [](OpticalSetup&) {}),
          changed("Oblique", oblique),
          changed("Point", lit_from_a_point),
          changed("Mirror", mirror),
          changed("Convex", [](OpticalSetup& s) { s.front = spherical_front(120.0, s.lens_size); }),
          changed("WavyFront", wavy),
          changed("Spectrum", spectrum),
          changed("Extended",
                  [](OpticalSetup& s) {
                    s.extent = {0.03, {}};
                  }),
          changed("Circle", [](OpticalSetup& s) { s.outline = circle_outline(s.lens_size); }),
          changed("OutlinedPoint", outlined_point)};
}

}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/two_plane_map.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/optics/light_path.h"
#include "core/optics/screen.h"

namespace lensforge {
namespace {

/// Newton's method has its last, quadratic steps at a hundredth: one more costs little.
constexpr double kMassTolerance = 1e-3;
constexpr int kMaxSteps = 150;

/// Transport of equal rays to a picture. Points are millimetres on a plane.
class Transport {
 public:
  Transport(const Executor& executor, const RunControl& control)
      : executor_(executor), control_(control) {
    options_.tolerance = kMassTolerance;
    options_.max_newton_steps = kMaxSteps;
  }

  /// Where the light of every point goes.
  Eigen::Matrix2Xd operator()(const Eigen::Matrix2Xd& from, const ImagePlane& plane,
                              const Image& light) {
    Eigen::Matrix2Xd sites(2, from.cols());
    for (Eigen::Index k = 0; k < from.cols(); ++k) sites.col(k) = plane.to_pixels(from.col(k));
    const Eigen::VectorXd masses =
        Eigen::VectorXd::Constant(from.cols(), 1.0 / static_cast<double>(from.cols()));
    TransportResult result =
        solve_semi_discrete(sites, masses, light, options_, executor_, control_);
    if (result.status == TransportResult::Status::kStopped) throw Interrupted();
    converged_ = converged_ && result.converged();
    if (result.centroids.cols() == 0) return from;
    for (Eigen::Index k = 0; k < from.cols(); ++k) {
      sites.col(k) = plane.to_mm(result.centroids.col(k));
    }
    return sites;
  }

  [[nodiscard]] bool converged() const { return converged_; }

 private:
  const Executor& executor_;
  const RunControl& control_;
  TransportOptions options_;
  bool converged_ = true;
};

/// Middles of the cells of an even grid over a picture, mm.
Eigen::Matrix2Xd even_points(const OpticalSetup& setup, const GridShape& shape) {
  Eigen::Matrix2Xd points(2, Eigen::Index{shape.columns} * shape.rows);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const Eigen::Index row = k / shape.columns;
    const Eigen::Array2d cell(static_cast<double>(k - row * shape.columns) + 0.5,
                              static_cast<double>(row) + 0.5);
    points.col(k) = setup.image_origin.array() +
                    cell / Eigen::Array2d(shape.columns, shape.rows) * setup.image_size.array();
  }
  return points;
}

/// A grid of a picture's points within a ring of points at its edges, or one step further out where
/// its light ends before them. A point of the ring has its neighbour's place along the edge.
Eigen::Matrix2Xd with_ring(const Eigen::Matrix2Xd& points, const GridShape& shape,
                           const OpticalSetup& setup) {
  const GridShape ringed{shape.columns + 2, shape.rows + 2};
  Eigen::Matrix2Xd all(2, Eigen::Index{ringed.columns} * ringed.rows);
  const auto at = [&](const Eigen::Array2i& cell) -> Eigen::Array2d {
    return points.col(Eigen::Index{cell.y()} * shape.columns + cell.x());
  };
  const Eigen::Array2i last(shape.columns - 1, shape.rows - 1);
  const Eigen::Array2d low = setup.image_origin;
  const Eigen::Array2d high = low + setup.image_size.array();
  for (Eigen::Index k = 0; k < all.cols(); ++k) {
    const Eigen::Array2i cell(static_cast<int>(k % ringed.columns) - 1,
                              static_cast<int>(k / ringed.columns) - 1);
    const Eigen::Array2i nearest = cell.max(0).min(last);
    const Eigen::Array2i inner = (2 * nearest - cell).max(0).min(last);
    const Eigen::Array2d here = at(nearest);
    const Eigen::Array2d step = (here - at(inner)).abs();
    Eigen::Array2d place = here;
    for (int i = 0; i < 2; ++i) {
      if (cell[i] < 0) place[i] = std::max(low[i], here[i] - step[i]);
      if (cell[i] > last[i]) place[i] = std::min(high[i], here[i] + step[i]);
    }
    all.col(k) = place;
  }
  return all;
}

/// The front as a picture's place.
OpticalSetup front_of(OpticalSetup setup) {
  setup.front.reset();
  setup.image_size = setup.lens_size;
  setup.image_origin.setZero();
  return setup;
}

/// The lamp's light on a flat front, pixel by pixel.
Image light_on_front(const OpticalSetup& front) {
  const LightPath light(front);
  const ImagePlane plane(front);
  Image image(front.pixels.x(), front.pixels.y());
  for (int r = 0; r < image.rows(); ++r) {
    for (int c = 0; c < image.columns(); ++c) {
      const auto corner = [&](int i, int j) -> Eigen::Vector3d {
        const Eigen::Vector2d mm = plane.to_mm(Eigen::Vector2d(c + i, r + j));
        return {mm.x(), mm.y(), 0.0};
      };
      // A view from behind turns the triangles over.
      const double taken = light.intake({corner(0, 0), corner(1, 0), corner(1, 1)}) +
                           light.intake({corner(0, 0), corner(1, 1), corner(0, 1)});
      image.at(c, r) = static_cast<float>(std::fabs(taken));
    }
  }
  return image;
}

/// Points of a screen in the lens frame.
Eigen::Matrix3Xd in_space(const Eigen::Matrix2Xd& mm, const OpticalSetup& setup) {
  const ImagePlane plane(setup);
  const Screen screen(setup);
  Eigen::Matrix3Xd points(3, mm.cols());
  for (Eigen::Index k = 0; k < mm.cols(); ++k) {
    points.col(k) = screen.at(plane.to_pixels(mm.col(k)));
  }
  return points;
}

}  // namespace

RayBundle two_plane_map(const PlanePicture& first, const PlanePicture& second,
                        const GridShape& rays, double exit_height, const Executor& executor,
                        const RunControl& control) {
  Transport transport(executor, control);
  const ImagePlane near(first.setup);
  const ImagePlane far(second.setup);
  const Eigen::Matrix2Xd inner_a = transport(even_points(first.setup, rays), near, first.light);
  const Eigen::Matrix2Xd inner_b = transport(inner_a, far, second.light);
  const OpticalSetup front = front_of(first.setup);
  const auto exits = [&](const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
    Eigen::Matrix2Xd e(2, a.cols());
    for (Eigen::Index k = 0; k < a.cols(); ++k) {
      const Eigen::Vector3d way = b.col(k) - a.col(k);
      e.col(k) = (a.col(k) + (exit_height - a(2, k)) / way.z() * way).head<2>();
    }
    return e;
  };
  const Eigen::Matrix2Xd inner_e =
      exits(in_space(inner_a, first.setup), in_space(inner_b, second.setup));
  const Eigen::Matrix2Xd inner_p = transport(inner_e, ImagePlane(front), light_on_front(front));
  RayBundle bundle;
  bundle.first = in_space(with_ring(inner_a, rays, first.setup), first.setup);
  bundle.second = in_space(with_ring(inner_b, rays, second.setup), second.setup);
  bundle.exit = exits(bundle.first, bundle.second);
  bundle.entry = with_ring(inner_p, rays, front);
  bundle.converged = transport.converged();
  return bundle;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/render/source_picture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/image/color.h"
#include "core/image/image.h"
#include "core/optics/light_source.h"
#include "core/optics/optical_setup.h"
#include "design/flux/flux_image.h"
#include "design/flux/surface_projection.h"
#include "design/optimize/lbfgs.h"
#include "design/render.h"
#include "design/render/render_flux.h"

namespace lensforge {
namespace {

/// Source points per pixel of the source's image, minimum and maximum. With a 64² portrait and a
/// source of 2.2 pixels, 123 points instead of half as many change the picture by an MAE of 0.0010.
constexpr double kPointsPerPixel = 25.0;
constexpr int kMinPoints = 64;
constexpr int kMaxPoints = 256;
/// An image of at most so many pixels takes half of the minimum: of a 48² lake with one of 0.18
/// pixels 32 points err by an MAE of 0.00009, 64 by 0.00005.
constexpr double kSmallImage = 0.5;

double surface_height(const Lens& lens) { return lens.surface.vertices.row(2).mean(); }

}  // namespace

int source_point_count(const OpticalSetup& setup, double z) {
  const double blur = source_blur(setup, z);
  const double wanted = kPointsPerPixel * blur * blur;
  const int least = blur > kSmallImage ? kMinPoints : kMinPoints / 2;
  return wanted < kMaxPoints ? std::max(least, static_cast<int>(wanted)) : kMaxPoints;
}

std::vector<double> picture_under(const OpticalSetup& setup, int count, const PointPicture& picture,
                                  const RunControl& control) {
  if (setup.extent.none() && setup.spectrum.none()) return picture(setup);
  int done = 0;
  std::vector<double> sum(static_cast<std::size_t>(setup.pixels.prod()), 0.0);
  for (const LightColor& color : light_colors(setup)) {
    for (const SourcePoint& point : source_points(setup.extent, count)) {
      const OpticalSetup& whole = color.setup;
      const std::vector<double> one =
          picture(setup.extent.none() ? whole : lit_from(whole, point.at));
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += color.share * point.share * one[i];
      control.report({"picture", double{1} * ++done, 0.0, "view " + std::to_string(done)});
    }
  }
  return sum;
}

std::vector<double> picture_under_few_rays(const OpticalSetup& setup, double z, int count,
                                           const RayPictures& rays, const Executor& executor,
                                           const RunControl& control) {
  std::vector<double> sum = picture_under(setup, count, rays.few, control);
  const std::vector<double> coarse = picture_by_convolution(setup, z, rays.few, executor);
  const std::vector<double> fine = picture_by_convolution(setup, z, rays.many, executor);
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += fine[i] - coarse[i];
  return sum;
}

std::vector<double> picture_by_convolution(const OpticalSetup& setup, double z,
                                           const PointPicture& picture, const Executor& executor) {
  SourceBlurOn<Executor> blur(source_kernel(setup, z), setup.pixels.x(), setup.pixels.y(),
                              executor);
  OpticalSetup sharp = lit_from(setup, Eigen::Vector2d::Zero());
  sharp.pixels *= blur.parts();
  const std::vector<double> parts = picture(sharp);
  const std::span<const double> pixels = blur.apply(executor, parts);
  return {pixels.begin(), pixels.end()};
}

Image corrected(const Image& target, const std::vector<double>& exact,
                const std::vector<double>& seen) {
  Image aim = target;
  const double total = target.total();
  for (std::size_t i = 0; i < exact.size(); ++i) {
    float& value = aim.values()[i];
    value = std::max(0.0F, value - static_cast<float>(total * (exact[i] - seen[i])));
  }
  return aim;
}

std::vector<double> flux_under_source(const Lens& lens, const OpticalSetup& setup, int count,
                                      const Executor& executor, const RunControl& control) {
  if (lens.model != SurfaceModel::kSpline) {
    const auto picture = [&](const OpticalSetup& point) {
      return flux_of_surface(lens.surface, point, lens.model, executor);
    };
    return picture_under(setup, count, picture, control);
  }
  const auto picture = [&](int samples) {
    return [&, samples](const OpticalSetup& point) {
      return render_spline(*lens.spline, samples, point, executor);
    };
  };
  const int samples = picture_samples(*lens.spline);
  if (setup.extent.none() || samples <= kMeshSamples) {
    return picture_under(setup, count, picture(samples), control);
  }
  const RayPictures rays{picture(std::max(kMeshSamples, samples / 2)), picture(samples)};
  std::vector<double> flux =
      picture_under_few_rays(setup, surface_height(lens), count, rays, executor, control);
  // Differences of pictures may leave less than nothing where it is dark.
  for (double& value : flux) value = std::max(value, 0.0);
  return flux;
}

SourceCheck check_source(const Lens& lens, const Executor& executor, const RunControl& control) {
  const double z = surface_height(lens);
  const auto point = [&](const OpticalSetup& setup) {
    return flux_of_lens(lens, setup, executor, control);
  };
  SourceCheck check;
  check.blur = source_blur(lens.setup, z);
  const int count = source_point_count(lens.setup, z);
  check.points = static_cast<int>(source_points(lens.setup.extent, count).size());
  const auto difference = [&](std::vector<double> other) {
    for (double& value : other) value *= lens.target.total();
    const Eigen::Vector2i& pixels = lens.setup.pixels;
    return compare(image_of(other, pixels.x(), pixels.y()), lens.render).mae;
  };
  check.halving = difference(flux_under_source(lens, lens.setup, count / 2, executor, control));
  check.convolution = difference(picture_by_convolution(lens.setup, z, point, executor));
  return check;
}

// Notation: μ_i = T e^{q_i} / Σ e^q, so any q is allowed; T the target's total. A step in q is a
// relative change of a pixel's light, which suits the display encoding.

namespace {

/// Minimum light of a pixel at the start, relative to the mean: a pixel that starts without light
/// can never get any.
constexpr double kMinStart = 1e-4;

/// Limits of the search (64² portrait, source of 2.2 pixels: MAE 0.0021 after 3 s).
constexpr int kMaxIterations = 400;
constexpr double kRelativeDecrease = 1e-3;

class LimitObjective {
 public:
  LimitObjective(const Image& target, SourceKernel kernel, const Executor& executor)
      : executor_(executor),
        wanted_(encoded_values(target)),
        total_(target.total()),
        blur_(std::move(kernel), target.columns(), target.rows(), executor),
        light_(wanted_.size() * static_cast<std::size_t>(blur_.parts() * blur_.parts())),
        bar_(light_.size()) {}

  [[nodiscard]] int parts() const { return blur_.parts(); }

  double operator()(std::span<const double> q, std::span<double> gradient) {
    set_light(q);
    const std::span<const double> picture = blur_.apply(executor_, light_);
    const std::span<double> picture_bar = blur_.bar();
    double value = 0.0;
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
      const double error = encode(picture[i]) - wanted_[i];
      value += error * error;
      picture_bar[i] = 2.0 * error * encode_slope(picture[i]);
    }
    blur_.apply_adjoint(executor_, bar_);
    const double mean = std::inner_product(bar_.begin(), bar_.end(), light_.begin(), 0.0) / total_;
    for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] = light_[i] * (bar_[i] - mean);
    return value;
  }

  /// k∗μ for the last q.
  std::span<const double> picture() { return blur_.apply(executor_, light_); }

  /// Sets and returns μ for q.
  const std::vector<double>& set_light(std::span<const double> q) {
    const double highest = *std::max_element(q.begin(), q.end());
    for (std::size_t i = 0; i < q.size(); ++i) light_[i] = std::exp(q[i] - highest);
    const double sum = std::accumulate(light_.begin(), light_.end(), 0.0);
    for (double& value : light_) value *= total_ / sum;
    return light_;
  }

 private:
  const Executor& executor_;
  std::vector<double> wanted_;
  double total_;
  SourceBlurOn<Executor> blur_;
  std::vector<double> light_;
  std::vector<double> bar_;
};

/// The target's light, spread evenly over the parts of a pixel.
std::vector<double> start_from(const Image& target, int parts) {
  const double least = kMinStart * target.total() / static_cast<double>(target.values().size());
  std::vector<double> q;
  for (int row = 0; row < parts * target.rows(); ++row) {
    for (int column = 0; column < parts * target.columns(); ++column) {
      const double value = target.at(column / parts, row / parts);
      q.push_back(std::log(std::max(least, value)));
    }
  }
  return q;
}

/// Sums the light of the parts of every pixel.
Image in_pixels(const std::vector<double>& light, int columns, int rows, int parts) {
  std::vector<double> sums(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0.0);
  for (std::size_t i = 0; i < light.size(); ++i) {
    const auto line = static_cast<std::size_t>(columns) * static_cast<std::size_t>(parts);
    const auto side = static_cast<std::size_t>(parts);
    sums[i / line / side * static_cast<std::size_t>(columns) + i % line / side] += light[i];
  }
  return image_of(sums, columns, rows);
}

}  // namespace

SourceLimit source_limit(const Image& target, const OpticalSetup& setup, double z,
                         const Executor& executor) {
  LimitObjective objective(target, source_kernel(setup, z), executor);
  const RawObjective function = [&](std::span<const double> q, std::span<double> gradient) {
    return objective(q, gradient);
  };
  const RawPreconditioner plain = [](std::span<const double> g, std::span<double> r) {
    std::copy(g.begin(), g.end(), r.begin());
  };
  LbfgsOptions options;
  options.max_iterations = kMaxIterations;
  options.relative_decrease = kRelativeDecrease;
  std::vector<double> q = start_from(target, objective.parts());
  LbfgsOn<Executor>(function, plain, options, executor).run([](int, double) { return true; }, q);
  SourceLimit limit;
  limit.light =
      in_pixels(objective.set_light(q), target.columns(), target.rows(), objective.parts());
  const Image best = image_of(objective.picture(), target.columns(), target.rows());
  limit.metrics = compare(best, target);
  limit.metrics.flux_inside = best.total() / target.total();
  return limit;
}

namespace {

/// Zero outside of the picture.
double picture_at(const Image& image, const Eigen::Vector2d& at) {
  const Eigen::Array2d size(image.columns(), image.rows());
  if ((at.array() < 0.0).any() || (at.array() > size).any()) return 0.0;
  return bilinear(image, at);
}

/// wanted − projected; 1 is the value of an evenly lit picture of `total` flux as large as the
/// lens.
Image difference(const Image& wanted, const Image& projected, const OpticalSetup& setup,
                 double total) {
  Image image(wanted.columns(), wanted.rows());
  if (!(total > 0.0)) return image;
  const double unit = total / static_cast<double>(wanted.values().size()) *
                      setup.image_size.prod() / setup.lens_size.prod();
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    const double missing = double{wanted.values()[i]} - double{projected.values()[i]};
    image.values()[i] = static_cast<float>(missing / unit);
  }
  return image;
}

}  // namespace

WantedPicture::WantedPicture(const SurfaceMesh& mesh, const OpticalSetup& setup,
                             const Image& target, const Executor& executor)
    : setup_(lit_from(setup, Eigen::Vector2d::Zero())),
      light_(setup_),
      target_(target),
      executor_(executor),
      reach_(LightPath(setup).reach(1.0, mesh.vertices.row(2).mean()) *
             (traits(setup.body).reflects ? -1.0 : 1.0)) {
  mae_ = evaluate(mesh, setup, SurfaceModel::kSmooth, target, &wanted_, executor).mae;
}

WantedPicture::Comparison WantedPicture::compare(const SurfaceMesh& mesh,
                                                 const Eigen::Matrix3Xd& normals) const {
  Image projected;
  const double mae = evaluate(mesh, normals, setup_, target_, &projected, executor_).mae;
  const Image missing = difference(wanted_, projected, setup_, target_.total());
  Comparison result{mae - mae_, Eigen::VectorXd::Zero(mesh.vertex_count())};
  parallel_for(executor_, "missing flux", mesh.vertex_count(), [&](std::int64_t v) {
    const Eigen::Vector3d n = normals.col(v).normalized();
    const Eigen::Vector3d p = mesh.vertices.col(v);
    if (!light_.transmits(p, n)) return;
    result.missing[v] = picture_at(missing, project_vertex(p, n, light_));
  });
  return result;
}

Eigen::Matrix2d WantedPicture::stretch(const Eigen::Vector3d& p, const Eigen::Vector2d& slope,
                                       const Eigen::Matrix2d& bend) const {
  const Eigen::Vector3d w(-slope.x(), -slope.y(), 1.0);
  const Eigen::Vector3d n = w.normalized();
  if (!light_.transmits(p, n)) return Eigen::Matrix2d::Identity();
  Eigen::Matrix2d rows;
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector2d u_bar =
        Eigen::Vector2d::Unit(k).cwiseQuotient(light_.plane().pixels_per_mm());
    Eigen::Vector3d p_bar = Eigen::Vector3d::Zero();
    const Eigen::Vector3d n_bar = project_vertex_adjoint(p, n, light_, u_bar, p_bar);
    const Eigen::Vector3d w_bar = normalize_adjoint(n, w.norm(), n_bar);
    rows.row(k) = p_bar.head<2>() + p_bar.z() * slope - bend.transpose() * w_bar.head<2>();
  }
  return rows;
}

}  // namespace lensforge

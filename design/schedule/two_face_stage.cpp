// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/two_face_stage.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "core/compute/scalar.h"
#include "core/optics/light_path.h"
#include "core/spline/control_net.h"
#include "design/energy/objective.h"

namespace lensforge {
namespace {

/// See guided_optimization.cpp.
constexpr double kFaceProbePixels = 0.02;
constexpr int kFaceHalvings = 20;
constexpr double kFaceHeightFloor = 0.5;
constexpr double kFaceShiftFloor = 0.25;

/// Curvature, as a share of the heights', below which shifts along the surface move no light: the
/// surface is flat, and they are held.
constexpr double kLeastBend = 1e-4;

double lowest_of_grid(const GridShape& shape) {
  const double longest = std::max(shape.columns, shape.rows) - 1.0;
  return std::numbers::pi * std::numbers::pi / (longest * longest);
}

/// Linear interpolation between `samples` even samples at the Greville points of a spline.
Eigen::MatrixXd at_greville_points(int coefficients, int samples) {
  const int cells = coefficients - kSplineDegree;
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(coefficients, samples);
  for (int i = 0; i < coefficients; ++i) {
    const double t = greville_point(i, cells) * (samples - 1) / cells;
    const int first = std::clamp(static_cast<int>(t), 0, samples - 2);
    weights(i, first) = 1.0 - (t - first);
    weights(i, first + 1) = t - first;
  }
  return weights;
}

/// Even control points over the lens, for what of them may move.
Eigen::Matrix3Xd even_points(const GridShape& net, const Eigen::Vector2d& size) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, Eigen::Index{net.columns} * net.rows);
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const auto i = static_cast<int>(k % net.columns);
    const auto j = static_cast<int>(k / net.columns);
    points(0, k) = size.x() * greville_point(i, net.columns - 3) / (net.columns - 3);
    points(1, k) = size.y() * greville_point(j, net.rows - 3) / (net.rows - 3);
  }
  return points;
}

/// Of a front only heights move.
Eigen::Matrix3Xd heights_alone(const GridShape& front) {
  Eigen::Matrix3Xd movable = Eigen::Matrix3Xd::Zero(3, Eigen::Index{front.columns} * front.rows);
  movable.row(2).setOnes();
  return movable;
}

double aspect_of(const Eigen::Vector2d& size, int columns, int rows) {
  return size.y() / rows / (size.x() / columns);
}

}  // namespace

TwoFaceStage::TwoFaceStage(const GridShape& net, const GridShape& front,
                           const std::vector<ScreenGoal>& goals, const ObjectiveOptions& options,
                           const FaceLimits& limits, const Executor& executor)
    : executor_(executor),
      setup_(goals.front().setup),
      thickness_(limits.thickness),
      net_(net),
      front_(front),
      exit_size_(Eigen::Index{3} * net.columns * net.rows),
      lift_x_(at_greville_points(net.columns, front.columns)),
      lift_y_(at_greville_points(net.rows, front.rows)),
      objective_(net, front, goals, options, limits, executor),
      exit_preconditioner_(net, aspect_of(setup_.lens_size, net.columns - 1, net.rows - 1),
                           objective_detail::movable_coordinates(even_points(net, setup_.lens_size),
                                                                 setup_.lens_size),
                           executor),
      front_preconditioner_(front, aspect_of(setup_.lens_size, front.columns - 1, front.rows - 1),
                            heights_alone(front), executor) {
  exit_preconditioner_.xy = {1.0, kFaceShiftFloor, 1.0, 0.0};
  exit_preconditioner_.z = {1.0, kFaceHeightFloor * lowest_of_grid(net), 2.0, 0.0};
  front_preconditioner_.xy = {1.0, 1.0, 0.0, 0.0};
  front_preconditioner_.z = {1.0, kFaceHeightFloor * lowest_of_grid(front), 2.0, 0.0};
}

TwoFaceStage::Vector TwoFaceStage::variables_of(const LensFaces& faces) const {
  Vector x(static_cast<std::size_t>(exit_size_ + 3 * faces.front.size()), 0.0);
  Eigen::Map<Eigen::Matrix3Xd> exit(x.data(), 3, exit_size_ / 3);
  Eigen::Map<Eigen::Matrix3Xd> front(x.data() + exit_size_, 3, faces.front.size());
  exit = faces.exit;
  exit.row(2) -= (lift_x_ * faces.front * lift_y_.transpose()).reshaped().transpose();
  front.row(2) = faces.front.reshaped().transpose();
  return x;
}

void TwoFaceStage::set_faces(std::span<const double> x, LensFaces& faces) const {
  const Eigen::Map<const Eigen::Matrix3Xd> exit(x.data(), 3, exit_size_ / 3);
  const Eigen::Map<const Eigen::Matrix3Xd> front(x.data() + exit_size_, 3,
                                                 Eigen::Index{front_.columns} * front_.rows);
  faces.front = front.row(2).reshaped(front_.columns, front_.rows);
  faces.exit = exit;
  faces.exit.row(2) += (lift_x_ * faces.front * lift_y_.transpose()).reshaped().transpose();
}

double TwoFaceStage::evaluate(std::span<const double> x, std::span<double> gradient) {
  set_faces(x, faces_);
  last_ = objective_.evaluate(faces_, gradient_);
  if (!last_.feasible) return kInfinity;
  Eigen::Map<Eigen::Matrix3Xd> exit(gradient.data(), 3, exit_size_ / 3);
  Eigen::Map<Eigen::Matrix3Xd> front(gradient.data() + exit_size_, 3, gradient_.front.size());
  exit = gradient_.exit;
  const Eigen::MatrixXd heights = gradient_.exit.row(2).reshaped(net_.columns, net_.rows);
  front.setZero();
  front.row(2) = (gradient_.front + lift_x_.transpose() * heights * lift_y_).reshaped().transpose();
  return last_.energy.total;
}

void TwoFaceStage::precondition(std::span<const double> g, double exponent, std::span<double> r) {
  const auto exit = static_cast<std::size_t>(exit_size_);
  exit_preconditioner_.apply(g.first(exit), exponent, r.first(exit));
  front_preconditioner_.apply(g.subspan(exit), exponent, r.subspan(exit));
}

double& TwoFaceStage::scale(Part part) {
  if (part == Part::kFront) return front_preconditioner_.z.scale;
  return (part == Part::kHeights ? exit_preconditioner_.z : exit_preconditioner_.xy).scale;
}

/// Random signs in the variables of one part.
TwoFaceStage::Vector TwoFaceStage::signs(Part part) const {
  Vector signs(
      static_cast<std::size_t>(exit_size_ + Eigen::Index{3} * front_.columns * front_.rows), 0.0);
  for (std::size_t i = 0; i < signs.size(); ++i) {
    const bool front = i >= static_cast<std::size_t>(exit_size_);
    const Part own = front ? Part::kFront : (i % 3 == 2 ? Part::kHeights : Part::kShifts);
    if (own == part) signs[i] = (mixed_bits((i + 1) * kGoldenGamma) & 1U) != 0 ? 1.0 : -1.0;
  }
  return signs;
}

/// Root mean square of P^½ H P^½ applied to random signs, H by a central difference of the
/// gradient; 0 if the barriers refuse every step.
double TwoFaceStage::curvature(const Vector& x, Part part) {
  Vector direction(x.size());
  precondition(signs(part), 0.5, direction);
  const auto count = static_cast<double>(part == Part::kFront ? front_.columns * front_.rows
                                                              : net_.columns * net_.rows);
  const auto vector = [](const Vector& v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  const double rms = vector(direction).norm() / std::sqrt(count);
  const double cell = setup_.lens_size.x() / (part == Part::kFront ? front_.columns : net_.columns);
  double motion = rms;
  if (part == Part::kHeights) motion = LightPath(setup_).reach(rms / cell);
  if (part == Part::kFront) motion = thickness_ * rms / cell;
  double step = kFaceProbePixels * setup_.image_size.x() / setup_.pixels.x() / motion;
  Vector there(x.size());
  Vector forward(x.size());
  Vector backward(x.size());
  const auto look = [&](double along, Vector& gradient) {
    for (std::size_t i = 0; i < x.size(); ++i) there[i] = x[i] + along * direction[i];
    return std::isfinite(evaluate(there, gradient));
  };
  for (int halvings = 0; !look(step, forward) || !look(-step, backward); step *= 0.5) {
    if (++halvings == kFaceHalvings) return 0.0;
  }
  for (std::size_t i = 0; i < x.size(); ++i) there[i] = (forward[i] - backward[i]) / (2.0 * step);
  precondition(there, 0.5, direction);
  // Only the part's own variables: the others have scales of their own.
  const Vector own = signs(part);
  double squares = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (own[i] != 0.0) squares += direction[i] * direction[i];
  }
  return std::sqrt(squares / count);
}

/// Scales every part to a preconditioned curvature of one along random directions.
void TwoFaceStage::calibrate(const Vector& x) {
  for (const Part part : {Part::kHeights, Part::kFront, Part::kShifts}) scale(part) = 1.0;
  double heights = 0.0;
  for (const Part part : {Part::kHeights, Part::kFront, Part::kShifts}) {
    const double bend = curvature(x, part);
    if (part == Part::kHeights) heights = bend;
    if (bend > kLeastBend * heights) {
      scale(part) = 1.0 / bend;
    } else {
      scale(part) = 0.0;
    }
  }
}

LbfgsSummary TwoFaceStage::run(const LbfgsOptions& options, const GuidedStage::Observer& observe,
                               LensFaces& faces) {
  Vector x = variables_of(faces);
  calibrate(x);
  const RawObjective function = [&](std::span<const double> at, std::span<double> gradient) {
    return evaluate(at, gradient);
  };
  const RawPreconditioner preconditioner = [&](std::span<const double> g, std::span<double> r) {
    precondition(g, 1.0, r);
  };
  LbfgsOn<Executor> minimizer(function, preconditioner, options, executor_);
  try {
    LbfgsSummary summary =
        minimizer.run([&](int iteration, double) { return observe(iteration, last_); }, x);
    set_faces(x, faces);
    return summary;
  } catch (...) {
    set_faces(x, faces);
    throw;
  }
}

std::vector<double> TwoFaceStage::errors(const LensFaces& faces) {
  if (!objective_.evaluate(faces, gradient_).feasible) return {};
  return objective_.errors();
}

}  // namespace lensforge

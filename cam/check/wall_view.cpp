// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/wall_view.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/image/color.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

void require_same_size(const Image& one, const Image& other, const std::string& name) {
  if (one.columns() == other.columns() && one.rows() == other.rows()) return;
  throw InputError(name + ": has " + std::to_string(other.columns()) + " × " +
                   std::to_string(other.rows()) + " pixels, the photograph " +
                   std::to_string(one.columns()) + " × " + std::to_string(one.rows()) +
                   "; take both from the same place with the same camera");
}

/// Level of the wall without the picture: this share of a photograph is darker.
constexpr double kWallShare = 0.1;

/// A value below which this share of the picture lies.
double quantile(const Image& image, double share) {
  std::vector<float> values(image.values().begin(), image.values().end());
  const auto nth =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace

Photograph photograph(Image light, const Image& dark, const std::string& name) {
  if (!dark.empty()) require_same_size(light, dark, "--dark");
  Photograph photo{std::move(light), {}, name};
  photo.usable.reserve(photo.light.values().size());
  for (const float value : photo.light.values()) photo.usable.push_back(value < kClipped ? 1 : 0);
  for (std::size_t i = 0; i < dark.values().size(); ++i) {
    float& value = photo.light.values()[i];
    value = std::max(value - dark.values()[i], 0.0F);
  }
  return photo;
}

namespace {

/// Pixels below this light do not relate exposures: 8 bits resolve them poorly.
constexpr float kDimmest = 0.02F;
constexpr std::size_t kFewestShared = 100;

/// Light of `longer` per light of `shorter`, from the pixels that both show.
double exposure_ratio(const Photograph& shorter, const Photograph& longer) {
  require_same_size(shorter.light, longer.light, longer.name);
  double product = 0.0;
  double square = 0.0;
  std::size_t shared = 0;
  for (std::size_t i = 0; i < shorter.usable.size(); ++i) {
    const float low = shorter.light.values()[i];
    if (shorter.usable[i] == 0 || longer.usable[i] == 0 || low < kDimmest) continue;
    product += static_cast<double>(low) * longer.light.values()[i];
    square += static_cast<double>(low) * low;
    ++shared;
  }
  if (shared < kFewestShared) {
    throw InputError(longer.name + ": shares " + std::to_string(shared) +
                     " unclipped pixels with " + shorter.name + ", must be " +
                     std::to_string(kFewestShared) + " or more; take exposures that are nearer");
  }
  return product / square;
}

}  // namespace

Photograph bracketed(const std::vector<Photograph>& exposures) {
  std::vector<const Photograph*> order;
  order.reserve(exposures.size());
  for (const Photograph& one : exposures) order.push_back(&one);
  std::stable_sort(order.begin(), order.end(), [](const Photograph* a, const Photograph* b) {
    return a->light.total() < b->light.total();
  });
  Photograph all = *order.front();
  double unit = 1.0;
  for (std::size_t k = 1; k < order.size(); ++k) {
    unit *= exposure_ratio(*order[k - 1], *order[k]);
    for (std::size_t i = 0; i < all.usable.size(); ++i) {
      if (order[k]->usable[i] == 0) continue;
      all.light.values()[i] = static_cast<float>(order[k]->light.values()[i] / unit);
      all.usable[i] = 1;
    }
    const std::optional<SeenChart>& chart = order[k]->chart;
    if (chart && (!all.chart || chart->corners.size() > all.chart->corners.size())) {
      all.chart = chart;
    }
  }
  return all;
}

Photograph without_chart(Photograph photo) {
  const Eigen::Matrix3d map = photo.chart->perspective(photo.light);
  const auto wall = static_cast<float>(quantile(photo.light, kWallShare));
  for (int r = 0; r < photo.light.rows(); ++r) {
    for (int c = 0; c < photo.light.columns(); ++c) {
      const Eigen::Vector3d seen = map * place_in(photo.light, {c + 0.5, r + 0.5}).homogeneous();
      const Eigen::Vector2d at = seen.hnormalized();
      if (seen.z() <= 0.0 || at.minCoeff() < 0.0 || (chart_size() - at).minCoeff() < 0.0) continue;
      photo.light.at(c, r) = wall;
      photo.usable[static_cast<std::size_t>(r) * static_cast<std::size_t>(photo.light.columns()) +
                   static_cast<std::size_t>(c)] = Photograph::kCovered;
    }
  }
  return photo;
}

Photograph shrunk(const Photograph& photo, double by) {
  const int parts = std::max(1, static_cast<int>(by));
  if (parts == 1) return photo;
  const int columns = photo.light.columns() / parts;
  const int rows = photo.light.rows() / parts;
  const int left = (photo.light.columns() - columns * parts) / 2;
  const int top = (photo.light.rows() - rows * parts) / 2;
  Photograph less{Image(columns, rows), {}, photo.name, photo.chart};
  if (less.chart) {
    less.chart->error /= parts;
    for (SeenChart::Corner& corner : less.chart->corners) {
      corner.pixel = (corner.pixel - Eigen::Vector2d(left, top)) / parts;
    }
  }
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      double sum = 0.0;
      unsigned char usable = 1;
      for (int k = 0; k < parts * parts; ++k) {
        const int column = left + c * parts + k % parts;
        const int row = top + r * parts + k / parts;
        sum += photo.light.at(column, row);
        usable = photo.is_usable(column, row) ? usable : 0;
      }
      less.light.at(c, r) = static_cast<float>(sum / (1.0 * parts * parts));
      less.usable.push_back(usable);
    }
  }
  return less;
}

namespace {

/// Weights of four neighbours at t between the middle two, and their derivatives.
struct CubicWeights {
  explicit CubicWeights(double t)
      : value{0.5 * t * (t * (2.0 - t) - 1.0), 0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
              0.5 * t * (t * (4.0 - 3.0 * t) + 1.0), 0.5 * t * t * (t - 1.0)},
        slope{0.5 * (t * (4.0 - 3.0 * t) - 1.0), 0.5 * t * (9.0 * t - 10.0),
              0.5 * (t * (8.0 - 9.0 * t) + 1.0), 0.5 * t * (3.0 * t - 2.0)} {}

  std::array<double, 4> value;
  std::array<double, 4> slope;
};

}  // namespace

WallPicture::Light WallPicture::at(const Eigen::Vector2d& wall) const {
  const Eigen::Vector2d scale(0.5 * inner_columns(), 0.5 * inner_rows());
  const double x = (wall.x() + 1.0) * scale.x() + margin - 0.5;
  const double y = (wall.y() + 1.0) * scale.y() + margin - 0.5;
  if (!(x >= 1.0 && y >= 1.0 && x < light.columns() - 2.0 && y < light.rows() - 2.0)) return {};
  const int c = static_cast<int>(x);
  const int r = static_cast<int>(y);
  const CubicWeights across(x - c);
  const CubicWeights down(y - r);
  const float* row =
      &light.values()[static_cast<std::size_t>(r - 1) * static_cast<std::size_t>(light.columns()) +
                      static_cast<std::size_t>(c - 1)];
  Light sum;
  for (std::size_t j = 0; j < 4; ++j, row += light.columns()) {
    double value = 0.0;
    double slope = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      value += across.value[i] * row[i];
      slope += across.slope[i] * row[i];
    }
    sum.value += down.value[j] * value;
    sum.gradient += Eigen::Vector2d(down.value[j] * slope, down.slope[j] * value);
  }
  sum.gradient = sum.gradient.cwiseProduct(scale);
  return sum;
}

Eigen::Vector2d wall_of(const Eigen::VectorXd& view, const Eigen::Vector2d& pixel) {
  const double square = pixel.squaredNorm();
  const Eigen::Vector2d y =
      pixel * (1.0 + square * (view[view::kDistortion] + square * view[view::kDistortion + 1]));
  const double* const h = view.data();
  const double w = h[6] * y.x() + h[7] * y.y() + 1.0;
  return Eigen::Vector2d(h[0] * y.x() + h[1] * y.y() + h[2], h[3] * y.x() + h[4] * y.y() + h[5]) /
         w;
}

namespace {

/// Half a photograph's diagonal, pixels.
double half_diagonal(const Image& image) { return 0.5 * std::hypot(image.columns(), image.rows()); }

/// X of a pixel's middle.
Eigen::Vector2d place_of(const Image& image, int column, int row) {
  return place_in(image, {column + 0.5, row + 0.5});
}

double falloff_of(const Eigen::VectorXd& view, const Eigen::Vector2d& x) {
  const double* const f = &view[view::kFalloff];
  return 1.0 + f[0] * x.x() + f[1] * x.y() + f[2] * x.x() * x.x() + f[3] * x.x() * x.y() +
         f[4] * x.y() * x.y();
}

/// Light of the room.
double room_of(const Eigen::VectorXd& view, const Eigen::Vector2d& x) {
  return view[view::kAmbient] + view.segment<2>(view::kAmbient + 1).dot(x);
}

}  // namespace

Eigen::Vector2d place_in(const Image& photo, const Eigen::Vector2d& pixel) {
  return (pixel - 0.5 * Eigen::Vector2d(photo.columns(), photo.rows())) / half_diagonal(photo);
}

double wall_light(const Eigen::VectorXd& view, const Eigen::Vector2d& pixel, double light) {
  return (light / falloff_of(view, pixel) - room_of(view, pixel)) / view[view::kGain];
}

/// Newton's steps, bounded: towards places that no pixel shows they have no end. They begin in the
/// middle: from a place beyond a distortion's fold they would lead to others there.
Eigen::Vector2d WallToPhoto::at(const Eigen::Vector2d& wall) const {
  constexpr double kStep = 1e-5;
  constexpr int kSteps = 12;
  constexpr double kLongest = 0.5;  // Half diagonals of the photograph.
  constexpr double kFarthest = 2.0;
  Eigen::Vector2d at(0.0, 0.0);
  for (int k = 0; k < kSteps; ++k) {
    const Eigen::Vector2d off = wall_of(view_, at) - wall;
    Eigen::Matrix2d slope;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d moved = at + kStep * Eigen::Vector2d::Unit(axis);
      slope.col(axis) = (wall_of(view_, moved) - wall - off) / kStep;
    }
    const Eigen::Vector2d step = slope.partialPivLu().solve(off);
    if (!step.allFinite()) break;
    at -= step * std::min(1.0, kLongest / step.norm());
    if (step.norm() < 1e-9) break;
  }
  if (at.norm() > kFarthest) at.setZero();
  return half_ + at * half_.norm();
}

namespace {

/// Light added to both sides before they are compared: below some hundredths of white a camera's
/// black level and the prediction's stray light are no better than that, and sRGB is steep.
constexpr double kToe = 0.02;

}  // namespace

SeenPixels::SeenPixels(const Photograph& photo, const Eigen::VectorXd& view, double reach)
    : pixel_(1.0 / half_diagonal(photo.light)) {
  std::vector<double> seen;
  for (int r = 0; r < photo.light.rows(); ++r) {
    for (int c = 0; c < photo.light.columns(); ++c) {
      const Eigen::Vector2d place = place_of(photo.light, c, r);
      if (!photo.is_usable(c, r)) continue;
      if (!(wall_of(view, place).lpNorm<Eigen::Infinity>() < reach)) continue;
      places_.push_back(place);
      seen.push_back(encode(kToe + photo.light.at(c, r)));
    }
  }
  if (photo.chart) tie_.emplace(*photo.chart, photo.light);
  if (tie_) seen.resize(seen.size() + static_cast<std::size_t>(tie_->size()), 0.0);
  seen_ = Eigen::Map<const Eigen::VectorXd>(seen.data(), std::ssize(seen));
}

/// The picture's own pixels are means already: the places add what a pixel's variance on the wall
/// has beyond theirs, so that neither is blurred more than the other. A perspective changes pixels
/// by tens of per cent, which would read as another lamp.
SeenPixels::Spots SeenPixels::spots(const Eigen::VectorXd& view, const WallPicture& wall,
                                    const Eigen::Vector2d& place) const {
  constexpr double kShare = 0.25;
  const Eigen::Vector2d at = wall_of(view, place);
  const Eigen::Vector2d side(0.5 * wall.inner_columns(), 0.5 * wall.inner_rows());
  const auto edge = [&](const Eigen::Vector2d& way) {
    const Eigen::Vector2d moved = wall_of(view, place + kShare * pixel_ * way) - at;
    return Eigen::Vector2d(moved.cwiseProduct(side) / kShare);
  };
  const Eigen::Vector2d right = edge(Eigen::Vector2d::UnitX());
  const Eigen::Vector2d below = edge(Eigen::Vector2d::UnitY());
  // A parallelogram's covariance is that of its sides' ends / 12.
  const Eigen::Matrix2d more =
      (right * right.transpose() + below * below.transpose() - Eigen::Matrix2d::Identity()) / 12.0;
  const double x = std::sqrt(std::max(more(0, 0), 0.0));
  const double slant = x > 0.0 ? more(0, 1) / x : 0.0;
  const double y = std::sqrt(std::max(more(1, 1) - slant * slant, 0.0));
  const Eigen::Vector2d across = Eigen::Vector2d(x, slant).cwiseQuotient(side);
  const Eigen::Vector2d down = Eigen::Vector2d(0.0, y).cwiseQuotient(side);
  const double far = std::sqrt(1.5);  // Three places with a variance of 1.
  Spots spots;
  std::size_t next = 0;
  for (const double a : {-far, 0.0, far}) {
    for (const double b : {-far, 0.0, far}) spots.at(next++) = at + a * across + b * down;
  }
  return spots;
}

WallPicture::Light SeenPixels::seen_light(const Eigen::VectorXd& view, const WallPicture& wall,
                                          const Eigen::Vector2d& place) const {
  WallPicture::Light mean;
  for (const Eigen::Vector2d& spot : spots(view, wall, place)) {
    const WallPicture::Light light = wall.at(spot);
    mean.value += light.value / 9.0;
    mean.gradient += light.gradient / 9.0;
  }
  return mean;
}

SeenPixels::LightRows SeenPixels::light_rows(const Eigen::VectorXd& view, const WallPicture& wall,
                                             const std::vector<Eigen::Vector2d>& ways,
                                             Eigen::Index most, const Executor& executor) const {
  const Eigen::Index every = (size() + most - 1) / most;
  const Eigen::Index count = (size() + every - 1) / every;
  const Eigen::Index moved = std::ssize(ways);
  LightRows rows{Eigen::MatrixXd(count, moved + 3), Eigen::VectorXd(count)};
  parallel_for(executor, "light rows", count, [&](Eigen::Index row) {
    const Eigen::Vector2d& place = places_[static_cast<std::size_t>(row * every)];
    const double light = decode(seen_[row * every]);
    const double slope = encode_slope(light);
    const double lit = slope * falloff_of(view, place);
    const Spots around = spots(view, wall, place);
    for (Eigen::Index k = 0; k < moved; ++k) {
      double sum = 0.0;
      for (const Eigen::Vector2d& spot : around) {
        sum += wall.at(spot - ways[static_cast<std::size_t>(k)]).value / 9.0;
      }
      rows.of(row, k) = lit * view[view::kGain] * sum;
    }
    rows.of.row(row).tail(3) << lit, lit * place.x(), lit * place.y();
    rows.seen[row] = slope * (light - kToe);
  });
  return rows;
}

Eigen::VectorXd SeenPixels::shown(const Eigen::VectorXd& view, const WallPicture& wall) const {
  Eigen::VectorXd shown(size());
  if (tie_) shown.tail(tie_->size()) = in_steps(tie_->residuals(view, wall.log_size));
  for (Eigen::Index i = 0; i < std::ssize(places_); ++i) {
    const Eigen::Vector2d& place = places_[static_cast<std::size_t>(i)];
    shown[i] = encode(kToe + falloff_of(view, place) *
                                 (view[view::kGain] * seen_light(view, wall, place).value +
                                  room_of(view, place)));
  }
  return shown;
}

Eigen::MatrixXd SeenPixels::derivatives(const Eigen::VectorXd& view,
                                        const WallPicture& wall) const {
  Eigen::MatrixXd rows(size(), static_cast<int>(view::kCount));
  if (tie_) rows.bottomRows(tie_->size()) = in_steps(tie_->derivatives(view));
  for (Eigen::Index i = 0; i < std::ssize(places_); ++i) {
    const Eigen::Vector2d& x = places_[static_cast<std::size_t>(i)];
    const WallPicture::Light light = seen_light(view, wall, x);
    const double falloff = falloff_of(view, x);
    const double lit = view[view::kGain] * light.value + room_of(view, x);
    const double slope = encode_slope(kToe + falloff * lit);
    const double r2 = x.squaredNorm();
    const Eigen::Vector2d y =
        x * (1.0 + r2 * (view[view::kDistortion] + r2 * view[view::kDistortion + 1]));
    const Eigen::Vector2d at = wall_of(view, x);
    const double w = view[6] * y.x() + view[7] * y.y() + 1.0;
    const Eigen::Vector2d per = falloff * view[view::kGain] / w * light.gradient;
    Eigen::Matrix2d map;  // ∂at/∂y · w
    map << view[0] - at.x() * view[6], view[1] - at.x() * view[7], view[3] - at.y() * view[6],
        view[4] - at.y() * view[7];
    const double along = per.dot(map * x);
    const double toward = -per.dot(at);
    rows.row(i) << per.x() * y.x(), per.x() * y.y(), per.x(), per.y() * y.x(), per.y() * y.y(),
        per.y(), toward * y.x(), toward * y.y(), along * r2, along * r2 * r2, falloff * light.value,
        lit * x.x(), lit * x.y(), lit * x.x() * x.x(), lit * x.x() * x.y(), lit * x.y() * x.y(),
        falloff, falloff * x.x(), falloff * x.y();
    rows.row(i) *= slope;
  }
  return rows;
}

double SeenPixels::correlation(const Eigen::VectorXd& view, const WallPicture& wall) const {
  const Eigen::VectorXd all = shown(view, wall);
  std::vector<double> one;
  std::vector<double> other;
  for (Eigen::Index i = 0; i < std::ssize(places_); ++i) {
    if (wall_of(view, places_[static_cast<std::size_t>(i)]).lpNorm<Eigen::Infinity>() > 1.0) {
      continue;
    }
    one.push_back(all[i]);
    other.push_back(seen_[i]);
  }
  if (one.empty()) return 0.0;
  Eigen::ArrayXd a = Eigen::Map<Eigen::ArrayXd>(one.data(), std::ssize(one));
  Eigen::ArrayXd b = Eigen::Map<Eigen::ArrayXd>(other.data(), std::ssize(other));
  a -= a.mean();
  b -= b.mean();
  const double length = std::sqrt(a.square().sum() * b.square().sum());
  return length > 0.0 ? (a * b).sum() / length : 0.0;
}

SeenPixels::NeighbourMeans SeenPixels::neighbour_means(const Eigen::VectorXd& residuals) const {
  NeighbourMeans means;
  double count = 0.0;
  for (std::size_t i = 1; i < places_.size(); ++i) {
    const Eigen::Vector2d way = (places_[i] - places_[i - 1]) / pixel_;
    if ((way - Eigen::Vector2d::UnitX()).norm() > 0.5) continue;
    const double left = residuals[static_cast<Eigen::Index>(i) - 1];
    const double right = residuals[static_cast<Eigen::Index>(i)];
    count += 1.0;
    means.product += (left * right - means.product) / count;
    means.square += (0.5 * (left * left + right * right) - means.square) / count;
  }
  return means;
}

double SeenPixels::values_alike(const Eigen::VectorXd& residuals) const {
  constexpr double kMost = 0.9;
  const NeighbourMeans means = neighbour_means(residuals);
  const double rho =
      means.square > 0.0 ? std::clamp(means.product / means.square, 0.0, kMost) : 0.0;
  return std::pow((1.0 + rho) / (1.0 - rho), 2);
}

double SeenPixels::shared_by_neighbours(const Eigen::VectorXd& residuals) const {
  return std::sqrt(std::max(neighbour_means(residuals).product, 0.0));
}

LeastSquares view_problem() {
  LeastSquares problem;
  problem.longest = Eigen::VectorXd::Constant(view::kCount, 0.3);
  problem.longest.segment(view::kHomography, 6).setConstant(1.0);
  problem.free.resize(view::kCount);
  std::iota(problem.free.begin(), problem.free.end(), 0);
  problem.least_gain = 1e-6;
  return problem;
}

Eigen::VectorXd fit_view(const SeenPixels& pixels, const WallPicture& wall, Eigen::VectorXd view,
                         const std::vector<int>& free) {
  LeastSquares problem = view_problem();
  problem.free = free;
  problem.residuals = [&](const Eigen::VectorXd& at) {
    return Eigen::VectorXd(pixels.shown(at, wall) - pixels.seen());
  };
  problem.derivatives = [&](const Eigen::VectorXd& at) { return pixels.derivatives(at, wall); };
  return minimize(problem, std::move(view));
}

namespace {

/// Mean and covariance of light over places.
struct Moments {
  double weight = 0.0;
  Eigen::Vector2d mean{0.0, 0.0};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();

  [[nodiscard]] Eigen::Matrix2d root() const {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
    axes.computeDirect(covariance);
    return axes.operatorSqrt();
  }
};

/// Light beyond this share of the level where the mean of it falls counts, so that a dim wall does
/// not.
constexpr double kCounts = 0.3;

/// Level where the mean of an image's light falls: how much dark wall is around does not matter.
double level_of(const Image& image, double ambient) {
  double sum = 0.0;
  double square = 0.0;
  for (const float value : image.values()) {
    const double light = std::max(value - ambient, 0.0);
    sum += light;
    square += light * light;
  }
  return sum > 0.0 ? square / sum : 0.0;
}

template <class Place>
Moments moments(const Image& image, double ambient, const Place& place) {
  const double threshold = ambient + kCounts * level_of(image, ambient);
  Moments sum;
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  for (int r = 0; r < image.rows(); ++r) {
    for (int c = 0; c < image.columns(); ++c) {
      const double weight = std::max(image.at(c, r) - threshold, 0.0);
      const Eigen::Vector2d at = place(c, r);
      sum.weight += weight;
      sum.mean += weight * at;
      square += weight * at * at.transpose();
    }
  }
  if (sum.weight == 0.0) return sum;
  sum.mean /= sum.weight;
  sum.covariance = square / sum.weight - sum.mean * sum.mean.transpose();
  return sum;
}

/// A way in which a photograph may show a picture: wall = turn · what is upright.
struct Pose {
  Eigen::Matrix2d turn;
  const char* fault;  ///< Null if it is upright.
};

std::array<Pose, 8> poses() {
  Eigen::Matrix2d quarter;
  quarter << 0.0, -1.0, 1.0, 0.0;
  Eigen::Matrix2d mirror;
  mirror << -1.0, 0.0, 0.0, 1.0;
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  const char* const turned = "is turned by a quarter; turn it upright";
  const char* const mirrored =
      "is mirrored; photograph it from the viewer's side, or flip it left to right";
  return {Pose{one, nullptr},
          {-one, "is upside down; turn it by half a turn"},
          {mirror, mirrored},
          {-mirror, "is flipped top to bottom; flip it back, or turn the lens upright"},
          {quarter, turned},
          {-quarter, turned},
          {quarter * mirror, "is turned by a quarter and mirrored; turn and flip it"},
          {-quarter * mirror, "is turned by a quarter and mirrored; turn and flip it"}};
}

Eigen::VectorXd view_from(const Moments& photo, const Moments& wall, const Eigen::Matrix2d& turn) {
  const Eigen::Matrix2d back = turn.transpose();
  Moments turned = wall;
  turned.covariance = back * wall.covariance * turn;
  const Eigen::Matrix2d map = turn * turned.root() * photo.root().inverse();
  const Eigen::Vector2d offset = wall.mean - map * photo.mean;
  Eigen::VectorXd view = Eigen::VectorXd::Zero(view::kCount);
  view.segment(view::kHomography, 3) << map(0, 0), map(0, 1), offset.x();
  view.segment(view::kHomography + 3, 3) << map(1, 0), map(1, 1), offset.y();
  return view;
}

WallPicture coarser(const WallPicture& wall, double columns) {
  const double by = std::max(1.0, std::floor(wall.inner_columns() / columns));
  const int margin = static_cast<int>(wall.margin / by);
  if (by == 1.0) return wall;
  // Whole pixels, so that the rectangle keeps its place.
  const int cut = wall.margin - margin * static_cast<int>(by);
  const int wide = static_cast<int>(wall.inner_columns() / by) + 2 * margin;
  const int high = static_cast<int>(wall.inner_rows() / by) + 2 * margin;
  Image inside(wide * static_cast<int>(by), high * static_cast<int>(by));
  for (int r = 0; r < inside.rows(); ++r) {
    for (int c = 0; c < inside.columns(); ++c) {
      inside.at(c, r) = wall.light.at(std::min(c + cut, wall.light.columns() - 1),
                                      std::min(r + cut, wall.light.rows() - 1));
    }
  }
  return {resample(inside, wide, high), margin, wall.log_size};
}

constexpr double kReach = 1.2;  ///< Of SeenPixels: the picture and some wall around it.

/// Values of a view up to this one are free in each stage of the search.
std::vector<int> first(int count) {
  std::vector<int> free(static_cast<std::size_t>(count));
  std::iota(free.begin(), free.end(), 0);
  return free;
}

std::vector<int> with_light(std::vector<int> free) {
  free.push_back(view::kGain);
  free.push_back(view::kAmbient);
  return free;
}

/// Level of the wall without the picture.
double ambient_of(const Image& light) { return quantile(light, kWallShare); }

/// Dimmest picture that 8 bits resolve.
constexpr double kTooDark = 0.02;
/// Least ratio of the brightest light to the wall's: a picture is brighter than its surroundings.
constexpr double kShows = 1.3;
/// Share of a picture's light beyond which clipping leaves too little to compare.
constexpr double kMostClipped = 0.35;

}  // namespace

void require_light(const Photograph& photo) {
  const double ambient = ambient_of(photo.light);
  const double bright = quantile(photo.light, 0.995);
  std::size_t lit = 0;
  std::size_t clipped = 0;
  for (std::size_t i = 0; i < photo.usable.size(); ++i) {
    if (photo.light.values()[i] < ambient + 0.3 * (bright - ambient) && photo.usable[i] != 0) {
      continue;
    }
    ++lit;
    clipped += photo.usable[i] == 0 ? 1 : 0;
  }
  if (static_cast<double>(clipped) > kMostClipped * static_cast<double>(lit)) {
    throw InputError(
        photo.name + ": " +
        decimal_text(100.0 * static_cast<double>(clipped) / static_cast<double>(lit), 1) +
        " % of the lit wall is clipped, at most 35 %; expose a quarter as long");
  }
  if (bright < kTooDark) {
    throw InputError(photo.name + ": is too dark: the brightest wall has " +
                     number_text(100.0 * bright, 2) +
                     " % of white, must be 2 % or more; expose longer");
  }
  if (bright < kShows * ambient) {
    throw InputError(photo.name +
                     ": shows no picture of the lens: nothing is brighter than the wall around it");
  }
}

namespace {

/// Least correlation of the right picture after the search.
constexpr double kSame = 0.8;
/// By how much another pose must fit better than the upright one: pictures may be symmetric.
constexpr double kPoseMargin = 0.03;

/// Pixels across the picture while it is searched: edges attract from about one of them, so that
/// the first are wide.
constexpr double kFirstAcross = 14.0;
constexpr double kCoarseAcross = 28.0;
constexpr double kFineAcross = 56.0;

/// A photograph and a picture of about as many pixels across.
struct Level {
  Level(const Photograph& photo_of, const WallPicture& wall_of, const Eigen::VectorXd& view,
        double across)
      : photo(shrunk(photo_of, pixels_across(photo_of, view) / across)),
        wall(coarser(wall_of, across)) {}

  Photograph photo;
  WallPicture wall;
};

/// The view of the pose that fits best.
struct Match {
  Eigen::VectorXd view;
  double correlation = -1.0;
  const char* fault = nullptr;  ///< Pose::fault
};

Match best_match(const Photograph& photo, const WallPicture& wall) {
  constexpr double kFirstSide = 160.0;
  const Photograph small =
      shrunk(photo, std::max(photo.light.columns(), photo.light.rows()) / kFirstSide);
  const double ambient = ambient_of(small.light);
  const Moments seen =
      moments(small.light, ambient, [&](int c, int r) { return place_of(small.light, c, r); });
  const Moments shown = moments(wall.light, 0.0, [&](int c, int r) {
    return Eigen::Vector2d(2.0 * (c + 0.5 - wall.margin) / wall.inner_columns() - 1.0,
                           2.0 * (r + 0.5 - wall.margin) / wall.inner_rows() - 1.0);
  });
  const auto start = [&](const Eigen::Matrix2d& turn) {
    if (!small.chart) return view_from(seen, shown, turn);
    return view_by_chart(*small.chart, small.light, seen.mean, shown.mean, turn);
  };
  const Eigen::VectorXd even = start(Eigen::Matrix2d::Identity());
  const Level level(photo, wall, even, kFirstAcross);
  const Level finer(photo, wall, even, kCoarseAcross);
  const double gain = level_of(small.light, ambient) / level_of(wall.light, 0.0);
  Match best;
  double upright = -1.0;
  for (const Pose& pose : poses()) {
    Eigen::VectorXd view = start(pose.turn);
    view[view::kGain] = gain;
    view[view::kAmbient] = ambient;
    const SeenPixels pixels(level.photo, view, 1.5);
    // Where a chart gives the perspective it would be lost.
    if (!small.chart) view = fit_view(pixels, level.wall, view, with_light(first(6)));
    view = fit_view(pixels, level.wall, view, with_light(first(8)));
    const SeenPixels more(finer.photo, view, 1.3);
    view = fit_view(more, finer.wall, view, with_light(first(8)));
    const double score = more.correlation(view, finer.wall);
    if (pose.fault == nullptr) upright = score;
    const double margin = pose.fault != nullptr && best.correlation == upright ? kPoseMargin : 0.0;
    if (score > best.correlation + margin) best = {view, score, pose.fault};
  }
  return best;
}

}  // namespace

Eigen::VectorXd find_picture(const Photograph& photo, const WallPicture& wall) {
  require_light(photo);
  const Match match = best_match(photo, wall);
  if (match.correlation < kSame) {
    throw InputError(photo.name +
                     ": shows another picture than that of this lens: the best match has a "
                     "correlation of " +
                     decimal_text(match.correlation, 2) + ", must be 0.8 or more");
  }
  if (match.fault != nullptr) throw InputError(photo.name + ": " + match.fault);
  const Level fine(photo, wall, match.view, kFineAcross);
  const SeenPixels pixels(fine.photo, match.view, kReach);
  Eigen::VectorXd view = fit_view(pixels, fine.wall, match.view, with_light(first(8)));
  view = fit_view(pixels, fine.wall, view, with_light(first(10)));
  return fit_view(pixels, fine.wall, view, first(view::kCount));
}

double pixels_across(const Photograph& photo, const Eigen::VectorXd& view) {
  // Of the linear map in the middle: its inverse takes the rectangle's width back.
  Eigen::Matrix2d map;
  map << view[0], view[1], view[3], view[4];
  const Eigen::Matrix2d back = map.inverse();
  return 2.0 * back.col(0).norm() * half_diagonal(photo.light);
}

}  // namespace lensforge

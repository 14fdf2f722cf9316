// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/spline/made_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "core/lens/continued_surface.h"
#include "core/optics/polish_transfer.h"
#include "core/spline/control_net.h"

namespace lensforge {
namespace {

constexpr std::size_t kCount = GaussianWeights::kCount;
constexpr int kReach = GaussianWeights::kReach;
constexpr double kSpacing = 0.75;  ///< Distance between samples, in σ.
constexpr double kMaxSamples = 1e8;

/// Samples next to each rim, and their distance, in that of the others: three of them lie in the
/// outermost knot cell if it is at least 0.28 σ wide, where differences are exact. With half of it
/// rounding takes a tenfold error to gradients.
constexpr int kBesideRim = 3;
constexpr double kRimSpacing = 1.0 / 8.0;

}  // namespace

GaussianWeights::GaussianWeights(double offset, double step, double sigma) {
  // Neighbours' weights differ by a factor that itself shrinks by the same factor from one to the
  // next.
  const double shrink = std::exp(-step * step / (sigma * sigma));
  double factor = std::exp(-step * (offset + 0.5 * step) / (sigma * sigma));
  double weight = std::exp(-0.5 * offset * offset / (sigma * sigma));
  std::array<double, kCount> apart{};
  double sum = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) {
    apart[k] = offset + static_cast<double>(k) * step;
    value[k] = weight;
    sum += weight;
    weight *= factor;
    factor *= shrink;
  }
  double mean = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) {
    value[k] /= sum;
    mean += value[k] * apart[k];
  }
  // A constant has no slope, and a straight line its own.
  double variance = 0.0;
  for (std::size_t k = 0; k < kCount; ++k) {
    slope[k] = value[k] * (apart[k] - mean);
    variance += slope[k] * apart[k];
  }
  for (std::size_t k = 0; k < kCount; ++k) {
    slope[k] /= variance;
    bend[k] = (slope[k] * (apart[k] - mean) - value[k]) / variance;
  }
}

AveragingGrid::AveragingGrid(const Eigen::Vector2d& lens_size, const MadeBy& made)
    : size_(lens_size),
      sigma_(made.polish_sigma, std::hypot(made.polish_sigma, made.pitch / std::sqrt(12.0))),
      rim_depth_(made.rim_depth),
      rim_length_(made.rim_length) {
  if (!made.rows_along_x) sigma_.reverseInPlace();
  const Eigen::Array2d wanted = size_.array() / (kSpacing * sigma_.array());
  cells_ = wanted.ceil().cast<int>().max(kReach);
  step_ = size_.array() / cells_.cast<double>().array();
  if (made.polish_order == kFilmOrder) lay_filter(made.polish_sigma);
  lines_ = {make_lines(0), make_lines(1)};
}

/// In make_heights() the samples next to the rim, from it inwards, are behind all others.
std::vector<AveragingGrid::Line> AveragingGrid::make_lines(int axis) const {
  const double step = step_[axis];
  const Eigen::Index beside = cells_[axis] + 1 + 2 * margin_[axis];
  std::vector<Line> lines;
  for (int i = 0; i <= cells_[axis]; ++i) lines.push_back({i * step, i + margin_[axis]});
  for (int k = 0; k < kBesideRim; ++k) {
    const double apart = (k + 1) * kRimSpacing * step;
    lines.push_back({apart, beside + k});
    lines.push_back({cells_[axis] * step - apart, beside + kBesideRim + k});
  }
  std::sort(lines.begin(), lines.end(),
            [](const Line& a, const Line& b) { return a.place < b.place; });
  return lines;
}

/// The terms' weights, made exact for constants.
void AveragingGrid::lay_filter(double sigma) {
  double mean = 0.0;
  for (const LineTerm& term : film_over_gaussian_terms()) {
    FilterTerm& weights = filter_.emplace_back();
    Eigen::Vector2d means(0.0, 0.0);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double step = step_[static_cast<Eigen::Index>(axis)] / sigma;
      const int reach = static_cast<int>(std::ceil(kFilmReach / step));
      margin_[static_cast<Eigen::Index>(axis)] = kReach + reach;
      for (int k = 0; k <= reach; ++k) {
        weights[axis].push_back(step * term.kernel(k * step, 0));
        means[static_cast<Eigen::Index>(axis)] += (k == 0 ? 1.0 : 2.0) * weights[axis].back();
      }
    }
    for (double& weight : weights[1]) weight *= term.sign;
    mean += term.sign * means.prod();
  }
  for (FilterTerm& weights : filter_) {
    for (double& weight : weights[1]) weight /= mean;
  }
}

Eigen::MatrixXd AveragingGrid::make_heights() const {
  const Eigen::Vector2i size = samples().array() + 2 * kBesideRim;
  return Eigen::MatrixXd::Zero(size.x(), size.y());
}

/// f(−t) = f − t f′ + height(t) f″ with one-sided differences.
AveragingGrid::RimWeights AveragingGrid::rim_weights(int axis) const {
  const Eigen::Vector4d slope = Eigen::Vector4d(-11.0, 18.0, -9.0, 2.0) / 6.0;
  const Eigen::Vector4d bend(2.0, -5.0, 4.0, -1.0);
  const double apart = kRimSpacing * step_[axis];
  RimWeights weights;
  for (int k = 1; k <= margin_[axis]; ++k) {
    const double beyond = k * step_[axis];
    weights.emplace_back(Eigen::Vector4d::Unit(0) - beyond / apart * slope +
                         RunOut{}.height(beyond) / (apart * apart) * bend);
  }
  return weights;
}

namespace {

/// Calls `take(beyond, inside, weight)` for the numbers of every line of samples beyond both rims
/// of an axis and of those that make it up. @param lines  all of the axis.
template <class Weights, class Take>
void for_each_beyond(Eigen::Index lines, const Weights& weights, const Take& take) {
  const auto beyond = std::ssize(weights);
  const Eigen::Index beside = lines - 2 * kBesideRim;
  const Eigen::Index last = beside - 1 - beyond;
  for (Eigen::Index k = 1; k <= beyond; ++k) {
    const Eigen::Vector4d& w = weights[static_cast<std::size_t>(k - 1)];
    for (Eigen::Index j = 0; j < w.size(); ++j) {
      take(beyond - k, j == 0 ? beyond : beside + j - 1, w[j]);
      take(last + k, j == 0 ? last : beside + kBesideRim + j - 1, w[j]);
    }
  }
}

}  // namespace

void AveragingGrid::continue_beyond_rim(Eigen::MatrixXd& heights) const {
  heights.topRows(margin_.x()).setZero();
  heights.middleRows(margin_.x() + cells_.x() + 1, margin_.x()).setZero();
  for_each_beyond(heights.rows(), rim_weights(0),
                  [&](Eigen::Index to, Eigen::Index from, double w) {
                    heights.row(to) += w * heights.row(from);
                  });
  heights.leftCols(margin_.y()).setZero();
  heights.middleCols(margin_.y() + cells_.y() + 1, margin_.y()).setZero();
  for_each_beyond(heights.cols(), rim_weights(1),
                  [&](Eigen::Index to, Eigen::Index from, double w) {
                    heights.col(to) += w * heights.col(from);
                  });
}

void AveragingGrid::continue_beyond_rim_adjoint(Eigen::MatrixXd& heights_bar) const {
  for_each_beyond(heights_bar.cols(), rim_weights(1),
                  [&](Eigen::Index to, Eigen::Index from, double w) {
                    heights_bar.col(from) += w * heights_bar.col(to);
                  });
  for_each_beyond(heights_bar.rows(), rim_weights(0),
                  [&](Eigen::Index to, Eigen::Index from, double w) {
                    heights_bar.row(from) += w * heights_bar.row(to);
                  });
}

/// The sum of the filter's terms where they have all their samples.
Eigen::MatrixXd AveragingGrid::convolved(const Eigen::MatrixXd& samples,
                                         const Executor& executor) const {
  const Eigen::Vector2i reach = margin_.array() - kReach;
  const Eigen::Index rows = samples.rows() - 2 * reach.x();
  const Eigen::Index columns = samples.cols() - 2 * reach.y();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::MatrixXd along_x(rows, samples.cols());
  for (const FilterTerm& term : filter_) {
    const auto filter_x = [&](std::int64_t j) {
      const auto from = [&](Eigen::Index k) { return samples.col(j).segment(reach.x() + k, rows); };
      along_x.col(j) = term[0][0] * from(0);
      for (Eigen::Index k = 1; k <= reach.x(); ++k) {
        along_x.col(j) += term[0][static_cast<std::size_t>(k)] * (from(-k) + from(k));
      }
    };
    parallel_for(executor, "filter heights along x", samples.cols(), filter_x, 16);
    const auto filter_y = [&](std::int64_t j) {
      const auto from = [&](Eigen::Index k) { return along_x.col(j + reach.y() + k); };
      sum.col(j) += term[1][0] * from(0);
      for (Eigen::Index k = 1; k <= reach.y(); ++k) {
        sum.col(j) += term[1][static_cast<std::size_t>(k)] * (from(-k) + from(k));
      }
    };
    parallel_for(executor, "filter heights along y", columns, filter_y, 16);
  }
  return sum;
}

Eigen::MatrixXd AveragingGrid::filtered(const Eigen::MatrixXd& heights,
                                        const Executor& executor) const {
  if (filter_.empty()) return heights;
  return convolved(heights.topLeftCorner(samples().x(), samples().y()), executor);
}

/// The weights are even: the adjoint is the same filter, over zeros around the samples.
Eigen::MatrixXd AveragingGrid::filtered_adjoint(const Eigen::MatrixXd& filtered_bar,
                                                const Executor& executor) const {
  if (filter_.empty()) return filtered_bar;
  const Eigen::Vector2i around = 2 * (margin_.array() - kReach);
  Eigen::MatrixXd padded = Eigen::MatrixXd::Zero(filtered_bar.rows() + 2 * around.x(),
                                                 filtered_bar.cols() + 2 * around.y());
  padded.block(around.x(), around.y(), filtered_bar.rows(), filtered_bar.cols()) = filtered_bar;
  Eigen::MatrixXd heights_bar = make_heights();
  heights_bar.topLeftCorner(samples().x(), samples().y()) = convolved(padded, executor);
  return heights_bar;
}

int AveragingGrid::first_sample(double at, int axis) const {
  return std::clamp(static_cast<int>(at / step_[axis]), 0, cells_[axis] - 1);
}

GaussianWeights AveragingGrid::weights(double at, int axis) const {
  const double first = (first_sample(at, axis) - kReach) * step_[axis];
  return {first - at, step_[axis], sigma_[axis]};
}

AveragingGrid::RimLoss AveragingGrid::rim_loss(const Eigen::Vector2d& xy) const {
  RimLoss loss;
  for (int k = 0; k < 2; ++k) {
    const double low = rim_depth_ * std::exp(-xy[k] / rim_length_);
    const double high = rim_depth_ * std::exp((xy[k] - size_[k]) / rim_length_);
    loss.z += low + high;
    loss.slope[k] = (high - low) / rim_length_;
    loss.bend[k] = (low + high) / (rim_length_ * rim_length_);
  }
  return loss;
}

double AveragingGrid::least_sigma(const Eigen::Vector2d& lens_size) {
  return std::sqrt(lens_size.prod() / kMaxSamples) / kSpacing;
}

namespace {

Eigen::Matrix2d plan_of(const SplineFrame& frame) {
  Eigen::Matrix2d plan;
  plan << frame.by_u.head<2>(), frame.by_v.head<2>();
  return plan;
}

}  // namespace

MadeSurface::MadeSurface(const ControlNet& net, const MadeBy& made, const Executor& executor)
    : floor_(made.polish_floor),
      net_(floor_ > 0.0 ? net : ControlNet{}),
      grid_({net.points.row(0).maxCoeff(), net.points.row(1).maxCoeff()}, made),
      heights_(grid_.make_heights()) {
  const std::vector<AveragingGrid::Line>& rows = grid_.lines(1);
  const auto sample = [&](std::int64_t row) {
    sample_row(net, rows[static_cast<std::size_t>(row)]);
  };
  parallel_for(executor, "heights to polish", static_cast<std::int64_t>(rows.size()), sample, 1);
  grid_.continue_beyond_rim(heights_);
  heights_ = grid_.filtered(heights_, executor);
}

/// Newton's method from the last sample, and a Taylor expansion over its remaining error.
void MadeSurface::sample_row(const ControlNet& net, const AveragingGrid::Line& row) {
  constexpr int kSteps = 2;
  const Eigen::Vector2d high = net.cells().cast<double>();
  Eigen::Vector2d uv =
      net.parameters_of({0.0, row.place}, {0.0, high.y() * row.place / grid_.size().y()});
  SplineFrame frame = net.at(uv);
  for (const AveragingGrid::Line& column : grid_.lines(0)) {
    const Eigen::Vector2d xy(column.place, row.place);
    for (int step = 0; step < kSteps; ++step) {
      uv += plan_of(frame).inverse() * (xy - frame.point.head<2>());
      uv = uv.cwiseMax(0.0).cwiseMin(high);
      frame = net.at(uv);
    }
    const SurfaceShape shape = frame.shape();
    const Eigen::Vector2d rest = xy - frame.point.head<2>();
    heights_(column.index, row.index) =
        shape.z + rest.dot(shape.slope) + 0.5 * rest.dot(shape.bend * rest);
  }
}

SurfacePoint MadeSurface::at(const Eigen::Vector2d& xy) const {
  const GaussianWeights x = grid_.weights(xy.x(), 0);
  const GaussianWeights y = grid_.weights(xy.y(), 1);
  const Eigen::Index first = grid_.first_sample(xy.y(), 1);
  SurfacePoint made;
  for (std::size_t n = 0; n < kCount; ++n) {
    const double* const z =
        &heights_(grid_.first_sample(xy.x(), 0), first + static_cast<Eigen::Index>(n));
    double value = 0.0;
    double slope = 0.0;
    for (std::size_t m = 0; m < kCount; ++m) {
      value += x.value[m] * z[m];
      slope += x.slope[m] * z[m];
    }
    made.z += y.value[n] * value;
    made.slope += Eigen::Vector2d(y.value[n] * slope, y.slope[n] * value);
  }
  if (floor_ > 0.0) {
    const Eigen::Vector2d cells = net_.cells().cast<double>();
    const Eigen::Vector2d start = xy.cwiseQuotient(grid_.size()).cwiseProduct(cells);
    const SurfaceShape own = net_.at(net_.parameters_of(xy, start)).shape();
    made.z = floor_ * own.z + (1.0 - floor_) * made.z;
    made.slope = floor_ * own.slope + (1.0 - floor_) * made.slope;
  }
  const AveragingGrid::RimLoss loss = grid_.rim_loss(xy);
  made.z -= loss.z;
  made.slope -= loss.slope;
  return made;
}

void MadeField::sample(const GridWindow& window, const Executor& executor,
                       SurfacePatch& patch) const {
  resize_patch(window, false, patch);
  const auto sample_row = [&](std::int64_t j) {
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const auto n = static_cast<std::size_t>(j * window.columns + i);
      const SurfacePoint point = surface_.at(window.node(i, j));
      patch.z[n] = point.z;
      patch.slope_x[n] = point.slope.x();
      patch.slope_y[n] = point.slope.y();
    }
  };
  parallel_for(executor, "made surface", window.rows, sample_row, 4);
}

SampledSurface made_nodes(const ControlNet& net, const MadeBy& made, int samples,
                          const Executor& executor) {
  SampledSurface nodes = spline_nodes(net, samples);
  const MadeSurface surface(net, made, executor);
  const auto make = [&](std::int64_t i) {
    const SurfacePoint point = surface.at(nodes.mesh.vertices.col(i).head<2>());
    nodes.mesh.vertices(2, i) = point.z;
    nodes.normals.col(i) << -point.slope, 1.0;
  };
  parallel_for(executor, "made nodes", nodes.mesh.vertex_count(), make);
  return nodes;
}

namespace {

/// Newton's method stops at steps shorter than this, in knot cells; the remaining error is its
/// square.
constexpr double kShortStep = 1e-3;
constexpr int kMaxSteps = 20;
constexpr int kMaxHalvings = 8;

/// Number of bands whose derivatives are summed separately, for any number of threads.
constexpr std::int64_t kBands = 32;

/// Weighted sums along y of a block of heights, one per column.
using BlockRow = std::array<double, kCount>;

BlockRow weighted_rows(const double* block, Eigen::Index stride, const BlockRow& weights) {
  BlockRow sum{};
  for (std::size_t n = 0; n < kCount; ++n) {
    const double* const row = block + static_cast<Eigen::Index>(n) * stride;
    for (std::size_t m = 0; m < kCount; ++m) sum[m] += weights[n] * row[m];
  }
  return sum;
}

double dot(const BlockRow& a, const BlockRow& b) {
  double sum = 0.0;
  for (std::size_t m = 0; m < kCount; ++m) sum += a[m] * b[m];
  return sum;
}

/// Sums over several bands of work: each band has its own rows, which are added in the bands'
/// order.
class BandSums {
 public:
  /// @param row_size  numbers per row.
  explicit BandSums(Eigen::Index row_size) : row_size_(row_size) {}

  struct Band {
    Eigen::Index first = 0;
    Eigen::MatrixXd sums;  ///< Row size × rows, starting at `first`.
    [[nodiscard]] double* row(Eigen::Index i) { return sums.col(i - first).data(); }
  };

  /// @param rows_of  first and last row that a band adds to.
  void run(const Executor& executor, const char* kernel,
           const std::function<std::pair<int, int>(std::int64_t)>& rows_of,
           const std::function<void(std::int64_t, Band&)>& fill) {
    const auto work = [&](std::int64_t band) {
      const auto [first, last] = rows_of(band);
      if (last < first) return;
      Band& sums = bands_[static_cast<std::size_t>(band)];
      sums = {first, Eigen::MatrixXd::Zero(row_size_, last - first + 1)};
      fill(band, sums);
    };
    parallel_for(executor, kernel, kBands, work, 1);
  }

  /// Adds row i of all bands to `to`.
  void add_row(Eigen::Index i, double* to) const {
    Eigen::Map<Eigen::VectorXd> sum(to, row_size_);
    for (const Band& band : bands_) {
      const Eigen::Index at = i - band.first;
      if (at >= 0 && at < band.sums.cols()) sum += band.sums.col(at);
    }
  }

 private:
  Eigen::Index row_size_;
  std::array<Band, kBands> bands_;
};

std::int64_t band_start(std::int64_t band, std::int64_t count) { return band * count / kBands; }

}  // namespace

MadeNodes::MadeNodes(const GridShape& net, const Eigen::Vector2d& size, int samples,
                     const MadeBy& made, const Executor& executor)
    : executor_(executor),
      floor_(made.polish_floor),
      grid_(size, made),
      net_{net, Eigen::Matrix3Xd(3, Eigen::Index{net.columns} * net.rows)},
      plan_(spline_nodes_on(net, samples, executor)),
      heights_(grid_.make_heights()),
      samples_(grid_.lines(0).size() * grid_.lines(1).size()),
      nodes_(static_cast<std::size_t>(shape().columns) * static_cast<std::size_t>(shape().rows)),
      plan_bar_(3 * nodes_.size()),
      normal_bar_(3 * nodes_.size(), 0.0) {}

void MadeNodes::look(const double* points, double* positions, double* normals) {
  std::copy_n(points, net_.points.size(), net_.points.data());
  parallel_for(
      executor_, "heights to polish", static_cast<std::int64_t>(grid_.lines(1).size()),
      [&](std::int64_t row) { sample_row(static_cast<std::size_t>(row)); }, 1);
  grid_.continue_beyond_rim(heights_);
  filtered_ = grid_.filtered(heights_, executor_);
  known_ = true;
  plan_.look(points, positions, normals);
  parallel_for(executor_, "made nodes", static_cast<std::int64_t>(nodes_.size()),
               [&](std::int64_t i) { average(i, positions, normals); });
}

/// Newton's method; steps are halved until they come closer.
Eigen::Vector2d MadeNodes::search(const Eigen::Vector2d& xy, Eigen::Vector2d uv,
                                  SplineFrame& frame) const {
  const Eigen::Vector2d high = net_.cells().cast<double>();
  frame = net_.at(uv);
  Eigen::Vector2d rest = xy - frame.point.head<2>();
  for (int step = 0; step < kMaxSteps; ++step) {
    Eigen::Matrix2d plan;
    plan << frame.by_u.head<2>(), frame.by_v.head<2>();
    if (!(plan.determinant() > 0.0)) break;
    Eigen::Vector2d move = plan.inverse() * rest;
    const Eigen::Vector2d before = uv;
    for (int halvings = 0; halvings < kMaxHalvings; ++halvings, move *= 0.5) {
      const Eigen::Vector2d next = (before + move).cwiseMax(0.0).cwiseMin(high);
      const SplineFrame there = net_.at(next);
      const Eigen::Vector2d left = xy - there.point.head<2>();
      if (!(left.squaredNorm() < rest.squaredNorm())) continue;
      uv = next;
      frame = there;
      rest = left;
      break;
    }
    if ((uv - before).cwiseAbs().maxCoeff() < kShortStep) break;
  }
  return uv;
}

void MadeNodes::sample_row(std::size_t row) {
  const AveragingGrid::Line& line = grid_.lines(1)[row];
  Eigen::Vector2d before(0.0, net_.cells().y() * line.place / grid_.size().y());
  for (std::size_t i = 0; i < grid_.lines(0).size(); ++i) {
    const Eigen::Vector2d xy(grid_.lines(0)[i].place, line.place);
    Sample& s = sample(i, row);
    SplineFrame frame;
    s.uv = search(xy, known_ ? s.uv : before, frame);
    before = s.uv;
    const SurfaceShape shape = frame.shape();
    const Eigen::Vector2d rest = xy - frame.point.head<2>();
    s.slope = shape.slope + shape.bend * rest;
    heights_(grid_.lines(0)[i].index, line.index) = shape.z + 0.5 * rest.dot(shape.slope + s.slope);
  }
}

void MadeNodes::average(std::int64_t i, double* positions, double* normals) {
  Node& node = nodes_[static_cast<std::size_t>(i)];
  node.place = column3(positions, i).head<2>();
  const GaussianWeights x = grid_.weights(node.place.x(), 0);
  const GaussianWeights y = grid_.weights(node.place.y(), 1);
  const double* const block =
      &filtered_(grid_.first_sample(node.place.x(), 0), grid_.first_sample(node.place.y(), 1));
  const BlockRow value = weighted_rows(block, filtered_.rows(), y.value);
  const BlockRow slope = weighted_rows(block, filtered_.rows(), y.slope);
  const BlockRow bend = weighted_rows(block, filtered_.rows(), y.bend);
  const AveragingGrid::RimLoss loss = grid_.rim_loss(node.place);
  const double rest = 1.0 - floor_;
  const double mixed = rest * dot(slope, x.slope);
  node.slope = rest * Eigen::Vector2d(dot(value, x.slope), dot(slope, x.value)) - loss.slope;
  node.bend << rest * dot(value, x.bend) - loss.bend.x(), mixed, mixed,
      rest * dot(bend, x.value) - loss.bend.y();
  node.normal = column3(normals, i);
  const double own = floor_ == 0.0 ? 0.0 : floor_ * column3(positions, i).z();
  column3(positions, i).z() = own + rest * dot(value, x.value) - loss.z;
  column3(normals, i) << floor_ / node.normal.z() * node.normal.head<2>() - node.slope, 1.0;
}

void MadeNodes::look_adjoint(const double* position_bar, const double* normal_bar,
                             double* points_bar) {
  spread_nodes(position_bar, normal_bar);
  heights_bar_ = grid_.filtered_adjoint(heights_bar_, executor_);
  grid_.continue_beyond_rim_adjoint(heights_bar_);
  plan_.look_adjoint(plan_bar_.data(), normal_bar_.data(), points_bar);
  spread_samples(points_bar);
}

/// Carries derivatives from the nodes to the heights on the grid and to the nodes' places.
void MadeNodes::spread_nodes(const double* position_bar, const double* normal_bar) {
  const std::int64_t columns = shape().columns;
  const auto nodes_of = [&](std::int64_t band) {
    return std::pair(band_start(band, shape().rows) * columns,
                     band_start(band + 1, shape().rows) * columns);
  };
  const auto rows_of = [&](std::int64_t band) {
    const auto [begin, end] = nodes_of(band);
    int low = grid_.cells().y();
    int high = 0;
    for (std::int64_t i = begin; i < end; ++i) {
      const int first = grid_.first_sample(nodes_[static_cast<std::size_t>(i)].place.y(), 1);
      low = std::min(low, first);
      high = std::max(high, first);
    }
    return std::pair(low, high + static_cast<int>(kCount) - 1);
  };
  BandSums sums(filtered_.rows());
  const double rest = 1.0 - floor_;
  const auto spread = [&](std::int64_t band, BandSums::Band& to) {
    const auto [begin, end] = nodes_of(band);
    for (std::int64_t i = begin; i < end; ++i) {
      const Node& node = nodes_[static_cast<std::size_t>(i)];
      const double z_bar = column3(position_bar, i).z();
      const Eigen::Vector2d slope_bar = -column3(normal_bar, i).head<2>();
      column3(plan_bar_.data(), i)
          << column3(position_bar, i).head<2>() + z_bar * node.slope + node.bend * slope_bar,
          floor_ * z_bar;
      const Eigen::Vector2d of_normal = floor_ / node.normal.z() * slope_bar;
      column3(normal_bar_.data(), i) << -of_normal,
          of_normal.dot(node.normal.head<2>()) / node.normal.z();
      const GaussianWeights x = grid_.weights(node.place.x(), 0);
      const GaussianWeights y = grid_.weights(node.place.y(), 1);
      const int column = grid_.first_sample(node.place.x(), 0);
      const int row = grid_.first_sample(node.place.y(), 1);
      for (std::size_t n = 0; n < kCount; ++n) {
        double* const heights_bar = to.row(row + static_cast<Eigen::Index>(n)) + column;
        const double by_value = rest * (y.value[n] * z_bar + y.slope[n] * slope_bar.y());
        const double by_slope = rest * y.value[n] * slope_bar.x();
        for (std::size_t m = 0; m < kCount; ++m) {
          heights_bar[m] += by_value * x.value[m] + by_slope * x.slope[m];
        }
      }
    }
  };
  sums.run(executor_, "made nodes adjoint", rows_of, spread);
  heights_bar_ = Eigen::MatrixXd::Zero(filtered_.rows(), filtered_.cols());
  parallel_for(
      executor_, "sum heights adjoint", filtered_.cols(),
      [&](std::int64_t j) { sums.add_row(j, heights_bar_.col(j).data()); }, 16);
}

/// Carries derivatives from the heights on the grid to the control points.
void MadeNodes::spread_samples(double* points_bar) {
  const auto rows = static_cast<std::int64_t>(grid_.lines(1).size());
  const auto begin = [&](std::int64_t band) {
    return static_cast<std::size_t>(band_start(band, rows));
  };
  const int last_cell = net_.cells().y() - 1;
  const auto rows_of = [&](std::int64_t band) {
    int low = last_cell;
    int high = 0;
    for (std::size_t row = begin(band); row < begin(band + 1); ++row) {
      for (std::size_t i = 0; i < grid_.lines(0).size(); ++i) {
        const int cell = std::clamp(static_cast<int>(sample(i, row).uv.y()), 0, last_cell);
        low = std::min(low, cell);
        high = std::max(high, cell);
      }
    }
    return std::pair(low, high + 3);
  };
  BandSums sums(Eigen::Index{3} * net_.shape.columns);
  const auto spread = [&](std::int64_t band, BandSums::Band& to) {
    for (std::size_t row = begin(band); row < begin(band + 1); ++row) {
      for (std::size_t i = 0; i < grid_.lines(0).size(); ++i) {
        const Sample& s = sample(i, row);
        const double z_bar = heights_bar_(grid_.lines(0)[i].index, grid_.lines(1)[row].index);
        const Eigen::Vector3d point_bar(-s.slope.x() * z_bar, -s.slope.y() * z_bar, z_bar);
        const CubicBasis u = cubic_basis(s.uv.x(), net_.cells().x());
        const CubicBasis v = cubic_basis(s.uv.y(), net_.cells().y());
        for (std::size_t k = 0; k < 4; ++k) {
          double* const to_row = to.row(v.first + static_cast<Eigen::Index>(k));
          for (std::size_t m = 0; m < 4; ++m) {
            column3(to_row, u.first + static_cast<std::int64_t>(m)) +=
                v.value[k] * u.value[m] * point_bar;
          }
        }
      }
    }
  };
  sums.run(executor_, "heights to polish adjoint", rows_of, spread);
  const Eigen::Index row_size = Eigen::Index{3} * net_.shape.columns;
  parallel_for(
      executor_, "sum points adjoint", net_.shape.rows,
      [&](std::int64_t j) { sums.add_row(j, points_bar + j * row_size); }, 16);
}

HeightTerms::HeightTerms(const std::vector<AxisBasis>& u, const std::vector<AxisBasis>& v,
                         const Executor& executor)
    : executor_(executor) {
  for (std::size_t n = 1; n < u.size(); ++n) terms_.push_back({{u[n], executor}, {v[n], executor}});
  along_.resize(2 * static_cast<std::size_t>(u[0].nodes()) *
                static_cast<std::size_t>(v[0].coefficients));
}

void HeightTerms::add(const double* points, double* heights) {
  for (const Term& term : terms_) {
    const AxisTaps u = term.u.view();
    const AxisTaps v = term.v.view();
    const std::int64_t nodes_u = term.u.nodes();
    const std::int64_t columns = term.u.coefficients();
    const auto along_row = [&](std::int64_t i) {
      const std::int64_t node = i % nodes_u;
      const std::int64_t at = i / nodes_u * columns + u.first[node];
      double value = 0.0;
      double slope = 0.0;
      for (int k = 0; k < u.taps; ++k) {
        const double z = points[3 * (at + k) + 2];
        value += u.value[u.taps * node + k] * z;
        slope += u.slope[u.taps * node + k] * z;
      }
      along_[static_cast<std::size_t>(2 * i)] = value;
      along_[static_cast<std::size_t>(2 * i + 1)] = slope;
    };
    parallel_for(executor_, "height terms along rows", nodes_u * term.v.coefficients(), along_row);
    const auto across_rows = [&](std::int64_t i) {
      const std::int64_t node = i / nodes_u;
      const double* const along =
          &along_[static_cast<std::size_t>(2 * (v.first[node] * nodes_u + i % nodes_u))];
      auto sum = column3(heights, i);
      for (int k = 0; k < v.taps; ++k) {
        const double* const a = along + 2 * k * nodes_u;
        const double value = v.value[v.taps * node + k];
        sum += Eigen::Vector3d(value * a[1], v.slope[v.taps * node + k] * a[0], value * a[0]);
      }
    };
    parallel_for(executor_, "height terms", nodes_u * term.v.nodes(), across_rows);
  }
}

void HeightTerms::add_adjoint(const double* heights_bar, double* points_bar) {
  for (const Term& term : terms_) {
    const AxisTaps u = term.u.view();
    const AxisTaps v = term.v.view();
    const std::int64_t nodes_u = term.u.nodes();
    const std::int64_t columns = term.u.coefficients();
    const auto across_rows = [&](std::int64_t i) {
      const std::int64_t row = i / nodes_u;
      double value_bar = 0.0;
      double slope_bar = 0.0;
      for (std::int64_t node = v.begin[row]; node < v.end[row]; ++node) {
        const std::int64_t tap = v.taps * node + row - v.first[node];
        const auto bar = column3(heights_bar, node * nodes_u + i % nodes_u);
        value_bar += v.value[tap] * bar.z() + v.slope[tap] * bar.y();
        slope_bar += v.value[tap] * bar.x();
      }
      along_[static_cast<std::size_t>(2 * i)] = value_bar;
      along_[static_cast<std::size_t>(2 * i + 1)] = slope_bar;
    };
    parallel_for(executor_, "height terms adjoint", nodes_u * term.v.coefficients(), across_rows);
    const auto along_row = [&](std::int64_t i) {
      const std::int64_t column = i % columns;
      const double* const bars = &along_[static_cast<std::size_t>(2 * (i / columns * nodes_u))];
      double sum = 0.0;
      for (std::int64_t node = u.begin[column]; node < u.end[column]; ++node) {
        const std::int64_t tap = u.taps * node + column - u.first[node];
        sum += u.value[tap] * bars[2 * node] + u.slope[tap] * bars[2 * node + 1];
      }
      points_bar[3 * i + 2] += sum;
    };
    parallel_for(executor_, "height terms along rows adjoint", columns * term.v.coefficients(),
                 along_row);
  }
}

}  // namespace lensforge

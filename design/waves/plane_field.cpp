// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/waves/plane_field.h"

#include <fftw3.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <numbers>

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// FFTW plans one transform at a time.
std::mutex& planning() {
  static std::mutex mutex;
  return mutex;
}

fftw_complex* as_fftw(std::complex<double>* values) {
  // std::complex has the layout of two doubles ([complex.numbers.general]).
  return reinterpret_cast<fftw_complex*>(values);  // NOLINT(*-reinterpret-cast)
}

void transform(std::vector<std::complex<double>>& values, int columns, int rows, int sign) {
  fftw_complex* const data = as_fftw(values.data());
  fftw_plan plan = nullptr;
  {
    const std::lock_guard lock(planning());
    plan = fftw_plan_dft_2d(rows, columns, data, data, sign, FFTW_ESTIMATE);
  }
  fftw_execute(plan);
  const std::lock_guard lock(planning());
  fftw_destroy_plan(plan);
}

/// Square of the least cosine of a direction that goes on: a degree from the plane.
constexpr double kGrazing = 3e-4;

/// Vertices are moved to this part of a step, so that sides are found without rounding.
constexpr double kParts = 1024.0;

using Whole = Eigen::Matrix<std::int64_t, 2, 1>;

/// A triangle's side in whole numbers: ≥ 0 inside, and nodes on it belong to it if it is a lower
/// or a left one.
struct Side {
  std::int64_t a = 0, b = 0, c = 0;

  Side() = default;
  Side(const Whole& from, const Whole& to)
      : a(from.y() - to.y()), b(to.x() - from.x()), c(-(a * from.x() + b * from.y())) {
    if (!(a > 0 || (a == 0 && b > 0))) --c;
  }
  [[nodiscard]] std::int64_t at(const Whole& p) const { return a * p.x() + b * p.y() + c; }
};

/// A triangle of rays on the nodes of a field.
class LaidTriangle {
 public:
  LaidTriangle(const FieldPlan& plan, const std::array<PlaneField::Vertex, 3>& vertices)
      : plan_(plan), vertices_(vertices) {
    for (std::size_t k = 0; k < 3; ++k) {
      at_[k] = (vertices[k].place - plan.centre).cwiseQuotient(plan.step) + plan.middle();
      whole_[k] = (kParts * at_[k]).array().round().matrix().cast<std::int64_t>();
    }
    const Whole u = whole_[1] - whole_[0];
    const Whole v = whole_[2] - whole_[0];
    doubled_ = u.x() * v.y() - u.y() * v.x();
    if (doubled_ < 0) {
      std::swap(vertices_[1], vertices_[2]);
      std::swap(at_[1], at_[2]);
      std::swap(whole_[1], whole_[2]);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      sides_[k] = Side(whole_[(k + 1) % 3], whole_[(k + 2) % 3]);
    }
  }

  [[nodiscard]] bool is_empty() const { return doubled_ == 0; }
  /// Its box along an axis, in parts of a step.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> range(int axis) const {
    return std::minmax({whole_[0][axis], whole_[1][axis], whole_[2][axis]});
  }
  [[nodiscard]] bool contains(const Whole& p) const {
    return sides_[0].at(p) >= 0 && sides_[1].at(p) >= 0 && sides_[2].at(p) >= 0;
  }

  /// The field at a node, inside or near it.
  [[nodiscard]] std::complex<double> field(std::int64_t column, std::int64_t row) const {
    constexpr auto kWholeParts = static_cast<std::int64_t>(kParts);
    const Eigen::Vector2d node(static_cast<double>(column), static_cast<double>(row));
    double path = 0.0;
    double amplitude = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      // Linear interpolation errs by as much to one side as the mean of the vertices' tangent
      // planes does to the other.
      const double share =
          static_cast<double>(sides_[k].at({column * kWholeParts, row * kWholeParts})) /
          static_cast<double>(std::abs(doubled_));
      const Eigen::Vector2d away = (node - at_[k]).cwiseProduct(plan_.step);
      path += share * (vertices_[k].path + 0.5 * vertices_[k].cosine.dot(away));
      amplitude += share * vertices_[k].amplitude;
    }
    const Eigen::Vector2d from_centre = (node - plan_.middle()).cwiseProduct(plan_.step);
    const double beyond_fold = doubled_ < 0 ? 0.5 * std::numbers::pi : 0.0;
    const double phase =
        kTwoPi / plan_.wavelength * (path - plan_.cosine.dot(from_centre)) - beyond_fold;
    return std::polar(std::max(amplitude, 0.0), phase);
  }

 private:
  const FieldPlan& plan_;
  std::array<PlaneField::Vertex, 3> vertices_;  ///< Counter-clockwise.
  std::array<Eigen::Vector2d, 3> at_;           ///< In steps from the first node.
  std::array<Whole, 3> whole_;                  ///< In parts of steps.
  std::array<Side, 3> sides_;                   ///< Opposite to the vertices.
  std::int64_t doubled_ = 0;                    ///< Twice the area; < 0 if it is turned over.
};

}  // namespace

int transform_size(double least) {
  for (int size = 2 * static_cast<int>(std::ceil(0.5 * std::max(least, 8.0)));; size += 2) {
    int rest = size;
    for (const int factor : {2, 3, 5, 7}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return size;
  }
}

PlaneField::PlaneField(const FieldPlan& plan)
    : plan_(plan),
      values_(static_cast<std::size_t>(plan.columns) * static_cast<std::size_t>(plan.rows)) {}

void PlaneField::add(const std::array<Vertex, 3>& vertices) {
  const LaidTriangle triangle(plan_, vertices);
  if (triangle.is_empty()) return;
  // Point n of an axis lies at apart · n + first, in parts of a step.
  constexpr auto kWholeParts = static_cast<std::int64_t>(kParts);
  const Whole apart(kWholeParts / plan_.points.x(), kWholeParts / plan_.points.y());
  const Whole first = (apart.array() - kWholeParts) / 2;
  const auto points = [&](int axis, int count) {
    const auto [low, high] = triangle.range(axis);
    const std::int64_t last = std::int64_t{count} * plan_.points[axis] - 1;
    const auto point = [&](std::int64_t place) { return (place - first[axis]) / apart[axis]; };
    return std::pair(std::clamp<std::int64_t>(point(low), 0, last),
                     std::clamp<std::int64_t>(point(high), -1, last));
  };
  const auto columns = points(0, plan_.columns);
  const auto rows = points(1, plan_.rows);
  const double weight = 1.0 / plan_.points.prod();
  for (std::int64_t j = rows.first; j <= rows.second; ++j) {
    for (std::int64_t i = columns.first; i <= columns.second; ++i) {
      if (!triangle.contains({apart.x() * i + first.x(), apart.y() * j + first.y()})) continue;
      const std::int64_t column = i / plan_.points.x();
      const std::int64_t row = j / plan_.points.y();
      at(static_cast<int>(column), static_cast<int>(row)) += weight * triangle.field(column, row);
    }
  }
}

/// A component of the spectrum with the direction p turns by k D √(1 − |p|²), without what the mean
/// ray's turns by and without the shift of the nodes to far_centre().
void PlaneField::propagate() {
  transform(values_, plan_.columns, plan_.rows, FFTW_FORWARD);
  const double wave_number = kTwoPi / plan_.wavelength;
  const Eigen::Vector2d slope = plan_.slope();
  const double root = std::sqrt(1.0 - plan_.cosine.squaredNorm());
  const auto direction = [&](int n, int count, int axis) {
    const int frequency = n < (count + 1) / 2 ? n : n - count;
    return plan_.wavelength * frequency / (count * plan_.step[axis]);
  };
  const double scale = 1.0 / static_cast<double>(values_.size());
  for (int j = 0; j < plan_.rows; ++j) {
    const double q_y = direction(j, plan_.rows, 1);
    for (int i = 0; i < plan_.columns; ++i) {
      const Eigen::Vector2d more(direction(i, plan_.columns, 0), q_y);
      const double square = 1.0 - (plan_.cosine + more).squaredNorm();
      std::complex<double>& value = at(i, j);
      const double far = plan_.distance / std::sqrt(std::max(square, kGrazing));
      const Eigen::Vector2d aside = far * (plan_.cosine + more) - plan_.distance * slope;
      if (square <= kGrazing || (aside.cwiseAbs().array() > plan_.reach.array()).any()) {
        value = 0.0;
        continue;
      }
      // √s − √s0 without cancellation.
      const double longer = (square - root * root) / (std::sqrt(square) + root);
      value *= std::polar(scale, wave_number * plan_.distance * (longer + slope.dot(more)));
    }
  }
  transform(values_, plan_.columns, plan_.rows, FFTW_BACKWARD);
}

PixelLight PlaneField::spread(const Eigen::Vector2d& centre, const Eigen::Matrix2d& by_mm,
                              const Eigen::Vector2i& pixels) const {
  const Eigen::Matrix2d by_node = by_mm * plan_.step.asDiagonal();
  const Eigen::Vector2d cell = by_node.cwiseAbs().rowwise().sum();
  const Eigen::Vector2d half =
      0.5 * by_node.cwiseAbs() * Eigen::Vector2d(plan_.columns, plan_.rows) + cell;
  PixelLight result;
  const Eigen::Vector2i low = (centre - half).array().floor().cast<int>().max(0);
  const Eigen::Vector2i high = (centre + half).array().ceil().cast<int>().min(pixels.array());
  if (low.x() >= high.x() || low.y() >= high.y()) return result;
  result.first = low;
  result.columns = high.x() - low.x();
  result.rows = high.y() - low.y();
  result.light.assign(
      static_cast<std::size_t>(result.columns) * static_cast<std::size_t>(result.rows), 0.0);
  const double area = plan_.step.prod();
  /// Pixels that a cell touches along one axis, and its share in each.
  const auto touched = [&](int axis, double at, const auto& take) {
    const double from = at - 0.5 * cell[axis];
    const double to = at + 0.5 * cell[axis];
    for (int pixel = std::max(low[axis], static_cast<int>(std::floor(from)));
         pixel < high[axis] && pixel < to; ++pixel) {
      const double share = (std::min(to, pixel + 1.0) - std::max(from, double(pixel))) / cell[axis];
      if (share > 0.0) take(pixel - low[axis], share);
    }
  };
  for (int j = 0; j < plan_.rows; ++j) {
    for (int i = 0; i < plan_.columns; ++i) {
      const double light = std::norm(at(i, j)) * area;
      if (light == 0.0) continue;
      const Eigen::Vector2d place = centre + by_node * (Eigen::Vector2d(i, j) - plan_.middle());
      touched(1, place.y(), [&](int row, double of_row) {
        touched(0, place.x(), [&](int column, double of_column) {
          result.light[static_cast<std::size_t>(row) * static_cast<std::size_t>(result.columns) +
                       static_cast<std::size_t>(column)] += light * of_row * of_column;
        });
      });
    }
  }
  return result;
}

}  // namespace lensforge

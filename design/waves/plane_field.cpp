// SPDX-License-Identifier: GPL-3.0-or-later
#include <fftw3.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/optics/light_path.h"
#include "design/waves/wave_tile.h"

namespace lensforge {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// FFTW plans one transform at a time.
std::mutex& planning() {
  static std::mutex mutex;
  return mutex;
}

/// The transform of one row or column in its place.
class LineTransform {
 public:
  /// @param size  even, so that every row of values is aligned as the first is.
  LineTransform(int size, int sign) {
    std::vector<std::complex<float>> line(static_cast<std::size_t>(size));
    const std::lock_guard lock(planning());
    plan_ =
        fftwf_plan_dft_1d(size, data_of(line.data()), data_of(line.data()), sign, FFTW_ESTIMATE);
  }
  LineTransform(const LineTransform&) = delete;
  LineTransform& operator=(const LineTransform&) = delete;
  ~LineTransform() {
    const std::lock_guard lock(planning());
    fftwf_destroy_plan(plan_);
  }

  void run(std::complex<float>* line) const {
    fftwf_execute_dft(plan_, data_of(line), data_of(line));
  }

 private:
  /// std::complex has the layout of two numbers ([complex.numbers.general]).
  static fftwf_complex* data_of(std::complex<float>* values) {
    return reinterpret_cast<fftwf_complex*>(values);  // NOLINT(*-reinterpret-cast)
  }

  fftwf_plan plan_ = nullptr;
};

/// Columns that are transformed at once: two lines of the cache hold a value of each.
constexpr int kColumns = 16;

/// Adding and subtracting it rounds numbers below 2^51 to whole ones; std::round() is a call in
/// code for every x86-64.
constexpr double kRounds = 6755399441055744.0;

/// e^{2πi t} of many t at once; most of the work of laying and propagating fields.
class UnitPhases {
 public:
  void find(const std::vector<double>& turns) {
    const Eigen::Map<const Eigen::ArrayXd> t(turns.data(), static_cast<Eigen::Index>(turns.size()));
    const Eigen::ArrayXf angle = (kTwoPi * (t - ((t + kRounds) - kRounds))).cast<float>();
    cosine_ = angle.cos();
    sine_ = angle.sin();
  }
  [[nodiscard]] std::complex<float> operator[](std::size_t k) const {
    const auto at = static_cast<Eigen::Index>(k);
    return {cosine_[at], sine_[at]};
  }

 private:
  Eigen::ArrayXf cosine_, sine_;
};

/// Nodes laid at once.
constexpr std::size_t kPending = 2048;

/// Vertices are moved to this part of a step, so that sides are found without rounding.
constexpr double kParts = 1024.0;

/// A triangle of rays on the nodes of a field. Places are in steps from the first node, vertices'
/// and those tested for being inside whole parts of one: sides are then exact.
class LaidTriangle {
 public:
  using Corner = PlaneField::Corner;
  using Linear = PlaneField::Linear;

  explicit LaidTriangle(const std::array<Corner, 3>& corners) : corners_(&corners) {
    for (const Corner& corner : corners) box_.extend(corner.at);
    doubled_ = cross(corners[1].at - corners[0].at, corners[2].at - corners[0].at);
    if (doubled_ == 0.0) return;
    const double turn = doubled_ < 0.0 ? -1.0 : 1.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d& from = corners[(k + 1) % 3].at;
      const Eigen::Vector2d& to = corners[(k + 2) % 3].at;
      Linear& side = sides_[k];
      side = {turn * (from.y() - to.y()), turn * (to.x() - from.x()), 0.0};
      side.c = -(side.a * from.x() + side.b * from.y());
      own_[k] = side.a > 0.0 || (side.a == 0.0 && side.b > 0.0);
    }
  }

  [[nodiscard]] bool is_empty() const { return doubled_ == 0.0; }
  [[nodiscard]] const Eigen::AlignedBox2d& box() const { return box_; }
  /// Points on a side belong to it if it is a lower or a left one.
  [[nodiscard]] bool contains(double x, double y) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const double side = sides_[k].at(x, y);
      if (!(side > 0.0 || (side == 0.0 && own_[k]))) return false;
    }
    return true;
  }

  /// Number of the points of a node's cell inside.
  [[nodiscard]] int points_inside(const Eigen::Vector2i& points, int column, int row) const {
    const int all = points.prod();
    if (all == 1) return contains(column, row) ? 1 : 0;
    bool crosses = false;
    for (const Linear& side : sides_) {
      const double middle = side.at(column, row);
      const double half = 0.5 * (std::abs(side.a) + std::abs(side.b));
      if (middle < -half) return 0;
      crosses = crosses || middle <= half;
    }
    if (!crosses) return all;
    int inside = 0;
    for (int j = 0; j < points.y(); ++j) {
      const double y = row + (j + 0.5) / points.y() - 0.5;
      for (int i = 0; i < points.x(); ++i) {
        if (contains(column + (i + 0.5) / points.x() - 0.5, y)) ++inside;
      }
    }
    return inside;
  }

  struct Field {
    double amplitude = 0.0;
    double turns = 0.0;             ///< Phase ÷ 2π.
    std::array<double, 3> share{};  ///< Of the vertices.
  };

  /// The field at a node, inside or near it. Linear interpolation of the path errs by as much to
  /// one side as the mean of the vertices' tangent planes does to the other.
  [[nodiscard]] Field field(double x, double y) const {
    Field field;
    const double scale = 1.0 / std::abs(doubled_);
    for (std::size_t k = 0; k < 3; ++k) {
      const Corner& corner = (*corners_)[k];
      field.share[k] = scale * sides_[k].at(x, y);
      field.turns += field.share[k] * corner.turns.at(x, y);
      field.amplitude += field.share[k] * corner.amplitude;
    }
    field.amplitude = std::max(field.amplitude, 0.0);
    if (doubled_ < 0.0) field.turns -= 0.25;
    return field;
  }

 private:
  const std::array<Corner, 3>* corners_;
  Eigen::AlignedBox2d box_;
  std::array<Linear, 3> sides_;  ///< Opposite to the vertices; > 0 inside.
  std::array<bool, 3> own_{};    ///< True if points on the side belong to the triangle.
  double doubled_ = 0.0;         ///< Twice the area; < 0 if it is turned over.
};

/// What PlaneField::cover() knows of a node: whether a triangle holds it, and points of its cell
/// that are lit, those on two sheets twice.
constexpr std::uint8_t kCentre = 0x80;
constexpr std::uint8_t kPoints = 0x7f;

/// Calls `take(column, row, node)` for the nodes whose cells a triangle may meet.
template <class Take>
void for_each_cell(const FieldPlan& plan, const LaidTriangle& triangle, const Take& take) {
  if (triangle.is_empty()) return;
  // Numbers from 0 on lose their fraction when they become whole.
  const Eigen::Array2d last(plan.columns, plan.rows);
  const Eigen::Array2d low = (triangle.box().min().array() + 0.5).max(0.0).min(last);
  const Eigen::Array2d high = (triangle.box().max().array() + 1.5).max(0.0).min(last);
  const Eigen::Array2i from = low.cast<int>();
  const Eigen::Array2i to = high.cast<int>() - 1;
  for (int j = from.y(); j <= to.y(); ++j) {
    for (int i = from.x(); i <= to.x(); ++i) {
      take(i, j,
           static_cast<std::size_t>(j) * static_cast<std::size_t>(plan.columns) +
               static_cast<std::size_t>(i));
    }
  }
}

}  // namespace

int transform_size(double least) {
  LF_CHECK(least < kMostTransform, "a field of " + std::to_string(least) + " nodes");
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

/// Turns are the mean of the vertex's own and its tangent plane's.
PlaneField::Corner PlaneField::corner(const FieldPlan& plan, const Vertex& vertex) {
  const Eigen::Vector2d steps =
      (vertex.place - plan.centre).cwiseQuotient(plan.step) + plan.middle();
  const Eigen::Array2d parts = kParts * steps.array();
  const Eigen::Vector2d at = ((parts + kRounds) - kRounds) / kParts;
  const Eigen::Vector2d half = 0.5 / plan.wavelength * vertex.cosine.cwiseProduct(plan.step);
  return {at, {half.x(), half.y(), vertex.path / plan.wavelength - half.dot(at)}, vertex.amplitude};
}

void PlaneField::cover(const std::array<Corner, 3>& corners) {
  lit_.resize(values_.size());
  const LaidTriangle triangle(corners);
  for_each_cell(plan_, triangle, [&](int i, int j, std::size_t node) {
    const int points = (lit_[node] & kPoints) + triangle.points_inside(plan_.points, i, j);
    const bool centre = (lit_[node] & kCentre) != 0 || triangle.contains(i, j);
    lit_[node] = static_cast<std::uint8_t>(std::min(points, int{kPoints}) | (centre ? kCentre : 0));
  });
}

/// A triangle's field goes on beyond its sides as a quadratic. Where a surface has detail finer
/// than a cell that is wrong by some percent, so only cells without another have it.
template <class Take>
void PlaneField::for_each_node(const std::array<Corner, 3>& corners, Where where,
                               const Take& take) const {
  const LaidTriangle triangle(corners);
  const double all = plan_.points.prod();
  for_each_cell(plan_, triangle, [&](int i, int j, std::size_t node) {
    double share = 0.0;
    if (where == Where::kInside) {
      share = triangle.contains(i, j) ? 1.0 : 0.0;
    } else if ((lit_[node] & kCentre) == 0) {
      share = triangle.points_inside(plan_.points, i, j) / all;
    } else if (triangle.contains(i, j)) {
      share = std::min((lit_[node] & kPoints) / all, 1.0);
    }
    if (share == 0.0) return;
    LaidTriangle::Field field = triangle.field(i, j);
    field.amplitude *= share;
    take(node, field);
  });
}

void PlaneField::add(const std::array<Corner, 3>& corners, Where where) {
  for_each_node(corners, where, [&](std::size_t node, const LaidTriangle::Field& field) {
    pending_.node.push_back(node);
    pending_.turns.push_back(field.turns);
    pending_.amplitude.push_back(static_cast<float>(field.amplitude));
  });
  if (pending_.node.size() >= kPending) lay_rest();
}

void PlaneField::lay_rest() {
  UnitPhases phases;
  phases.find(pending_.turns);
  for (std::size_t k = 0; k < pending_.node.size(); ++k) {
    values_[pending_.node[k]] += pending_.amplitude[k] * phases[k];
  }
  pending_.clear();
}

void PlaneField::gather(const std::array<Corner, 3>& corners, Where where,
                        const std::array<std::size_t, 3>& vertex, std::span<double> by_path) {
  for_each_node(corners, where, [&](std::size_t node, const LaidTriangle::Field& field) {
    pending_.node.push_back(node);
    pending_.turns.push_back(field.turns);
    pending_.amplitude.push_back(static_cast<float>(field.amplitude));
    pending_.vertex.push_back(vertex);
    pending_.share.push_back(field.share);
  });
  if (pending_.node.size() >= kPending) gather_rest(by_path);
}

void PlaneField::gather_rest(std::span<double> by_path) {
  UnitPhases phases;
  phases.find(pending_.turns);
  const double wave_number = kTwoPi / plan_.wavelength;
  for (std::size_t k = 0; k < pending_.node.size(); ++k) {
    const std::complex<float> laid = pending_.amplitude[k] * phases[k];
    const double by_phase = (values_[pending_.node[k]] * std::conj(laid)).imag();
    for (std::size_t n = 0; n < 3; ++n) {
      by_path[pending_.vertex[k][n]] += wave_number * by_phase * pending_.share[k][n];
    }
  }
  pending_.clear();
}

PlaneField PlaneField::to_plane(double way) const {
  PlaneField there = *this;
  there.plan_ = plan_.beyond(way);
  return there;
}

void PlaneField::add(const PlaneField& other) {
  for (std::size_t n = 0; n < values_.size(); ++n) values_[n] += other.values_[n];
}

void PlaneField::propagate() {
  lay_rest();
  go(false);
}

void PlaneField::return_back() { go(true); }

/// A component with the direction s turns by −k D s² / 2m, m the magnification (Sziklas and
/// Siegman, Applied Optics 14, 1975); the adjoint turns it back. Columns go there and back at once,
/// and rows without light only back.
void PlaneField::go(bool back) {
  const Eigen::Vector2d way = plan_.distance * plan_.magnification.cwiseInverse();
  UnitPhases phases;
  const auto factors = [&](int count, int axis, double scale) {
    std::vector<double> turns;
    std::vector<double> kept;
    for (int n = 0; n < count; ++n) {
      const int frequency = n < (count + 1) / 2 ? n : n - count;
      const double direction = plan_.wavelength * frequency / (count * plan_.step[axis]);
      turns.push_back((back ? 0.5 : -0.5) * way[axis] / plan_.wavelength * direction * direction);
      kept.push_back(std::abs(way[axis] * direction) <= plan_.reach[axis] ? scale : 0.0);
    }
    phases.find(turns);
    Eigen::ArrayXcf all(count);
    for (int n = 0; n < count; ++n) {
      const auto at = static_cast<std::size_t>(n);
      all[n] = static_cast<float>(kept[at]) * phases[at];
    }
    return all;
  };
  const Eigen::ArrayXcf along_x =
      factors(plan_.columns, 0, 1.0 / static_cast<double>(values_.size()));
  const Eigen::ArrayXcf along_y = factors(plan_.rows, 1, 1.0);
  transform_rows(FFTW_FORWARD);
  turn_columns(along_x, along_y);
  transform_rows(FFTW_BACKWARD);
}

void PlaneField::transform_rows(int sign) {
  const LineTransform transform(plan_.columns, sign);
  for (int j = 0; j < plan_.rows; ++j) {
    std::complex<float>* const row = &at(0, j);
    const auto is_dark = [](const std::complex<float>& value) { return value == 0.0F; };
    if (!std::all_of(row, row + plan_.columns, is_dark)) transform.run(row);
  }
}

void PlaneField::turn_columns(const Eigen::ArrayXcf& along_x, const Eigen::ArrayXcf& along_y) {
  const LineTransform forward(plan_.rows, FFTW_FORWARD);
  const LineTransform backward(plan_.rows, FFTW_BACKWARD);
  Eigen::ArrayXXcf held(plan_.rows, kColumns);
  for (int first = 0; first < plan_.columns; first += kColumns) {
    const int count = std::min(kColumns, plan_.columns - first);
    for (int j = 0; j < plan_.rows; ++j) {
      const std::complex<float>* const row = &at(first, j);
      for (int k = 0; k < count; ++k) held(j, k) = row[k];
    }
    for (int k = 0; k < count; ++k) {
      auto column = held.col(k);
      const std::complex<float> of_column = along_x[first + k];
      if (of_column == 0.0F) {
        column = 0.0F;
        continue;
      }
      forward.run(column.data());
      column *= along_y * of_column;
      backward.run(column.data());
    }
    for (int j = 0; j < plan_.rows; ++j) {
      std::complex<float>* const row = &at(first, j);
      for (int k = 0; k < count; ++k) row[k] = held(j, k);
    }
  }
}

PlaneField::Vertex laid_ray(const FieldPlan& plan, const PlaneField::Vertex& ray) {
  const double square = ray.cosine.squaredNorm();
  const double secant = 1.0 / std::sqrt(1.0 - square);
  PlaneField::Vertex laid = ray;
  laid.place += plan.distance * (secant - 1.0) * ray.cosine;
  const Eigen::Vector2d from = laid.place - plan.centre;
  const Eigen::Vector2d curved =
      (Eigen::Vector2d::Ones() - plan.magnification).cwiseProduct(from) / plan.distance;
  laid.path += plan.distance * (secant - 1.0 - 0.5 * square) + 0.5 * from.dot(curved);
  laid.cosine = ray.cosine + curved;
  return laid;
}

namespace {

/// Floor of a number that an int holds; std::floor() is a call in code for every x86-64.
int floor_of(double x) {
  const int whole = static_cast<int>(x);
  return x < whole ? whole - 1 : whole;
}

/// How a field's nodes lie on pixels: each has a cell that is spread over those it touches.
class NodesOnPixels {
 public:
  NodesOnPixels(const FieldPlan& plan, const OnPicture& to)
      : to_(to),
        step_(plan.magnification.cwiseProduct(plan.step)),
        middle_(plan.middle()),
        divergence_(plan.divergence()),
        cell_((to.by_mm * step_.asDiagonal()).cwiseAbs().rowwise().sum()),
        along_(step_.x() *
               (Eigen::ArrayXd::LinSpaced(plan.columns, 0.0, plan.columns - 1) - middle_.x())),
        is_alone_(to.before == HUGE_VAL && to.behind == HUGE_VAL) {
    Eigen::AlignedBox2d box;
    for (const int j : {0, plan.rows / 2, plan.rows}) {
      for (const int i : {0, plan.columns / 2, plan.columns}) box.extend(lands(i, j));
    }
    low = (box.min() - cell_).array().floor().cast<int>().max(0);
    high = (box.max() + cell_).array().ceil().cast<int>().min(to.pixels.array());
  }

  Eigen::Vector2i low;   ///< First pixel.
  Eigen::Vector2i high;  ///< One past the last.

  [[nodiscard]] bool none() const { return low.x() >= high.x() || low.y() >= high.y(); }
  [[nodiscard]] int columns() const { return high.x() - low.x(); }

  /// Goes to a row of nodes: where their cells begin, a row at a time, is most of the work.
  void go_to(int j) {
    const double across = (j - middle_.y()) * step_.y();
    const double wider = divergence_.y() * across;
    way_ = -(to_.way + to_.tilt.x() * along_ + to_.tilt.y() * across) /
           (1.0 + (to_.tilt.x() * divergence_.x() * along_ + to_.tilt.y() * wider));
    const auto moved_along = along_ + way_ * divergence_.x() * along_;
    const auto moved_across = across + way_ * wider;
    const Eigen::Vector2d from = to_.centre - 0.5 * cell_;
    x_ = from.x() + to_.by_mm(0, 0) * moved_along + to_.by_mm(0, 1) * moved_across;
    y_ = from.y() + to_.by_mm(1, 0) * moved_along + to_.by_mm(1, 1) * moved_across;
  }
  /// Of the light of the row's node that lands from this plane.
  [[nodiscard]] double share(int i) const { return is_alone_ ? 1.0 : to_.share(way_[i]); }

  /// Calls `take(number, share)` for the pixels that the cell of the row's node touches; numbers
  /// count from `low`, row by row.
  template <class Take>
  void for_each_pixel(int i, const Take& take) const {
    const double x = x_[i], y = y_[i];
    const int column = floor_of(x), row = floor_of(y);
    // Most cells touch one pixel.
    if (x + cell_.x() < column + 1.0 && y + cell_.y() < row + 1.0) {
      if (column >= low.x() && column < high.x() && row >= low.y() && row < high.y()) {
        take(number(column, row), 1.0);
      }
      return;
    }
    touched(1, y, [&](int r, double of_row) {
      touched(0, x, [&](int c, double of_column) { take(number(c, r), of_row * of_column); });
    });
  }

 private:
  /// Where a node's light lands, pixel coordinates.
  [[nodiscard]] Eigen::Vector2d lands(int i, int j) const {
    const Eigen::Vector2d at = (Eigen::Vector2d(i, j) - middle_).cwiseProduct(step_);
    const Eigen::Vector2d wider = divergence_.cwiseProduct(at);
    const double way = -(to_.way + to_.tilt.dot(at)) / (1.0 + to_.tilt.dot(wider));
    return to_.centre + to_.by_mm * (at + way * wider);
  }
  [[nodiscard]] std::size_t number(int column, int row) const {
    return static_cast<std::size_t>(row - low.y()) * static_cast<std::size_t>(columns()) +
           static_cast<std::size_t>(column - low.x());
  }

  /// Pixels that a cell touches along one axis, and its share in each.
  template <class Take>
  void touched(int axis, double from, const Take& take) const {
    const double to = from + cell_[axis];
    for (int pixel = std::max(low[axis], floor_of(from)); pixel < high[axis] && pixel < to;
         ++pixel) {
      const double share =
          (std::min(to, pixel + 1.0) - std::max(from, double(pixel))) / cell_[axis];
      if (share > 0.0) take(pixel, share);
    }
  }

  OnPicture to_;
  Eigen::Vector2d step_;  ///< Of the nodes where they land, mm.
  Eigen::Vector2d middle_, divergence_;
  Eigen::Vector2d cell_;  ///< Pixels.
  Eigen::ArrayXd along_;  ///< Of the nodes of a row from the middle, mm.
  bool is_alone_;         ///< All light lands from this plane.
  Eigen::ArrayXd way_;
  Eigen::ArrayXd x_, y_;  ///< Where the cells of a row begin, pixel coordinates.
};

}  // namespace

PixelLight PlaneField::spread(const OnPicture& to) const {
  NodesOnPixels on(plan_, to);
  PixelLight result;
  if (on.none()) return result;
  result.first = on.low;
  result.columns = on.columns();
  result.rows = on.high.y() - on.low.y();
  result.light.assign(
      static_cast<std::size_t>(result.columns) * static_cast<std::size_t>(result.rows), 0.0);
  const double area = plan_.step.prod();
  for (int j = 0; j < plan_.rows; ++j) {
    on.go_to(j);
    for (int i = 0; i < plan_.columns; ++i) {
      const double light = static_cast<double>(std::norm(at(i, j))) * area * on.share(i);
      if (light == 0.0) continue;
      on.for_each_pixel(
          i, [&](std::size_t pixel, double share) { result.light[pixel] += share * light; });
    }
  }
  return result;
}

void PlaneField::pull(const OnPicture& to, std::span<const double> by_pixel) {
  NodesOnPixels on(plan_, to);
  std::vector<double> bars;
  for (int row = on.low.y(); row < on.high.y(); ++row) {
    const auto first = by_pixel.begin() + std::ptrdiff_t{row} * to.pixels.x();
    if (!on.none()) bars.insert(bars.end(), first + on.low.x(), first + on.high.x());
  }
  const double doubled_area = 2.0 * plan_.step.prod();
  for (int j = 0; j < plan_.rows; ++j) {
    on.go_to(j);
    for (int i = 0; i < plan_.columns; ++i) {
      double bar = 0.0;
      if (!on.none()) {
        on.for_each_pixel(i, [&](std::size_t pixel, double share) { bar += share * bars[pixel]; });
      }
      at(i, j) *= static_cast<float>(doubled_area * bar * on.share(i));
    }
  }
}

}  // namespace lensforge

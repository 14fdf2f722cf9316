// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/monge_ampere.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>
#include <vector>

#include "core/image/image.h"
#include "design/optimize/cosine_transform.h"

namespace lensforge {

namespace {

/// Notation: φ = u − |x|²/2 on a grid of nodes with unit spacing, mirrored at the borders.
class Iteration {
 public:
  Iteration(const Image& picture, double floor)
      : columns_(picture.columns() + 1),
        rows_(picture.rows() + 1),
        picture_(picture),
        phi_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), 0.0),
        transform_(columns_, rows_) {
    const double mean = picture.total() / static_cast<double>(picture.values().size());
    scale_ = (1.0 - floor) / mean;
    floor_ = floor;
  }

  /// One step of the fixed point; returns the largest change of a landing point.
  double step() {
    const auto right = transform_.values();
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) right[index(c, r)] = laplacian_to_be(c, r) - 2.0;
    }
    transform_.solve_poisson();
    double change = 0.0;
    const std::vector<double> before = std::exchange(phi_, {right.begin(), right.end()});
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        change = std::max(change, (gradient(phi_, c, r) - gradient(before, c, r)).norm());
      }
    }
    return change;
  }

  [[nodiscard]] MongeAmpereResult result() const {
    MongeAmpereResult result;
    result.columns = columns_;
    result.rows = rows_;
    result.displacement.resize(2, static_cast<Eigen::Index>(phi_.size()));
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        result.displacement.col(static_cast<Eigen::Index>(index(c, r))) = gradient(phi_, c, r);
      }
    }
    return result;
  }

 private:
  [[nodiscard]] std::size_t index(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(c);
  }
  [[nodiscard]] static int mirror(int i, int n) {
    const int positive = std::abs(i);
    return positive < n ? positive : 2 * (n - 1) - positive;
  }
  [[nodiscard]] double at(const std::vector<double>& f, int c, int r) const {
    return f[index(mirror(c, columns_), mirror(r, rows_))];
  }
  [[nodiscard]] Eigen::Vector2d gradient(const std::vector<double>& f, int c, int r) const {
    return {0.5 * (at(f, c + 1, r) - at(f, c - 1, r)), 0.5 * (at(f, c, r + 1) - at(f, c, r - 1))};
  }

  /// Floored density of mean 1 at a point in pixel coordinates, bilinear between pixel centres.
  [[nodiscard]] double density(const Eigen::Vector2d& y) const {
    return floor_ + scale_ * bilinear(picture_, y);
  }

  [[nodiscard]] double laplacian_to_be(int c, int r) const {
    const double centre = at(phi_, c, r);
    const double xx = 1.0 + at(phi_, c + 1, r) - 2.0 * centre + at(phi_, c - 1, r);
    const double yy = 1.0 + at(phi_, c, r + 1) - 2.0 * centre + at(phi_, c, r - 1);
    const double xy = 0.25 * (at(phi_, c + 1, r + 1) - at(phi_, c - 1, r + 1) -
                              at(phi_, c + 1, r - 1) + at(phi_, c - 1, r - 1));
    const Eigen::Vector2d landing = Eigen::Vector2d(c, r) + gradient(phi_, c, r);
    return std::sqrt(xx * xx + yy * yy + 2.0 * xy * xy + 2.0 / density(landing));
  }

  int columns_;
  int rows_;
  const Image& picture_;
  double scale_;
  double floor_;
  std::vector<double> phi_;
  CosineTransform transform_;
};

}  // namespace

MongeAmpereResult solve_monge_ampere(const Image& picture, const MongeAmpereOptions& options,
                                     const RunControl& control) {
  Iteration iteration(picture, options.floor);
  double change = 0.0;
  int done = 0;
  bool converged = false;
  while (done < options.max_iterations && !converged && !control.stop_requested()) {
    change = iteration.step();
    ++done;
    converged = change <= options.tolerance;
    control.report(
        {"transport", static_cast<double>(done), static_cast<double>(options.max_iterations), ""});
  }
  MongeAmpereResult result = iteration.result();
  result.converged = converged;
  result.stopped = control.stop_requested();
  result.iterations = done;
  result.last_change = change;
  return result;
}

}  // namespace lensforge

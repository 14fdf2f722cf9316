// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/objective.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "design/energy/picture_terms.h"

namespace lensforge {
namespace {

/// Share of the wanted light below which a pixel counts as unlit.
constexpr double kMinLight = 0.3;

/// Linear light (white is 1) below which a pixel may stay black.
constexpr double kMinWanted = 1e-4;

/// Maximum distance of a facet from its assigned pixel, in columns and rows.
constexpr int kUnlitReach = 3;

/// Added distance, in pixels, of a facet that is alone in its pixel.
constexpr double kLonelyLoss = 1.0;

/// Facets by the pixel of their centroid; those outside belong to the nearest pixel.
class FacetsByPixel {
 public:
  FacetsByPixel(int columns, int rows, const Eigen::Matrix2Xd& centroids)
      : columns_(columns),
        rows_(rows),
        begin_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) + 1, 0),
        facets_(static_cast<std::size_t>(centroids.cols())) {
    std::vector<std::size_t> pixel(facets_.size());
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      const Eigen::Vector2d u = centroids.col(static_cast<Eigen::Index>(f));
      pixel[f] = u.allFinite() ? pixel_at(u) : begin_.size() - 1;
      if (pixel[f] + 1 < begin_.size()) ++begin_[pixel[f] + 1];
    }
    for (std::size_t p = 1; p < begin_.size(); ++p) begin_[p] += begin_[p - 1];
    std::vector<std::size_t> next(begin_);
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      if (pixel[f] + 1 < begin_.size()) facets_[next[pixel[f]]++] = f;
    }
  }

  [[nodiscard]] std::size_t pixel_at(const Eigen::Vector2d& u) const {
    const auto cell = [](double value, int limit) {
      return static_cast<std::size_t>(std::clamp(std::floor(value), 0.0, limit - 1.0));
    };
    return cell(u.y(), rows_) * static_cast<std::size_t>(columns_) + cell(u.x(), columns_);
  }
  [[nodiscard]] std::span<const std::size_t> in(std::size_t pixel) const {
    return {facets_.data() + begin_[pixel], begin_[pixel + 1] - begin_[pixel]};
  }

 private:
  int columns_;
  int rows_;
  std::vector<std::size_t> begin_;   ///< Begin of every pixel's part of facets_.
  std::vector<std::size_t> facets_;  ///< In ascending order within a pixel.
};

/// Assigns a facet to every unlit pixel, row by row.
class Guide {
 public:
  Guide(const LitPicture& picture, const Eigen::Matrix2Xd& centroids)
      : picture_(picture),
        centroids_(centroids),
        facets_(picture.columns, picture.rows, centroids),
        staying_(picture.wanted.size()),
        led_(static_cast<std::size_t>(centroids.cols()), kNoPixel) {
    for (std::size_t p = 0; p < staying_.size(); ++p) staying_[p] = facets_.in(p).size();
  }

  std::vector<std::int32_t> run() {
    for (int row = 0; row < picture_.rows; ++row) {
      for (int column = 0; column < picture_.columns; ++column) {
        if (unlit(index(row, column))) lead_to(row, column);
      }
    }
    return std::move(led_);
  }

 private:
  [[nodiscard]] std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(picture_.columns) +
           static_cast<std::size_t>(column);
  }
  [[nodiscard]] bool unlit(std::size_t pixel) const {
    const double wanted = picture_.wanted[pixel];
    return wanted >= kMinWanted && picture_.light[pixel] < kMinLight * wanted;
  }

  struct Candidate {
    double distance = std::numeric_limits<double>::infinity();
    std::size_t facet = 0;
    std::size_t home = 0;  ///< The pixel that it leaves.
  };

  void lead_to(int row, int column) {
    const Eigen::Vector2d middle(column + 0.5, row + 0.5);
    Candidate nearest;
    for (int r = std::max(0, row - kUnlitReach);
         r <= std::min(picture_.rows - 1, row + kUnlitReach); ++r) {
      for (int c = std::max(0, column - kUnlitReach);
           c <= std::min(picture_.columns - 1, column + kUnlitReach); ++c) {
        look_in(index(r, c), middle, nearest);
      }
    }
    if (std::isinf(nearest.distance)) return;
    led_[nearest.facet] = static_cast<std::int32_t>(index(row, column));
    --staying_[nearest.home];
  }

  void look_in(std::size_t home, const Eigen::Vector2d& middle, Candidate& nearest) const {
    const double loss = staying_[home] <= 1 ? kLonelyLoss : 0.0;
    for (const std::size_t f : facets_.in(home)) {
      if (led_[f] != kNoPixel) continue;
      const double distance = (centroids_.col(static_cast<Eigen::Index>(f)) - middle).norm() + loss;
      if (distance < nearest.distance) nearest = {distance, f, home};
    }
  }

  LitPicture picture_;
  const Eigen::Matrix2Xd& centroids_;
  FacetsByPixel facets_;
  std::vector<std::size_t>
      staying_;  ///< Per pixel: number of facets that are not assigned elsewhere.
  std::vector<std::int32_t> led_;
};

}  // namespace

std::vector<std::int32_t> lead_to_unlit_pixels(const LitPicture& picture,
                                               const Eigen::Matrix2Xd& centroids) {
  return Guide(picture, centroids).run();
}

AreaBarrier default_area_barrier(const OpticalSetup& setup, std::int64_t triangles, double least) {
  const double mean = setup.lens_size.prod() / static_cast<double>(triangles);
  return {least * mean, 5.0 * least * mean};
}

template class DesignObjectiveOn<Executor>;

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cam/check/chart.h"
#include "cam/coupon/coupon_fit.h"
#include "core/compute/executor.h"
#include "core/image/image.h"

namespace lensforge {

/// A photograph of the wall in linear light.
struct Photograph {
  Image light;                        ///< 1 is the white of the file.
  std::vector<unsigned char> usable;  ///< Per pixel: 0 if it is clipped, kCovered, else 1.
  std::string name;                   ///< For messages.
  std::optional<SeenChart> chart = {};

  /// Of a pixel that shows the chart in place of the wall.
  static constexpr unsigned char kCovered = 2;

  [[nodiscard]] bool is_usable(int column, int row) const {
    return usable[static_cast<std::size_t>(row) * static_cast<std::size_t>(light.columns()) +
                  static_cast<std::size_t>(column)] == 1;
  }
};

/// Light above which a pixel counts as clipped.
inline constexpr double kClipped = 0.955;

/// A photograph of the wall. @param dark  one with the lamp off, in the same place, that is
/// subtracted; empty: none.
/// @throw InputError if their sizes differ.
Photograph photograph(Image light, const Image& dark, const std::string& name);

/// One photograph from several of different exposures: each is related to the one before by the
/// pixels that neither clips, and a pixel's light is that of the longest exposure that does not
/// clip it, in the unit of the shortest.
/// @throw InputError if sizes differ, or two have too few pixels in common.
Photograph bracketed(const std::vector<Photograph>& exposures);

/// The same without the light of its chart, in whose place is that of the darkest wall.
/// @pre there is a chart.
Photograph without_chart(Photograph photo);

/// Place of a pixel from the photograph's middle in half diagonals.
Eigen::Vector2d place_in(const Image& photo, const Eigen::Vector2d& pixel);

/// The same with pixels about `by` times as wide: means of light over whole pixels, clipped if any
/// of them is; up to `by` columns and rows at its sides are left out.
Photograph shrunk(const Photograph& photo, double by);

/// A predicted picture on the wall: `margin` of its pixels lie beyond each side of the rectangle
/// whose coordinates run from −1 to 1, to the right and down.
struct WallPicture {
  Image light;
  int margin = 0;
  /// ln of the size on the wall of what the coordinates take for 1, in half the planned picture's:
  /// a lamp's distance changes it, and the pictures stay alike.
  double log_size = 0.0;

  [[nodiscard]] double inner_columns() const { return light.columns() - 2.0 * margin; }
  [[nodiscard]] double inner_rows() const { return light.rows() - 2.0 * margin; }
  /// Light, and its derivatives by the place on the wall.
  struct Light {
    double value = 0.0;
    Eigen::Vector2d gradient{0.0, 0.0};
  };
  /// Cubic convolution (Keys 1981) between pixels' middles; 0 outside.
  [[nodiscard]] Light at(const Eigen::Vector2d& wall) const;
};

/// How a camera sees the wall: the values of a fit.
///
/// Notation: X a pixel from the middle of the photograph in half diagonals; Y = X (1 + k₁ r² + k₂
/// r⁴), r = |X|, what a lens without distortion would have seen; w = H Y, homogeneous, the place on
/// the wall (WallPicture); the light of the pixel is f (g p(w) + b + c·X) with the camera's falloff
/// f = 1 + a·X + X·B X.
namespace view {
inline constexpr int kHomography = 0;  ///< Rows of H, but its last element, 1.
inline constexpr int kDistortion = 8;  ///< k₁, k₂
inline constexpr int kGain = 10;       ///< g
inline constexpr int kFalloff = 11;    ///< a, B₁₁, B₁₂, B₂₂
inline constexpr int kAmbient = 16;    ///< b, then c: the room's light.
inline constexpr int kCount = 19;
}  // namespace view

/// Where a pixel sees the wall. @param pixel  X.
Eigen::Vector2d wall_of(const Eigen::VectorXd& view, const Eigen::Vector2d& pixel);

/// Light p of the wall's picture from that of a pixel. @param pixel  X.
double wall_light(const Eigen::VectorXd& view, const Eigen::Vector2d& pixel, double light);

/// Pixel coordinates at which a photograph shows places on the wall.
class WallToPhoto {
 public:
  /// @param photo  of which the view is.
  WallToPhoto(const Photograph& photo, Eigen::VectorXd view)
      : half_(0.5 * Eigen::Vector2d(photo.light.columns(), photo.light.rows())),
        view_(std::move(view)) {}

  /// Where a strong distortion shows no such place it is one in or near the photograph.
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& wall) const;

  /// Light of the wall's picture from that of the photograph at pixel coordinates.
  [[nodiscard]] double light(const Eigen::Vector2d& pixel, double seen) const {
    return wall_light(view_, (pixel - half_) / half_.norm(), seen);
  }

 private:
  Eigen::Vector2d half_;
  Eigen::VectorXd view_;
};

/// Pixels of a photograph that see the wall around a picture, and their light, as display values:
/// sRGB's of 2 % of white more than the light. Where the photograph has a chart, its ChartTie's
/// residuals follow the display values, one standard error as a step of these.
class SeenPixels {
 public:
  /// Pixels whose wall lies within `reach` (1: the rectangle itself) by this view.
  /// @param view  of a photograph with these proportions.
  SeenPixels(const Photograph& photo, const Eigen::VectorXd& view, double reach);

  [[nodiscard]] const std::optional<ChartTie>& tie() const { return tie_; }
  /// Takes the chart's size for certain, too, but for the error of its bar.
  /// @param step  display values as uncertain as a standard error of the chart's.
  void trust_bar(double step) {
    step_ = step;
    bar_ = true;
  }
  /// Of all values.
  [[nodiscard]] Eigen::Index size() const { return seen_.size(); }
  /// Display values that the view makes of a picture: the mean of nine places in every pixel, with
  /// the variance of the pixel on the wall where it is wider than the picture's.
  [[nodiscard]] Eigen::VectorXd shown(const Eigen::VectorXd& view, const WallPicture& wall) const;
  /// Their derivatives by the view's values; those of light by its middle.
  [[nodiscard]] Eigen::MatrixXd derivatives(const Eigen::VectorXd& view,
                                            const WallPicture& wall) const;
  /// Display values of the photograph.
  [[nodiscard]] const Eigen::VectorXd& seen() const { return seen_; }
  /// A linear problem in light: what pixels get from the picture moved on the wall by each of
  /// `ways`, then from the three values of the room's light, and what they show; each times the
  /// slope of display values at what they show.
  struct LightRows {
    Eigen::MatrixXd of;
    Eigen::VectorXd seen;
  };
  /// @param most  rows at most: of more pixels every n-th has one.
  [[nodiscard]] LightRows light_rows(const Eigen::VectorXd& view, const WallPicture& wall,
                                     const std::vector<Eigen::Vector2d>& ways, Eigen::Index most,
                                     const Executor& executor) const;
  /// Correlation of both over pixels that see the rectangle itself.
  [[nodiscard]] double correlation(const Eigen::VectorXd& view, const WallPicture& wall) const;
  /// Pixels per independent value of residuals: ((1 + ρ) / (1 − ρ))², ρ their correlation from a
  /// pixel to its right neighbour, as of a first-order process along both axes; at least 1.
  [[nodiscard]] double values_alike(const Eigen::VectorXd& residuals) const;
  /// Root mean square of what a pixel's residual shares with its right neighbour's: the part that
  /// is no noise of the pixels.
  [[nodiscard]] double shared_by_neighbours(const Eigen::VectorXd& residuals) const;

 private:
  /// Means over neighbours along a row.
  struct NeighbourMeans {
    double product = 0.0;
    double square = 0.0;
  };
  [[nodiscard]] NeighbourMeans neighbour_means(const Eigen::VectorXd& residuals) const;
  [[nodiscard]] WallPicture::Light seen_light(const Eigen::VectorXd& view, const WallPicture& wall,
                                              const Eigen::Vector2d& place) const;
  /// Places on the wall whose mean stands for a pixel.
  using Spots = std::array<Eigen::Vector2d, 9>;
  [[nodiscard]] Spots spots(const Eigen::VectorXd& view, const WallPicture& wall,
                            const Eigen::Vector2d& place) const;

  /// Of the tie's residuals in order, or their derivatives, those that count, in display values.
  template <class Rows>
  [[nodiscard]] Rows in_steps(Rows rows) const {
    rows *= step_;
    if (!bar_) rows.bottomRows(1).setZero();
    return rows;
  }

  std::vector<Eigen::Vector2d> places_;
  Eigen::VectorXd seen_;
  double pixel_;  ///< Side, in half diagonals.
  std::optional<ChartTie> tie_;
  double step_ = 0.03;  ///< About what a picture's forecast leaves before anything is fitted to it.
  bool bar_ = false;
};

/// Fit of a view's values, some free, to a photograph of a known picture.
Eigen::VectorXd fit_view(const SeenPixels& pixels, const WallPicture& wall, Eigen::VectorXd view,
                         const std::vector<int>& free);

/// Problem in a view's values, all free, without its residuals.
LeastSquares view_problem();

/// @throw InputError naming the photograph: too dark, clipped, or nothing is brighter than the
/// wall.
void require_light(const Photograph& photo);

/// Finds a picture in a photograph.
/// @throw InputError naming the photograph: no picture in it, too dark, clipped, mirrored, upside
///        down, turned, or a picture of another lens.
Eigen::VectorXd find_picture(const Photograph& photo, const WallPicture& wall);

/// Pixels of the photograph across the picture.
double pixels_across(const Photograph& photo, const Eigen::VectorXd& view);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <complex>

#include "cam/check/chart.h"
#include "core/image/image.h"

namespace lensforge {

/// Standard error of the bar's length as a person measures it: 0.2 mm of 100 mm.
inline constexpr double kBarError = 0.002;

/// What a chart on the wall says of a camera's view (wall_view.h).
///
/// Notation: m a corner on the chart and z the place where the view sees it, mm, as complex
/// numbers. The chart hangs anywhere, at any angle: z = a m + b by weighted least squares, or of m
/// mirrored if that is nearer. A right view sees every corner at its (z − b) / a, and its picture
/// is as large as planned if |a| = 1.
class ChartTie {
 public:
  /// @param photo  that the corners belong to. @pre the chart has a mark, and its picture's size.
  ChartTie(const SeenChart& chart, const Image& photo);

  /// (z − b) / a − m of every corner, and ln |a|, in standard errors.
  /// @param log_size  WallPicture::log_size
  [[nodiscard]] Eigen::VectorXd residuals(const Eigen::VectorXd& view, double log_size) const;
  /// Their derivatives by the view's values, from differences.
  [[nodiscard]] Eigen::MatrixXd derivatives(const Eigen::VectorXd& view) const;
  [[nodiscard]] Eigen::Index size() const { return 2 * places_.cols() + 1; }
  /// |a|: size on the wall of what the view takes for 1.
  [[nodiscard]] double scale(const Eigen::VectorXd& view) const;

 private:
  struct Similarity {
    std::complex<double> a, b;
    bool mirrored = false;
  };
  [[nodiscard]] Eigen::VectorXcd seen(const Eigen::VectorXd& view) const;
  [[nodiscard]] Similarity similarity(const Eigen::VectorXcd& z) const;

  Eigen::Matrix2Xd places_;  ///< In the photograph, half diagonals from its middle.
  Eigen::VectorXcd chart_;   ///< m
  Eigen::VectorXd weights_;  ///< 1 / standard error, 1/mm.
  Eigen::Vector2d half_;     ///< Half the picture's size, mm.
};

/// Standard error of a chart's corners along each axis, pixels: of what the best perspective with
/// distortion leaves, and not below that of finding them.
double corner_error(const SeenChart& chart, const Image& photo);

/// A view that the chart is right in. Around a place of the photograph, which shows `at` on the
/// wall, it is turned by `turn` from upright.
Eigen::VectorXd view_by_chart(const SeenChart& chart, const Image& photo,
                              const Eigen::Vector2d& place, const Eigen::Vector2d& at,
                              const Eigen::Matrix2d& turn);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "core/image/image.h"

namespace lensforge {

/// A chart to print and fasten on the wall beside a lens's picture: four ArUco marks (0 … 3 of
/// 4 × 4 cells, Garrido-Jurado et al. 2014) and a scale bar. With a bar of 100 mm it is as large as
/// a sheet of A5. Places on it are in bars from its upper left corner, to the right and down.

/// Length of the bar, mm.
inline constexpr double kChartBar = 100.0;

/// The chart as an SVG drawing in mm. @param bar  mm
std::string chart_drawing(double bar);

/// Size of the chart, bars.
Eigen::Vector2d chart_size();

/// A chart in a photograph.
struct SeenChart {
  struct Corner {
    Eigen::Vector2d pixel;  ///< From the photograph's upper left corner.
    Eigen::Vector2d at;     ///< On the chart.
  };

  std::vector<Corner> corners;        ///< Four of every mark that is in sight.
  double error = 0.0;                 ///< Standard, of a corner along each axis, pixels.
  double bar = kChartBar;             ///< Length of the bar as printed, mm.
  Eigen::Vector2d picture{0.0, 0.0};  ///< Planned size of the lens's picture, mm.

  [[nodiscard]] int marks() const { return static_cast<int>(corners.size()) / 4; }
  /// Perspective from photograph to chart, of places beside the photograph's middle in half
  /// diagonals. @param photo  as large as the corners' one. @pre a mark
  [[nodiscard]] Eigen::Matrix3d perspective(const Image& photo) const;
};

/// Marks that a chart needs: with fewer its scale is poor, and what is found may be no chart.
inline constexpr int kFewestMarks = 2;

/// Finds the marks of a chart that are in sight, in whatever light the wall has: dark
/// quadrilaterals on a brighter ground whose cells are those of a mark. Corners are those of lines
/// through their sides. A mirrored chart is not one. Marks need 25 pixels, and 2 % of the longer
/// side. @return none if no mark is in sight, or more than one in no
/// common perspective.
/// @param name  of the photograph. @throw InputError if a mark is in it twice.
std::optional<SeenChart> find_chart(const Image& light, const std::string& name);

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

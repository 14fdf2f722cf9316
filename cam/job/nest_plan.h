// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "cam/plan/cam_options.h"
#include "cam/report/report_data.h"
#include "core/compute/work_estimate.h"
#include "core/surface/lens.h"

namespace lensforge {

/// A rectangle that is to lie on a blank; mm.
struct NestItem {
  std::string name;
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
};

/// The blank and what of it has to stay around rectangles; mm.
struct NestSheet {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  double gap = 0.0;   ///< Between rectangles, at least.
  double edge = 0.0;  ///< Between them and the blank's edge, at least.
};

/// Places rectangles in rows along x, the highest first, each in the first row that has room for
/// it; none is turned, since the cut of a turned lens would be another one.
/// @return their lower left corners from that of the blank, in the order of the items, on whole
///         multiples of kNestStep.
/// @throw InputError naming --blank and a size that would do, if they do not fit.
std::vector<Eigen::Vector2d> place_in_rows(const std::vector<NestItem>& items,
                                           const NestSheet& sheet);

/// mm; a whole number of units of any program's last decimal, so that moved numbers are rounded as
/// they were.
inline constexpr double kNestStep = 0.01;

/// One of the lenses that share a blank.
struct NestLens {
  std::string name;  ///< Of its folder of reports: no two have the same.
  const Lens* lens = nullptr;
};

/// How lenses share a blank; mm. Clamps are placed from the blank's lower left corner.
struct NestOptions {
  CamOptions cam;  ///< Of all lenses; stock.margin is kept free at the blank's edge.
  Eigen::Vector2d blank = Eigen::Vector2d::Zero();
  std::optional<double> thickness;  ///< Of the blank; none: what the highest lens needs.
  double gap = 0.0;                 ///< Between lenses; 0: the least that the tools need.
};

/// A lens where it lies on the blank.
struct NestedLens {
  std::string name;
  Eigen::AlignedBox2d box;               ///< Its rectangle from the blank's corner, mm.
  std::vector<Eigen::Vector2d> outline;  ///< Likewise, counter-clockwise.
  bool cut_out = false;                  ///< Else it stays joined to the blank.
  ReportData report;
};

/// How a nest is laid out.
struct NestLayout {
  Eigen::Vector3d blank = Eigen::Vector3d::Zero();  ///< mm
  double gap = 0.0;
  double edge = 0.0;
  double slot = 0.0;  ///< Width of the cut around lenses, mm; 0 if none is cut out.
  std::vector<NestedLens> lenses;
  std::vector<KeepOut> keep_outs;
};

/// The options of each lens's cut in the order of the lenses, and where they lie.
struct NestPlan {
  NestLayout layout;
  std::vector<CamOptions> cuts;
};

/// Of the common blank, at least: the highest lens with the stock above it, mm.
double least_thickness(const std::vector<NestLens>& lenses, const NestOptions& options);

/// @throw InputError as make_nest().
NestPlan plan_nest(const std::vector<NestLens>& lenses, const NestOptions& options);

/// What make_nest() takes: all that estimate_cut() says of each lens.
WorkEstimate estimate_nest(const NestPlan& plan, const std::vector<NestLens>& lenses, int threads);

/// The blank seen from above as SVG: lenses with their names and places, the cut around them,
/// clamps, the program's zero. One unit is a millimetre.
std::string nest_svg(const NestLayout& layout);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "cam/check/wall_model.h"
#include "cam/check/wall_view.h"
#include "core/compute/executor.h"

namespace lensforge {

/// One deviation that explains a part of what a photograph shows.
struct FoundCause {
  Deviation deviation;
  double value = 0.0;  ///< In the unit of Deviation.
  double error = 0.0;  ///< Standard.
  /// By how much the photograph is likelier with it, in ln likelihood times 2, less the cost of a
  /// cause.
  double evidence = 0.0;
  /// Deviations that would explain the same nearly as well in its place.
  std::vector<Deviation> alternatives;
};

/// What one photograph tells of a lens.
struct CauseFit {
  Eigen::VectorXd view;           ///< With the causes.
  Deviations deviations;          ///< 0 but for the causes.
  std::vector<FoundCause> found;  ///< Most evidence first; none: nothing is wrong that shows.
  /// What every deviation would be if it were added to the causes, and its standard error; 0 if it
  /// does not show.
  Deviations alone = Deviations::Zero(), errors = Deviations::Zero();
  double residual = 0.0;     ///< Root mean square of display values.
  double systematic = 0.0;   ///< Its part that neighbouring pixels share, which is no noise.
  double unexplained = 0.0;  ///< The same without any cause.
};

/// Finds the set of causes with the most evidence, less what speaks against so many and so large
/// ones beforehand: all sets are compared to first order, the best few are fitted together with the
/// view by Gauss-Newton steps over pictures that are predicted anew (a polish also from a weaker
/// one), and all are compared again around it, with one more cause allowed each time, until none is
/// better.
/// @param view  find_picture()'s. @throw Interrupted
CauseFit find_causes(const WallModel& model, const SeenPixels& pixels, const Eigen::VectorXd& view,
                     const RunControl& control);

/// A predicted picture of the model for a view. @param near  as of WallModel::picture().
WallPicture wall_picture(const WallModel& model, const Deviations& deviations,
                         const Deviations& near);
WallPicture wall_picture(const WallModel& model, const Deviations& deviations);

}  // namespace lensforge

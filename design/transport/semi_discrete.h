// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"

namespace lensforge {

struct TransportOptions {
  /// Ends when no cell's mass differs from the wanted one by more than this share of it.
  double tolerance = 1e-4;
  /// Newton steps over all levels after which the solver gives up.
  int max_newton_steps = 1000;
  /// Newton steps under one blur and floor after which the solver gives up: where it gets on at
  /// all, a dozen do.
  int max_stage_steps = 1000;
};

/// Share of the mean light below which a pixel counts as black.
inline constexpr double kBlack = 1e-3;

/// One Newton step, for the log.
struct TransportStep {
  int level = 0;            ///< 0 is the finest.
  int sites = 0;            ///< Of the level.
  double blur = 0.0;        ///< σ of the Gaussian that the density is blurred with, pixels.
  double floor = 0.0;       ///< Share of the mass that is spread evenly over the picture.
  int number = 0;           ///< Steps taken before this one on the level.
  double length = 0.0;      ///< Share of the Newton direction that was taken.
  double mass_error = 0.0;  ///< max |mass − wanted| / wanted after the step, under blur and floor.
  double seconds = 0.0;     ///< Wall-clock time of the step.
  double cpu_seconds = 0.0;  ///< Processor time of all threads of the process in the step.
};

struct TransportResult {
  enum class Status { kConverged, kNotConverged, kStopped };
  Status status = Status::kNotConverged;
  std::string message;  ///< Why it ended, in one line.
  /// n, pixels²; mean 0 over the sites of positive mass. A site without mass has the least weight
  /// at which its cell is a point.
  Eigen::VectorXd weights;
  /// 2 × n, pixels: centre of mass of every site's cell (Sun et al., Eq. 22). Sites that lie on
  /// top of each other share one cell; sites without mass get the interpolated centroids of the
  /// cells around their place.
  Eigen::Matrix2Xd centroids;
  /// n, pixels²: how much of the picture, dark parts included, a site's cell covers. Sites that
  /// share a cell share it as they share its mass.
  Eigen::VectorXd areas;
  Eigen::VectorXd lit_areas;  ///< n, pixels²: the same without what is black (kBlack).
  double mass_error = 0.0;    ///< max |mass − wanted| / wanted over the sites of positive mass.
  double misplaced = 1.0;  ///< Share of all mass that is in the wrong cell, ½ Σ |mass − wanted|.
  std::vector<TransportStep> steps;

  [[nodiscard]] bool converged() const { return status == Status::kConverged; }
};

/// Semi-discrete optimal transport of a picture onto sites under the squared distance (Sun et al.,
/// 3.4): the weights whose power cells, cut to the picture, hold the wanted masses. They minimise
/// the convex H(w) of the paper; found by damped Newton steps (Kitagawa, Mérigot & Thibert 2019) on
/// a hierarchy of site clusters.
/// @param sites    2 × n, pixel coordinates (ImagePlane::to_pixels()); may lie outside of the
///                 picture and on top of each other.
/// @param masses   n, not negative.
/// @param density  linear light; scaled so that its integral is the sum of the masses.
/// @throw InputError if a site is not finite, a mass is negative or not finite, the masses or the
///        density sum to 0, or the sizes disagree.
TransportResult solve_semi_discrete(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses,
                                    const Image& density, const TransportOptions& options,
                                    const Executor& executor, const RunControl& control);

}  // namespace lensforge

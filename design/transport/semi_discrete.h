// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"

namespace lensforge {

/// Blurs a picture with exp(−(|x| + |y|)/length), mirrored at its borders, and mixes it with an
/// even grey that has `floor` of all light. The total is kept to rounding.
///
/// The kernel's tails fall slowly, so every cell feels the light on both sides of a black part,
/// more faintly the smaller the length. As the length falls, cells leave the black gradually. A
/// Gaussian (zero at 5 σ) needs a floor for that: on the two-level logo of the benchmark at 3,680
/// sites lowering a floor from 0.1 to 0 took 50 Newton steps, lowering the length from 8 pixels to
/// 0 took 18.
/// @param length  pixels; 0 for no blur.
/// @param floor   0 … 1.
Image soften(const Image& picture, double length, double floor);

struct TransportOptions {
  /// Ends when no cell's mass differs from the wanted one by more than this share of it.
  double tolerance = 1e-4;
  /// Maximum number of Newton steps over all levels.
  int max_newton_steps = 1000;
  /// Maximum number of Newton steps under one blur and floor; a dozen suffice if it converges at
  /// all.
  int max_stage_steps = 1000;
};

/// Share of the mean light below which a pixel counts as black.
inline constexpr double kBlack = 1e-3;

/// One Newton step, for the log.
struct TransportStep {
  int level = 0;            ///< 0 is the finest.
  int sites = 0;            ///< Number of sites of the level.
  double blur = 0.0;        ///< Length of the blur of the density (soften()), pixels.
  double floor = 0.0;       ///< Share of the mass spread evenly over the picture.
  int number = 0;           ///< Steps taken before this one on the level.
  double length = 0.0;      ///< Share of the Newton direction taken.
  double mass_error = 0.0;  ///< max |mass − wanted| / wanted after the step, under blur and floor.
  double seconds = 0.0;     ///< Wall-clock time of the step.
  double cpu_seconds = 0.0;  ///< Processor time of all threads of the process in the step.
};

struct TransportResult {
  enum class Status { kConverged, kNotConverged, kStopped };
  Status status = Status::kNotConverged;
  std::string message;  ///< Reason of its end, in one line.
  /// n, pixels²; mean 0 over the sites of positive mass. A site without mass has the smallest
  /// weight at which its cell is a point.
  Eigen::VectorXd weights;
  /// 2 × n, pixels: centre of mass of every site's cell (Sun et al., Eq. 22). Coincident sites
  /// share one cell; sites without mass get the interpolated centroids of the cells around them.
  Eigen::Matrix2Xd centroids;
  /// n, pixels²: area of the picture, including dark parts, covered by a site's cell. Sites that
  /// share a cell share its area like its mass.
  Eigen::VectorXd areas;
  Eigen::VectorXd lit_areas;  ///< n, pixels²: `areas` without black parts (kBlack).
  double mass_error = 0.0;    ///< max |mass − wanted| / wanted over the sites of positive mass.
  double misplaced = 1.0;     ///< Share of all mass in the wrong cell.
  std::vector<TransportStep> steps;

  [[nodiscard]] bool converged() const { return status == Status::kConverged; }
};

/// Semi-discrete optimal transport of a picture onto sites under the squared distance (Sun et al.,
/// 3.4): finds the weights whose power cells, cut to the picture, hold the wanted masses. They
/// minimise the convex H(w) of the paper and are found by damped Newton steps (Kitagawa, Mérigot &
/// Thibert 2019) on a hierarchy of site clusters.
/// @param sites    2 × n, pixel coordinates (ImagePlane::to_pixels()); may lie outside the picture
///                 and coincide.
/// @param masses   n, not negative.
/// @param density  linear light; scaled so that its integral is the sum of the masses.
/// @throw InputError if a site is not finite, a mass is negative or not finite, the masses or the
///        density sum to 0, or the sizes disagree.
TransportResult solve_semi_discrete(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses,
                                    const Image& density, const TransportOptions& options,
                                    const Executor& executor, const RunControl& control);

/// The transport map between the sites of a solved semi-discrete transport.
///
/// Brenier's potential ψ is convex and T = ∇ψ. Every site i with its cell's centroid c̃_i gives a
/// plane below it, ψ_i + c̃_i·(p − x_i). The site whose plane is highest at p lies on p's side of
/// every crease of ψ, where the map jumps over a black part of the picture. T at p is that site's
/// linear map, fitted to the neighbours on the same side. So no light is sent into black, and the
/// jump is sharp. It lies within half the sites' spacing of the true crease, because a site whose
/// cell has light on both sides does not show how much lies on which.
class BrenierMap {
 public:
  /// @param sites    2 × n, pixel coordinates, as given to solve_semi_discrete().
  /// @param result   its result. @param density  the picture it was solved for. All three must
  ///                 outlive the map. @pre result.centroids is 2 × n.
  BrenierMap(const Eigen::Matrix2Xd& sites, const TransportResult& result, const Image& density);

  /// T(p), pixel coordinates; within the picture.
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& p) const;

  /// The vector from p to the nearest point of the crease between p's side and the next one across
  /// black; nothing if no site around is on another side.
  [[nodiscard]] std::optional<Eigen::Vector2d> way_to_crease(const Eigen::Vector2d& p) const;

 private:
  [[nodiscard]] int bucket_of(double coordinate, Eigen::Index axis) const;
  [[nodiscard]] std::size_t bucket(int column, int row) const;
  /// Sites in the buckets around p whose cells' centroids are lit.
  [[nodiscard]] std::vector<int> around(const Eigen::Vector2d& p) const;
  /// The one of `sites` whose plane is highest at p; −1 if there are none.
  [[nodiscard]] int highest(const std::vector<int>& sites, const Eigen::Vector2d& p) const;
  [[nodiscard]] double plane_at(int site, const Eigen::Vector2d& p) const;
  [[nodiscard]] bool is_lit(const Eigen::Vector2d& at) const;
  [[nodiscard]] bool is_lit_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;
  [[nodiscard]] Eigen::Matrix2d slope_at(int site, const std::vector<int>& others) const;

  const Eigen::Matrix2Xd& sites_;
  const Eigen::Matrix2Xd& centroids_;
  const Image& density_;
  double black_;
  Eigen::VectorXd psi_;
  std::vector<char> lit_;  ///< Per site: 1 if its cell's centroid is lit.
  Eigen::Vector2d low_;
  Eigen::Vector2i buckets_;
  double spacing_;
  std::vector<int> begin_;  ///< Begin of every bucket's sites in `members_`, and the end.
  std::vector<int> members_;
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/image/image.h"
#include "design/transport/semi_discrete.h"

namespace lensforge {

/// The transport map between the sites of a solved semi-discrete transport.
///
/// Brenier's potential ψ is convex and T = ∇ψ. Every site i with its cell's centroid c̃_i gives a
/// plane below it, ψ_i + c̃_i·(p − x_i). The site whose plane is the highest at p is on p's side of
/// every crease of ψ, where the map jumps over a black part of the picture; its own linear map,
/// fitted to the neighbours on the same side, is T at p. So no light is sent into black, and the
/// jump is sharp. It lies within half the sites' spacing of the true crease: a site whose cell has
/// light on both sides of the black tells nothing of how much on which.
class BrenierMap {
 public:
  /// @param sites    2 × n, pixel coordinates, as given to solve_semi_discrete().
  /// @param result   of it. @param density  the picture it was solved for. All three must outlive
  ///                 the map. @pre result.centroids is 2 × n.
  BrenierMap(const Eigen::Matrix2Xd& sites, const TransportResult& result, const Image& density);

  /// T(p), pixel coordinates; within the picture.
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& p) const;

  /// The way from p to the nearest point of the crease between p's side and the next one across
  /// black; nothing where no site around has another side.
  [[nodiscard]] std::optional<Eigen::Vector2d> way_to_crease(const Eigen::Vector2d& p) const;

 private:
  [[nodiscard]] int bucket_of(double coordinate, Eigen::Index axis) const;
  [[nodiscard]] std::size_t bucket(int column, int row) const;
  /// Sites in the buckets around p whose cells' centroids lie in light.
  [[nodiscard]] std::vector<int> around(const Eigen::Vector2d& p) const;
  /// The one of `sites` whose plane is the highest at p; −1 if there are none.
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
  std::vector<char> lit_;  ///< Per site, whether its cell's centroid lies in light.
  Eigen::Vector2d low_;
  Eigen::Vector2i buckets_;
  double spacing_;
  std::vector<int> begin_;  ///< Of every bucket's sites among `members_`, and one past.
  std::vector<int> members_;
};

}  // namespace lensforge

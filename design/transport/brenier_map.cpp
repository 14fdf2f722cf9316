// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/brenier_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "design/transport/potential_upsampling.h"

namespace lensforge {

namespace {

/// Buckets to each side of a place's own whose sites are looked at.
constexpr int kReach = 2;

/// Distance between the places at which a way is looked at for black, pixels.
constexpr double kLook = 0.5;

/// Added to the moments of the neighbours' places, as a share of their trace, so that neighbours
/// in one line do not give an unbounded slope across it.
constexpr double kRidge = 1e-3;

}  // namespace

BrenierMap::BrenierMap(const Eigen::Matrix2Xd& sites, const TransportResult& result,
                       const Image& density)
    : sites_(sites),
      centroids_(result.centroids),
      density_(density),
      black_(kBlack * density.total() / static_cast<double>(density.values().size())),
      psi_(potential_of_weights(sites, result.weights)) {
  for (Eigen::Index i = 0; i < sites.cols(); ++i) lit_.push_back(is_lit(centroids_.col(i)) ? 1 : 0);
  low_ = sites.rowwise().minCoeff();
  const Eigen::Vector2d size = sites.rowwise().maxCoeff() - low_;
  spacing_ = std::sqrt(std::max(size.prod(), 1e-12) / static_cast<double>(sites.cols()));
  buckets_ = (size / spacing_).cast<int>() + Eigen::Vector2i::Ones();
  const auto number = [&](Eigen::Index i) {
    return bucket(bucket_of(sites(0, i), 0), bucket_of(sites(1, i), 1));
  };
  begin_.assign(static_cast<std::size_t>(buckets_.prod()) + 1, 0);
  for (Eigen::Index i = 0; i < sites.cols(); ++i) ++begin_[number(i) + 1];
  for (std::size_t b = 1; b < begin_.size(); ++b) begin_[b] += begin_[b - 1];
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  members_.resize(static_cast<std::size_t>(sites.cols()));
  for (Eigen::Index i = 0; i < sites.cols(); ++i) {
    members_[static_cast<std::size_t>(next[number(i)]++)] = static_cast<int>(i);
  }
}

int BrenierMap::bucket_of(double coordinate, Eigen::Index axis) const {
  const int bucket = static_cast<int>(std::floor((coordinate - low_[axis]) / spacing_));
  return std::clamp(bucket, 0, buckets_[axis] - 1);
}

std::size_t BrenierMap::bucket(int column, int row) const {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(buckets_.x()) +
         static_cast<std::size_t>(column);
}

std::vector<int> BrenierMap::around(const Eigen::Vector2d& p) const {
  const int column = bucket_of(p.x(), 0);
  const int row = bucket_of(p.y(), 1);
  const int left = std::max(0, column - kReach);
  const int right = std::min(buckets_.x() - 1, column + kReach);
  std::vector<int> found;
  for (int r = std::max(0, row - kReach); r <= std::min(buckets_.y() - 1, row + kReach); ++r) {
    const int first = begin_[bucket(left, r)];
    const int last = begin_[bucket(right, r) + 1];
    std::copy_if(members_.begin() + first, members_.begin() + last, std::back_inserter(found),
                 [&](int site) { return lit_[static_cast<std::size_t>(site)] != 0; });
  }
  return found;
}

int BrenierMap::highest(const std::vector<int>& sites, const Eigen::Vector2d& p) const {
  int best = -1;
  for (const int site : sites) {
    if (best < 0 || plane_at(site, p) > plane_at(best, p)) best = site;
  }
  return best;
}

double BrenierMap::plane_at(int site, const Eigen::Vector2d& p) const {
  return psi_[site] + centroids_.col(site).dot(p - sites_.col(site));
}

bool BrenierMap::is_lit(const Eigen::Vector2d& at) const {
  const int column = std::clamp(static_cast<int>(at.x()), 0, density_.columns() - 1);
  const int row = std::clamp(static_cast<int>(at.y()), 0, density_.rows() - 1);
  return static_cast<double>(density_.at(column, row)) > black_;
}

bool BrenierMap::is_lit_between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
  const int steps = static_cast<int>((b - a).norm() / kLook);
  for (int k = 1; k <= steps; ++k) {
    if (!is_lit(a + (b - a) * (static_cast<double>(k) / (steps + 1)))) return false;
  }
  return true;
}

Eigen::Matrix2d BrenierMap::slope_at(int site, const std::vector<int>& others) const {
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d products = Eigen::Matrix2d::Zero();
  for (const int other : others) {
    if (other == site) continue;
    const Eigen::Vector2d d = sites_.col(other) - sites_.col(site);
    if (!is_lit_between(centroids_.col(site), centroids_.col(other))) continue;
    const double weight = 1.0 / (d.squaredNorm() + spacing_ * spacing_);
    moments += weight * d * d.transpose();
    products += weight * (centroids_.col(other) - centroids_.col(site)) * d.transpose();
  }
  if (!(moments.trace() > 0.0)) return Eigen::Matrix2d::Zero();
  moments.diagonal().array() += kRidge * moments.trace();
  return products * moments.inverse();
}

Eigen::Vector2d BrenierMap::operator()(const Eigen::Vector2d& p) const {
  const std::vector<int> sites = around(p);
  const int best = highest(sites, p);
  if (best < 0) {
    Eigen::Index nearest = 0;
    (sites_.colwise() - p).colwise().squaredNorm().minCoeff(&nearest);
    return centroids_.col(nearest);
  }
  const Eigen::Vector2d landing =
      (centroids_.col(best) + slope_at(best, sites) * (p - sites_.col(best)))
          .cwiseMax(0.0)
          .cwiseMin(Eigen::Vector2d(density_.columns(), density_.rows()));
  return is_lit(landing) ? landing : Eigen::Vector2d(centroids_.col(best));
}

std::optional<Eigen::Vector2d> BrenierMap::way_to_crease(const Eigen::Vector2d& p) const {
  std::vector<int> sites = around(p);
  const int here = highest(sites, p);
  if (here < 0) return std::nullopt;
  const Eigen::Vector2d landing = centroids_.col(here);
  std::erase_if(sites, [&](int s) { return is_lit_between(landing, centroids_.col(s)); });
  const int there = highest(sites, p);
  if (there < 0) return std::nullopt;
  // Where the two planes are level.
  const Eigen::Vector2d jump = centroids_.col(there) - landing;
  return (plane_at(here, p) - plane_at(there, p)) / jump.squaredNorm() * jump;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

#include "design/optimize/vector_kernels.h"

namespace lensforge {

/// The latest steps s of a minimisation with the gradient's changes y over them, and the two loops
/// of limited-memory BFGS over these pairs (Nocedal & Wright, algorithm 7.4). With sᵢ·yⱼ at hand
/// each loop reads its vectors twice in all, a few in one pass. They are in single precision, and
/// rounded before anything is made of them: the matrix stays positive definite.
template <class Exec>
class CurvaturePairsOn {
 public:
  using Vector = typename Exec::template Buffer<double>;

  /// @param most  pairs that are kept, ≥ 1.
  CurvaturePairsOn(const Exec& executor, int most)
      : executor_(executor), most_(static_cast<std::size_t>(most)) {}

  [[nodiscard]] bool empty() const { return pairs_.empty(); }
  void clear() {
    for (Pair& pair : pairs_) spare_.push_back(std::move(pair));
    pairs_.clear();
  }

  /// Adds s = to.x − from.x and y = to.gradient − from.gradient, for the oldest where there are too
  /// many. @return s·y; 0, with nothing added, unless it is above kCurvatureFloor × |s||y|.
  template <class Point>
  double add(const Point& from, const Point& to);

  /// q ← g − Σ αᵢ yᵢ
  void first_loop(const Vector& g, Vector& q);
  /// r ← r + Σ (αᵢ − βᵢ) sᵢ, r = H₀ q. @pre the first loop was the last call.
  void second_loop(Vector& r);

 private:
  using Floats = typename Exec::template Buffer<float>;

  struct Pair {
    Floats s, y;
    double curvature = 0.0;        ///< s·y
    std::vector<double> products;  ///< sᵢ·y with the steps before, oldest first.
  };
  using Member = Floats Pair::*;

  /// Pairs with s·y below this share of |s||y| would spoil the matrix.
  static constexpr double kCurvatureFloor = 1e-12;

  [[nodiscard]] Pair free_pair(std::size_t size);
  [[nodiscard]] VectorGroup group(Member member, std::size_t first) const;
  template <class Values>
  [[nodiscard]] std::vector<double> products(Member member, const Values& v) const;
  void combine(Member member, const std::vector<double>& a, const Vector& from, Vector& to) const;

  Exec executor_;
  std::size_t most_;
  std::vector<Pair> pairs_;  ///< Oldest first.
  std::vector<Pair> spare_;  ///< Vectors to use again.
  std::vector<double> alpha_;
};

template <class Exec>
typename CurvaturePairsOn<Exec>::Pair CurvaturePairsOn<Exec>::free_pair(std::size_t size) {
  if (spare_.empty()) return {Floats(size), Floats(size), 0.0, {}};
  Pair pair = std::move(spare_.back());
  spare_.pop_back();
  return pair;
}

/// The vectors of a few pairs from `first` on; the last one again where there are fewer.
template <class Exec>
VectorGroup CurvaturePairsOn<Exec>::group(Member member, std::size_t first) const {
  VectorGroup vectors;
  for (std::size_t k = 0; k < kVectorGroup; ++k) {
    vectors[k] = (pairs_[std::min(first + k, pairs_.size() - 1)].*member).data();
  }
  return vectors;
}

/// Products of each pair's vector with v.
template <class Exec>
template <class Values>
std::vector<double> CurvaturePairsOn<Exec>::products(Member member, const Values& v) const {
  using Entry = std::remove_cv_t<std::remove_pointer_t<decltype(v.data())>>;
  const auto size = static_cast<std::int64_t>(v.size());
  std::vector<typename Exec::template PendingSum<kVectorGroup>> sums;
  for (std::size_t first = 0; first < pairs_.size(); first += kVectorGroup) {
    sums.push_back(pending_sum<kVectorGroup>(executor_, "products", size,
                                             GroupProducts<Entry>{group(member, first), v.data()}));
  }
  std::vector<double> result(pairs_.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = sums[i / kVectorGroup].get()[i % kVectorGroup];
  }
  return result;
}

/// to ← from + Σ a v over the pairs' vectors.
template <class Exec>
void CurvaturePairsOn<Exec>::combine(Member member, const std::vector<double>& a,
                                     const Vector& from, Vector& to) const {
  const double* start = from.data();
  for (std::size_t first = 0; first < pairs_.size(); first += kVectorGroup) {
    AddGroup add{group(member, first), {}, start, to.data()};
    const std::size_t count = std::min(kVectorGroup, pairs_.size() - first);
    std::copy_n(a.begin() + static_cast<std::ptrdiff_t>(first), count, add.a.begin());
    parallel_for(executor_, "combine", static_cast<std::int64_t>(to.size()), add, kVectorGrain);
    start = to.data();
  }
}

template <class Exec>
template <class Point>
double CurvaturePairsOn<Exec>::add(const Point& from, const Point& to) {
  const auto size = static_cast<std::int64_t>(from.x.size());
  Pair pair = free_pair(from.x.size());
  parallel_for(executor_, "difference", size,
               DifferenceEntry<float>{to.x.data(), from.x.data(), pair.s.data()}, kVectorGrain);
  parallel_for(executor_, "difference", size,
               DifferenceEntry<float>{to.gradient.data(), from.gradient.data(), pair.y.data()},
               kVectorGrain);
  const auto [curvature, ss, yy] =
      pending_sum<3>(executor_, "curvature", size, CurvatureEntry{pair.s.data(), pair.y.data()})
          .get();
  if (!(curvature > kCurvatureFloor * std::sqrt(ss * yy))) {
    spare_.push_back(std::move(pair));
    return 0.0;
  }
  if (pairs_.size() == most_) {
    spare_.push_back(std::move(pairs_.front()));
    pairs_.erase(pairs_.begin());
    for (Pair& kept : pairs_) kept.products.erase(kept.products.begin());
  }
  pair.curvature = curvature;
  pair.products = products(&Pair::s, pair.y);
  pairs_.push_back(std::move(pair));
  return curvature;
}

template <class Exec>
void CurvaturePairsOn<Exec>::first_loop(const Vector& g, Vector& q) {
  alpha_ = products(&Pair::s, g);
  for (std::size_t i = pairs_.size(); i-- > 0;) {
    for (std::size_t j = i + 1; j < pairs_.size(); ++j) {
      alpha_[i] -= alpha_[j] * pairs_[j].products[i];
    }
    alpha_[i] /= pairs_[i].curvature;
  }
  std::vector<double> a = alpha_;
  for (double& share : a) share = -share;
  combine(&Pair::y, a, g, q);
}

template <class Exec>
void CurvaturePairsOn<Exec>::second_loop(Vector& r) {
  const std::vector<double> along = products(&Pair::y, r);
  std::vector<double> a(pairs_.size());
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    double beta = along[i];
    for (std::size_t j = 0; j < i; ++j) beta += a[j] * pairs_[i].products[j];
    a[i] = alpha_[i] - beta / pairs_[i].curvature;
  }
  combine(&Pair::s, a, r, r);
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/energy/laplacian_term.h"

#include <array>
#include <cstddef>
#include <span>

namespace lensforge {

namespace {

std::span<const std::int32_t> neighbours_of(const MeshTopology& topology, std::int64_t v) {
  const auto k = static_cast<std::size_t>(v);
  const auto begin = static_cast<std::size_t>(topology.vertex_neighbour_begin[k]);
  const auto end = static_cast<std::size_t>(topology.vertex_neighbour_begin[k + 1]);
  return std::span(topology.vertex_neighbours).subspan(begin, end - begin);
}

}  // namespace

double laplacian_term(const Executor& executor, const Eigen::Matrix3Xd& vertices,
                      const MeshTopology& topology, double weight, Eigen::Matrix3Xd& gradient) {
  // Distance of every interior vertex from the mean of its neighbours, divided by their number so
  // that the second pass can gather it; zero on the boundary.
  Eigen::Matrix2Xd shares(2, vertices.cols());
  const auto measure = [&](std::int64_t v) {
    shares.col(v).setZero();
    if (topology.on_boundary[static_cast<std::size_t>(v)] != 0) return std::array<double, 1>{0.0};
    const auto around = neighbours_of(topology, v);
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const std::int32_t u : around) sum += vertices.col(u).head<2>();
    const double count = static_cast<double>(around.size());
    const Eigen::Vector2d difference = vertices.col(v).head<2>() - sum / count;
    shares.col(v) = difference / count;
    return std::array<double, 1>{difference.squaredNorm()};
  };
  const double value = parallel_sum<1>(executor, "laplacian term", vertices.cols(), measure)[0];
  const auto gather = [&](std::int64_t v) {
    const auto around = neighbours_of(topology, v);
    Eigen::Vector2d bar = static_cast<double>(around.size()) * shares.col(v);
    for (const std::int32_t u : around) bar -= shares.col(u);
    gradient.col(v).head<2>() += 2.0 * weight * bar;
  };
  parallel_for(executor, "laplacian gradient", vertices.cols(), gather);
  return value;
}

}  // namespace lensforge

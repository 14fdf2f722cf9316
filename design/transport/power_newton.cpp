// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/power_newton.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "design/transport/power_diagram.h"

namespace lensforge {
namespace {

/// Maximum number of sites merged into one coarser site.
constexpr std::size_t kClusterSize = 4;

/// False if all sites lie on or near one line: then there are no triangles to upsample in.
bool is_two_dimensional(const Eigen::Matrix2Xd& sites) {
  const Eigen::Matrix2Xd offsets = sites.colwise() - sites.rowwise().mean();
  const Eigen::Matrix2d spread = offsets * offsets.transpose();
  const double determinant = spread(0, 0) * spread(1, 1) - spread(0, 1) * spread(1, 0);
  return determinant > 1e-12 * spread.trace() * spread.trace();
}

double extent_of(const Eigen::Matrix2Xd& sites) {
  return (sites.rowwise().maxCoeff() - sites.rowwise().minCoeff()).maxCoeff();
}

/// Sums masses and mass-weighted positions per parent.
SiteClusters gather(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses,
                    std::vector<int> parent, int count) {
  SiteClusters clusters;
  clusters.sites = Eigen::Matrix2Xd::Zero(2, count);
  clusters.masses = Eigen::VectorXd::Zero(count);
  for (std::size_t k = 0; k < parent.size(); ++k) {
    if (parent[k] < 0) continue;
    const auto i = static_cast<Eigen::Index>(k);
    clusters.sites.col(parent[k]) += masses[i] * sites.col(i);
    clusters.masses[parent[k]] += masses[i];
  }
  for (int c = 0; c < count; ++c) clusters.sites.col(c) /= clusters.masses[c];
  clusters.parent = std::move(parent);
  return clusters;
}

}  // namespace

SiteClusters merge_coincident(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses) {
  using Key = std::array<std::int64_t, 3>;
  const Eigen::Vector2d low = sites.rowwise().minCoeff();
  const double extent = extent_of(sites);
  const double scale = extent > 0.0 ? 1.0 / (kCoincident * extent) : 0.0;
  std::vector<Key> keys;
  for (Eigen::Index i = 0; i < sites.cols(); ++i) {
    const Eigen::Vector2d p = scale * (sites.col(i) - low);
    if (masses[i] > 0.0) keys.push_back({std::llround(p.x()), std::llround(p.y()), i});
  }
  std::sort(keys.begin(), keys.end());
  std::vector<int> leader(static_cast<std::size_t>(sites.cols()), -1);
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const bool same = k > 0 && keys[k][0] == keys[k - 1][0] && keys[k][1] == keys[k - 1][1];
    leader[static_cast<std::size_t>(keys[k][2])] =
        static_cast<int>(same ? leader[static_cast<std::size_t>(keys[k - 1][2])] : keys[k][2]);
  }
  // Numbers follow the order of the sites, so nothing is renumbered without coincidences.
  std::vector<int> number(leader.size(), -1);
  std::vector<int> parent(leader.size(), -1);
  int count = 0;
  for (std::size_t i = 0; i < leader.size(); ++i) {
    if (leader[i] < 0) continue;
    int& n = number[static_cast<std::size_t>(leader[i])];
    if (n < 0) n = count++;
    parent[i] = n;
  }
  return gather(sites, masses, std::move(parent), count);
}

namespace {

/// Halves parts across their longer side until none has more than kClusterSize sites.
class Splitting {
 public:
  explicit Splitting(const Eigen::Matrix2Xd& sites)
      : sites_(sites), parent_(static_cast<std::size_t>(sites.cols())) {
    std::vector<int> all(parent_.size());
    std::iota(all.begin(), all.end(), 0);
    split(all);
  }
  [[nodiscard]] const std::vector<int>& parent() const { return parent_; }
  [[nodiscard]] int count() const { return count_; }

 private:
  void split(std::span<int> part) {
    if (part.size() <= kClusterSize) {
      for (const int i : part) parent_[static_cast<std::size_t>(i)] = count_;
      ++count_;
      return;
    }
    Eigen::Vector2d low = sites_.col(part[0]);
    Eigen::Vector2d high = low;
    for (const int i : part) {
      low = low.cwiseMin(sites_.col(i));
      high = high.cwiseMax(sites_.col(i));
    }
    const Eigen::Index axis = (high - low).x() >= (high - low).y() ? 0 : 1;
    const std::size_t middle = part.size() / 2;
    const auto before = [&](int i, int j) {
      return std::tuple(sites_(axis, i), sites_(1 - axis, i), i) <
             std::tuple(sites_(axis, j), sites_(1 - axis, j), j);
    };
    std::nth_element(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(middle), part.end(),
                     before);
    split(part.subspan(0, middle));
    split(part.subspan(middle));
  }

  const Eigen::Matrix2Xd& sites_;
  std::vector<int> parent_;
  int count_ = 0;
};

}  // namespace

SiteClusters cluster_sites(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses) {
  const Splitting splitting(sites);
  SiteClusters clusters = gather(sites, masses, splitting.parent(), splitting.count());
  SiteClusters merged = merge_coincident(clusters.sites, clusters.masses);
  for (int& p : clusters.parent) p = merged.parent[static_cast<std::size_t>(p)];
  merged.parent = std::move(clusters.parent);
  return merged;
}

std::vector<SiteLevel> make_site_levels(const Eigen::Matrix2Xd& sites,
                                        const Eigen::VectorXd& masses, int coarsest) {
  std::vector<SiteLevel> levels;
  levels.push_back({sites, masses, spatial_order(sites)});
  while (levels.back().sites.cols() >= static_cast<Eigen::Index>(kClusterSize) * coarsest &&
         is_two_dimensional(levels.back().sites)) {
    SiteClusters clusters = cluster_sites(levels.back().sites, levels.back().masses);
    std::vector<int> order = spatial_order(clusters.sites);
    levels.push_back({std::move(clusters.sites), std::move(clusters.masses), std::move(order)});
  }
  return levels;
}

namespace {

/// Maximum number of halvings of a step.
constexpr int kMaxHalvings = 24;

/// First length of the next step, in lengths of the last: every halving costs a power diagram, and
/// lengths change slowly from step to step. (58,880 sites, logo on black: 7.4 processor seconds;
/// 9.6 starting from 1 each time.)
constexpr double kGrowth = 4.0;  ///< If the last was accepted at once,
constexpr double kRetry = 2.0;   ///< and if not.

/// Maximum share of the sites whose weights a trial may raise to keep their cells. Otherwise a
/// handful of cells would hold back the step of all others: 56 instead of 41 Newton steps for the
/// logo on 235,520 sites. From 0.001 to 0.03 it took the same.
constexpr double kMaxRaised = 0.01;

Eigen::Map<const Eigen::VectorXd> masses_of(const PowerCells& cells) {
  return {cells.mass.data(), static_cast<Eigen::Index>(cells.mass.size())};
}

/// Returns the diagram for other weights; sites that these would hide are shown if possible.
PowerDiagram shown(const PowerDiagram& from, const SiteLevel& level, const Eigen::VectorXd& weights,
                   const Executor& executor) {
  std::optional<PowerDiagram> diagram =
      from.reweighted(weights, level.order, executor, static_cast<int>(level.masses.size()));
  if (diagram) return std::move(*diagram);
  return {level.sites, weights, level.order, executor.stop_token()};
}

/// Measures the cells of a diagram.
PowerState measured(PowerDiagram diagram, const Executor& executor, CellStage& stage) {
  const SummedDensity& density = stage.density();
  CellEdges edges = cell_edges(diagram, density.columns(), density.rows(), executor);
  PowerCells cells = stage.measure(edges);
  return {std::move(diagram), std::move(edges), std::move(cells)};
}

}  // namespace

PowerState power_state(const SiteLevel& level, const Eigen::VectorXd& weights,
                       const Executor& executor, CellStage& stage) {
  const PowerDiagram even(level.sites, Eigen::VectorXd::Zero(level.sites.cols()), level.order,
                          executor.stop_token());
  return measured(shown(even, level, weights, executor), executor, stage);
}

PowerState power_state(const SiteLevel& level, const PowerState& from,
                       const Eigen::VectorXd& weights, const Executor& executor, CellStage& stage) {
  return measured(shown(from.diagram, level, weights, executor), executor, stage);
}

double mass_error(const SiteLevel& level, const PowerCells& cells) {
  return ((masses_of(cells) - level.masses).array().abs() / level.masses.array()).maxCoeff();
}

double misplaced_share(const SiteLevel& level, const PowerCells& cells) {
  return 0.5 * (masses_of(cells) - level.masses).lpNorm<1>() / level.masses.sum();
}

namespace {

/// Measures trial steps.
struct Search {
  const SiteLevel& level;
  const Executor& executor;
  CellStage& stage;
  double least;  ///< Mass that every cell keeps.

  /// Returns the state after a step of `length` times the Newton direction, if it is good enough.
  [[nodiscard]] std::optional<PowerState> step(const PowerState& state,
                                               const Eigen::VectorXd& direction,
                                               double length) const {
    const int max_raises = static_cast<int>(kMaxRaised * static_cast<double>(direction.size()));
    std::optional<PowerDiagram> diagram = state.diagram.reweighted(
        state.diagram.weights() + length * direction, level.order, executor, max_raises);
    if (!diagram) return std::nullopt;  // A site without a cell has no mass either.
    PowerState trial = measured(std::move(*diagram), executor, stage);
    const auto mass = masses_of(trial.cells);
    const double before = (level.masses - masses_of(state.cells)).norm();
    const double after = (level.masses - mass).norm();
    if (mass.minCoeff() < least || !(after <= (1.0 - 0.5 * length) * before)) return std::nullopt;
    return trial;
  }
};

}  // namespace

bool balance_masses(const SiteLevel& level, const NewtonControl& control, const Executor& executor,
                    CellStage& stage, PowerState& state) {
  const double least = 0.5 * std::min(masses_of(state.cells).minCoeff(), level.masses.minCoeff());
  const Search search{level, executor, stage, least};
  double error = mass_error(level, state.cells);
  double first = 1.0;
  while (error > control.mass_error) {
    const Eigen::VectorXd residual = level.masses - masses_of(state.cells);
    const Eigen::VectorXd direction = stage.newton_direction(state.edges, residual);
    if (!direction.allFinite()) return false;
    double length = first;
    std::optional<PowerState> next = search.step(state, direction, length);
    for (int halvings = 0; !next && halvings < kMaxHalvings; ++halvings) {
      length *= 0.5;
      next = search.step(state, direction, length);
    }
    if (!next) return false;
    state = std::move(*next);
    first = std::min(1.0, (length == first ? kGrowth : kRetry) * length);
    error = mass_error(level, state.cells);
    if (!control.observe({length, error})) return false;
  }
  return true;
}

Eigen::VectorXd weights_of_potential(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& psi) {
  return sites.colwise().squaredNorm().transpose() - 2.0 * psi;
}

Eigen::VectorXd potential_of_weights(const Eigen::Matrix2Xd& sites,
                                     const Eigen::VectorXd& weights) {
  return 0.5 * (sites.colwise().squaredNorm().transpose() - weights);
}

Eigen::Matrix2Xd cell_centroids(const PowerDiagram& diagram, const SummedDensity& density,
                                const std::vector<Moments>& moments) {
  // Far below any cell that Newton steps keep, far above the rounding of differences of sums.
  const double least = 1e-12 * density.total();
  Eigen::Matrix2Xd centroids = diagram.sites();
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const Moments& m = moments[i];
    if (!(m.mass > least)) continue;
    const Eigen::Vector2d centroid(m.x / m.mass, m.y / m.mass);
    centroids.col(static_cast<Eigen::Index>(i)) =
        centroid.cwiseMax(0.0).cwiseMin(Eigen::Vector2d(density.columns(), density.rows()));
  }
  return centroids;
}

Eigen::VectorXd stretched_weights(const Eigen::Matrix2Xd& sites, const SummedDensity& density) {
  // Minimum width of a box, as a share of the picture.
  constexpr double kMinWidth = 1e-3;
  constexpr double kInset = 0.95;
  const Eigen::Vector2d size(density.columns(), density.rows());
  const Eigen::Vector2d low = sites.rowwise().minCoeff();
  const Eigen::Vector2d high = sites.rowwise().maxCoeff();
  const Eigen::Vector2d stretch =
      (kInset * size).cwiseQuotient((high - low).cwiseMax(kMinWidth * size));
  const Eigen::Vector2d middle = 0.5 * (low + high);
  Eigen::VectorXd psi(sites.cols());
  for (Eigen::Index i = 0; i < psi.size(); ++i) {
    const Eigen::Vector2d d = sites.col(i) - middle;
    psi[i] = 0.5 * d.dot(stretch.cwiseProduct(d)) + 0.5 * size.dot(sites.col(i));
  }
  return weights_of_potential(sites, psi);
}

namespace {

/// Values and slopes of ψ at scattered places.
struct PotentialSamples {
  std::vector<Eigen::Vector2d> sites;
  std::vector<Eigen::Vector2d> slopes;
  std::vector<double> values;

  /// Adds the mirror images about `line` of the samples closer to it than `reach`; ψ is continued
  /// evenly about the slope `border` at the picture's border.
  void mirror(Eigen::Index axis, double line, double border, double reach) {
    const std::size_t count = sites.size();
    for (std::size_t i = 0; i < count; ++i) {
      const double move = 2.0 * (line - sites[i][axis]);
      if (std::fabs(move) > 2.0 * reach) continue;
      Eigen::Vector2d site = sites[i];
      Eigen::Vector2d slope = slopes[i];
      site[axis] += move;
      slope[axis] = 2.0 * border - slope[axis];
      sites.push_back(site);
      slopes.push_back(slope);
      values.push_back(values[i] + border * move);
    }
  }
};

PotentialSamples mirrored_samples(const PowerState& coarse, CellStage& stage,
                                  const Eigen::Matrix2Xd& fine) {
  const SummedDensity& density = stage.density();
  const Eigen::Matrix2Xd& sites = coarse.diagram.sites();
  const Eigen::Matrix2Xd slopes =
      cell_centroids(coarse.diagram, density, stage.moments(coarse.edges));
  const Eigen::VectorXd psi = potential_of_weights(sites, coarse.diagram.weights());
  PotentialSamples samples;
  for (Eigen::Index i = 0; i < sites.cols(); ++i) {
    samples.sites.emplace_back(sites.col(i));
    samples.slopes.emplace_back(slopes.col(i));
    samples.values.push_back(psi[i]);
  }
  const Eigen::Vector2d low = fine.rowwise().minCoeff();
  const Eigen::Vector2d high = fine.rowwise().maxCoeff();
  // Three coarse spacings are mirrored; the sites' domain ends half a spacing beyond the outermost.
  const double reach = 3.0 * std::sqrt((high - low).prod() / static_cast<double>(sites.cols()));
  const double margin = 0.5 * std::sqrt((high - low).prod() / static_cast<double>(fine.cols()));
  const Eigen::Vector2d size(density.columns(), density.rows());
  for (const Eigen::Index axis : {0, 1}) {
    samples.mirror(axis, low[axis] - margin, 0.0, reach);
    samples.mirror(axis, high[axis] + margin, size[axis], reach);
  }
  return samples;
}

/// ψ at `point`, which lies at `place` among the samples.
double blended(const PotentialSamples& samples, const PowerDiagram::Place& place,
               const Eigen::Vector2d& point) {
  double value = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto j = static_cast<std::size_t>(place.sites[k]);
    value += place.share[static_cast<Eigen::Index>(k)] *
             (samples.values[j] + 0.5 * samples.slopes[j].dot(point - samples.sites[j]));
  }
  return value;
}

Eigen::Matrix2Xd columns_of(const Eigen::Matrix2Xd& all, const std::vector<int>& numbers) {
  Eigen::Matrix2Xd some(2, static_cast<Eigen::Index>(numbers.size()));
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    some.col(static_cast<Eigen::Index>(k)) = all.col(numbers[k]);
  }
  return some;
}

/// Places of the hidden sites among the visible ones.
std::vector<PowerDiagram::Place> hidden_places(const PowerDiagram& diagram) {
  if (diagram.hidden().empty()) return {};
  const Eigen::Matrix2Xd points = columns_of(diagram.sites(), diagram.hidden());
  return diagram.locate(points, spatial_order(points));
}

}  // namespace

Eigen::VectorXd upsampled_weights(const PowerState& coarse, CellStage& stage,
                                  const Eigen::Matrix2Xd& fine, const std::vector<int>& order,
                                  const std::stop_token& stop) {
  const PotentialSamples samples = mirrored_samples(coarse, stage, fine);
  Eigen::Matrix2Xd sites(2, static_cast<Eigen::Index>(samples.sites.size()));
  Eigen::VectorXd psi(sites.cols());
  for (Eigen::Index i = 0; i < sites.cols(); ++i) {
    sites.col(i) = samples.sites[static_cast<std::size_t>(i)];
    psi[i] = samples.values[static_cast<std::size_t>(i)];
  }
  const PowerDiagram diagram(sites, weights_of_potential(sites, psi), spatial_order(sites), stop);
  const std::vector<PowerDiagram::Place> places = diagram.locate(fine, order);
  Eigen::VectorXd result(fine.cols());
  for (Eigen::Index i = 0; i < fine.cols(); ++i) {
    result[i] = blended(samples, places[static_cast<std::size_t>(i)], fine.col(i));
  }
  return weights_of_potential(fine, result);
}

namespace {

/// Neighbours in the whole plane; a hidden site has the triangle around it as neighbours.
class Neighbourhood {
 public:
  explicit Neighbourhood(const PowerDiagram& diagram)
      : first_(static_cast<std::size_t>(diagram.sites().cols()) + 1, 0) {
    std::vector<std::pair<int, int>> pairs = diagram.neighbours();
    const std::vector<PowerDiagram::Place> places = hidden_places(diagram);
    for (std::size_t k = 0; k < places.size(); ++k) {
      for (const int site : places[k].sites) pairs.emplace_back(diagram.hidden()[k], site);
    }
    for (const auto& [a, b] : pairs) {
      ++first_[static_cast<std::size_t>(a) + 1];
      ++first_[static_cast<std::size_t>(b) + 1];
    }
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    others_.resize(first_.back());
    for (const auto& [a, b] : pairs) {
      others_[next[static_cast<std::size_t>(a)]++] = b;
      others_[next[static_cast<std::size_t>(b)]++] = a;
    }
  }

  [[nodiscard]] std::span<const int> of(int site) const {
    const auto i = static_cast<std::size_t>(site);
    return std::span(others_).subspan(first_[i], first_[i + 1] - first_[i]);
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<int> others_;
};

/// The first rounds mend cells with less than this share of their wanted mass, later ones only
/// those that are empty, because a round costs a triangulation.
constexpr double kNearlyEmpty = 0.02;
constexpr double kEmpty = 1e-4;
constexpr int kThoroughRounds = 4;
constexpr int kMendingRounds = 60;
/// Rings of neighbours that are searched for room: two, and more only while none has any.
constexpr int kRings = 2;
constexpr int kMaxRings = 12;
/// Maximum number of neighbours searched: a site beside a wide black part has thousands.
constexpr std::size_t kMaxAsked = 256;
/// Share of empty cells above which mending is given up; it can only mend stragglers.
constexpr double kMaxEmpty = 0.15;

/// Maximum number of takers of one cell in a round, and the position of each one's border in the
/// cell, in standard deviations from the centroid towards the taker. Nearer sites cut closer, or
/// the farther one's steeper plane would hide them.
constexpr std::size_t kMaxTakers = 4;
constexpr std::array<std::array<double, kMaxTakers>, kMaxTakers> kCuts = {{
    {0.0, 0.0, 0.0, 0.0},
    {-0.3, 0.6, 0.0, 0.0},
    {-0.5, 0.2, 0.9, 0.0},
    {-0.6, -0.1, 0.4, 0.9},
}};

/// One round of mending.
class Mending {
 public:
  Mending(const PowerState& state, const SiteLevel& level, CellStage& stage)
      : state_(state),
        level_(level),
        neighbourhood_(state.diagram),
        moments_(stage.moments(state.edges)),
        centroids_(cell_centroids(state.diagram, stage.density(), moments_)),
        psi_(potential_of_weights(level.sites, state.diagram.weights())) {}

  /// Returns new weights; cells below `share` of their wanted mass are given room.
  [[nodiscard]] Eigen::VectorXd weights(double share) const {
    std::vector<Taking> takings;
    for (int i = 0; i < static_cast<int>(psi_.size()); ++i) {
      if (has_share(i, share)) continue;
      const int giver = best_giver(i, share);
      if (giver >= 0) takings.push_back({giver, distance(giver, i), i});
    }
    std::sort(takings.begin(), takings.end(), [](const Taking& a, const Taking& b) {
      return std::tie(a.giver, a.distance, a.taker) < std::tie(b.giver, b.distance, b.taker);
    });
    Eigen::VectorXd psi = psi_;
    for (std::size_t begin = 0; begin < takings.size();) {
      std::size_t end = begin;
      while (end < takings.size() && takings[end].giver == takings[begin].giver) ++end;
      const std::size_t takers = std::min(end - begin, kMaxTakers);
      for (std::size_t k = 0; k < takers; ++k) {
        const Taking& t = takings[begin + k];
        const double cut = kCuts[takers - 1][k] * deviation(t.giver) * t.distance;
        psi[t.taker] = std::min(psi[t.taker], tangent(t.giver, t.taker) + cut);
      }
      begin = end;
    }
    return weights_of_potential(level_.sites, psi);
  }

 private:
  [[nodiscard]] bool has_share(int i, double share) const {
    return state_.cells.mass[static_cast<std::size_t>(i)] >= share * level_.masses[i];
  }
  struct Taking {
    int giver;
    double distance;
    int taker;
  };
  [[nodiscard]] double distance(int i, int j) const {
    return (level_.sites.col(i) - level_.sites.col(j)).norm();
  }
  /// Standard deviation of a cell's mass along a line, the mean over all directions.
  [[nodiscard]] double deviation(int i) const {
    const Moments& m = moments_[static_cast<std::size_t>(i)];
    return std::sqrt(std::max(0.0, 0.5 * (m.second / m.mass - centroids_.col(i).squaredNorm())));
  }
  [[nodiscard]] double tangent(int at, int i) const {
    return psi_[at] + centroids_.col(at).dot(level_.sites.col(i) - level_.sites.col(at));
  }

  /// The cell around i whose tangent plane is the highest at i; −1 if none has mass.
  [[nodiscard]] int best_giver(int i, double share) const {
    std::vector<int> seen{i};
    std::size_t begin = 0;
    int best = -1;
    for (int ring = 0; ring < kMaxRings && (ring < kRings || best < 0); ++ring) {
      const std::size_t end = seen.size();
      for (; begin < end; ++begin) {
        for (const int j : neighbourhood_.of(seen[begin])) {
          if (seen.size() > kMaxAsked) return best;
          if (std::find(seen.begin(), seen.end(), j) != seen.end()) continue;
          seen.push_back(j);
          if (has_share(j, share) && (best < 0 || tangent(j, i) > tangent(best, i))) best = j;
        }
      }
    }
    return best;
  }

  const PowerState& state_;
  const SiteLevel& level_;
  Neighbourhood neighbourhood_;
  std::vector<Moments> moments_;
  Eigen::Matrix2Xd centroids_;
  Eigen::VectorXd psi_;
};

/// Number of cells with less than `share` of their wanted mass.
std::size_t count_below(const SiteLevel& level, const PowerCells& cells, double share) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells.mass.size(); ++i) {
    if (cells.mass[i] < share * level.masses[static_cast<Eigen::Index>(i)]) ++count;
  }
  return count;
}

}  // namespace

bool mend_empty_cells(const SiteLevel& level, const Executor& executor, CellStage& stage,
                      PowerState& state) {
  for (int round = 0; round < kMendingRounds; ++round) {
    const double share = round < kThoroughRounds ? kNearlyEmpty : kEmpty;
    const std::size_t empty = count_below(level, state.cells, share);
    if (empty == 0) return true;
    const double most = kMaxEmpty * static_cast<double>(state.cells.mass.size());
    if (static_cast<double>(empty) > most || !state.diagram.is_planar()) return false;
    const Mending mending(state, level, stage);
    state = power_state(level, state, mending.weights(share), executor, stage);
  }
  return count_below(level, state.cells, kEmpty) == 0;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/semi_discrete.h"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <iterator>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "design/transport/power_cells.h"
#include "design/transport/power_newton.h"

namespace lensforge {
namespace {

/// Blurs a line by one recursive pass each way (a discrete exponential). @param work  scratch.
void blur_line(std::span<double> line, double decay, std::vector<double>& work) {
  const std::size_t n = line.size();
  work.resize(n);
  // Sum of the mirrored, periodically repeated line before its start; a period is 2n.
  double before = 0.0;
  for (std::size_t i = 0; i < n; ++i) before = line[i] + decay * before;
  for (std::size_t i = n; i-- > 0;) before = line[i] + decay * before;
  double sum = before / (1.0 - std::pow(decay, 2.0 * static_cast<double>(n)));
  for (std::size_t i = 0; i < n; ++i) {
    sum = line[i] + decay * sum;
    work[i] = sum;
  }
  // The line is mirrored at its end, so the sum from the right starts with the sum from the left.
  for (std::size_t i = n; i-- > 0;) {
    const double value = line[i];
    const double right = decay * sum;
    line[i] = (work[i] + right) * (1.0 - decay) / (1.0 + decay);
    sum = value + right;
  }
}

}  // namespace

Image soften(const Image& picture, double length, double floor) {
  const auto columns = static_cast<std::size_t>(picture.columns());
  const auto rows = static_cast<std::size_t>(picture.rows());
  std::vector<double> values(picture.values().begin(), picture.values().end());
  if (length > 0.0) {
    const double decay = std::exp(-1.0 / length);
    std::vector<double> work;
    for (std::size_t r = 0; r < rows; ++r) {
      blur_line(std::span(values).subspan(r * columns, columns), decay, work);
    }
    std::vector<double> column(rows);
    for (std::size_t c = 0; c < columns; ++c) {
      for (std::size_t r = 0; r < rows; ++r) column[r] = values[r * columns + c];
      blur_line(column, decay, work);
      for (std::size_t r = 0; r < rows; ++r) values[r * columns + c] = column[r];
    }
  }
  const double mean = picture.total() / static_cast<double>(values.size());
  Image result(picture.columns(), picture.rows());
  for (std::size_t i = 0; i < values.size(); ++i) {
    result.values()[i] = static_cast<float>((1.0 - floor) * values[i] + floor * mean);
  }
  return result;
}

namespace {

/// Minimum number of sites of the coarsest level: there a step takes milliseconds and can start
/// anywhere.
constexpr int kCoarsest = 500;
/// Blur of a level in mean cell widths. 0.5 to 2 took the same number of steps at 58,880 sites with
/// black pixels; with less, upsampling leaves thousands of cells empty.
constexpr double kBlurPerCell = 1.0;
/// First blur of the coarsest level, as a share of the picture's longer side.
constexpr double kFirstBlur = 0.125;
/// Factor of the blur from stage to stage; below kMinBlur pixels it becomes 0.
constexpr double kBlurFactor = 0.5;
constexpr double kMinBlur = 0.1;
/// Evenly spread share of the light while there is blur, so that no density vanishes. Without blur
/// it falls by kFloorFactor from stage to stage; below kMinFloor it becomes 0. If it fell to 0 at
/// once, cells in black would lose all of their mass, and no Newton step would help (logo, spread
/// mesh).
constexpr double kFloor = 1e-4;
constexpr double kFloorFactor = 0.1;
constexpr double kMinFloor = 1e-9;
/// Mass errors that end a stage, and a level before it is upsampled.
constexpr double kStageError = 0.5;
constexpr double kLevelError = 1e-2;

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void check_input(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses,
                 const Image& density) {
  if (sites.cols() == 0) throw InputError("transport: no sites");
  if (masses.size() != sites.cols()) {
    throw InputError("transport: " + std::to_string(sites.cols()) + " sites but " +
                     std::to_string(masses.size()) + " masses");
  }
  if (!sites.allFinite()) throw InputError("transport: a site is not finite");
  if (!masses.allFinite() || (masses.array() < 0.0).any()) {
    throw InputError("transport: a mass is negative or not finite");
  }
  if (!(masses.sum() > 0.0)) throw InputError("transport: the masses sum to 0");
  const double total = density.total();
  if (!(total > 0.0) || !std::isfinite(total)) {
    throw InputError("transport: the density sums to " + std::to_string(total));
  }
}

using Density = std::shared_ptr<const SummedDensity>;

/// A density of 1 wherever the picture is not black.
Density lit_part(const Image& picture) {
  const double black = kBlack * picture.total() / static_cast<double>(picture.values().size());
  Image lit = picture;
  for (float& value : lit.values()) value = static_cast<double>(value) > black ? 1.0F : 0.0F;
  return std::make_shared<SummedDensity>(lit, lit.total());
}

/// A density of the sequence that ends with the picture.
struct Stage {
  double blur;
  double floor;
  Density density;
};

/// Solves transport over the levels and logs its steps.
class TransportSolver {
 public:
  TransportSolver(SiteClusters merged, const Image& picture, const TransportOptions& options,
                  const Executor& executor, const RunControl& control, TransportResult& result)
      : merged_(std::move(merged)),
        picture_(picture),
        options_(options),
        executor_(executor.with_stop(control.stop_token())),
        control_(control),
        result_(result),
        levels_(make_site_levels(merged_.sites, merged_.masses, kCoarsest)) {}

  /// Solves coarse to fine. @return the balanced diagram, or the best found.
  std::optional<PowerState> solve() {
    std::optional<PowerState> state;
    for (int l = static_cast<int>(levels_.size()) - 1; l >= 0; --l) {
      if (state) {
        state = upsampled(l, *state);
        if (!state) return fail("cells without mass could not be mended");
      } else {
        state = stretched(l);
      }
      // A coarser level's result is of no use for the given sites.
      if (!descend(l, *state) && l > 0) return std::nullopt;
    }
    return state;
  }

  /// Writes weights and centroids of the given sites from those of the merged ones.
  void write(const PowerState& state, const Eigen::Matrix2Xd& sites,
             const Eigen::VectorXd& masses) {
    cells_->set_density(stage(0.0, 0.0).density);
    const PowerCells cells = cells_->measure(state.edges);
    const Eigen::Matrix2Xd centroids =
        cell_centroids(state.diagram, cells_->density(), cells_->moments(state.edges));
    const Eigen::VectorXd& weights = state.diagram.weights();
    result_.mass_error = mass_error(level(0), cells);
    result_.misplaced = misplaced_share(level(0), cells);
    result_.weights.resize(sites.cols());
    result_.centroids.resize(2, sites.cols());
    result_.areas = Eigen::VectorXd::Zero(sites.cols());
    result_.lit_areas = Eigen::VectorXd::Zero(sites.cols());
    cells_->set_density(lit_part(picture_));
    const PowerCells lit = cells_->measure(state.edges);
    const double mean = weights.mean();
    std::vector<int> massless;
    for (Eigen::Index i = 0; i < sites.cols(); ++i) {
      const int p = merged_.parent[static_cast<std::size_t>(i)];
      if (p < 0) {
        massless.push_back(static_cast<int>(i));
        continue;
      }
      result_.weights[i] = weights[p] - mean;
      result_.centroids.col(i) = centroids.col(p);
      const double share = masses[i] / merged_.masses[p];
      result_.areas[i] = cells.area[static_cast<std::size_t>(p)] * share;
      result_.lit_areas[i] = lit.mass[static_cast<std::size_t>(p)] * share;
    }
    write_massless(state, sites, centroids, mean, massless);
  }

 private:
  [[nodiscard]] const SiteLevel& level(int l) const { return levels_[static_cast<std::size_t>(l)]; }
  [[nodiscard]] std::stop_token stop() const { return control_.stop_token(); }

  [[nodiscard]] Stage stage(double blur, double floor) const {
    return {blur, floor,
            std::make_shared<SummedDensity>(soften(picture_, blur, floor), merged_.masses.sum())};
  }

  [[nodiscard]] double level_blur(int l) const {
    const double area = static_cast<double>(picture_.columns()) * picture_.rows();
    return kBlurPerCell * std::sqrt(area / static_cast<double>(level(l).sites.cols()));
  }

  /// Starts a level: sends its sites to the device.
  PowerState measured(int l, const Eigen::VectorXd& weights, const Stage& s) {
    cells_ = make_cell_stage(level(l).sites, executor_);
    cells_->set_density(s.density);
    return power_state(level(l), weights, executor_, *cells_);
  }

  /// Measures the same diagram under another density.
  void refill(const Stage& s, PowerState& state) {
    cells_->set_density(s.density);
    state.cells = cells_->measure(state.edges);
  }

  std::optional<PowerState> fail(std::string message) {
    result_.message = std::move(message);
    return std::nullopt;
  }

  /// Runs and logs Newton steps under one density.
  bool run_stage(int l, const Stage& s, double goal, PowerState& state) {
    int number = 0;
    double wall = wall_seconds();
    double cpu = cpu_seconds();
    const auto observe = [&](const NewtonStep& step) {
      const double now = wall_seconds();
      const double cpu_now = cpu_seconds();
      result_.steps.push_back({l, static_cast<int>(level(l).sites.cols()), s.blur, s.floor,
                               number++, step.length, step.mass_error, now - wall, cpu_now - cpu});
      wall = now;
      cpu = cpu_now;
      control_.report({"transport level " +
                           std::to_string(levels_.size() - static_cast<std::size_t>(l)) + "/" +
                           std::to_string(levels_.size()),
                       static_cast<double>(result_.steps.size()), 0.0,
                       "mass error " + std::to_string(step.mass_error)});
      return number < options_.max_stage_steps &&
             static_cast<int>(result_.steps.size()) < options_.max_newton_steps;
    };
    const bool done = balance_masses(level(l), {goal, observe}, executor_, *cells_, state);
    if (!done) {
      const bool limited = number >= options_.max_stage_steps ||
                           static_cast<int>(result_.steps.size()) >= options_.max_newton_steps;
      result_.message =
          limited ? "Newton step limit reached" : "no Newton step lowers the mass error";
    }
    return done;
  }

  /// Lowers the blur from the coarser level's to this level's own; on the finest to 0.
  bool descend(int l, PowerState& state) {
    const bool finest = l == 0;
    const double last = level_blur(l);
    const bool coarsest = l + 1 == static_cast<int>(levels_.size());
    double blur =
        coarsest ? kFirstBlur * std::max(picture_.columns(), picture_.rows()) : level_blur(l + 1);
    while (blur > last || (finest && blur > kMinBlur)) {
      blur = finest ? kBlurFactor * blur : std::max(last, kBlurFactor * blur);
      if (finest && blur <= kMinBlur) break;
      const Stage s = stage(blur, kFloor);
      refill(s, state);
      if (!run_stage(l, s, !finest && blur == last ? kLevelError : kStageError, state))
        return false;
    }
    if (!finest) return true;
    for (double floor = kFloor; floor > kMinFloor; floor *= kFloorFactor) {
      const Stage s = stage(0.0, floor);
      refill(s, state);
      if (!run_stage(l, s, kStageError, state)) return false;
    }
    const Stage sharp = stage(0.0, 0.0);
    refill(sharp, state);
    return run_stage(l, sharp, options_.tolerance, state);
  }

  /// The coarsest level's start, balanced under the first blur.
  PowerState stretched(int l) {
    const Stage first = stage(kFirstBlur * std::max(picture_.columns(), picture_.rows()), kFloor);
    PowerState state = measured(l, stretched_weights(level(l).sites, *first.density), first);
    run_stage(l, first, kStageError, state);
    return state;
  }

  /// A level's start from the solved coarser level, under that level's blur.
  std::optional<PowerState> upsampled(int l, const PowerState& coarse) {
    const Stage s = stage(level_blur(l + 1), kFloor);
    cells_->set_density(s.density);
    PowerState state =
        measured(l, upsampled_weights(coarse, *cells_, level(l).sites, level(l).order, stop()), s);
    if (!mend_empty_cells(level(l), executor_, *cells_, state)) return std::nullopt;
    if (!run_stage(l, s, kStageError, state)) return std::nullopt;
    return state;
  }

  /// Sites without mass get ψ and centroid interpolated between the visible sites around.
  void write_massless(const PowerState& state, const Eigen::Matrix2Xd& sites,
                      const Eigen::Matrix2Xd& centroids, double mean,
                      const std::vector<int>& massless) {
    if (massless.empty()) return;
    Eigen::Matrix2Xd points(2, static_cast<Eigen::Index>(massless.size()));
    for (std::size_t k = 0; k < massless.size(); ++k) {
      points.col(static_cast<Eigen::Index>(k)) = sites.col(massless[k]);
    }
    const auto places = state.diagram.locate(points, spatial_order(points));
    const Eigen::VectorXd psi =
        potential_of_weights(state.diagram.sites(), state.diagram.weights());
    for (std::size_t k = 0; k < massless.size(); ++k) {
      double value = 0.0;
      Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
      Eigen::Vector2d foot = Eigen::Vector2d::Zero();
      for (std::size_t j = 0; j < 3; ++j) {
        const int site = places[k].sites[j];
        const double share = places[k].share[static_cast<Eigen::Index>(j)];
        value += share * psi[site];
        centroid += share * centroids.col(site);
        foot += share * state.diagram.sites().col(site);
      }
      const int i = massless[k];
      value += centroid.dot(sites.col(i) - foot);
      result_.weights[i] = sites.col(i).squaredNorm() - 2.0 * value - mean;
      result_.centroids.col(i) = centroid;
    }
  }

  SiteClusters merged_;
  const Image& picture_;
  const TransportOptions& options_;
  Executor executor_;
  const RunControl& control_;
  TransportResult& result_;
  std::vector<SiteLevel> levels_;
  std::unique_ptr<CellStage> cells_;  ///< Stage of the current level.
};

}  // namespace

TransportResult solve_semi_discrete(const Eigen::Matrix2Xd& sites, const Eigen::VectorXd& masses,
                                    const Image& density, const TransportOptions& options,
                                    const Executor& executor, const RunControl& control) {
  check_input(sites, masses, density);
  TransportResult result;
  try {
    TransportSolver solver(merge_coincident(sites, masses), density, options, executor, control,
                           result);
    const std::optional<PowerState> state = solver.solve();
    if (state && state->diagram.sites().cols() > 0) solver.write(*state, sites, masses);
    const bool good = state && result.mass_error <= options.tolerance;
    result.status =
        good ? TransportResult::Status::kConverged : TransportResult::Status::kNotConverged;
    if (good) result.message = "every cell has its mass";
  } catch (const Interrupted&) {
    result.status = TransportResult::Status::kStopped;
    result.message = "stopped on request";
  }
  return result;
}

namespace {

/// Number of buckets searched to each side of a point's own.
constexpr int kBucketReach = 2;

/// Distance between the points at which a segment is checked for black, pixels.
constexpr double kLook = 0.5;

/// Added to the moments of the neighbours' positions, as a share of their trace, so that collinear
/// neighbours do not give an unbounded slope across their line.
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
  const int left = std::max(0, column - kBucketReach);
  const int right = std::min(buckets_.x() - 1, column + kBucketReach);
  std::vector<int> found;
  for (int r = std::max(0, row - kBucketReach); r <= std::min(buckets_.y() - 1, row + kBucketReach);
       ++r) {
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
  // The two planes intersect there.
  const Eigen::Vector2d jump = centroids_.col(there) - landing;
  return (plane_at(here, p) - plane_at(there, p)) / jump.squaredNorm() * jump;
}

}  // namespace lensforge

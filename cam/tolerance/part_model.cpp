// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_model.h"

#include <Eigen/Core>
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "cam/leakage/render_field.h"
#include "cam/milled/polished_field.h"
#include "cam/tolerance/part_heights.h"
#include "cam/tolerance/part_light.h"
#include "cam/workshop/workshop.h"
#include "core/lens/surface_field.h"
#include "core/mesh/surface_mesh.h"
#include "design/flux/flux_image.h"
#include "design/flux/flux_triangle.h"
#include "design/render/source_picture.h"

// Notation: θ = k · spacing, the phase from one node to the next; a wave of n nodes has 2π / n.

namespace lensforge {
namespace {

/// Up to here (waves of three nodes) the response is that of the polish; above it falls to zero,
/// because a box's own response is close to zero there and nothing can be restored.
constexpr double kBand = 2.0;
/// Minimum number of phases for fitting the response, and the number per weight.
constexpr std::int64_t kPhases = 96;
constexpr std::int64_t kPhasesPerWeight = 8;

constexpr double kBeyond = 0.1;  ///< Weight of the phases above kBand.
constexpr double kGentle = 0.1;  ///< Long waves weigh more: 1 / (kGentle + θ²).

double box_response(const LinePolish& polish, double theta) {
  const double step = theta * polish.box / polish.spacing / static_cast<double>(polish.samples);
  if (step < 1e-6) return 1.0;
  const auto count = static_cast<double>(polish.samples);
  return std::sin(0.5 * count * step) / (count * std::sin(0.5 * step));
}

double response(const LinePolish& polish, double theta) {
  const double in = std::min(theta, kBand);
  const double t = polish.sigma / polish.spacing * in;
  const double kept =
      polish.term == nullptr ? std::exp(-0.5 * t * t) : polish.term->at(t) / polish.term->at(0.0);
  const double wanted = kept / box_response(polish, in);
  if (theta <= kBand) return wanted;
  const double rest = (std::numbers::pi - theta) / (std::numbers::pi - kBand);
  return wanted * rest * rest;
}

double weight(double theta) { return (theta <= kBand ? 1.0 : kBeyond) / (kGentle + theta * theta); }

/// Solves for the weights of pairs first … reach: `basis(k, θ)` is the contribution of pair k to
/// the response, `target(θ)` the wanted response.
template <class Basis, class Target>
Eigen::VectorXd fit(std::int64_t first, std::int64_t reach, const Basis& basis,
                    const Target& target) {
  const std::int64_t phases = std::max(kPhases, kPhasesPerWeight * reach);
  Eigen::MatrixXd rows(phases, reach - first + 1);
  Eigen::VectorXd wanted(phases);
  for (std::int64_t i = 0; i < phases; ++i) {
    const double theta =
        std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(phases);
    const double w = weight(theta);
    for (std::int64_t k = first; k <= reach; ++k) {
      rows(i, k - first) = w * basis(static_cast<double>(k), theta);
    }
    wanted(i) = w * target(theta);
  }
  return rows.colPivHouseholderQr().solve(wanted);
}

}  // namespace

std::int64_t line_filter_reach(double sigma, double spacing, int order) {
  constexpr double kSigmas = 4.2;
  constexpr double kFilmSigmas = 9.0;
  const double sigmas = order == kFilmOrder ? kFilmSigmas : kSigmas;
  return static_cast<std::int64_t>(std::ceil(sigmas * std::max(sigma / spacing, 0.5))) + 3;
}

/// The innermost significant pair is set so that the sum is 1, or the slope of a straight line its
/// own; the others are free. For a node itself that is pair 0, twice the node, and pair 1.
LineFilter line_filter(const LinePolish& polish, std::int64_t shift, std::int64_t reach) {
  const auto size = static_cast<std::size_t>(reach + 1);
  LineFilter filter{shift, std::vector<double>(size), std::vector<double>(size)};
  const double half = 0.5 * static_cast<double>(shift);
  const std::int64_t inner = 1 - shift;  // Of slopes.
  const double away = static_cast<double>(inner) + half;
  const Eigen::VectorXd average = fit(
      1, reach,
      [&](double k, double theta) {
        return 2.0 * (std::cos((k + half) * theta) - std::cos(half * theta));
      },
      [&](double theta) { return response(polish, theta) - std::cos(half * theta); });
  const Eigen::VectorXd slope = fit(
      inner + 1, reach,
      [&](double k, double theta) {
        const double straight = (k + half) / away * std::sin(away * theta);
        return 2.0 * (std::sin((k + half) * theta) - straight) / theta;
      },
      [&](double theta) {
        return response(polish, theta) - std::sin(away * theta) / (away * theta);
      });
  filter.average[0] = 0.5 - average.sum();
  double straight = 0.5;
  for (std::int64_t k = 1; k <= reach; ++k) {
    const auto n = static_cast<std::size_t>(k);
    filter.average[n] = average(k - 1);
    if (k == inner) continue;
    const double weight = slope(k - inner - 1);
    filter.slope[n] = weight / polish.spacing;
    straight -= (static_cast<double>(k) + half) * weight;
  }
  filter.slope[static_cast<std::size_t>(inner)] = straight / (away * polish.spacing);
  if (polish.term == nullptr) return filter;
  for (double& weight : filter.average) weight *= polish.term->at(0.0);
  for (double& weight : filter.slope) weight *= polish.term->at(0.0);
  return filter;
}

namespace {

AxisFilters filters_of(const LinePolish& polish, std::int64_t shifts, int order, double weight) {
  AxisFilters all{weight, {}};
  const std::int64_t reach = line_filter_reach(polish.sigma, polish.spacing, order);
  for (std::int64_t shift = 0; shift < shifts; ++shift) {
    all.filters.push_back(line_filter(polish, shift, reach));
  }
  return all;
}

}  // namespace

std::vector<AxisFilters> polish_filters(const PolishTransfer& transfer, const LinePolish& polish,
                                        std::int64_t shifts) {
  constexpr std::size_t kTerms = 4;  // Exact to 1e-4; the filters are to 2e-3.
  const double rest = 1.0 - transfer.floor;
  std::vector<AxisFilters> all;
  if (transfer.order == kFilmOrder) {
    for (std::size_t n = 0; n < kTerms; ++n) {
      LinePolish of_term = polish;
      of_term.term = &film_terms()[n];
      all.push_back(filters_of(of_term, shifts, kFilmOrder, rest * of_term.term->sign));
    }
  } else {
    all.push_back(filters_of(polish, shifts, kPadOrder, rest));
  }
  if (transfer.floor > 0.0) {
    LinePolish none = polish;
    none.sigma = 0.0;
    all.push_back(filters_of(none, shifts, kPadOrder, transfer.floor));
  }
  return all;
}

namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

constexpr int kProfile = 96;    ///< Sampled places of a scallop's period.
constexpr int kHarmonics = 32;  ///< Used; without polish the last has 0.1 % of the first's height.
/// Stored slopes per period; linear interpolation between them is exact to 1e-4 of a sine.
constexpr std::size_t kSlopePlaces = 256;

/// Height of the scallop at the middles of kProfile equal parts of a period, mm.
std::array<double, kProfile> scallop(double pitch, double radius) {
  std::array<double, kProfile> height{};
  for (int i = 0; i < kProfile; ++i) {
    const double out = std::min(std::abs((i + 0.5) / kProfile - 0.5) * pitch, radius);
    height[static_cast<std::size_t>(i)] = radius - std::sqrt((radius - out) * (radius + out));
  }
  return height;
}

/// Mean of what a crossing second raster leaves of a scallop.
std::array<double, kProfile> crossed(const std::array<double, kProfile>& height) {
  std::array<double, kProfile> lower{};
  for (std::size_t i = 0; i < kProfile; ++i) {
    for (const double other : height) lower[i] += std::min(height[i], other) / kProfile;
  }
  return lower;
}

/// Cosine coefficients 1 … kHarmonics of a profile that is even about its middle.
std::array<double, kHarmonics> harmonics(const std::array<double, kProfile>& height) {
  std::array<double, kHarmonics> coefficients{};
  for (int k = 1; k <= kHarmonics; ++k) {
    double sum = 0.0;
    for (int i = 0; i < kProfile; ++i) {
      const double t = (i + 0.5) / kProfile - 0.5;
      sum += height[static_cast<std::size_t>(i)] * std::cos(kTurn * k * t);
    }
    coefficients[static_cast<std::size_t>(k - 1)] = 2.0 * sum / kProfile;
  }
  return coefficients;
}

}  // namespace

Ripple::Ripple(const Passes& passes, double radius, const PolishTransfer& polish)
    : pitch_(passes.pitch), radius_(radius), polish_(polish), sign_(passes.cast ? -1.0 : 1.0) {
  auto height = scallop(passes.pitch, radius);
  if (passes.cross) height = crossed(height);
  const auto coefficients = harmonics(height);
  for (std::size_t i = 0; i < kSlopePlaces; ++i) {
    double slope = 0.0;
    for (int k = 1; k <= kHarmonics; ++k) {
      const double wave = kTurn * k / passes.pitch;
      slope -= coefficients[static_cast<std::size_t>(k - 1)] * polish_.at(wave) * wave *
               std::sin(kTurn * k * static_cast<double>(i) / kSlopePlaces);
    }
    slope_.push_back(slope);
    largest_ = std::max(largest_, std::abs(slope));
  }
  slope_.push_back(slope_.front());
}

double Ripple::slope(double place, const Eigen::Vector2d& surface, int across) const {
  const double stretch = std::sqrt(1.0 + surface.squaredNorm());
  const double lowest = sign_ * radius_ * surface[across] / stretch;
  const double periods = (place - lowest) / pitch_;
  const double phase = (periods - std::floor(periods)) * static_cast<double>(kSlopePlaces);
  const std::size_t i = std::min(static_cast<std::size_t>(phase), kSlopePlaces - 1);
  const double t = phase - static_cast<double>(i);
  const double bend = (1.0 + surface[across] * surface[across]) * stretch;
  return sign_ * bend * (slope_[i] + t * (slope_[i + 1] - slope_[i]));
}

double Ripple::seen_by_disc(double radius) const {
  constexpr double kSmall = 1e-4;  // Below, the series' x²/8 is 1e-9.
  const double x = kTurn * radius / pitch_;
  return x < kSmall ? 1.0 : 2.0 * std::cyl_bessel_j(1.0, x) / x;
}

double Ripple::kept(double factor) const {
  const double wave = kTurn / pitch_;
  if (polish_.floor > 0.0) return polish_.at(factor * wave) / polish_.at(wave);
  const double t = wave * polish_.sigma;
  if (polish_.order == kFilmOrder) {
    return std::exp(-0.25 * std::pow(t, 4) * (std::pow(factor, 4) - 1.0));
  }
  return std::exp(-0.5 * t * t * (factor * factor - 1.0));
}

namespace {

/// Rendering of a part along one axis.
struct SceneAxis {
  /// The polish's terms, each with one filter for every node in a cell of the base: the first, or
  /// the first and the middle.
  std::vector<AxisFilters> terms;
  bool ripples = false;   ///< True if scallops are visible along it.
  std::int64_t fine = 1;  ///< Parts between nodes in which a floor's scallops are resolved.

  [[nodiscard]] std::int64_t parts() const { return std::ssize(terms.front().filters); }
  [[nodiscard]] std::int64_t reach() const { return terms.front().filters.front().reach(); }
};

/// Common inputs of the tiles of one part.
struct PartScene {
  const BaseHeights& base;
  const ErrorHeights& heights;
  const PartLight& light;
  const Ripple& ripple;
  const PolishModel& polish;
  std::array<SceneAxis, 2> axes;
  Eigen::Vector2d lens_size;         ///< mm
  std::int64_t margin = 0;           ///< Pixels around the picture.
  double whole = 0.0;                ///< Light on the part, mm², of which fluxes are shares.
  Eigen::Vector2d source{0.0, 0.0};  ///< Half axes of the spot that a point lights, pixels.
};

/// A rectangle of cells of one part: polishes its heights with errors, lands its nodes' rays and
/// deposits two triangles per cell.
class PartTile {
 public:
  /// @param cells  of BaseHeights.
  PartTile(const PartScene& scene, const CellRange& cells);

  void deposit(const FluxAccumulator& image) const;

 private:
  /// Nodes of one axis, including those between the base's.
  struct Nodes {
    std::int64_t parts;  ///< Of a cell of the base.
    std::int64_t first;  ///< One before the tile's.
    std::int64_t count;  ///< Up to one behind it.
    std::int64_t base;   ///< First node of the base that polishing needs.
    std::int64_t bases;  ///< Number of base nodes.
    double spacing;      ///< mm
  };

  [[nodiscard]] Nodes nodes_of(int axis) const;
  [[nodiscard]] static const LineFilter& filter_of(const AxisFilters& filters, std::int64_t node);
  void polish();
  void polish_line(std::size_t term, const double* raw, double* heights, double* slopes) const;
  void add_term(std::size_t term, const std::vector<double>& raw);
  void take_off_rim();
  void land();
  void sharpen();
  /// Movement of the light per slope of the ripple along an axis.
  [[nodiscard]] Eigen::Vector2d ripple_step(int axis) const;
  void add_ripple(int axis);
  void deposit_fine(std::int64_t i, std::int64_t j, const FluxAccumulator& image) const;
  [[nodiscard]] Eigen::Vector2d fine_landing(std::size_t node, const Eigen::Vector2d& share,
                                             const Eigen::Vector2d& place) const;
  [[nodiscard]] double seen_by_source(int axis) const;
  [[nodiscard]] Eigen::Vector2d place(std::int64_t i, std::int64_t j) const;
  [[nodiscard]] std::size_t index(std::int64_t i, std::int64_t j) const {
    return static_cast<std::size_t>(j * x_.count + i);
  }
  [[nodiscard]] const IncidentRay* ray_to(std::size_t node) const {
    return rays_.empty() ? nullptr : &rays_[node];
  }
  [[nodiscard]] double flux_of(std::size_t a, std::size_t b, std::size_t c) const;

  const PartScene& scene_;
  CellRange cells_;
  Nodes x_, y_;
  std::vector<double> z_, slope_x_, slope_y_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<IncidentRay> rays_;  ///< To the points; empty if all are alike.
  std::vector<Eigen::Vector2d> landing_;
  std::array<Eigen::Vector2d, 2> steps_{};  ///< ripple_step() of axes with fine parts.
};

/// Between four nodes per period of a ripple (PartModel), linear interpolation leaves sinc²(1/4) of
/// a sine's amplitude; this factor restores it.
constexpr double kRippleGain = 0.125 * std::numbers::pi * std::numbers::pi;

/// Minimum pixels per millimetre of the part; below it all its light is in one place.
constexpr double kMinScale = 1e-6;

/// The cell of a node: node −1 is in cell −1.
std::int64_t cell_of(std::int64_t node, std::int64_t parts) {
  return node >= 0 ? node / parts : -((-node + parts - 1) / parts);
}

/// out[n] += factor Σ weight[k] (in[n − k step] + in[n + (k + shift) step]) for n = 0 … count − 1.
struct FilterStep {
  std::int64_t step = 1;
  std::int64_t count = 0;
  double factor = 1.0;
};

void add_average(const double* in, const FilterStep& run, const LineFilter& filter, double* out) {
  const auto [step, count, factor] = run;
  for (std::int64_t k = 0; k <= filter.reach(); ++k) {
    const double weight = factor * filter.average[static_cast<std::size_t>(k)];
    const double* const before = in - k * step;
    const double* const after = in + (k + filter.shift) * step;
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (before[n] + after[n]);
  }
}

/// The same with the difference of both sides.
void add_slope(const double* in, const FilterStep& run, const LineFilter& filter, double* out) {
  const auto [step, count, factor] = run;
  for (std::int64_t k = 0; k <= filter.reach(); ++k) {
    const double weight = factor * filter.slope[static_cast<std::size_t>(k)];
    const double* const before = in - k * step;
    const double* const after = in + (k + filter.shift) * step;
    for (std::int64_t n = 0; n < count; ++n) out[n] += weight * (after[n] - before[n]);
  }
}

PartTile::PartTile(const PartScene& scene, const CellRange& cells)
    : scene_(scene), cells_(cells), x_(nodes_of(0)), y_(nodes_of(1)) {
  polish();
  if (scene_.polish.rim_depth > 0.0) take_off_rim();
  land();
  sharpen();
  for (int axis = 0; axis < 2; ++axis) {
    const SceneAxis& scene_axis = scene_.axes[static_cast<std::size_t>(axis)];
    Eigen::Vector2d& step = steps_[static_cast<std::size_t>(axis)];
    step.setZero();
    if (scene_axis.ripples && scene_axis.fine > 1) {
      step = ripple_step(axis);
    } else if (scene_axis.ripples) {
      add_ripple(axis);
    }
  }
}

PartTile::Nodes PartTile::nodes_of(int axis) const {
  const SceneAxis& scene = scene_.axes[static_cast<std::size_t>(axis)];
  const std::int64_t from = axis == 0 ? cells_.column : cells_.row;
  const std::int64_t cells = axis == 0 ? cells_.columns : cells_.rows;
  const std::int64_t reach = scene.reach();
  Nodes nodes{};
  nodes.parts = scene.parts();
  nodes.first = nodes.parts * from - 1;
  nodes.count = nodes.parts * cells + 3;
  nodes.base = cell_of(nodes.first, nodes.parts) - reach;
  // Behind the last node's cell there is one more base where filters lie between nodes.
  const std::int64_t last =
      cell_of(nodes.first + nodes.count - 1, nodes.parts) + scene.parts() - 1 + reach;
  nodes.bases = last - nodes.base + 1;
  nodes.spacing = scene_.base.axis(axis).spacing / static_cast<double>(nodes.parts);
  return nodes;
}

const LineFilter& PartTile::filter_of(const AxisFilters& filters, std::int64_t node) {
  const std::int64_t parts = std::ssize(filters.filters);
  return filters.filters[static_cast<std::size_t>(node - parts * cell_of(node, parts))];
}

/// Polishes one row of the base along x. Nodes at the same position in their cells are stored
/// together first.
void PartTile::polish_line(std::size_t term, const double* raw, double* heights,
                           double* slopes) const {
  std::vector<double> line(static_cast<std::size_t>(2 * x_.bases));
  for (std::int64_t first = 0; first < x_.parts; ++first) {
    const std::int64_t node = x_.first + first;
    const LineFilter& filter = filter_of(scene_.axes[0].terms[term], node);
    const double* const in = raw + cell_of(node, x_.parts) - x_.base;
    const std::int64_t count = (x_.count - first + x_.parts - 1) / x_.parts;
    double* const means = line.data();
    double* const rises = means + x_.bases;
    std::fill(line.begin(), line.end(), 0.0);
    add_average(in, {1, count}, filter, means);
    add_slope(in, {1, count}, filter, rises);
    for (std::int64_t n = 0; n < count; ++n) {
      heights[first + n * x_.parts] = means[n];
      slopes[first + n * x_.parts] = rises[n];
    }
  }
}

void PartTile::polish() {
  std::vector<double> raw(static_cast<std::size_t>(x_.bases * y_.bases));
  scene_.heights.fill({x_.base, y_.base, x_.bases, y_.bases}, raw.data());
  const auto nodes = static_cast<std::size_t>(x_.count * y_.count);
  z_.assign(nodes, 0.0);
  slope_x_.assign(nodes, 0.0);
  slope_y_.assign(nodes, 0.0);
  for (std::size_t term = 0; term < scene_.axes[0].terms.size(); ++term) add_term(term, raw);
}

void PartTile::add_term(std::size_t term, const std::vector<double>& raw) {
  std::vector<double> heights(static_cast<std::size_t>(x_.count * y_.bases));
  std::vector<double> slopes(heights.size());
  for (std::int64_t j = 0; j < y_.bases; ++j) {
    polish_line(term, &raw[static_cast<std::size_t>(j * x_.bases)], &heights[index(0, j)],
                &slopes[index(0, j)]);
  }
  const AxisFilters& filters = scene_.axes[1].terms[term];
  const FilterStep run{x_.count, x_.count, filters.weight};
  for (std::int64_t j = 0; j < y_.count; ++j) {
    const LineFilter& filter = filter_of(filters, y_.first + j);
    const std::size_t from = index(0, cell_of(y_.first + j, y_.parts) - y_.base);
    add_average(&heights[from], run, filter, &z_[index(0, j)]);
    add_average(&slopes[from], run, filter, &slope_x_[index(0, j)]);
    add_slope(&heights[from], run, filter, &slope_y_[index(0, j)]);
  }
}

Eigen::Vector2d PartTile::place(std::int64_t i, std::int64_t j) const {
  return {static_cast<double>(x_.first + i) * x_.spacing,
          static_cast<double>(y_.first + j) * y_.spacing};
}

void PartTile::take_off_rim() {
  const PolishModel& model = scene_.polish;
  for (std::int64_t j = 0; j < y_.count; ++j) {
    for (std::int64_t i = 0; i < x_.count; ++i) {
      const Eigen::Vector2d at = place(i, j);
      const std::size_t n = index(i, j);
      const double left = rim_loss(model, at.x());
      const double right = rim_loss(model, scene_.lens_size.x() - at.x());
      const double low = rim_loss(model, at.y());
      const double high = rim_loss(model, scene_.lens_size.y() - at.y());
      z_[n] -= left + right + low + high;
      slope_x_[n] += (left - right) / model.rim_length;
      slope_y_[n] += (low - high) / model.rim_length;
    }
  }
}

void PartTile::land() {
  const Eigen::Vector2d margin = Eigen::Vector2d::Constant(static_cast<double>(scene_.margin));
  points_.resize(z_.size());
  landing_.resize(z_.size());
  for (std::int64_t j = 0; j < y_.count; ++j) {
    for (std::int64_t i = 0; i < x_.count; ++i) {
      const std::size_t n = index(i, j);
      points_[n] = scene_.light.grown(place(i, j), z_[n]);
      if (scene_.light.varies()) rays_.push_back(scene_.light.ray_to(points_[n]));
      const Eigen::Vector2d slope(slope_x_[n], slope_y_[n]);
      landing_[n] = scene_.light.land(points_[n], slope, ray_to(n)) + margin;
    }
  }
}

void PartTile::sharpen() {
  std::vector<Eigen::Vector2d> sharp = landing_;
  for (std::int64_t j = 1; j + 1 < y_.count; ++j) {
    for (std::int64_t i = 1; i + 1 < x_.count; ++i) {
      const std::size_t n = index(i, j);
      sharp[n] = sharp_landing(landing_, n, x_.count);
    }
  }
  landing_.swap(sharp);
}

/// The ripple's polish and the light's movement per slope hardly change over a tile: both are taken
/// in its middle.
Eigen::Vector2d PartTile::ripple_step(int axis) const {
  const std::size_t middle = index(x_.count / 2, y_.count / 2);
  const Eigen::Vector2d moved =
      scene_.light.moved_by(points_[middle], {slope_x_[middle], slope_y_[middle]}, axis);
  if (!moved.allFinite()) return Eigen::Vector2d::Zero();
  const double factor =
      scene_.heights.sigma_factor(cells_.column + cells_.columns / 2, cells_.row + cells_.rows / 2);
  return scene_.ripple.kept(factor) * seen_by_source(axis) * moved;
}

void PartTile::add_ripple(int axis) {
  const Eigen::Vector2d step = kRippleGain * ripple_step(axis);
  for (std::int64_t j = 0; j < y_.count; ++j) {
    for (std::int64_t i = 0; i < x_.count; ++i) {
      const std::size_t n = index(i, j);
      landing_[n] +=
          scene_.ripple.slope(place(i, j)[axis], {slope_x_[n], slope_y_[n]}, axis) * step;
    }
  }
}

/// Share of the light moved by a ripple over a pixel's border that remains with a source: for every
/// direction of its disc the border lies at another place of the ripple. The rest is a blur
/// (PartModel).
double PartTile::seen_by_source(int axis) const {
  const std::size_t low = index(0, 0);
  const std::size_t high = axis == 0 ? index(x_.count - 1, 0) : index(0, y_.count - 1);
  const double length = axis == 0 ? static_cast<double>(x_.count - 1) * x_.spacing
                                  : static_cast<double>(y_.count - 1) * y_.spacing;
  const double pixels_per_mm = std::abs((landing_[high] - landing_[low])[axis]) / length;
  return scene_.ripple.seen_by_disc(scene_.source[axis] / std::max(pixels_per_mm, kMinScale));
}

double PartTile::flux_of(std::size_t a, std::size_t b, std::size_t c) const {
  const CornerRays rays{ray_to(a), ray_to(b), ray_to(c)};
  return scene_.light.intake({points_[a], points_[b], points_[c]}, rays) / scene_.whole;
}

/// Where light lands between nodes.
/// @param node  at the cell's low corner. @param share  of the cell from there.
Eigen::Vector2d PartTile::fine_landing(std::size_t node, const Eigen::Vector2d& share,
                                       const Eigen::Vector2d& place) const {
  const auto up = static_cast<std::size_t>(x_.count);
  const auto between = [&](const auto& of) {
    return ((1.0 - share.y()) * ((1.0 - share.x()) * of(node) + share.x() * of(node + 1)) +
            share.y() * ((1.0 - share.x()) * of(node + up) + share.x() * of(node + up + 1)))
        .eval();
  };
  Eigen::Vector2d landing = between([&](std::size_t n) { return landing_[n]; });
  const Eigen::Vector2d slope =
      between([&](std::size_t n) { return Eigen::Vector2d(slope_x_[n], slope_y_[n]); });
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d& step = steps_[static_cast<std::size_t>(axis)];
    if (!step.isZero()) landing += scene_.ripple.slope(place[axis], slope, axis) * step;
  }
  return landing;
}

/// Deposits a cell in parts of equal light.
void PartTile::deposit_fine(std::int64_t i, std::int64_t j, const FluxAccumulator& image) const {
  const std::array<std::int64_t, 2> parts{scene_.axes[0].fine, scene_.axes[1].fine};
  const Eigen::Vector2d part(1.0 / static_cast<double>(parts[0]),
                             1.0 / static_cast<double>(parts[1]));
  const Eigen::Vector2d spacing(x_.spacing, y_.spacing);
  const std::size_t node = index(i, j);
  const auto at = [&](std::int64_t s, std::int64_t t) {
    const Eigen::Vector2d share =
        part.cwiseProduct(Eigen::Vector2d(static_cast<double>(s), static_cast<double>(t)));
    return fine_landing(node, share, place(i, j) + share.cwiseProduct(spacing));
  };
  const std::size_t opposite = index(i + 1, j + 1);
  const double flux =
      0.5 * part.prod() *
      (flux_of(node, node + 1, opposite) + flux_of(node, opposite, index(i, j + 1)));
  for (std::int64_t t = 0; t < parts[1]; ++t) {
    for (std::int64_t s = 0; s < parts[0]; ++s) {
      const Eigen::Vector2d low = at(s, t);
      const Eigen::Vector2d high = at(s + 1, t + 1);
      lensforge::deposit({low, at(s + 1, t), high, flux}, image);
      lensforge::deposit({low, high, at(s, t + 1), flux}, image);
    }
  }
}

void PartTile::deposit(const FluxAccumulator& image) const {
  const bool fine = scene_.axes[0].fine * scene_.axes[1].fine > 1;
  const auto up = static_cast<std::size_t>(x_.count);
  for (std::int64_t j = 1; j + 2 < y_.count; ++j) {
    for (std::int64_t i = 1; i + 2 < x_.count; ++i) {
      if (fine) {
        deposit_fine(i, j, image);
        continue;
      }
      const std::size_t a = index(i, j);
      const std::size_t c = a + up + 1;
      lensforge::deposit({landing_[a], landing_[a + 1], landing_[c], flux_of(a, a + 1, c)}, image);
      lensforge::deposit({landing_[a], landing_[c], landing_[a + up], flux_of(a, c, a + up)},
                         image);
    }
  }
}

/// Cells of a tile: its buffers, 1 MB, fit a core's cache, and an interrupt waits for two.
constexpr std::int64_t kModelTile = 96;

std::array<BaseAxis, 2> axes_of(const PartPlan& plan) {
  const Eigen::Vector2d& size = plan.optics.lens_size;
  const Eigen::Vector2d detail = size.cwiseQuotient(plan.optics.pixels.cast<double>());
  return base_axes(size, plan.passes, transfer_of(plan.polish), detail);
}

/// Nodes beyond the rim needed by the filters of the strongest polish, one more for the slopes
/// there that errors need, and one for the landing places beside the rim's.
std::int64_t pad_of(const std::array<BaseAxis, 2>& axes, double sigma, int order) {
  return std::max(line_filter_reach(sigma, axes[0].spacing, order),
                  line_filter_reach(sigma, axes[1].spacing, order)) +
         1 + error_reach(order);
}

double mean_height(const BaseHeights& base) {
  double sum = 0.0;
  for (std::int64_t j = 0; j < base.axis(1).nodes; ++j) {
    for (std::int64_t i = 0; i < base.axis(0).nodes; ++i) sum += *base.at(i, j);
  }
  return sum / static_cast<double>(base.axis(0).nodes * base.axis(1).nodes);
}

/// Regularly spaced nodes of the base along an axis, and the last.
std::vector<std::int64_t> coarse_nodes(const BaseAxis& axis) {
  constexpr std::int64_t kCells = 64;
  std::vector<std::int64_t> nodes;
  const std::int64_t cells = axis.nodes - 1;
  const std::int64_t count = std::min(kCells, cells);
  for (std::int64_t k = 0; k <= count; ++k) nodes.push_back(k * cells / count);
  return nodes;
}

/// Nodes for the light on the whole part.
PartNodes light_nodes(const BaseHeights& base) {
  const std::vector<std::int64_t> columns = coarse_nodes(base.axis(0));
  PartNodes nodes{columns.size(), {}};
  for (const std::int64_t j : coarse_nodes(base.axis(1))) {
    for (const std::int64_t i : columns) {
      nodes.places.emplace_back(static_cast<double>(i) * base.axis(0).spacing,
                                static_cast<double>(j) * base.axis(1).spacing, *base.at(i, j));
    }
  }
  return nodes;
}

/// Across rows with a ripple there are four nodes per pitch.
SceneAxis scene_axis(const BaseAxis& axis, const PolishTransfer& transfer, bool ripples) {
  const LinePolish polish{transfer.sigma, axis.spacing, axis.box(), 2 * axis.half};
  return {polish_filters(transfer, polish, ripples ? 2 : 1), ripples};
}

/// What a floor leaves of scallops is no sine that four nodes per pitch could carry: the space
/// between nodes is divided.
std::int64_t fine_parts(const SceneAxis& axis, const BaseAxis& base, double pitch) {
  constexpr double kPerPitch = 24.0;  // As cam_options.cpp samples such a part.
  const double spacing = base.spacing / static_cast<double>(axis.parts());
  return std::max<std::int64_t>(1, std::llround(kPerPitch * spacing / pitch));
}

/// Where boxes hold several pitches, these are so much finer than σ that no ripple is left: less
/// than 1e-5 of a scallop's slope.
bool ripples(const BaseAxis& axis, const Passes& passes) { return axis.box() < 1.5 * passes.pitch; }

/// Includes the scene's margin.
FluxRaster render_tiles(const PartScene& scene, const Eigen::Vector2i& pixels,
                        const Executor& executor) {
  FluxRaster raster{pixels.x() + 2 * scene.margin, pixels.y() + 2 * scene.margin, {}};
  FluxImage image(static_cast<int>(raster.columns), static_cast<int>(raster.rows));
  image.begin(executor);
  const std::vector<CellRange> tiles =
      tiles_of({0, 0, scene.base.axis(0).nodes - 1, scene.base.axis(1).nodes - 1}, kModelTile);
  const auto add_tile = [&](std::int64_t t, const FluxAccumulator& sum) {
    PartTile(scene, tiles[static_cast<std::size_t>(t)]).deposit(sum);
  };
  image.add(executor, static_cast<std::int64_t>(tiles.size()), add_tile, 1);
  const auto flux = image.resolve(executor);
  raster.flux.assign(flux.begin(), flux.end());
  return raster;
}

FluxPicture cropped(const FluxRaster& raster, std::int64_t margin) {
  FluxPicture picture;
  picture.columns = static_cast<int>(raster.columns - 2 * margin);
  picture.rows = static_cast<int>(raster.rows - 2 * margin);
  for (std::int64_t r = margin; r < raster.rows - margin; ++r) {
    const auto row = raster.flux.begin() + r * raster.columns;
    picture.flux.insert(picture.flux.end(), row + margin, row + raster.columns - margin);
  }
  return picture;
}

/// Radii along x and y of the spot lit by a point of the part: that of the source, increased along
/// a ripple that the source sees only in part (PartTile) so that the variance is that of the whole
/// ripple.
Eigen::Vector2d blur_radii(const PartScene& scene, const Eigen::Vector2d& scale,
                           const Eigen::Vector3d& middle) {
  Eigen::Vector2d square = scene.source.cwiseAbs2();
  const Eigen::Vector2d slope = scene.light.slope_of_middle(middle.z());
  for (int axis = 0; axis < 2; ++axis) {
    if (!scene.axes[static_cast<std::size_t>(axis)].ripples) continue;
    const Eigen::Vector2d moved = scene.light.moved_by(middle, slope, axis);
    const double seen = scene.ripple.seen_by_disc(scene.source[axis] / scale[axis]);
    const double far = scene.ripple.largest() * moved[axis];
    square[axis] += 2.0 * far * far * (1.0 - seen * seen);
  }
  return square.cwiseSqrt();
}

}  // namespace

PartModel::PartModel(const SurfaceField& cut, const PartPlan& plan, const Executor& executor,
                     const RunControl& control)
    : plan_(plan),
      base_(BaseHeights::sample(cut, plan.apron, axes_of(plan),
                                pad_of(axes_of(plan), plan.largest_sigma, plan.polish.order),
                                executor, control)),
      mean_height_(mean_height(base_)),
      lit_(light_nodes(base_)) {}

FluxPicture PartModel::render(const PartError& error, const Executor& executor) const {
  const OpticalSetup& optics = plan_.optics;
  const auto sharp = [&](const OpticalSetup& point) { return clear(error, point, executor).flux; };
  const std::vector<double> flux = picture_by_convolution(optics, mean_height_, sharp, executor);
  const Haze haze = plan_.haze.times(error.roughness_factor);
  return {optics.pixels.x(), optics.pixels.y(), hazed(haze, flux, optics.pixels, executor)};
}

/// The picture in the light of a point, without haze.
FluxPicture PartModel::clear(const PartError& error, const OpticalSetup& optics,
                             const Executor& executor) const {
  const Passes& passes = plan_.passes;
  const double sigma = std::min(plan_.polish.sigma * error.sigma_factor, plan_.largest_sigma);
  const PolishTransfer polish{sigma, plan_.polish.order, plan_.polish.floor};
  const PartLight light(optics, error);
  const ErrorHeights heights(base_, error, passes, polish);
  const Ripple ripple(passes, passes.ball_radius + error.radius, polish);
  const auto axis = [&](int k) {
    const bool across = k != passes.axis || passes.cross;
    const bool floor = polish.floor > 0.0;
    SceneAxis scene =
        scene_axis(base_.axis(k), polish, across && (floor || ripples(base_.axis(k), passes)));
    if (across && floor) scene.fine = fine_parts(scene, base_.axis(k), passes.pitch);
    return scene;
  };
  PartScene scene{base_,
                  heights,
                  light,
                  ripple,
                  plan_.polish,
                  {axis(0), axis(1)},
                  optics.lens_size,
                  0,
                  light.whole(lit_),
                  light.source_radii(error.source, mean_height_)};
  if (scene.source.isZero()) return cropped(render_tiles(scene, optics.pixels, executor), 0);
  const Eigen::Vector2d& size = optics.lens_size;
  const Eigen::Vector3d middle(0.5 * size.x(), 0.5 * size.y(), mean_height_);
  const Eigen::Vector2d scale = optics.pixels.cast<double>().cwiseQuotient(size);
  const BlurKernel blur = disc_blur(blur_radii(scene, scale, middle));
  scene.margin = blur.reach;
  const FluxRaster raster = render_tiles(scene, optics.pixels, executor);
  return cropped(blurred(raster, blur, executor), blur.reach);
}

std::int64_t part_nodes(const PartPlan& plan) {
  const std::array<BaseAxis, 2> axes = axes_of(plan);
  return axes[0].nodes * axes[1].nodes;
}

}  // namespace lensforge

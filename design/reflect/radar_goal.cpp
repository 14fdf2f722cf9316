// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar_goal.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/optimize/lbfgs.h"
#include "design/reflect/mesh/faces.h"

// Notation
//   ω        unit vector towards the radar
//   k        wave number 2π/λ
//   φ        phase −2k ω·r of a vertex
//   f[a, b]  divided difference of f(x) = e^{ix}; a node that comes twice gives a derivative

namespace lensforge::reflect {

using Eigen::Vector3d;
using Complex = std::complex<double>;
using std::numbers::pi;

namespace {

constexpr Complex kI{0.0, 1.0};

/// A phase with its wave.
struct Node {
  double phase;
  Complex wave;
};

/// Difference of phases below which quotients lose digits and are replaced by their first terms.
constexpr double kNear = 1e-3;

/// f[a, b]
Complex first_difference(const Node& a, const Node& b) {
  const double gap = b.phase - a.phase;
  if (std::abs(gap) > kNear) return (b.wave - a.wave) / gap;
  return 0.5 * kI * (a.wave + b.wave) * (1.0 + gap * gap / 12.0);
}

/// f[a, a, b] of f[a, b]
Complex double_difference(const Node& a, const Node& b, const Complex& first) {
  const double gap = b.phase - a.phase;
  if (std::abs(gap) > kNear) return (first - kI * a.wave) / gap;
  return -0.5 * a.wave * Complex(1.0, gap / 3.0);
}

/// Spread of the phases from which a quotient by it loses no digits.
constexpr double kWide = 1.0;

/// The values for three phases in ascending order, the last at least kWide above the first.
TriangleWave wide_wave(const Node& a, const Node& b, const Node& c) {
  const double spread = c.phase - a.phase;
  const Complex ab = first_difference(a, b);
  const Complex bc = first_difference(b, c);
  const Complex abc = (bc - ab) / spread;
  const Complex aab = double_difference(a, b, ab);
  const Complex bba = double_difference(b, a, ab);
  const Complex bbc = double_difference(b, c, bc);
  const Complex ccb = double_difference(c, b, bc);
  return {-abc, {(aab - abc) / spread, (bba - bbc) / spread, (abc - ccb) / spread}};
}

/// The same for phases within kWide: f's power series about their mean, where the divided
/// difference of xⁿ is the complete homogeneous polynomial of degree n − 2.
TriangleWave narrow_wave(const std::array<double, 3>& phase) {
  constexpr std::size_t kTerms = 10;
  const double mean = (phase[0] + phase[1] + phase[2]) / 3.0;
  const std::array u{phase[0] - mean, phase[1] - mean, phase[2] - mean};
  std::array<double, kTerms> h{1.0};
  for (std::size_t n = 1; n < kTerms; ++n) h[n] = u[0] * h[n - 1];
  for (const double x : {u[1], u[2]}) {
    for (std::size_t n = 1; n < kTerms; ++n) h[n] += x * h[n - 1];
  }
  TriangleWave wave{0.0, {}};
  std::array<double, 3> with{};
  Complex factor = std::polar(0.5, mean);  // iⁿ/(n + 2)!
  for (std::size_t n = 0; n < kTerms; ++n) {
    wave.value += factor * h[n];
    const Complex next = factor * kI / static_cast<double>(n + 3);
    for (std::size_t j = 0; j < 3; ++j) {
      with[j] = h[n] + u[j] * with[j];
      wave.by_phase[j] += next * with[j];
    }
    factor = next;
  }
  return wave;
}

}  // namespace

TriangleWave wave_with_slopes(const std::array<double, 3>& phase) {
  std::array<std::size_t, 3> at{0, 1, 2};
  std::sort(at.begin(), at.end(), [&](auto i, auto j) { return phase[i] < phase[j]; });
  if (phase[at[2]] - phase[at[0]] < kWide) return narrow_wave(phase);
  const auto node = [&](std::size_t i) -> Node { return {phase[i], std::polar(1.0, phase[i])}; };
  const TriangleWave sorted = wide_wave(node(at[0]), node(at[1]), node(at[2]));
  TriangleWave wave{sorted.value, {}};
  for (std::size_t i = 0; i < 3; ++i) wave.by_phase[at[i]] = sorted.by_phase[i];
  return wave;
}

// The sector

namespace {

/// Azimuths are no farther apart than λ/(6 R). With Nyquist's λ/(4 R) the rocket's mean in between
/// them ended 2.4 dB higher.
constexpr double kStepsPerRadius = 6.0;

constexpr double kMinGhz = 0.01;
constexpr double kMaxGhz = 1000.0;
constexpr std::size_t kMaxFrequencies = 64;
constexpr double kMinStep = 0.05;       ///< deg
constexpr double kSquareMetres = 1e-6;  ///< Of a square millimetre.

std::vector<double> frequencies(const std::string& text) {
  if (text.empty()) {
    throw InputError("--frequency: is missing; --goal radar needs it, as --frequency 10");
  }
  const std::size_t count = split(text, ',').size();
  std::vector<double> ghz = parse_numbers(text, "--frequency", static_cast<int>(count));
  const bool ascend = std::is_sorted(ghz.begin(), ghz.end(), std::less_equal<>());
  if (ghz.front() < kMinGhz || ghz.back() > kMaxGhz || !ascend || count > kMaxFrequencies) {
    throw InputError("--frequency " + text +
                     ": must be at most 64 ascending frequencies of 0.01 to 1000 GHz; 9,10,11 is "
                     "a band");
  }
  return ghz;
}

struct SectorRange {
  double from;
  double to;
  double step;
};

SectorRange sector_range(const std::string& text) {
  if (text.empty()) return {0.0, 360.0, 2.0};
  const std::vector<double> n = parse_numbers(text, "--sector", 3);
  const SectorRange range{n[0], n[1], n[2]};
  const double width = range.to - range.from;
  const bool good = std::abs(range.from) <= 360.0 && width > 0.0 && width <= 360.0 &&
                    range.step >= kMinStep && range.step <= width;
  if (good) return range;
  throw InputError("--sector " + text +
                   ": must be FROM,TO,STEP in degrees with TO above FROM by at most 360 and a STEP "
                   "of 0.05 to that; -30,30,2 is a sector about +x");
}

/// What is of light, and no use to a radar.
void require_no_light(const ReflectOptions& options) {
  const ReflectOptions usual;
  for (const auto& [given, option] :
       {std::pair(!options.light.empty(), "--light"),
        std::pair(options.method != Method::kExact, "--method paper"),
        std::pair(options.denoise > 0.0, "--denoise"),
        std::pair(options.radar_ghz > 0.0, "--radar"),
        std::pair(options.elevation_deg != usual.elevation_deg, "--elevation"),
        std::pair(options.direction_rows != usual.direction_rows, "--direction-rows"),
        std::pair(options.sun_positions != usual.sun_positions, "--sun-positions"),
        std::pair(options.normal_weight != usual.normal_weight, "--normal-weight"),
        std::pair(options.rim_updates != usual.rim_updates, "--rim-updates"),
        std::pair(options.face_updates != usual.face_updates, "--face-updates"),
        std::pair(options.normal_steps != usual.normal_steps, "--normal-steps"),
        std::pair(!options.split, "--no-split")}) {
    if (!given) continue;
    throw InputError(std::string(option) +
                     ": does not go with --goal radar, which has --frequency, --sector and "
                     "--radar-updates; leave it out");
  }
}

}  // namespace

void require_radar_goal(const ReflectOptions& options) {
  if (options.goal == GoalKind::kRadar) {
    frequencies(options.frequency);
    sector_range(options.sector);
    require_no_light(options);
    return;
  }
  for (const auto& [option, text] :
       {std::pair("--frequency ", options.frequency), std::pair("--sector ", options.sector)}) {
    if (text.empty()) continue;
    throw InputError(option + text + ": is for --goal radar; --radar GHZ evaluates other goals");
  }
  if (options.radar_updates == ReflectOptions{}.radar_updates) return;
  throw InputError(
      "--radar-updates: is for --goal radar; other goals have --rim-updates and "
      "--face-updates");
}

RadarSector radar_sector(const ReflectOptions& options, const SurfaceMesh& mesh) {
  RadarSector sector{frequencies(options.frequency), {}};
  const double wavelength = radar_wavelength(sector.ghz.back());
  require_radar_size(mesh, wavelength, "--frequency");
  const auto flat = mesh.vertices.topRows<2>();
  const Eigen::Vector2d middle = 0.5 * (flat.rowwise().maxCoeff() + flat.rowwise().minCoeff());
  const double radius = (flat.colwise() - middle).colwise().norm().maxCoeff();
  const SectorRange range = sector_range(options.sector);
  const double finest = wavelength / (kStepsPerRadius * radius) / kDegree;
  const double step = range.step / std::max(1.0, std::ceil(range.step / finest));
  const auto steps = static_cast<int>(std::floor((range.to - range.from) / step + 1e-9));
  const bool around = range.to - range.from > 360.0 - 0.5 * step;
  for (int i = 0; i < steps + (around ? 0 : 1); ++i) {
    sector.azimuth_deg.push_back(range.from + i * step);
  }
  return sector;
}

namespace {

Vector3d horizon(double azimuth_deg) {
  return {std::cos(azimuth_deg * kDegree), std::sin(azimuth_deg * kDegree), 0.0};
}

/// Cross-sections by azimuth, averaged over the frequencies, m².
struct SectorSections {
  std::vector<double> direct;
  std::vector<double> total;
};

SectorSections sections(const SurfaceMesh& mesh, const RadarSector& sector,
                        Polarization polarization, const Executor& executor) {
  const std::vector<double> zeros(sector.azimuth_deg.size(), 0.0);
  SectorSections sum{zeros, zeros};
  for (const double ghz : sector.ghz) {
    const RadarBody body(mesh, radar_wavelength(ghz));
    const double scale =
        kSquareMetres * body.section_scale() / static_cast<double>(sector.ghz.size());
    for (std::size_t i = 0; i < zeros.size(); ++i) {
      const RadarParts parts = body.parts(horizon(sector.azimuth_deg[i]), polarization, executor);
      sum.direct[i] += scale * std::norm(parts.direct());
      sum.total[i] += scale * std::norm(parts.total());
    }
  }
  return sum;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

Energies radar_energies(const SurfaceMesh& mesh, const RadarSector& sector,
                        Polarization polarization, const Executor& executor) {
  const SectorSections all = sections(mesh, sector, polarization, executor);
  return {mean_of(all.direct), mean_of(all.total)};
}

RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after,
                              const RadarSector& sector, Polarization polarization,
                              const Executor& executor) {
  return {sector.ghz, polarization, sector.azimuth_deg,
          sections(before, sector, polarization, executor).total,
          sections(after, sector, polarization, executor).total};
}

// The echoes

RadarEchoes::RadarEchoes(const SurfaceMesh& mesh, const RadarSector& sector,
                         Polarization polarization, const Executor& executor)
    : triangles_(mesh.triangles), executor_(executor) {
  const auto count = static_cast<double>(sector.ghz.size() * sector.azimuth_deg.size());
  for (const double ghz : sector.ghz) {
    const double wavelength = radar_wavelength(ghz);
    const RadarBody body(mesh, wavelength);
    middle_ = body.middle();
    for (const double azimuth : sector.azimuth_deg) {
      const Vector3d towards = horizon(azimuth);
      const RadarParts parts = body.parts(towards, polarization, executor);
      echoes_.push_back({towards, 2.0 * pi / wavelength,
                         kSquareMetres * body.section_scale() / count, parts.total(),
                         parts.edges + parts.bounces,
                         body.seen_faces(towards, polarization, executor)});
    }
  }
}

double RadarEchoes::mean() const {
  double sum = 0.0;
  for (const Echo& echo : echoes_) sum += echo.scale * std::norm(echo.total);
  return sum;
}

double RadarEchoes::add(const Echo& echo, const Eigen::Matrix3Xd& vertices,
                        Eigen::Matrix3Xcd& by_vertex, Eigen::Matrix3Xd& gradient) const {
  by_vertex.setZero(3, vertices.cols());
  Complex sum = echo.rest;
  const Vector3d along = -2.0 * echo.wave_number * echo.towards;
  for (const SeenFace& seen : echo.faces) {
    const Eigen::Vector3i corner = triangles_.col(seen.face);
    std::array<Vector3d, 3> p;
    std::array<double, 3> phase{};
    for (int j = 0; j < 3; ++j) {
      const auto at = static_cast<std::size_t>(j);
      p[at] = vertices.col(corner[j]) - middle_;
      phase[at] = along.dot(p[at]);
    }
    const TriangleWave wave = wave_with_slopes(phase);
    const double facing = (p[1] - p[0]).cross(p[2] - p[0]).dot(echo.towards);
    sum += seen.weight * facing * wave.value;
    for (std::size_t j = 0; j < 3; ++j) {
      const Vector3d turn = (p[(j + 1) % 3] - p[(j + 2) % 3]).cross(echo.towards);
      by_vertex.col(corner[static_cast<Eigen::Index>(j)]) +=
          (seen.weight * wave.value) * turn + (seen.weight * facing * wave.by_phase[j]) * along;
    }
  }
  gradient += 2.0 * echo.scale * (std::conj(sum) * by_vertex).real();
  return echo.scale * std::norm(sum);
}

double RadarEchoes::value_and_gradient(const Eigen::Matrix3Xd& vertices,
                                       Eigen::Matrix3Xd& gradient) const {
  /// Directions are summed in so many blocks, each with a gradient of its own.
  constexpr std::int64_t kBlocks = 32;
  const std::int64_t count = std::ssize(echoes_);
  std::vector<Eigen::Matrix3Xd> partial(index_of(kBlocks));
  std::array<double, kBlocks> value{};
  const auto sum_block = [&](std::int64_t b) {
    Eigen::Matrix3Xcd by_vertex;
    partial[index_of(b)].setZero(3, vertices.cols());
    for (std::int64_t i = b * count / kBlocks; i < (b + 1) * count / kBlocks; ++i) {
      value[index_of(b)] += add(echoes_[index_of(i)], vertices, by_vertex, partial[index_of(b)]);
    }
  };
  parallel_for(executor_, "radar gradient", kBlocks, sum_block, 1);
  gradient.setZero(3, vertices.cols());
  for (const Eigen::Matrix3Xd& part : partial) gradient += part;
  double sum = 0.0;
  for (const double part : value) sum += part;
  return sum;
}

// The descent

namespace {

/// Length over which steps are smooth, in wavelengths. With a third the rocket ended after 8
/// updates at −22.1 dBsm, of two and three bounces alone at −23.8, and at 9 GHz at −19.4; with two
/// thirds at −22.6, −25.2 and −22.1.
constexpr double kSmoothness = 2.0 / 3.0;

/// Largest distance, in wavelengths, that a vertex moves before the radar looks again. The phase of
/// its echo then changes by 48° at most.
constexpr double kRadarReach = 1.0 / 15.0;

/// Iterations of L-BFGS between two looks.
constexpr int kDescentIterations = 20;

template <class T>
auto as_columns(std::span<T> values) {
  using Matrix = std::conditional_t<std::is_const_v<T>, const Eigen::Matrix3Xd, Eigen::Matrix3Xd>;
  return Eigen::Map<Matrix>(values.data(), 3, static_cast<Eigen::Index>(values.size() / 3));
}

using Sparse = Eigen::SparseMatrix<double>;

}  // namespace

struct RadarDescent::Metric {
  RadarDescentOptions options;
  Eigen::Matrix3Xd reference;
  std::vector<Eigen::Index> free;  ///< Vertices that move.
  double area = 0.0;               ///< Of the surface.
  Eigen::VectorXd mass;            ///< Of the free vertices.
  Sparse laplacian;                ///< Of all vertices.
  Eigen::SimplicialLDLT<Sparse> solver;

  Metric(const SurfaceMesh& mesh, const std::vector<std::uint8_t>& fixed,
         const RadarDescentOptions& o)
      : options(o), reference(mesh.vertices) {
    const Eigen::Index count = mesh.vertex_count();
    Eigen::VectorXd all_mass = Eigen::VectorXd::Zero(count);
    std::vector<Eigen::Triplet<double>> entries;
    for (Eigen::Index face = 0; face < mesh.triangle_count(); ++face) {
      const Corners c = mesh.corners(face);
      const double third = area_normal(c).norm() / 6.0;
      const Vector3d weight = 0.5 * cotangents(c);
      for (int j = 0; j < 3; ++j) {
        const int from = mesh.triangles(j, face);
        const int to = mesh.triangles((j + 1) % 3, face);
        all_mass[from] += third;
        entries.emplace_back(from, from, weight[j]);
        entries.emplace_back(to, to, weight[j]);
        entries.emplace_back(from, to, -weight[j]);
        entries.emplace_back(to, from, -weight[j]);
      }
    }
    laplacian.resize(count, count);
    laplacian.setFromTriplets(entries.begin(), entries.end());
    area = all_mass.sum();
    factorize(all_mass, fixed);
  }

  void factorize(const Eigen::VectorXd& all_mass, const std::vector<std::uint8_t>& fixed) {
    for (Eigen::Index v = 0; v < all_mass.size(); ++v) {
      if (fixed.empty() || fixed[index_of(v)] == 0) free.push_back(v);
    }
    const auto unknowns = static_cast<Eigen::Index>(free.size());
    Sparse selection(all_mass.size(), unknowns);
    for (Eigen::Index i = 0; i < unknowns; ++i) selection.insert(free[index_of(i)], i) = 1.0;
    mass = selection.transpose() * all_mass;
    const double length = kSmoothness * options.wavelength;
    Sparse system = length * length * (selection.transpose() * laplacian * selection);
    for (Eigen::Index i = 0; i < unknowns; ++i) system.coeffRef(i, i) += mass[i];
    solver.compute(system);
  }

  /// (M + ℓ²L)⁻¹ M (M + ℓ²L)⁻¹ g of the free vertices, zero elsewhere.
  [[nodiscard]] Eigen::Matrix3Xd smoothed(const Eigen::Matrix3Xd& g) const {
    Eigen::MatrixX3d right(static_cast<Eigen::Index>(free.size()), 3);
    for (std::size_t i = 0; i < free.size(); ++i) {
      right.row(static_cast<Eigen::Index>(i)) = g.col(free[i]);
    }
    const Eigen::MatrixX3d once = mass.asDiagonal() * solver.solve(right);
    const Eigen::MatrixX3d twice = solver.solve(once);
    Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, g.cols());
    for (std::size_t i = 0; i < free.size(); ++i) {
      result.col(free[i]) = twice.row(static_cast<Eigen::Index>(i));
    }
    return result;
  }

  double objective(const RadarEchoes& echoes, const Eigen::Matrix3Xd& vertices,
                   Eigen::Matrix3Xd& gradient) const {
    const double section = echoes.value_and_gradient(vertices, gradient);
    const Eigen::Matrix3Xd moved = vertices - reference;
    const Eigen::Matrix3Xd bent = (options.anchor / area) * (moved * laplacian);
    gradient = gradient / options.first_section + 2.0 * bent;
    return section / options.first_section + moved.cwiseProduct(bent).sum();
  }
};

RadarDescent::RadarDescent(const SurfaceMesh& reference, const std::vector<std::uint8_t>& fixed,
                           const RadarDescentOptions& options)
    : metric_(std::make_unique<Metric>(reference, fixed, options)) {}

RadarDescent::~RadarDescent() = default;
RadarDescent::RadarDescent(RadarDescent&&) noexcept = default;
RadarDescent& RadarDescent::operator=(RadarDescent&&) noexcept = default;

Eigen::Matrix3Xd RadarDescent::moved(const Eigen::Matrix3Xd& vertices, const RadarEchoes& echoes,
                                     const Executor& executor) const {
  const double reach = kRadarReach * metric_->options.wavelength;
  Eigen::Matrix3Xd gradient;
  const auto evaluate = [&](std::span<const double> x, std::span<double> out) {
    const auto step = as_columns(x);
    const double farthest = step.colwise().norm().maxCoeff();
    if (!(farthest <= reach)) return std::numeric_limits<double>::infinity();
    const double value = metric_->objective(echoes, vertices + step, gradient);
    as_columns(out) = gradient;
    return value;
  };
  metric_->objective(echoes, vertices, gradient);
  const double longest = metric_->smoothed(gradient).colwise().norm().maxCoeff();
  if (!(longest > 0.0)) return vertices;
  const double scale = 0.25 * reach / longest;  // The first step is a quarter of the reach.
  const auto precondition = [&](std::span<const double> g, std::span<double> r) {
    as_columns(r) = scale * metric_->smoothed(as_columns(g));
  };
  LbfgsOptions options;
  options.max_iterations = kDescentIterations;
  std::vector<double> x(static_cast<std::size_t>(vertices.size()), 0.0);
  LbfgsOn<Executor>(evaluate, precondition, options, executor)
      .run([](int, double) { return true; }, x);
  return vertices + as_columns(std::span<const double>(x));
}

}  // namespace lensforge::reflect

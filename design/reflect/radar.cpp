// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <string>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/reflect/mesh/faces.h"

// Notation
//   ω       unit vector towards the radar
//   k       wave number 2π/λ
//   d       direction of a ray before it hits a face with the normal n
//   path    from a plane through the middle of the mesh, along the ray, and back to that plane

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

constexpr double kTubesPerWavelength = 10.0;
constexpr int kBounces = 3;

/// A pseudo-random number in 0 … 1 for a counter (SplitMix64).
double jitter(std::uint64_t counter) { return unit_share(mixed_bits(counter * kGoldenGamma)); }

double tubes_across(const SurfaceMesh& mesh, double wavelength) {
  return std::ceil(bounding_diagonal(mesh) * kTubesPerWavelength / wavelength);
}

/// e^{ix} averaged over a … b, times i: a first divided difference of e^{ix} without cancellation.
std::complex<double> mean_wave(double a, double b) {
  const double half = 0.5 * (b - a);
  const double sinc = std::abs(half) < 1e-8 ? 1.0 : std::sin(half) / half;
  return std::polar(sinc, 0.5 * (a + b)) * std::complex<double>(0.0, 1.0);
}

/// ∫ e^{iφ} over a triangle of area ½ whose corners have these phases: the second divided
/// difference of −e^{ix} (Hermite–Genocchi).
std::complex<double> triangle_wave(std::array<double, 3> phase) {
  std::sort(phase.begin(), phase.end());
  const double spread = phase[2] - phase[0];
  constexpr double kFlat = 1e-5;  // Below it the quotient's rounding exceeds the mean's error.
  if (spread < kFlat) return std::polar(0.5, (phase[0] + phase[1] + phase[2]) / 3.0);
  return -(mean_wave(phase[1], phase[2]) - mean_wave(phase[0], phase[1])) / spread;
}

/// One bounce: Σ (n·ω) ∫ e^{2ikω·r} dA over the faces, each weighted by its visible share.
class OneBounce {
 public:
  OneBounce(const SurfaceMesh& mesh, const Vector3d& towards, double wavelength)
      : mesh_(mesh),
        scene_(mesh),
        towards_(towards),
        middle_(0.5 * (mesh.vertices.rowwise().maxCoeff() + mesh.vertices.rowwise().minCoeff())),
        wave_number_(2.0 * pi / wavelength) {}

  [[nodiscard]] std::array<double, 2> face(std::int64_t k) const {
    const Corners c = mesh_.corners(k);
    Vector3d twice = area_normal(c);
    if (twice.dot(towards_) < 0.0) twice = -twice;
    const double share = seen_share(c, twice.normalized());
    if (share == 0.0) return {};
    const auto phase = [&](const Vector3d& p) {
      return -2.0 * wave_number_ * towards_.dot(p - middle_);
    };
    const std::complex<double> wave =
        share * twice.dot(towards_) * triangle_wave({phase(c.v0), phase(c.v1), phase(c.v2)});
    return {wave.real(), wave.imag()};
  }

 private:
  /// Visible share of four points of the face.
  [[nodiscard]] double seen_share(const Corners& c, const Vector3d& n) const {
    const Vector3d middle = (c.v0 + c.v1 + c.v2) / 3.0;
    int seen = 0;
    for (const Vector3d& p : {middle, Vector3d(0.5 * (middle + c.v0)),
                              Vector3d(0.5 * (middle + c.v1)), Vector3d(0.5 * (middle + c.v2))}) {
      seen += scene_.blocked(scene_.lifted(p, n), towards_, RayScene::kAnywhere) ? 0 : 1;
    }
    return 0.25 * seen;
  }

  const SurfaceMesh& mesh_;
  RayScene scene_;
  Vector3d towards_;
  Vector3d middle_;
  double wave_number_;
};

/// The square of tubes that covers a mesh seen from ω. Tubes start at random places of their cells,
/// so that their grid has no phase of its own.
class Aperture {
 public:
  Aperture(const SurfaceMesh& mesh, const Vector3d& towards, double wavelength)
      : scene_(mesh),
        faces_(measure_faces(mesh)),
        towards_(towards),
        u_(towards.unitOrthogonal()),
        v_(towards.cross(u_)),
        middle_(0.5 * (mesh.vertices.rowwise().maxCoeff() + mesh.vertices.rowwise().minCoeff())),
        radius_(0.5 * bounding_diagonal(mesh)),
        wave_number_(2.0 * pi / wavelength) {
    const double tubes = tubes_across(mesh, wavelength);
    count_ = static_cast<std::int64_t>(tubes);
    cell_ = 2.0 * radius_ / tubes;
  }

  [[nodiscard]] std::int64_t rows() const { return count_; }
  [[nodiscard]] double tube_area() const { return cell_ * cell_; }

  /// Amplitude of a row of tubes, each of area 1.
  [[nodiscard]] std::array<double, 2> row(std::int64_t r) const {
    std::complex<double> sum = 0.0;
    for (std::int64_t c = 0; c < count_; ++c) {
      const auto cell = static_cast<std::uint64_t>(r * count_ + c);
      const double x = (static_cast<double>(c) + jitter(2 * cell + 1)) * cell_ - radius_;
      const double y = (static_cast<double>(r) + jitter(2 * cell + 2)) * cell_ - radius_;
      sum += tube(middle_ + x * u_ + y * v_ + 2.0 * radius_ * towards_);
    }
    return {sum.real(), sum.imag()};
  }

 private:
  [[nodiscard]] std::complex<double> tube(Vector3d p) const {
    std::complex<double> sum = 0.0;
    Vector3d d = -towards_;
    double path = -2.0 * radius_;
    double sign = 1.0;
    for (int bounce = 0; bounce < kBounces; ++bounce) {
      const RayHit hit = scene_.nearest(p, d);
      if (!hit.met()) break;
      Vector3d n = faces_.normal.col(hit.face);
      if (n.dot(d) > 0.0) n = -n;
      path += hit.distance;
      p = scene_.lifted(p + hit.distance * d, n);
      const bool back = n.dot(towards_) > 0.0;
      if (bounce > 0 && back && !scene_.blocked(p, towards_, RayScene::kAnywhere)) {
        const double factor = 0.5 * sign * (1.0 - n.dot(towards_) / n.dot(d));
        sum += std::polar(factor, wave_number_ * (path - towards_.dot(p - middle_)));
      }
      d -= 2.0 * n.dot(d) * n;
      sign = -sign;
    }
    return sum;
  }

  RayScene scene_;
  Faces faces_;
  Vector3d towards_;
  Vector3d u_;
  Vector3d v_;
  Vector3d middle_;
  double radius_;
  double wave_number_;
  std::int64_t count_ = 0;
  double cell_ = 0.0;
};

}  // namespace

void require_radar_size(const SurfaceMesh& mesh, double wavelength) {
  const double most = std::sqrt(kMaxRadarRays);
  if (tubes_across(mesh, wavelength) <= most) return;
  throw InputError("--radar: the mesh is " + number_text(bounding_diagonal(mesh) / wavelength, 4) +
                   " wavelengths across: must be at most " +
                   number_text(most / kTubesPerWavelength, 4) + "; lower the frequency");
}

double radar_cross_section(const SurfaceMesh& mesh, const Vector3d& towards, double wavelength,
                           const Executor& executor) {
  require_radar_size(mesh, wavelength);
  const Aperture aperture(mesh, towards, wavelength);
  const auto row = [&](std::int64_t r) { return aperture.row(r); };
  const auto tubes = parallel_sum<2>(executor, "radar tubes", aperture.rows(), row, 4);
  const OneBounce one(mesh, towards, wavelength);
  const auto face = [&](std::int64_t k) { return one.face(k); };
  const auto faces = parallel_sum<2>(executor, "radar faces", mesh.triangle_count(), face, 64);
  const double amplitude = std::hypot(aperture.tube_area() * tubes[0] + faces[0],
                                      aperture.tube_area() * tubes[1] + faces[1]);
  return 4.0 * pi * amplitude * amplitude / (wavelength * wavelength);
}

std::vector<double> horizon_cross_sections(const SurfaceMesh& mesh, double wavelength, int count,
                                           const Executor& executor) {
  std::vector<double> sections;
  for (int i = 0; i < count; ++i) {
    const double azimuth = 2.0 * pi * i / count;
    sections.push_back(radar_cross_section(mesh, {std::cos(azimuth), std::sin(azimuth), 0.0},
                                           wavelength, executor));
  }
  return sections;
}

namespace {

constexpr double kLightSpeed = 299.792458;   ///< mm·GHz
constexpr double kSquareMillimetres = 1e-6;  ///< m²
constexpr double kFloor = 1e-12;             ///< m²; smaller sections are reported as −120 dBsm.
constexpr double kHalf = 260.0;              ///< Half the drawing's side.
constexpr double kRing = 40.0;               ///< Distance between rings, 10 dB.
constexpr int kRings = 6;

double dbsm(double section) { return 10.0 * std::log10(std::max(section, kFloor)); }

std::vector<double> sections(const SurfaceMesh& mesh, double ghz, const Executor& executor) {
  std::vector<double> result =
      horizon_cross_sections(mesh, radar_wavelength(ghz), kRadarAzimuths, executor);
  for (double& section : result) section *= kSquareMillimetres;
  return result;
}

/// @param outer  dBsm of the outermost ring.
std::string curve(const std::vector<double>& values, double outer, const std::string& colour) {
  std::string points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double angle =
        2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(values.size());
    const double rings = std::max(0.0, kRings - (outer - dbsm(values[i])) / 10.0);
    points.append(decimal_text(kHalf + kRing * rings * std::cos(angle), 1)).append(",");
    points.append(decimal_text(kHalf - kRing * rings * std::sin(angle), 1)).append(" ");
  }
  return "<polygon points=\"" + points + "\" fill=\"none\" stroke=\"" + colour +
         "\" stroke-width=\"2\"/>\n";
}

}  // namespace

double radar_wavelength(double ghz) { return kLightSpeed / ghz; }

RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after, double ghz,
                              const Executor& executor) {
  return {ghz, sections(before, ghz, executor), sections(after, ghz, executor)};
}

double mean_dbsm(const std::vector<double>& sections) {
  return dbsm(std::accumulate(sections.begin(), sections.end(), 0.0) /
              static_cast<double>(sections.size()));
}

nlohmann::json radar_json(const RadarComparison& comparison) {
  return {{"ghz", comparison.ghz},
          {"mean_dbsm_before", mean_dbsm(comparison.before)},
          {"mean_dbsm_after", mean_dbsm(comparison.after)}};
}

std::string radar_csv(const RadarComparison& comparison) {
  std::string text = "# " + program_mark() + "\nazimuth_deg,before_dbsm,after_dbsm\n";
  for (std::size_t i = 0; i < comparison.before.size(); ++i) {
    const double azimuth = 360.0 * static_cast<double>(i) / kRadarAzimuths;
    text.append(decimal_text(azimuth, 1)).append(",");
    text.append(decimal_text(dbsm(comparison.before[i]), 2)).append(",");
    text.append(decimal_text(dbsm(comparison.after[i]), 2)).append("\n");
  }
  return text;
}

std::string radar_svg(const RadarComparison& comparison) {
  const double largest =
      std::max(*std::max_element(comparison.before.begin(), comparison.before.end()),
               *std::max_element(comparison.after.begin(), comparison.after.end()));
  const double outer = 10.0 * std::ceil(dbsm(largest) / 10.0);
  const std::string side = decimal_text(2.0 * kHalf, 0);
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + side + "\" height=\"" +
                    side + "\" font-family=\"sans-serif\" font-size=\"12\">\n<!-- " +
                    program_mark() +
                    " -->\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  for (int ring = 1; ring <= kRings; ++ring) {
    const std::string radius = decimal_text(ring * kRing, 0);
    const std::string middle = decimal_text(kHalf, 0);
    svg += joined({"<circle cx=\"", middle, "\" cy=\"", middle, "\" r=\"", radius,
                   "\" fill=\"none\" stroke=\"#ccc\"/>\n<text x=\"", middle, "\" y=\"",
                   decimal_text(kHalf - ring * kRing, 0), "\" fill=\"#666\">",
                   decimal_text(outer - 10.0 * (kRings - ring), 0), " dBsm</text>\n"});
  }
  svg += curve(comparison.before, outer, "#c33") + curve(comparison.after, outer, "#236");
  return svg +
         "<text x=\"8\" y=\"18\" fill=\"#c33\">before</text>\n<text x=\"8\" y=\"34\" "
         "fill=\"#236\">after</text>\n</svg>\n";
}

}  // namespace lensforge::reflect

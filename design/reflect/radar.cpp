// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "design/reflect/mesh/faces.h"

// Notation
//   ω       unit vector towards the radar
//   k       wave number 2π/λ
//   e       unit vector of the electric field that the radar sends and receives
//   d, f    direction and field of a ray before it hits a face with the normal n
//   path    from a plane through the middle of the mesh, along the ray, and back to that plane

namespace lensforge::reflect {

using Eigen::Vector3d;
using std::numbers::pi;

// Edges

// Notation, for one face of a wedge whose open angle is Nπ
//   x, y, z  away from the edge in the face, the face's normal, x × y along the edge
//   β        angle between the direction of incidence and z
//   φ        angle of the radar above the face, seen along z
//   e, h     the electric field, and the magnetic one times the impedance of free space
//   κ        k sin β
//   μ        rate of phase of field and observation along the grazing ray, in units of κ:
//            cos φ − 2 cot² β; α = arccos μ
//   a, b     (π − α)/N and φ/N
//   U        1 if the face is lit, else 0
//
// With Sommerfeld's series of Bessel functions, where e_z and h_z of the incident wave are 1,
//   ∫₀^∞ h_z e^{−iκμx} dx     = (2i/κ) (1/N) sin a / (sin α (cos a − cos b))
//   ∫₀^∞ ∂e_z/∂y e^{−iκμx} dx = 2 (1/N) sin b / (cos a − cos b).
// Physical optics has these integrals for N = 1, if the face is lit: −(2i/κ) U/(cos φ + μ) and
// −2 U sin φ/(cos φ + μ). The differences are (2i/κ) p and 2 q. The current x h_z − z h_x has h_x
// from both by the equations of Maxwell; what it radiates back with the polarization of the
// incident field, e = e_φ φ̂ + e_β β̂, is
//   f = p sin φ e_φ² + q e_β² − e_φ e_β cos β (p (cos φ + μ) + 1/N − U).

namespace {

/// Sine of the angle between sight and edge below which an edge is seen from its end: its field,
/// finite there, is that of its end points, which this theory does not have.
constexpr double kAlongEdge = 1e-4;

/// The integrals of a face's fringe current.
struct FringeTerms {
  double p = 0.0;
  double q = 0.0;
};

FringeTerms fringe_terms(double open, double phi, double mu, bool lit) {
  const double b = phi / open;
  double cos_a = 0.0;
  double ratio = 1.0 / open;  // sin a/sin α
  if (mu > -1.0) {
    const double alpha = std::acos(std::min(mu, 1.0));
    cos_a = std::cos((pi - alpha) / open);
    if (alpha < pi) ratio = std::sin((pi - alpha) / open) / std::sin(alpha);
  } else {
    const double c = std::acosh(-mu);  // π − α = −i c
    cos_a = std::cosh(c / open);
    if (c > 0.0) ratio = std::sinh(c / open) / std::sinh(c);
  }
  const double wedge = 1.0 / (open * (cos_a - std::cos(b)));
  const double optics = lit ? 1.0 / (std::cos(phi) + mu) : 0.0;
  return {ratio * wedge + optics, std::sin(b) * wedge + std::sin(phi) * optics};
}

/// Both terms are smooth where the wedge's current and that of physical optics have a common pole,
/// but their difference loses digits there: within kPole of it they are means of both sides, whose
/// error is of the order of kAside².
FringeTerms smooth_fringe_terms(double open, double phi, double mu, bool lit) {
  constexpr double kPole = 1e-4;
  constexpr double kAside = 0.01;
  const double pole = -std::cos(phi);
  if (!lit || std::abs(mu - pole) > kPole) return fringe_terms(open, phi, mu, lit);
  const double alpha = pi - phi;  // Even and 2π-periodic.
  const FringeTerms one = fringe_terms(open, phi, std::cos(alpha - kAside), lit);
  const FringeTerms other = fringe_terms(open, phi, std::cos(alpha + kAside), lit);
  return {0.5 * (one.p + other.p), 0.5 * (one.q + other.q)};
}

double face_fringe(const WedgeFace& face, double open, const Vector3d& towards,
                   const Vector3d& polarization) {
  /// Angle above the face below which p is that at this angle: it grows without bound at 0, its
  /// product with sin φ does not.
  constexpr double kGrazing = 1e-6;
  const Vector3d along = face.out.cross(face.normal);
  const double cos_beta = -towards.dot(along);
  const double sin_beta = std::hypot(towards.dot(face.out), towards.dot(face.normal));
  if (sin_beta < kAlongEdge) return 0.0;
  double phi = std::atan2(towards.dot(face.normal), towards.dot(face.out));
  const Vector3d phi_hat = std::cos(phi) * face.normal - std::sin(phi) * face.out;
  const double e_phi = polarization.dot(phi_hat);
  const double e_beta = polarization.dot(towards.cross(phi_hat));
  if (phi < 0.0) phi += 2.0 * pi;
  if (phi > open * pi) return 0.0;
  phi = std::clamp(phi, kGrazing, 2.0 * pi - kGrazing);
  const bool lit = phi < pi;
  const double mu = std::cos(phi) - 2.0 * std::pow(cos_beta / sin_beta, 2);
  const auto [p, q] = smooth_fringe_terms(open, phi, mu, lit);
  return p * std::sin(phi) * e_phi * e_phi + q * e_beta * e_beta -
         e_phi * e_beta * cos_beta * (p * (std::cos(phi) + mu) + 1.0 / open - (lit ? 1.0 : 0.0));
}

WedgeFace wedge_face(const SurfaceMesh& mesh, int face, const Vector3d& from,
                     const Vector3d& along) {
  const Corners c = mesh.corners(face);
  const Vector3d inner = (c.v0 + c.v1 + c.v2) / 3.0 - from;
  return {(inner - inner.dot(along) * along).normalized(), area_normal(c).normalized()};
}

/// Angle by which a mesh's faces turn at an edge from which it is one for radar, rad.
double least_turn(const SurfaceMesh& mesh, const Edge& edge, double length, double wavelength) {
  constexpr double kAlwaysSharp = 40.0 * kDegree;
  const double areas = area_normal(mesh, edge.left).norm() + area_normal(mesh, edge.right).norm();
  const double height = 0.5 * areas / length;
  return std::min(kAlwaysSharp, 0.5 * wavelength / height);
}

}  // namespace

double edge_fringe(const RadarEdge& edge, const Vector3d& towards, const Vector3d& polarization) {
  return face_fringe(edge.faces[0], edge.open, towards, polarization) +
         face_fringe(edge.faces[1], edge.open, towards, polarization);
}

std::vector<RadarEdge> radar_edges(const SurfaceMesh& mesh, double wavelength) {
  std::vector<RadarEdge> edges;
  for (const Edge& edge : make_edges(mesh).edges) {
    RadarEdge radar{
        mesh.vertices.col(edge.from), mesh.vertices.col(edge.to), {}, 2.0, {edge.from, edge.to}};
    const double length = (radar.to - radar.from).norm();
    const Vector3d along = (radar.to - radar.from) / length;
    const WedgeFace left = wedge_face(mesh, edge.left, radar.from, along);
    radar.faces = {left, {left.out, -left.normal}};
    if (edge.right >= 0) {
      const WedgeFace right = wedge_face(mesh, edge.right, radar.from, along);
      const double turn = std::acos(std::clamp(left.normal.dot(right.normal), -1.0, 1.0));
      const bool convex = right.out.dot(left.normal) < 0.0;
      if (!convex || turn < least_turn(mesh, edge, length, wavelength)) continue;
      radar.faces[1] = right;
      radar.open = 1.0 + turn / pi;
    }
    edges.push_back(radar);
  }
  return edges;
}

// Faces of surfaces that bend

namespace {

using Complex = std::complex<double>;

/// Above this kρ both shares differ from 1 by less than 1 %, and the surface counts as flat.
constexpr double kLargeRadius = 50.0;

/// ∫_τ^∞ e^{iu²} du e^{−iτ²} along u = τ + e^{iπ/4} s, where the integrand decays as e^{−s²}:
/// Simpson's rule, error below 1e-8.
Complex fresnel_tail(double tau) {
  constexpr int kSteps = 200;
  const double step = std::min(6.0, 20.0 / tau) / kSteps;
  const Complex rate = std::numbers::sqrt2 * tau * Complex(-1.0, 1.0);
  Complex sum = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    const double s = i * step;
    const double weight = i == 0 || i == kSteps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
    sum += weight * std::exp(rate * s - s * s);
  }
  return std::polar(step / 3.0, 0.25 * pi) * sum;
}

ParabolicShares shares_of(double curvature, double wave_number) {
  if (curvature * kLargeRadius <= wave_number) return {1.0, 1.0};
  return parabolic_shares(wave_number / curvature);
}

/// Least squares of the second fundamental form (a, b; b, c) over the sides of a face.
Eigen::Matrix2d second_form(const Corners& c, const std::array<Vector3d, 3>& normal,
                            const Vector3d& u, const Vector3d& v) {
  const std::array p{c.v0, c.v1, c.v2};
  Eigen::Matrix<double, 6, 3> rows = Eigen::Matrix<double, 6, 3>::Zero();
  Eigen::Matrix<double, 6, 1> turns;
  for (int k = 0; k < 3; ++k) {
    const auto from = static_cast<std::size_t>(k);
    const auto to = static_cast<std::size_t>((k + 1) % 3);
    const Vector3d side = p[to] - p[from];
    const Vector3d turn = normal[to] - normal[from];
    rows.row(2 * k) << side.dot(u), side.dot(v), 0.0;
    rows.row(2 * k + 1) << 0.0, side.dot(u), side.dot(v);
    turns.segment<2>(2 * k) << turn.dot(u), turn.dot(v);
  }
  const Vector3d form = rows.colPivHouseholderQr().solve(turns);
  return (Eigen::Matrix2d() << form[0], form[1], form[1], form[2]).finished();
}

}  // namespace

ParabolicShares parabolic_shares(double k_rho) {
  const double tau = std::sqrt(k_rho);
  const Complex w = Complex(0.0, -2.0 * tau) * fresnel_tail(tau);
  return {1.0 / w, 1.0 / (2.0 - w)};
}

Complex CurvedFace::of(const Vector3d& polarization, const Vector3d& n) const {
  const double a = polarization.dot(along);
  const double b = polarization.dot(n.cross(along));
  const double both = a * a + b * b;
  return both > 0.0 ? (a * a * share + b * b * other) / both : 1.0;
}

std::vector<CurvedFace> curved_faces(const SurfaceMesh& mesh, const std::vector<bool>& creased,
                                     double wavelength) {
  const Eigen::Matrix3Xd normals = vertex_area_normals(mesh).colwise().normalized();
  const double wave_number = 2.0 * pi / wavelength;
  std::vector<CurvedFace> faces;
  for (std::int64_t k = 0; k < mesh.triangle_count(); ++k) {
    const Eigen::Vector3i corner = mesh.triangles.col(k);
    CurvedFace face{Vector3d::UnitX(), 1.0, 1.0};
    const bool smooth = std::none_of(corner.begin(), corner.end(),
                                     [&](int v) { return creased[static_cast<std::size_t>(v)]; });
    if (smooth) {
      const Vector3d n = area_normal(mesh, k).normalized();
      const Vector3d u = n.unitOrthogonal();
      const Vector3d v = n.cross(u);
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal;
      principal.computeDirect(second_form(
          mesh.corners(k), {normals.col(corner[0]), normals.col(corner[1]), normals.col(corner[2])},
          u, v));
      const ParabolicShares one = shares_of(principal.eigenvalues()[0], wave_number);
      const ParabolicShares two = shares_of(principal.eigenvalues()[1], wave_number);
      const Eigen::Vector2d axis = principal.eigenvectors().col(0);
      face = {axis[0] * u + axis[1] * v, one.across * two.along, one.along * two.across};
    }
    faces.push_back(face);
  }
  return faces;
}

// The body: faces, edges and bounces

namespace {

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

}  // namespace

/// What one direction and polarization of the radar add up.
class RadarBody::View {
 public:
  View(const RadarBody& body, const Vector3d& towards, Polarization polarization)
      : body_(body),
        towards_(towards),
        u_(towards.unitOrthogonal()),
        v_(towards.cross(u_)),
        field_(radar_field(towards, polarization)) {}

  /// The weight of a face's integral: its visible share, and its curvature's; 0 if it is hidden.
  [[nodiscard]] std::complex<double> weight(std::int64_t k) const {
    const Corners c = body_.mesh_.corners(k);
    Vector3d n = body_.faces_.normal.col(k);
    const bool behind = n.dot(towards_) < 0.0;  // Seen through an open mesh.
    if (behind) n = -n;
    const Vector3d middle = (c.v0 + c.v1 + c.v2) / 3.0;
    const double share =
        seen_share(std::array{middle, Vector3d(0.5 * (middle + c.v0)),
                              Vector3d(0.5 * (middle + c.v1)), Vector3d(0.5 * (middle + c.v2))},
                   n);
    if (share == 0.0 || behind) return -share;
    return share * body_.curved_[index_of(k)].of(field_, n);
  }

  /// One bounce: (n·ω) ∫ e^{−2ikω·r} dA over a face, weighted.
  [[nodiscard]] std::array<double, 2> face(std::int64_t k) const {
    const std::complex<double> seen = weight(k);
    if (seen == 0.0) return {};
    const Corners c = body_.mesh_.corners(k);
    const std::complex<double> wave = seen * area_normal(c).dot(towards_) *
                                      triangle_wave({phase(c.v0), phase(c.v1), phase(c.v2)});
    return {wave.real(), wave.imag()};
  }

  /// What an edge adds to the faces beside it: (i/k) f ∫ e^{−2ikω·r} dl, weighted likewise.
  [[nodiscard]] std::array<double, 2> edge(std::int64_t k) const {
    const RadarEdge& edge = body_.edges_[index_of(k)];
    const double fringe = edge_fringe(edge, towards_, field_);
    if (fringe == 0.0) return {};
    const Vector3d side = edge.to - edge.from;
    const double share =
        seen_share(std::array{Vector3d(edge.from + side / 6.0), Vector3d(edge.from + 0.5 * side),
                              Vector3d(edge.to - side / 6.0)},
                   lift_of(edge));
    const std::complex<double> wave = share * fringe * side.norm() / body_.wave_number_ *
                                      mean_wave(phase(edge.from), phase(edge.to));
    return {wave.real(), wave.imag()};
  }

  /// Two and three bounces: amplitude of a row of tubes, each of area 1. They start at random
  /// places of their cells, so that their grid has no phase of its own.
  [[nodiscard]] std::array<double, 2> row(std::int64_t r) const {
    std::complex<double> sum = 0.0;
    for (std::int64_t c = 0; c < body_.tubes_; ++c) {
      const auto cell = static_cast<std::uint64_t>(r * body_.tubes_ + c);
      const double x = (static_cast<double>(c) + jitter(2 * cell + 1)) * body_.cell_;
      const double y = (static_cast<double>(r) + jitter(2 * cell + 2)) * body_.cell_;
      sum += tube(body_.middle_ + (x - body_.radius_) * u_ + (y - body_.radius_) * v_ +
                  2.0 * body_.radius_ * towards_);
    }
    return {sum.real(), sum.imag()};
  }

 private:
  [[nodiscard]] double phase(const Vector3d& p) const {
    return -2.0 * body_.wave_number_ * towards_.dot(p - body_.middle_);
  }

  /// Direction from an edge to where none of its own faces is in the way of the radar.
  [[nodiscard]] Vector3d lift_of(const RadarEdge& edge) const {
    if (edge.open < 2.0) return (edge.faces[0].normal + edge.faces[1].normal).normalized();
    const WedgeFace& face = edge.faces[0];
    const Vector3d n = face.normal.dot(towards_) < 0.0 ? Vector3d(-face.normal) : face.normal;
    return (n - face.out).normalized();
  }

  template <std::size_t N>
  [[nodiscard]] double seen_share(const std::array<Vector3d, N>& points,
                                  const Vector3d& lift) const {
    const auto seen = std::count_if(points.begin(), points.end(), [&](const Vector3d& p) {
      return !body_.scene_.blocked(body_.scene_.lifted(p, lift), towards_, RayScene::kAnywhere);
    });
    return static_cast<double>(seen) / static_cast<double>(N);
  }

  [[nodiscard]] std::complex<double> tube(Vector3d p) const {
    std::complex<double> sum = 0.0;
    Vector3d d = -towards_;
    Vector3d f = field_;
    double path = -2.0 * body_.radius_;
    for (int bounce = 0; bounce < kBounces; ++bounce) {
      const RayHit hit = body_.scene_.nearest(p, d);
      if (!hit.met()) break;
      Vector3d n = body_.faces_.normal.col(hit.face);
      if (n.dot(d) > 0.0) n = -n;
      path += hit.distance;
      p = body_.scene_.lifted(p + hit.distance * d, n);
      const bool back = n.dot(towards_) > 0.0;
      if (bounce > 0 && back && !body_.scene_.blocked(p, towards_, RayScene::kAnywhere)) {
        const double factor = f.dot(field_) - d.dot(field_) * n.dot(f) / n.dot(d);
        sum += std::polar(factor, body_.wave_number_ * (path - towards_.dot(p - body_.middle_)));
      }
      d -= 2.0 * n.dot(d) * n;
      f = 2.0 * n.dot(f) * n - f;
    }
    return sum;
  }

  const RadarBody& body_;
  Vector3d towards_;
  Vector3d u_;
  Vector3d v_;
  Vector3d field_;
};

RadarBody::RadarBody(const SurfaceMesh& mesh, double wavelength)
    : mesh_(mesh),
      scene_(mesh),
      faces_(measure_faces(mesh)),
      edges_(radar_edges(mesh, wavelength)),
      middle_(0.5 * (mesh.vertices.rowwise().maxCoeff() + mesh.vertices.rowwise().minCoeff())),
      radius_(0.5 * bounding_diagonal(mesh)),
      wave_number_(2.0 * pi / wavelength) {
  std::vector<bool> creased(static_cast<std::size_t>(mesh.vertex_count()));
  for (const RadarEdge& edge : edges_) {
    for (const int v : edge.vertices) creased[index_of(v)] = true;
  }
  curved_ = curved_faces(mesh, creased, wavelength);
  tubes_ = static_cast<std::int64_t>(tubes_across(mesh, wavelength));
  cell_ = 2.0 * radius_ / static_cast<double>(tubes_);
}

RadarParts RadarBody::parts(const Vector3d& towards, Polarization polarization,
                            const Executor& executor) const {
  const View view(*this, towards, polarization);
  const auto row = [&](std::int64_t r) { return view.row(r); };
  const auto tubes = parallel_sum<2>(executor, "radar tubes", tubes_, row, 4);
  const auto face = [&](std::int64_t k) { return view.face(k); };
  const auto faces = parallel_sum<2>(executor, "radar faces", mesh_.triangle_count(), face, 64);
  const auto edge = [&](std::int64_t k) { return view.edge(k); };
  const auto edges = parallel_sum<2>(executor, "radar edges", std::ssize(edges_), edge, 64);
  const double area = cell_ * cell_;
  return {{faces[0], faces[1]}, {edges[0], edges[1]}, {area * tubes[0], area * tubes[1]}};
}

std::vector<SeenFace> RadarBody::seen_faces(const Vector3d& towards, Polarization polarization,
                                            const Executor& executor) const {
  const View view(*this, towards, polarization);
  std::vector<std::complex<double>> weight(index_of(mesh_.triangle_count()));
  const auto look = [&](std::int64_t k) { weight[index_of(k)] = view.weight(k); };
  parallel_for(executor, "radar faces", mesh_.triangle_count(), look, 64);
  std::vector<SeenFace> seen;
  for (int k = 0; k < mesh_.triangle_count(); ++k) {
    if (weight[index_of(k)] != 0.0) seen.push_back({k, weight[index_of(k)]});
  }
  return seen;
}

double RadarBody::section_scale() const { return wave_number_ * wave_number_ / pi; }

double RadarBody::cross_section(const Vector3d& towards, Polarization polarization,
                                const Executor& executor) const {
  return section_scale() * std::norm(parts(towards, polarization, executor).total());
}

Vector3d radar_field(const Vector3d& towards, Polarization polarization) {
  Vector3d across = Vector3d::UnitZ().cross(towards);
  across = across.norm() > 0.0 ? across.normalized() : Vector3d::UnitY();
  return polarization == Polarization::kHorizontal ? across : Vector3d(towards.cross(across));
}

void require_radar_size(const SurfaceMesh& mesh, double wavelength, const char* option) {
  const double most = std::sqrt(kMaxRadarRays);
  if (tubes_across(mesh, wavelength) <= most) return;
  throw InputError(std::string(option) + ": the mesh is " +
                   number_text(bounding_diagonal(mesh) / wavelength, 4) +
                   " wavelengths across: must be at most " +
                   number_text(most / kTubesPerWavelength, 4) + "; lower the frequency");
}

std::vector<double> horizon_cross_sections(const RadarBody& body, Polarization polarization,
                                           int count, const Executor& executor) {
  std::vector<double> sections;
  for (int i = 0; i < count; ++i) {
    const double azimuth = 2.0 * pi * i / count;
    sections.push_back(
        body.cross_section({std::cos(azimuth), std::sin(azimuth), 0.0}, polarization, executor));
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

/// @param outer  dBsm of the outermost ring.
std::string curve(const std::vector<double>& azimuth_deg, const std::vector<double>& values,
                  double outer, const std::string& colour) {
  std::string points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double angle = azimuth_deg[i] * kDegree;
    const double rings = std::max(0.0, kRings - (outer - dbsm(values[i])) / 10.0);
    points.append(decimal_text(kHalf + kRing * rings * std::cos(angle), 1)).append(",");
    points.append(decimal_text(kHalf - kRing * rings * std::sin(angle), 1)).append(" ");
  }
  const double gap = azimuth_deg.front() + 360.0 - azimuth_deg.back();
  const bool closed = values.size() < 2 || gap < 1.5 * (azimuth_deg[1] - azimuth_deg[0]);
  return std::string(closed ? "<polygon" : "<polyline") + " points=\"" + points +
         "\" fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"2\"/>\n";
}

}  // namespace

double radar_wavelength(double ghz) { return kLightSpeed / ghz; }

std::vector<double> radar_sections(const SurfaceMesh& mesh, const ReflectOptions& options,
                                   const Executor& executor) {
  const RadarBody body(mesh, radar_wavelength(options.radar_ghz));
  std::vector<double> result =
      horizon_cross_sections(body, options.polarization, kRadarAzimuths, executor);
  for (double& section : result) section *= kSquareMillimetres;
  return result;
}

RadarComparison compare_radar(const SurfaceMesh& before, const SurfaceMesh& after,
                              const ReflectOptions& options, const Executor& executor) {
  RadarComparison comparison{{options.radar_ghz}, options.polarization, {}, {}, {}};
  for (int i = 0; i < kRadarAzimuths; ++i) {
    comparison.azimuth_deg.push_back(360.0 * i / kRadarAzimuths);
  }
  comparison.before = radar_sections(before, options, executor);
  comparison.after = radar_sections(after, options, executor);
  return comparison;
}

const char* polarization_word(Polarization polarization) {
  return polarization == Polarization::kVertical ? "vv" : "hh";
}

double mean_dbsm(const std::vector<double>& sections) {
  return dbsm(std::accumulate(sections.begin(), sections.end(), 0.0) /
              static_cast<double>(sections.size()));
}

double p90_dbsm(std::vector<double> sections) {
  const auto at = sections.begin() + std::ssize(sections) * 9 / 10;
  std::nth_element(sections.begin(), at, sections.end());
  return dbsm(*at);
}

nlohmann::json radar_json(const RadarComparison& comparison) {
  const bool one = comparison.ghz.size() == 1;
  return {{"ghz", one ? nlohmann::json(comparison.ghz[0]) : nlohmann::json(comparison.ghz)},
          {"polarization", polarization_word(comparison.polarization)},
          {"mean_dbsm_before", mean_dbsm(comparison.before)},
          {"mean_dbsm_after", mean_dbsm(comparison.after)},
          {"p90_dbsm_before", p90_dbsm(comparison.before)},
          {"p90_dbsm_after", p90_dbsm(comparison.after)}};
}

std::string radar_csv(const RadarComparison& comparison) {
  std::string text = "# " + program_mark() + "\nazimuth_deg,before_dbsm,after_dbsm\n";
  for (std::size_t i = 0; i < comparison.before.size(); ++i) {
    text.append(decimal_text(comparison.azimuth_deg[i], 2)).append(",");
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
  svg += curve(comparison.azimuth_deg, comparison.before, outer, "#c33") +
         curve(comparison.azimuth_deg, comparison.after, outer, "#236");
  return svg +
         "<text x=\"8\" y=\"18\" fill=\"#c33\">before</text>\n<text x=\"8\" y=\"34\" "
         "fill=\"#236\">after</text>\n</svg>\n";
}

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/radar_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/compute/scalar.h"

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

namespace lensforge::reflect {
namespace {

using Eigen::Vector3d;
using std::numbers::pi;

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

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/scalar.h"
#include "core/mesh/surface_mesh.h"
#include "design/reflect/input.h"
#include "design/reflect/light/sun.h"
#include "design/reflect/mesh/faces.h"

// Sunlight that the panes of a façade reflect to places, W/m² through a year.

namespace lensforge::reflect {

/// A material that mirrors: a pane of glass with two faces, or metal.
struct MirrorMaterial {
  std::string name;
  std::complex<double> index;  ///< n + ik, against air.
  bool pane = true;            ///< Light that enters is reflected by the back face, too.

  /// Share of unpolarised light that is reflected, by Fresnel's formulas; of a pane with all
  /// reflections between its faces, 2ρ/(1 + ρ) for either polarization, without absorption.
  /// @param cosine  of the angle of incidence, 0 … 1.
  [[nodiscard]] double reflectance(double cosine) const;
};

/// "aluminium" and those of material_names(), the words of --glare-material.
std::vector<std::string> mirror_material_names();

/// Angular radius of the sun at the distance 1, rad (959.63″, Auwers 1891).
inline constexpr double kSunRadius = 959.63 / 3600.0 * kDegree;

/// The flat faces of a shape, as mirrors that are seen from a place. Each reflects from its front.
class MirrorView {
 public:
  /// @param mesh, scene  must outlive it; the scene is the mesh's.
  MirrorView(const SurfaceMesh& mesh, const RayScene& scene, const Eigen::Vector3d& place);

  /// Irradiance at the place by one reflection, as a multiple of that of the sun's beam, each
  /// face's light on a plane across it: Σ_k R(θ_k) V_k Ω_k/Ω. Ω is the solid angle of the sun's
  /// disc and Ω_k the part of it that is seen in face k (exact to 1e-4); V_k is 1 if neither the
  /// light nor the reflection is blocked at the middle of that part, else 0. The sum is an upper
  /// bound for any plane at the place. Light that is reflected twice is not counted.
  /// @param sun  unit vector. @param radius  of the sun's disc, rad.
  [[nodiscard]] double gain(const Eigen::Vector3d& sun, double radius,
                            const MirrorMaterial& material) const;

 private:
  /// A face whose front looks at the place.
  struct Mirror {
    Eigen::Vector3d normal;
    std::array<Eigen::Vector3d, 3> seen;  ///< From the mirrored place to the corners.
    double height;                        ///< Of the place above the face's plane.
  };

  /// The sun's disc with two unit vectors across it.
  struct Disc {
    Eigen::Vector3d sun;
    Eigen::Vector3d u;
    Eigen::Vector3d w;
    double radius;  ///< Tangent of its angle.
  };

  [[nodiscard]] double gain(const Mirror& mirror, const Disc& disc,
                            const MirrorMaterial& material) const;
  /// True if a point of a face is lit from `sun` and seen from the place.
  [[nodiscard]] bool open(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                          const Eigen::Vector3d& sun) const;

  const RayScene& scene_;
  Eigen::Vector3d place_;
  std::vector<Mirror> mirrors_;
  Eigen::Matrix3Xd axis_;  ///< Unit; the mirrored direction of every mirror's middle.
  // Cosine and sine of the angle from that direction to the farthest corner.
  Eigen::VectorXd cosine_;
  Eigen::VectorXd sine_;
};

/// Maximum size of a file of places.
inline constexpr std::uintmax_t kMaxPlaceBytes = std::uintmax_t{16} << 20U;

/// All that glare depends on beside the shape.
struct GlareSetup {
  SunSite site;
  double bearing = 0.0;    ///< Of +y, clockwise from north, rad.
  double turbidity = 3.0;  ///< Linke's, of clear_sky_beam().
  double limit = 0.0;      ///< W/m²; 0: none.
  MirrorMaterial material;
  Eigen::Matrix3Xd places;  ///< In the unit of the mesh, 3 × P.
};

/// The setup of --glare and the options that go with it.
/// @throw InputError naming option, value or line of a file, and rule; also for options that go
///        with --glare where that is missing. @pre --glare is not empty
GlareSetup make_glare_setup(const ReflectOptions& options);

/// @throw InputError naming an option that is only for --glare, where that is empty.
void require_glare_options(const ReflectOptions& options);

/// @throw InputError naming --place unless the front of a face is seen from every place, which then
///        is neither inside the shape nor behind it, and none is farther than 1e6 times the
///        diagonal.
void require_glare_places(const SurfaceMesh& mesh, const GlareSetup& setup);

/// Minutes from one position of the sun to the next: it moves by 1.25°, two and a half diameters.
inline constexpr int kGlareMinutes = 5;
inline constexpr int kGlareDays = 365;  ///< Of kSunYear.

/// The glare of one shape through kSunYear, by the clocks of the site.
struct GlareYear {
  /// Largest irradiance at any of the places within an hour of a day, W/m²: 24 × 365.
  Eigen::ArrayXXd hourly;
  double maximum = 0.0;            ///< W/m²
  int minute = 0;                  ///< Of the year, when it is reached.
  int place = 0;                   ///< Where it is reached.
  double hours_above_limit = 0.0;  ///< At any of the places; 0 without a limit.
  Eigen::VectorXd place_maximum;   ///< Of every place, W/m².

  /// The largest irradiance within an hour of any day of a month: 24 × 12.
  [[nodiscard]] Eigen::ArrayXXd monthly() const;
};

/// Same bits for any number of threads. @throw Interrupted
GlareYear yearly_glare(const SurfaceMesh& mesh, const GlareSetup& setup, const Executor& executor);

/// Glare of the original mesh and of the new shape.
struct GlareComparison {
  GlareSetup setup;
  GlareYear before;
  GlareYear after;
};

/// @throw Interrupted
GlareComparison compare_glare(const SurfaceMesh& before, const SurfaceMesh& after,
                              const GlareSetup& setup, const Executor& executor);

/// "2025-03-08 12:35"
std::string glare_time(int minute);

/// {"maximum", "time", "place", "hours_above_limit", "monthly", "places"}
nlohmann::json glare_json(const GlareSetup& setup, const GlareYear& year);
/// {"latitude", "longitude", "zone", "north", "year", "material", "turbidity", "limit"}
nlohmann::json glare_json(const GlareSetup& setup);
/// The setup's, with "before" and "after".
nlohmann::json glare_json(const GlareComparison& comparison);
/// "month,day,hour,before,after", a line per hour of the year.
std::string glare_csv(const GlareComparison& comparison);
/// Maps by month and hour, before and after with one scale, as SVG.
std::string glare_svg(const GlareComparison& comparison);
/// Section of the report: table and maps.
std::string glare_section(const GlareComparison& comparison);

}  // namespace lensforge::reflect

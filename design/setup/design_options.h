// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/lens/optical_surface.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "core/optics/outline.h"
#include "design/energy/objective_options.h"
#include "design/spline/made_by.h"

namespace lensforge {

class Description;

/// Maximum tilt of a screen from the lens's plane, and maximum angle of light on a mirror, degrees:
/// beyond it light grazes.
inline constexpr double kMaxTilt = 80.0;
/// Limits of the picture's width on the screen, mm: up to a kilometre.
inline constexpr double kMinImageWidth = 1e-3;
inline constexpr double kMaxImageWidth = 1e6;

/// Limits of a source's angle, mrad, and size, mm: from a laser to a lamp that fills half of the
/// sky.
inline constexpr double kMinSourceWidth = 1e-3;
inline constexpr double kMaxSourceAngle = 1500.0;
inline constexpr double kMaxSourceSize = 1e6;

/// Maximum radius of a spherical front, mm: beyond it the front is flat to a nanometre.
inline constexpr double kMaxFrontRadius = 1e9;

enum class SourceKind { kParallel, kPoint };

/// Light source, kind of surface (lens or mirror), and place of the picture.
struct LightOptions {
  std::string lamp;        ///< As typed, see set_lamp(); its meaning is in the fields below.
  Body body;               ///< Lens or mirror.
  double incidence = 0.0;  ///< Angle of parallel light from a mirror's z axis, degrees, in x.
  SourceKind source = SourceKind::kParallel;
  std::optional<double> front_radius;                 ///< Radius, mm; above 0: convex; none: flat.
  std::string front_file;                             ///< File of a front that is a height map.
  std::shared_ptr<const HeightSpline> front_heights;  ///< Content of front_file, or shared.
  /// Both faces are shaped: half of the turn that light takes is the front's (shared_front()).
  bool both_faces = false;
  std::optional<Eigen::Vector3d> source_position;  ///< Place of a point source, mm, lens frame.
  /// Distance of a point source from a lens's flat face, in front of its middle, mm; 0: stated by
  /// source_position.
  double source_distance = 0.0;
  Emission emission = Emission::kIsotropic;  ///< Intensity of a point source.
  double source_angle = 0.0;                 ///< Full angle of parallel light, mrad.
  double source_size = 0.0;                  ///< Diameter of a point source, mm.
  std::string source_picture;                ///< File with the source's shape; empty: a disc.
  SourceShape source_shape;                  ///< Content of source_picture.
  bool fresnel = false;                      ///< Count the light that a lens's faces reflect.
  Spectrum spectrum;  ///< Colours of the light; none: DesignOptions::ior for all.
  /// What the last steps of a spline follow: rays, or the picture of a wave.
  LightModel model = LightModel::kRays;
  double wavelength_nm = 550.0;  ///< Of waves, without a spectrum.
  double image_width = 0.0;      ///< Width of the picture on the screen, mm; 0: the lens's.
  /// Offset of the picture's centre from the point where a flat surface's chief ray meets the
  /// screen, mm along the lens's x and y.
  Eigen::Vector2d image_offset{0.0, 0.0};
  /// Rotations of the screen by the right-hand rule, degrees: about the picture's right, then its
  /// up.
  Eigen::Vector2d screen_tilt{0.0, 0.0};
};

/// Limits of what can be made and computed: from a micro-lens to a shop window, from nearly no
/// refraction (a lens in a liquid) to more than any optical material has, from a wall at arm's
/// length to one kilometres away. Lengths in mm.
inline constexpr double kMinLensWidth = 0.01;
inline constexpr double kMaxLensWidth = 1e5;
inline constexpr double kMinThickness = 1e-3;
inline constexpr double kMaxThickness = 1e4;
inline constexpr double kMaxFocalLength = 1e7;
inline constexpr double kMinIor = 1.01;
inline constexpr double kMaxIor = 10.0;
/// Minimum pixels of the working picture on either side: below it there is nothing to shape.
inline constexpr int kMinPixels = 4;
/// Maximum weight of a term of the objective: beyond it the others are lost to rounding.
inline constexpr double kMaxWeight = 1e12;

/// A second picture, of a lens of two free faces.
struct SecondOptions {
  std::string file;                      ///< As typed; empty: none.
  std::shared_ptr<const Image> picture;  ///< Content of `file`.
  double focal_length = 0.0;             ///< z of its screen, mm.
  double width = 0.0;                    ///< Of the picture there, mm; 0: the first one's.
  Eigen::Vector2d offset{0.0, 0.0};      ///< See LightOptions::image_offset.
  Eigen::Vector2d tilt{0.0, 0.0};        ///< See LightOptions::screen_tilt.
};

/// Everything that shapes a design except the picture itself.
struct DesignOptions {
  double width = 100.0;         ///< Lens width, mm; the height follows the picture.
  double focal_length = 300.0;  ///< z of the receiving plane, mm, > thickness.
  std::string material;         ///< As typed, see set_material().
  double ior = 1.49;            ///< Refractive index, > 1.
  double thickness = 5.0;       ///< Minimum z of the finished surface, mm, > 0.
  LightOptions light;           ///< Source, mirror or lens, screen.
  SecondOptions second;         ///< With a picture, both faces are shaped.
  /// Edge of a lens that is not a rectangle: its kind and radius, mm, or the corners of a polygon
  /// in any unit. optical_setup() fits it into the lens's rectangle.
  std::optional<Outline> outline;
  int pixels = 256;          ///< Longer side of the working picture; at most the source's.
  double mesh_ratio = 1.25;  ///< Mesh vertices per pixel side, 0.25 … 8.
  /// Number of resolutions, coarse to fine, each twice the one before; the coarsest picture keeps
  /// at least 32 pixels. The default is one: with transport at full size the picture ends closer
  /// than over coarse levels (128² portrait, two rounds, facets: MAE 0.0038 with one level, 0.0063
  /// with three).
  int levels = 1;
  int rounds = 6;  ///< Alternations per level, ≥ 1 (Sun et al., section 3.4).
  /// Rounds of a level that begin with transport, ≥ 0; 0 starts from a flat surface. Transport
  /// moves light over distances, but it treats a facet as a point and undoes fine detail; once the
  /// mesh follows the picture, little is left to move (128² photograph, facets: MAE 0.0039 with 1,
  /// 0.0037 with 3).
  int transport_rounds = 1;
  bool rendering_guided = true;  ///< False: rounds consist of transport alone.
  /// Share of the facets that is spread evenly over the picture instead of the lens, 0 … 0.95; see
  /// spread_vertices().
  double spread = 0.7;
  /// Maximum L-BFGS iterations on Sun et al., Eq. 20, per round, ≥ 0. The default is none: the
  /// fitted heights are closer to the picture than the surface that these iterations reach (128²
  /// portrait, two rounds, facets: MAE 0.0048 with none, 0.0059 with 50).
  int update_iterations = 0;
  /// Maximum L-BFGS iterations per round, ≥ 1. Below kPaperIterations a design ends when light
  /// cannot show more (Finish).
  int iterations = 100;
  static constexpr int kPaperIterations = 300;
  [[nodiscard]] bool ends_when_seen() const { return iterations < kPaperIterations; }
  /// Surface model to optimise. A spline is one surface from design to part and STEP; the normals
  /// of a smooth mesh belong to no surface (docs/accuracy.md, "One surface").
  SurfaceModel model = SurfaceModel::kSpline;
  ViewSide view = ViewSide::kFront;
  ObjectiveWeights weights;
  /// Process that the part is designed for; none: the designed surface itself. @pre model is
  /// kSpline.
  std::optional<MadeBy> made_by;
  double smoothness = 1.0;  ///< Factor on weights.smooth.
  /// File for a checkpoint after every round; empty: none is written.
  std::filesystem::path checkpoint;
  /// Continue from `checkpoint`. The same picture and options give the same result as without
  /// interruption.
  bool resume = false;
};

/// Default options for a design of `target`: the smoothness that the model needs, and no more
/// pixels than the picture has.
DesignOptions default_design_options(SurfaceModel model, const Image& target);

/// The same options with `smoothness` multiplied into weights.smooth and set to 1.
DesignOptions with_smoothness_applied(DesignOptions options);

/// @throw InputError naming option, value and rule if an option breaks its rule on its own or
///        against the picture, or the picture is all black.
void validate(const DesignOptions& options, const Image& target);

/// The shape of a source from its picture, averaged to at most kMaxShapeSide pixels per side.
/// @throw InputError if it is all black.
SourceShape shape_of(const Image& picture);

/// What `--lamp` may be, for help.
inline constexpr const char* kLampWords = "sun|led:3mm@600mm|torch|laser:532nm|projector|FILE:...";

/// Sets source, its size or angle and, for a laser, the wavelength, to those of a lamp:
/// - "sun": parallel light of 9.3 mrad;
/// - "led", "led:3mm@600mm": a flat disc of that diameter, that far in front of the lens's middle;
/// - "torch": that of a telephone, 2 mm at 1 m; "projector": its lens, 12 mm at 2 m;
/// - "laser", "laser:532nm": a widened beam, parallel light of one wavelength;
/// - "FILE:3mm@600mm", "FILE:9.3mrad": a picture of the lamp, as wide as that.
/// @throw InputError naming option, text and rule.
void set_lamp(LightOptions& light, const std::string& text);

/// Puts the lamp of the options before a finished lens; a parallel one shines straight on a lens,
/// and from where light came so far on a mirror.
/// @throw InputError naming `--lamp` if a mirror was made for a point source and the lamp is none,
///        or the other way round.
void put_lamp(const LightOptions& light, OpticalSetup& setup);

/// Sets index and Abbe number to those of a material (material_named()), if it names one: the index
/// at 587.56 nm, or at the wavelength of `light` if its lamp is a laser.
/// @throw InputError naming option, text and rule.
void set_material(const std::string& text, const LightOptions& light, double& ior, double& abbe);

/// A lamp and a material that a finished lens is seen with instead of its own.
struct OtherLight {
  LightOptions light;    ///< Of `--lamp`; without one the lens's own stays.
  std::string material;  ///< As typed; empty: the lens's own.

  [[nodiscard]] bool none() const { return light.lamp.empty() && material.empty(); }
};

/// @throw InputError as put_lamp() and set_material() do.
void put_light(const OtherLight& other, OpticalSetup& setup);

/// Reads the shape of a source from LightOptions::source_picture, if there is one.
/// @return what was changed in the picture. @throw InputError; Interrupted.
std::vector<std::string> read_lamp(LightOptions& light, const Background& background,
                                   const RunControl& control);

/// Reads the height map of `--front FILE`. @throw InputError naming the file and its fault, or the
/// option if there is no such file.
std::shared_ptr<const HeightSpline> front_from(const std::string& file, const RunControl& control);

/// The optical setup that the options describe, for a working picture of `pixels`. The picture's
/// centre is the point where the light from the middle of a flat surface at height `thickness`
/// meets z = focal_length, moved by image_offset. @pre require_light().
OpticalSetup optical_setup(const DesignOptions& options, const Eigen::Vector2i& pixels);

/// True if a design's last steps follow waves: as asked, or with kAuto for a spline where
/// waves_show().
bool follows_waves(const DesignOptions& options, const OpticalSetup& setup);

/// The waves of a design.
WaveOptions wave_options(const DesignOptions& options, const OpticalSetup& setup);

/// The least distance between two screens, as a share of that from z = 0 to the nearer: with less
/// the light that leaves the lens would have to cross over on its way to the second.
inline constexpr double kLeastScreenGap = 0.5;

/// @throw InputError naming option, value and rule if the second picture does not fit the first or
///        its screen the lens, or another option cannot be had with two free faces.
/// @pre the other options are valid.
void require_second(const DesignOptions& options, const Image& target);

/// Width of the picture on the screen, mm: as stated, or the lens's.
inline double picture_width(const DesignOptions& options) {
  return options.light.image_width > 0.0 ? options.light.image_width : options.width;
}

/// Extent of the options' source.
SourceExtent source_extent(const LightOptions& light);

/// The place of a point source before a lens of this size, mm; none if none is stated.
std::optional<Eigen::Vector3d> place_of_source(const LightOptions& light,
                                               const Eigen::Vector2d& size);

/// The same setup with the picture's centre moved along that light to another z.
OpticalSetup at_focal_length(OpticalSetup setup, double focal_length, double thickness);

/// @throw InputError naming option, value and rule if the source is on the wrong side of the
///        surface, an option does not belong to this kind of light, or the screen is not beyond the
///        surface.
void require_light(const DesignOptions& options, const Eigen::Vector2i& pixels);

/// Minimum share of the lens's rectangle that an outline covers: below it nearly the whole mesh is
/// dark.
inline constexpr double kMinOutlineShare = 0.05;

/// Pixels of the longer side at which an SVG file is drawn to find its outline.
inline constexpr int kOutlineDrawing = 2048;

/// Maximum distance of a simplified outline from the original, pixels.
inline constexpr double kOutlineTolerance = 0.1;

/// The edge between the light and the dark part of a picture as one closed polygon: the line where
/// its display-encoded values, interpolated linearly between the pixels' centres, pass one half.
/// Outside of the picture is dark. Simplified by Douglas and Peucker's method, within
/// kOutlineTolerance.
/// @return corners in pixels, y upwards. @throw InputError naming `what` if nothing is light, or
///         the light has holes or several pieces.
std::vector<Eigen::Vector2d> contour_of(const Image& picture, const std::string& what);

/// The requested outline, and the changes made to its picture, in plain words.
struct OutlineChoice {
  std::optional<Outline> outline;
  std::vector<std::string> changes;
};

/// Reads `--outline`: rectangle (none), circle, rounded:R, or the name of a picture or SVG file in
/// which the lens is white, seen from +z.
/// @param background  shown where the picture is transparent.
/// @throw InputError naming option, value and rule; Interrupted.
OutlineChoice outline_from(const std::string& text, const Background& background,
                           const RunControl& control);

/// Fits an outline of DesignOptions into a lens of this size. @pre require_outline() passed.
Outline fitted(const Outline& outline, const Eigen::Vector2d& lens_size);

/// @throw InputError naming option, value and rule if an outline does not fit a lens of this size.
void require_outline(const std::optional<Outline>& outline, const Eigen::Vector2d& lens_size);

/// Every option of a design except light and weights, in the order in which a fingerprint stores
/// them.
void describe(Description& d, DesignOptions& o);

/// Options of light and screen. A fingerprint stores only those that differ from the default.
void describe(Description& d, LightOptions& o);

/// Options of a second picture and its screen.
void describe(Description& d, SecondOptions& o);

/// The weights, stored like a design's other options.
void describe(Description& d, ObjectiveWeights& w);

void describe(Description& d, OtherLight& o);

/// Options of a rendering.
struct RenderOptions {
  SurfaceModel model = SurfaceModel::kFacet;
  OpticalSetup setup;         ///< With a spectrum the picture is in colour.
  LightOptions light = {};    ///< Of --lamp, for put_lamp().
  std::string material = {};  ///< As typed; its meaning is in the setup.
};

/// Every option of a rendering, to be set in this order: setting the picture's width keeps its
/// proportions and centre, setting its pixels keeps the proportions.
void describe(Description& d, RenderOptions& o);

}  // namespace lensforge

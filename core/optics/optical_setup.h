// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/optics/front.h"
#include "core/optics/outline.h"

namespace lensforge {

class Description;

/// Range of Abbe numbers of optical materials, from dense flint to fluorite, with a margin.
inline constexpr double kMinAbbe = 10.0;
inline constexpr double kMaxAbbe = 200.0;

/// Fraunhofer's lines, nm, by which index and Abbe number are stated.
inline constexpr double kLineF = 486.13;
inline constexpr double kLineD = 587.56;
inline constexpr double kLineC = 656.27;

/// A material's refractive index by wavelength. Acrylic has an Abbe number of about 57.
struct Dispersion {
  double n_d = 1.49;   ///< At the helium line d, 587.56 nm.
  double abbe = 57.0;  ///< (n_d − 1) / (n_F − n_C), > 0.

  /// n(λ) = A + B / λ² (Cauchy) through n_d with this Abbe number; λ in nm. For acrylic the error
  /// is at most 0.001 from 400 to 700 nm.
  [[nodiscard]] double index_at(double wavelength) const;
};

/// Minimum and maximum number of wavelengths.
inline constexpr int kMinWavelengths = 1;
inline constexpr int kMaxWavelengths = 5;

/// Light of several wavelengths, and the dispersion of the lens's material.
struct Spectrum {
  std::vector<double> wavelengths;  ///< nm, ascending; none: all light has the setup's index.
  std::vector<double> powers;       ///< Source's power at each, in any unit; none: all equal.
  double abbe = 57.0;               ///< Abbe number of the material; acrylic's.

  [[nodiscard]] bool none() const { return wavelengths.empty(); }
  /// Each wavelength's share of the brightness, power × V(λ), normalised to sum 1.
  [[nodiscard]] std::vector<double> shares() const;

  friend bool operator==(const Spectrum&, const Spectrum&) = default;
};

/// Wavelengths in nm from "450,550,650", with the source's powers from "450:0.6,550:1,650:0.8".
/// @param name  the option's name, for the message.
/// @throw InputError unless there are 1 to 5 ascending wavelengths from 380 to 780, all with powers
///        above 0 or all without.
Spectrum parse_spectrum(const std::string& text, const std::string& name);

/// The text from which parse_spectrum() reads the same wavelengths and powers; "" for none.
std::string spectrum_text(const Spectrum& spectrum);

void describe(Description& d, Spectrum& spectrum);

/// True if parse_spectrum() would accept it and the Abbe number is one of a material.
bool is_valid(const Spectrum& spectrum);

/// Distribution of an extended source's light: rows of pixels from the top, seen from the lens with
/// the lens's y up. Empty: an evenly lit disc.
struct SourceShape {
  int columns = 0;
  int rows = 0;
  std::vector<double> weights;  ///< ≥ 0, not all 0.

  [[nodiscard]] bool is_disc() const { return weights.empty(); }

  friend bool operator==(const SourceShape&, const SourceShape&) = default;
};

/// Maximum number of pixels on a shape's longer side: each is a separate beam in an exact
/// rendering.
inline constexpr int kMaxShapeSide = 16;

/// Size of a source. A point, or parallel light of one direction, has width 0.
struct SourceExtent {
  double width =
      0.0;  ///< Diameter of a disc or width of a shape: rad for parallel light, mm for a point.
  SourceShape shape;

  [[nodiscard]] bool none() const { return width == 0.0; }

  friend bool operator==(const SourceExtent&, const SourceExtent&) = default;
};

/// The viewer's side: the lens's side of an opaque wall, or behind a translucent screen.
enum class ViewSide { kFront, kRear };

std::vector<std::pair<std::string, ViewSide>> named_views();

/// Intensity of a point source by direction: constant, or proportional to the cosine of the angle
/// to the line from the source to the middle of the lens (a flat LED).
enum class Emission { kIsotropic, kLambertian };

std::vector<std::pair<std::string, Emission>> named_emissions();

// Kinds of lamps and of parts. Fields, rules and words of each are here and in optical_setup.cpp.
// Other files ask for a property or visit all kinds, so the compiler names the places that a
// further kind must fill.

struct LampTraits {
  const char* type;        ///< In lens.json.
  const char* name;        ///< On pages.
  const char* width_key;   ///< Of a source's width in lens.json.
  const char* width_unit;  ///< "mm"
  double unit;             ///< rad or mm
};

struct ParallelLight {
  static constexpr LampTraits kTraits{"parallel", "parallel light", "angle_mrad", "mrad", 1e-3};

  /// Unit vector before the surface: upwards for a lens, downwards for a mirror.
  Eigen::Vector3d direction{0.0, 0.0, 1.0};

  // Every kind of lamp has these four functions.
  /// Place of the lamp, mm; none if it is at infinity.
  [[nodiscard]] std::optional<Eigen::Vector3d> place() const { return std::nullopt; }
  /// Place of the lamp, or if at infinity the point of the ray to p that is `away` mm before p.
  [[nodiscard]] Eigen::Vector3d before(const Eigen::Vector3d& p, double away) const {
    return p - away * direction;
  }
  /// True if the light comes from above `height`, or if not `above` from below 0.
  [[nodiscard]] bool comes_from(bool above, double /*height*/) const {
    return above ? direction.z() < 0.0 : direction.z() > 0.0;
  }
  /// The same lamp after a rotation about a point.
  [[nodiscard]] ParallelLight turned(const Eigen::Matrix3d& turn, const Eigen::Vector3d&) const {
    return {(turn * direction).normalized()};
  }

  friend bool operator==(const ParallelLight&, const ParallelLight&) = default;
};

struct PointSource {
  static constexpr LampTraits kTraits{"point", "a point source", "size_mm", "mm", 1.0};

  /// mm; z < 0 for a lens, above the surface for a mirror.
  Eigen::Vector3d position{0.0, 0.0, 0.0};
  Emission emission = Emission::kIsotropic;

  [[nodiscard]] std::optional<Eigen::Vector3d> place() const { return position; }
  [[nodiscard]] Eigen::Vector3d before(const Eigen::Vector3d&, double) const { return position; }
  [[nodiscard]] bool comes_from(bool above, double height) const {
    return above ? position.z() > height : position.z() < 0.0;
  }
  [[nodiscard]] PointSource turned(const Eigen::Matrix3d& turn,
                                   const Eigen::Vector3d& centre) const {
    return {centre + turn * (position - centre), emission};
  }

  friend bool operator==(const PointSource&, const PointSource&) = default;
};

using Lamp = std::variant<ParallelLight, PointSource>;

void describe(Description& d, ParallelLight& lamp);
void describe(Description& d, PointSource& lamp);

const LampTraits& traits(const Lamp& lamp);
std::optional<Eigen::Vector3d> lamp_place(const Lamp& lamp);
Eigen::Vector3d lamp_before(const Lamp& lamp, const Eigen::Vector3d& p, double away);

struct BodyTraits {
  const char* mode;     ///< In lens.json and for --mode.
  const char* name;     ///< On pages and in messages.
  const char* help;     ///< Of --mode.
  bool transmits;       ///< Light passes the material. Only then are there fronts, colours, losses.
  bool reflects;        ///< The surface reflects the light.
  bool lit_from_above;  ///< By a lamp on the screen's side.
};

/// The surface is the exit face of a lens, with the entry face below it.
struct LensBody {
  static constexpr BodyTraits kTraits{"refract", "lens", "a lens", true, false, false};
  friend bool operator==(const LensBody&, const LensBody&) = default;
};

/// The surface is a mirror.
struct MirrorBody {
  static constexpr BodyTraits kTraits{"reflect", "mirror", "a mirror that is lit from above",
                                      false,     true,     true};
  friend bool operator==(const MirrorBody&, const MirrorBody&) = default;
};

using Body = std::variant<LensBody, MirrorBody>;

const BodyTraits& traits(const Body& body);
/// Every kind by its word.
std::vector<std::pair<std::string, Body>> named_bodies();

/// The place of another picture of the same light, with as many pixels, seen from the same side.
/// Fields as those of OpticalSetup.
struct SecondScreen {
  double focal_length = 0.0;
  Eigen::Vector2d image_size{0.0, 0.0};
  Eigen::Vector2d image_origin{0.0, 0.0};
  Eigen::Vector3d screen_x{1.0, 0.0, 0.0};
  Eigen::Vector3d screen_y{0.0, 1.0, 0.0};

  friend bool operator==(const SecondScreen&, const SecondScreen&) = default;
};

/// Everything between the lamp and the wall except the surface itself. Millimetres, lens frame.
/// LightPath derives the rays from it.
///
/// The picture lies on the screen, a plane through its centre: image_origin + image_size / 2 in x
/// and y, focal_length in z. screen_x and screen_y give its rotation about that point. Unturned,
/// the screen is the plane z = focal_length, and image_origin the picture's corner of least x and
/// y.
struct OpticalSetup {
  // The fields of parts that transmit light are not members of their kinds: each of those has the
  // same ones, and a mirror's lens.json states an index.
  Body body;
  Lamp lamp;
  /// Entry face of a lens; none: the plane z = 0.
  std::optional<Front> front;
  SourceExtent extent;  ///< Of any lamp; LightPath treats it as a point.
  Spectrum spectrum;    ///< Light through a lens; LightPath uses ior for all of it.
  /// True: light that a lens's faces reflect is missing behind them; steeper faces transmit less.
  bool fresnel = false;
  double ior = 1.49;                        ///< Refractive index of the lens against air, > 1.
  double focal_length = 300.0;              ///< z of the picture's centre, mm; above the surface.
  Eigen::Vector2d lens_size{100.0, 100.0};  ///< mm
  /// Light passes only inside it; none: the whole rectangle of lens_size.
  std::optional<Outline> outline;
  Eigen::Vector2d image_size{100.0, 100.0};  ///< mm, on the screen
  Eigen::Vector2d image_origin{0.0, 0.0};    ///< mm
  Eigen::Vector3d screen_x{1.0, 0.0, 0.0};   ///< Unit vector on the screen; x if unturned.
  Eigen::Vector3d screen_y{0.0, 1.0, 0.0};   ///< The same for y; perpendicular to screen_x.
  Eigen::Vector2i pixels{256, 256};          ///< columns, rows of the working picture
  ViewSide view = ViewSide::kFront;
  std::optional<SecondScreen> second;  ///< Of a lens for two pictures.

  [[nodiscard]] bool screen_is_turned() const {
    return screen_x != Eigen::Vector3d::UnitX() || screen_y != Eigen::Vector3d::UnitY();
  }
  [[nodiscard]] Eigen::Vector3d screen_centre() const {
    return {image_origin.x() + 0.5 * image_size.x(), image_origin.y() + 0.5 * image_size.y(),
            focal_length};
  }

  friend bool operator==(const OpticalSetup&, const OpticalSetup&) = default;
};

/// The light for pages: "parallel, straight onto the flat face", "point source at x 1, y 2, z −30
/// mm", and the width of the lamp.
std::string lamp_words(const OpticalSetup& setup);
/// A place for pages: "x 1, y 2, z 3 mm".
std::string place_words(const Eigen::Vector3d& p);

/// @throw InputError naming the field, its value and the rule, unless ior > 1, all sizes, the focal
///        length and the pixel counts are positive, the light comes from the right side, the
///        screen's vectors are of length 1, at a right angle and turn it by less than a right
///        angle, a spherical front's radius is longer than half of the lens's diagonal, a height
///        map spans the lens's rectangle, an outline is one closed line inside that rectangle, and
///        everything is finite.
void validate(const OpticalSetup& setup);

/// The same setup with its second screen in place of the first, and no other. @pre setup.second.
OpticalSetup on_second_screen(OpticalSetup setup);

/// The setup for light of one wavelength; setup.ior is taken as the index at the d line.
OpticalSetup in_color(OpticalSetup setup, double wavelength);

/// The setup for one wavelength, and that wavelength's share of the brightness.
struct LightColor {
  OpticalSetup setup;
  double share;
};

/// The colours of a setup, shortest wavelength (bent most) first. A setup without a spectrum has
/// one colour: itself.
std::vector<LightColor> light_colors(const OpticalSetup& setup);

/// What a picture is computed of.
enum class LightModel {
  kAuto,  ///< Waves where they show: waves_show().
  kRays,
  kWaves,
};

/// mm per nm, the unit of wavelengths in options and files.
inline constexpr double kMmPerNm = 1e-6;

/// Wavelength of light that states none, mm; white light is as this.
inline constexpr double kMiddleWavelength = 550.0 * kMmPerNm;

/// Light as a scalar wave.
struct WaveOptions {
  double wavelength = kMiddleWavelength;  ///< In air, mm, > 0; of a setup without a spectrum.
  /// Angles along x and y within which the surfaces scatter beside their rays, rad: λ / pitch
  /// across a tool's rows.
  Eigen::Vector2d scatter{0.0, 0.0};
  /// Side of the tiles into which the lens is divided, and width over which neighbours overlap, in
  /// lengths over which waves interfere: λ f / pixel, at least √(λ f). With 0 the lens is one
  /// piece.
  double tile = 24.0;
  double overlap = 8.0;
  /// Pixels by which light may stray where a screen is tilted against its tile; beyond, a tile's
  /// light is found on several planes.
  double stray = 0.25;
};

/// What blurs a picture, and by how much.
struct PictureBlur {
  std::string cause;    ///< "lamp", "diffraction", "polish" or "pitch".
  double pixels = 0.0;  ///< Width of a point's light on the wall, about its full width at half.
};

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "cam/cam.h"
#include "cam/milled/ball_sweep.h"
#include "cam/path/finish_raster.h"
#include "cam/plan/cut_plan.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"

/// A workshop, a lamp, a wall and a camera that do not exist, for tests of `check`. Parts are made
/// by cam's chain (MilledField, PolishedField, render_field()) from planned rows, as in its fit, so
/// that errors of the chain itself do not show. Lamps are sums of points here, a convolution there;
/// haze and the camera, a pinhole with Brown's distortion, share nothing with the fit.
namespace lensforge::virtual_wall {

/// A lens of 4 mm whose picture has no symmetry: waves that gather light up to about twice.
Lens wavy_lens();

/// What is wrong. All 0: nothing.
struct Fault {
  double distance = 0.0;     ///< Of the wall, a share.
  double tilt_x = 0.0;       ///< Of the wall about the picture's x axis, rad.
  double tilt_y = 0.0;       ///< rad
  double part_tilt_x = 0.0;  ///< Of the part about its x axis, rad.
  double part_tilt_y = 0.0;  ///< rad
  double lamp = 0.0;         ///< Of the lamp's width, a share.
  double vergence = 0.0;     ///< Of parallel light: focal length over the lamp's distance.
  double index = 0.0;        ///< Of the index.
  double sigma = 0.0;        ///< Of the polish's σ, a share.
  double ball = 0.0;         ///< Of the ball's radius, a share.
  double pitch_error = 0.0;  ///< Across the rows, a share.
  double backlash = 0.0;     ///< Between rows to and fro, mm.
  double haze = 0.0;         ///< Share of the light that is scattered, 25 mrad wide.
};

inline constexpr int kFine = 8;  ///< Pixels of the wall per pixel of the picture.

/// Irradiance of a part of the wall around the picture; 1: all light evenly on the picture.
struct WallLight {
  Image light;
  Eigen::Vector2d size{0.0, 0.0};  ///< mm; the picture is in its middle.

  /// A sheet on the wall.
  struct Sheet {
    Image light;             ///< Share of light that it reflects, as a share of the wall's.
    Eigen::Vector2d size;    ///< mm
    Eigen::Vector2d middle;  ///< From the picture's, to the right and down, mm.
    double turn = 0.0;       ///< Clockwise, rad.
  };
  std::vector<Sheet> sheets = {};
};

/// A printed chart: the drawing in a file. @param bar  length of its bar on the wall, mm.
WallLight::Sheet printed_chart(const std::filesystem::path& drawing, double bar,
                               const Eigen::Vector2d& middle, double turn = 0.0);

/// A lamp that is no disc.
struct DrawnLamp {
  Image light;         ///< As seen from the lens, its y up; square.
  double width = 0.0;  ///< Full angle, rad; of a lamp with a place mm.
};

/// The default workshop, its pictures by such light.
CamOptions light_by(LightModel model);

/// Cuts a lens once and shows what parts with faults project.
class Workshop {
 public:
  /// @param lens  must outlive this. @param options  kWaves for their light: by waves, else by
  /// rays.
  Workshop(const Lens& lens, const CamOptions& options, const Executor& executor);

  [[nodiscard]] WallLight light(const Fault& fault) const;
  /// In the light of another lamp than the lens's.
  [[nodiscard]] WallLight light(const Fault& fault, const DrawnLamp& lamp) const;

 private:
  /// A place on the lamp as seen from the lens, to the right and up, and its share of the light.
  struct LampPoint {
    Eigen::Vector2d at{0.0, 0.0};  ///< rad or mm
    double share = 0.0;
  };
  /// @param spread  standard deviation along an axis of the Gaussian that each point stands for.
  [[nodiscard]] WallLight lit_by(const std::vector<LampPoint>& points, double spread,
                                 const Fault& fault) const;
  [[nodiscard]] static std::vector<LampPoint> disc_points(double diameter);
  [[nodiscard]] std::vector<BallPath> paths(const Fault& fault) const;

  const Lens& lens_;
  CamOptions options_;
  Executor executor_;
  CutSetup setup_;
  std::vector<std::pair<double, std::vector<RasterRow>>> rows_;  ///< By the ball's radius.
};

/// The image that a pinhole throws of a lamp on a dark wall, twice as wide as it.
/// @param lamp  with an angle. @param distance  from hole to wall, mm. @param diameter  mm
WallLight pinhole_light(const DrawnLamp& lamp, double distance, double diameter);

/// A camera before the wall.
struct Camera {
  int columns = 264;
  int rows = 198;
  double focal = 1.2;             ///< In widths of the photograph.
  double yaw = 0.0;               ///< From the wall's normal, rad.
  double pitch = 0.0;             ///< rad
  double roll = 0.0;              ///< rad
  double away = 2.2;              ///< Distance, in widths of the picture.
  Eigen::Vector2d aim{0.0, 0.0};  ///< Place that it looks at, in widths from the picture's middle.
  double k1 = 0.0;                ///< Distortion by radius in half widths (Brown).
  double k2 = 0.0;
  double vignetting = 0.0;  ///< Share of light that is missing in the corners.
  double white = 0.85;    ///< Display value of the brightest light but for 0.1 %; above 1 it clips.
  double ambient = 0.0;   ///< Light of the room, a share of white.
  double slope = 0.0;     ///< Of that across the photograph, a share of it.
  double well = 20000.0;  ///< Photons of white.
  int jpeg = 92;          ///< Quality; 0: none.
  std::uint64_t seed = 1;
};

/// A photograph with 8 bits a pixel, decoded: linear light, 1 is white.
/// @param lit  false: the lamp is off.
Image photograph(const WallLight& wall, const Eigen::Vector2d& picture, const Camera& camera,
                 bool lit = true);

/// A camera of everyday, by number.
Camera any_camera(std::uint64_t seed);

}  // namespace lensforge::virtual_wall

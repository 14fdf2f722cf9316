// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_field.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Light as a scalar wave.
struct WaveOptions {
  double wavelength = 550e-6;  ///< In air, mm, > 0; of a setup without a spectrum.
  /// Angle within which the surfaces scatter beside their rays, rad: λ / pitch for a tool's marks.
  double scatter = 0.0;
  /// Side of the tiles into which the lens is divided, and width over which neighbours overlap, in
  /// lengths over which waves interfere: λ f / pixel, at least √(λ f). With 0 the lens is one
  /// piece.
  double tile = 24.0;
  double overlap = 8.0;
};

/// The grid on which waves follow a surface's rays: a quarter of the length over which it bends
/// apart, which is the mean knot cell of a spline, the mean side of other surfaces' triangles.
GridWindow wave_grid(const OpticalSetup& setup, const OpticalSurface& surface);

/// Light that each of several surfaces of one lens sends to every pixel of `setup`, as shares of
/// its whole, by scalar waves; row by row from the top. An extended source is many points whose
/// light does not interfere: its picture is blurred, as by rays (source_kernel()). A spectrum's is
/// the sum of its wavelengths'.
///
/// The lens is divided into tiles with windows whose squares sum to 1. The rays of each are traced
/// through its surface to a plane at its mean height, exactly; where they fold above the surface
/// every branch adds its field with its own optical path, and −π/2 beyond a fold. The field without
/// the phase of the mean ray, amplitude √(light per area), goes to the screen by the angular
/// spectrum along that ray (Goodman, Introduction to Fourier Optics, section 3.10), and the tiles'
/// intensities are added. Waves of points farther apart than about λ f / pixel do not interfere in
/// a pixel's mean, so windows that overlap more than that change nothing but the speed;
/// WavePicture.* bound the error against one piece by 2e-4 MAE.
///
/// Tiles are sampled one after the other, each from all surfaces in order, so that surfaces made
/// from one another can share samples (HeldField). Same bits for any number of threads.
/// @param grid      nodes over the whole lens from which rays are traced; between them a surface is
///                  the cubic of its heights and slopes.
/// @param surfaces  without creases.
/// @throw Interrupted.
std::vector<std::vector<double>> wave_flux(const OpticalSetup& setup, const GridWindow& grid,
                                           std::span<const SurfaceField* const> surfaces,
                                           const WaveOptions& options, const Executor& executor,
                                           const RunControl& control);

/// Wavelength to which most of a setup's brightness is near, mm: the middle one of its spectrum.
/// @param otherwise  mm, for a setup without one.
double middle_wavelength(const OpticalSetup& setup, double otherwise = WaveOptions{}.wavelength);

/// Blurs of the light itself, that no surface escapes: the lamp's image (source_blur()), and
/// √(λ f) for diffraction.
/// @param z  height of the surface, mm. @param wavelength  mm
std::vector<PictureBlur> light_blurs(const OpticalSetup& setup, double z, double wavelength);

/// √(λ f), mm on the wall.
double diffraction_width(const OpticalSetup& setup, double z, double wavelength);

/// The widest. @pre not empty.
const PictureBlur& widest(const std::vector<PictureBlur>& blurs);

/// "diffraction blurs 1.0 pixels, polish 0.4, pitch 0.1"; causes below kNoBlur pixels are left out.
std::string blur_words(const std::vector<PictureBlur>& blurs);
inline constexpr double kNoBlur = 0.05;

/// What makes a cause's blur smaller: "a nearer wall".
const char* blur_remedy(const std::string& cause);

// How a field goes from one plane to another, tile by tile.

/// A field on a plane z = const and its way to a parallel one.
struct FieldPlan {
  double wavelength = 550e-6;        ///< mm
  double distance = 0.0;             ///< Between the planes, mm, > 0.
  Eigen::Vector2d centre{0.0, 0.0};  ///< Of the first plane's nodes, mm.
  Eigen::Vector2d cosine{0.0, 0.0};  ///< Direction of the mean ray, along x and y.
  Eigen::Vector2d step{0.0, 0.0};    ///< Of the nodes, mm.
  int columns = 0, rows = 0;
  /// Components that go farther aside than this on their way are dropped, mm: they would come back
  /// on the other side of the nodes.
  Eigen::Vector2d reach{HUGE_VAL, HUGE_VAL};
  /// Points along x and y by which a node's cell is known to be lit: more than one where the field
  /// has a hard edge across that axis.
  Eigen::Vector2i points{1, 1};

  /// Column and row of the centre.
  [[nodiscard]] Eigen::Vector2i centre_node() const { return Eigen::Vector2i(columns, rows) / 2; }
  [[nodiscard]] Eigen::Vector2d middle() const { return centre_node().cast<double>(); }
  [[nodiscard]] Eigen::Vector2d slope() const {
    return cosine / std::sqrt(1.0 - cosine.squaredNorm());
  }
  /// Where the mean ray from the centre meets the other plane, mm.
  [[nodiscard]] Eigen::Vector2d far_centre() const { return centre + distance * slope(); }
};

/// The next size of 2, 3, 5 and 7 from `least` up, even: fast to transform.
int transform_size(double least);

/// Light of a rectangle of pixels.
struct PixelLight {
  Eigen::Vector2i first{0, 0};  ///< Column and row.
  int columns = 0, rows = 0;
  std::vector<double> light;  ///< Row by row.
  double whole = 0.0;         ///< All that the field has, on these pixels or not.
  /// Light that came as rays: pixels of the picture, row by row, and shares.
  std::vector<std::pair<int, double>> rays;
};

/// A scalar field without the phase of its mean ray, on as many nodes as its steepest rays ask for.
/// Phases are found in double precision, values kept in single: 1e-7 of the field.
class PlaneField {
 public:
  /// A ray on the plane.
  struct Vertex {
    Eigen::Vector2d place;   ///< mm
    Eigen::Vector2d cosine;  ///< Direction along x and y.
    double path = 0.0;       ///< Optical, mm.
    double amplitude = 0.0;  ///< √(light per mm²)
  };

  explicit PlaneField(const FieldPlan& plan);

  /// Adds the field of a triangle of neighbouring rays at the nodes of which a point is inside it,
  /// at the latest when the field is propagated or lay_rest() is called.
  /// The path is the quadratic through the vertices with their directions as slopes; a triangle
  /// that is turned over is beyond a fold, where the phase is π/2 less. Points on a common side of
  /// two triangles belong to one of them.
  void add(const std::array<Vertex, 3>& vertices);
  void lay_rest();

  /// Goes to the other plane by the angular spectrum: nodes are then around far_centre().
  void propagate();

  /// Light of the nodes on pixels, each spread evenly over its cell.
  /// @param centre  pixel coordinates of the plane's centre. @param by_mm  their derivatives.
  [[nodiscard]] PixelLight spread(const Eigen::Vector2d& centre, const Eigen::Matrix2d& by_mm,
                                  const Eigen::Vector2i& pixels) const;

  [[nodiscard]] const FieldPlan& plan() const { return plan_; }
  /// Node (i, j), (0, 0) the lowest.
  [[nodiscard]] const std::complex<float>& at(int i, int j) const {
    return values_[static_cast<std::size_t>(j) * static_cast<std::size_t>(plan_.columns) +
                   static_cast<std::size_t>(i)];
  }
  [[nodiscard]] std::complex<float>& at(int i, int j) {
    return values_[static_cast<std::size_t>(j) * static_cast<std::size_t>(plan_.columns) +
                   static_cast<std::size_t>(i)];
  }

 private:
  /// Nodes to lay at once.
  struct Pending {
    std::vector<std::size_t> node;
    std::vector<double> turns;  ///< Phase ÷ 2π.
    std::vector<float> amplitude;
  };

  FieldPlan plan_;
  std::vector<std::complex<float>> values_;
  Pending pending_;
};

}  // namespace lensforge

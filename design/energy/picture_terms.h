// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/host_device.h"
#include "core/compute/lanes.h"
#include "design/energy/objective_options.h"
#include "design/flux/flux_triangle.h"

namespace lensforge {

// Terms of the pixels.

/// A rendered picture compared with its target, both display-encoded, row by row from the top.
struct PictureError {
  int columns = 0;
  int rows = 0;
  const double* error = nullptr;  ///< g − g̃ per pixel, in the memory of the executor.

  [[nodiscard]] std::int64_t count() const { return static_cast<std::int64_t>(columns) * rows; }
};

/// One pixel of E_img: adds weight × its derivative, returns its value.
struct ImageTermPixel {
  PictureError picture;
  double weight;
  double* g_bar;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    const double e = picture.error[i];
    g_bar[i] += 2.0 * weight * e;
    return {e * e};
  }
};

/// E_img = Σ (g − g̃)² (Sun et al., Eq. 5). Adds weight × ∂E/∂g to `g_bar`, `.get()[0]` is E.
template <class Exec>
auto image_term(const Exec& executor, const PictureError& picture, double weight,
                std::span<double> g_bar) {
  return pending_sum<1>(executor, "image term", picture.count(),
                        ImageTermPixel{picture, weight, g_bar.data()});
}

/// One pixel of E_grad: adds weight × its derivative, returns its share of the value. It gathers
/// all its differences and counts half of each square, so no two pixels write to the same place.
struct GradientTermPixel {
  PictureError picture;
  double weight;
  double* g_bar;

  LF_HD std::array<double, 1> operator()(std::int64_t i) const {
    const std::int64_t columns = picture.columns;
    const std::int64_t c = i % columns;
    const std::int64_t r = i / columns;
    const double e = picture.error[i];
    double value = 0.0;
    double slope = 0.0;
    const auto difference = [&](std::int64_t neighbour) {
      const double other = picture.error[neighbour];
      value += 0.5 * (e - other) * (e - other);
      slope += 2.0 * (e - other);
    };
    if (c > 0) difference(i - 1);
    if (c + 1 < columns) difference(i + 1);
    if (r > 0) difference(i - columns);
    if (r + 1 < picture.rows) difference(i + columns);
    g_bar[i] += weight * slope;
    return {value};
  }
};

/// E_grad = ‖G_x − G̃_x‖² + ‖G_y − G̃_y‖² with forward differences between neighbouring pixels
/// (Sun et al., Eq. 6). Adds weight × ∂E/∂g to `g_bar`, `.get()[0]` is E.
template <class Exec>
auto gradient_term(const Exec& executor, const PictureError& picture, double weight,
                   std::span<double> g_bar) {
  return pending_sum<1>(executor, "gradient term", picture.count(),
                        GradientTermPixel{picture, weight, g_bar.data()});
}

// Terms of one image triangle.

/// Vector from the nearest point of the picture rectangle [0, columns] × [0, rows] to u, pixels.
template <class T = double>
LF_HD LF_INLINE PlaneVector<T> excess_outside(const PlaneVector<T>& u, double columns,
                                              double rows) {
  const T none{};
  return {u.x() - clamped<T>(u.x(), none, none + columns),
          u.y() - clamped<T>(u.y(), none, none + rows)};
}

/// E_bdr of one image triangle, Σ_k ‖u_k − P_I(u_k)‖² over its corners (Sun et al., Eq. 7), in
/// square pixels. Adds weight × derivative to `bar`, returns the value.
template <class T = double>
LF_HD LF_INLINE T boundary_term(const ImageTriangleOf<T>& t, double columns, double rows,
                                double weight, ImageTriangleOf<T>& bar) {
  const PlaneVector<T> e0 = excess_outside<T>(t.p0, columns, rows);
  const PlaneVector<T> e1 = excess_outside<T>(t.p1, columns, rows);
  const PlaneVector<T> e2 = excess_outside<T>(t.p2, columns, rows);
  bar.p0 += 2.0 * weight * e0;
  bar.p1 += 2.0 * weight * e1;
  bar.p2 += 2.0 * weight * e2;
  return e0.dot(e0) + e1.dot(e1) + e2.dot(e2);
}

/// Marks a facet without an assigned pixel.
inline constexpr std::int32_t kNoPixel = -1;

/// A facet picture and its target.
struct LitPicture {
  int columns;
  int rows;
  std::span<const double> light;   ///< Linear, row by row from the top.
  std::span<const double> wanted;  ///< The same of the target.
};

/// Finds the pixels that get less than kMinLight of the light they want and assigns a facet to
/// each: the nearest one within kUnlitReach pixels that is not assigned yet, where a facet that is
/// alone in its pixel counts as one pixel farther. In dark areas, where one or two facets light a
/// pixel, such pixels cause most of a facet picture's error.
/// @param centroids  of the facets' images, pixel coordinates, 2 × F; those that are not finite are
///        ignored.
/// @return the assigned pixel of every facet, kNoPixel for most.
std::vector<std::int32_t> lead_to_unlit_pixels(const LitPicture& picture,
                                               const Eigen::Matrix2Xd& centroids);

/// The same for the faces that an executor holds: all of them, except with the executor of
/// design/mpi/.
template <class Exec>
std::vector<std::int32_t> lead_to_unlit_pixels(const Exec& /*executor*/, const LitPicture& picture,
                                               const Eigen::Matrix2Xd& centroids) {
  return lead_to_unlit_pixels(picture, centroids);
}

/// Distance from an unlit pixel's border at which its facet's centroid stops being pulled, pixels:
/// a facet that stops right at the border gives the pixel next to no light.
inline constexpr double kUnlitMargin = 0.25;

/// E_unlit of the facet that is assigned to an unlit pixel, g̃² d²: d is the distance of the
/// facet's centroid from the inner part of that pixel, in pixels, g̃ the wanted value. The pixel's
/// own error, g̃² while it is unlit, has no derivative because no edge passes through it; E_unlit
/// grows with the distance of the facet. It is not part of Sun et al. MAE after six rounds, 64²
/// city with 2.5 vertices per pixel side: 0.00090 without it, 0.00045 with it. Adds weight ×
/// derivative to `bar`, returns the value.
/// @param pixel  number of the pixel, row by row from the top of a picture of `columns`.
LF_HD inline double unlit_term(const ImageTriangle& t, std::int64_t pixel, std::int64_t columns,
                               double wanted, double weight, ImageTriangle& bar) {
  const std::int64_t row = pixel / columns;
  const std::int64_t column = pixel % columns;
  const Eigen::Vector2d inner(static_cast<double>(column) + kUnlitMargin,
                              static_cast<double>(row) + kUnlitMargin);
  const double side = 1.0 - 2.0 * kUnlitMargin;
  const Eigen::Vector2d offset = excess_outside((t.p0 + t.p1 + t.p2) / 3.0 - inner, side, side);
  const double stiffness = wanted * wanted;
  const Eigen::Vector2d corner_bar = (2.0 / 3.0 * weight * stiffness) * offset;
  bar.p0 += corner_bar;
  bar.p1 += corner_bar;
  bar.p2 += corner_bar;
  return stiffness * offset.squaredNorm();
}

struct CorrespondenceValues {
  double align = 0.0;  ///< Square pixels.
  double flux = 0.0;   ///< Squared flux, in units of the mean pixel's.
};

/// One face's share of E_align = ‖c' − c̃‖² and E_flux = (Φ − Φ^old)² (Sun et al., Eqs. 21 and 23).
/// Adds weights.align and weights.flux × the derivatives to `bar`.
/// @param pixels  number of pixels: the lens's flux is counted as that many, so Eq. 20's weights
///        mean the same at every resolution.
LF_HD inline CorrespondenceValues correspondence_term(const ImageTriangle& t,
                                                      const Eigen::Vector2d& wanted_centroid,
                                                      double wanted_flux, double pixels,
                                                      const ObjectiveWeights& weights,
                                                      ImageTriangle& bar) {
  const Eigen::Vector2d offset = (t.p0 + t.p1 + t.p2) / 3.0 - wanted_centroid;
  const double excess = pixels * (t.flux - wanted_flux);
  const Eigen::Vector2d corner_bar = (2.0 / 3.0 * weights.align) * offset;
  bar.p0 += corner_bar;
  bar.p1 += corner_bar;
  bar.p2 += corner_bar;
  bar.flux += 2.0 * weights.flux * pixels * excess;
  return {offset.squaredNorm(), excess * excess};
}

}  // namespace lensforge

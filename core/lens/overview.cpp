// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/overview.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/image/image_io.h"
#include "core/image/transfer.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/screen.h"

namespace lensforge {
namespace {

constexpr int kPanelSide = 512;       ///< Longer side of one panel, pixels.
constexpr int kGap = 8;               ///< Between panels, pixels.
constexpr int kReliefSamples = 2;     ///< Relief samples per pixel side.
constexpr int kSwellShare = 24;       ///< A swell is wider than this share of the longer side.
constexpr float kFlattening = 0.85F;  ///< Share of the swells that is taken away.
constexpr double kStretch = 0.01;     ///< Share of the relief that may clip at either end.

/// Brightness of a surface in raking light, to first order in its slopes; unscaled. The light comes
/// from the viewer's upper left.
double raking_light(const Eigen::Vector3d& normal, double toward_left) {
  return (toward_left * normal.x() + normal.y()) / normal.z();
}

/// A triangle in pixel coordinates, walked pixel centre by pixel centre.
struct PixelTriangle {
  Eigen::Vector2d a, b, c;

  [[nodiscard]] bool contains(const Eigen::Vector2d& p) const {
    const double u = side(a, b, p);
    const double v = side(b, c, p);
    const double w = side(c, a, p);
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
  }
  static double side(const Eigen::Vector2d& p, const Eigen::Vector2d& q, const Eigen::Vector2d& x) {
    const Eigen::Vector2d d = q - p;
    const Eigen::Vector2d e = x - p;
    return d.x() * e.y() - d.y() * e.x();
  }
};

void fill(Image& image, const PixelTriangle& t, float value) {
  const Eigen::Vector2d low = t.a.cwiseMin(t.b).cwiseMin(t.c);
  const Eigen::Vector2d high = t.a.cwiseMax(t.b).cwiseMax(t.c);
  const int c0 = std::max(0, static_cast<int>(std::floor(low.x() - 0.5)));
  const int c1 = std::min(image.columns() - 1, static_cast<int>(std::ceil(high.x() - 0.5)));
  const int r0 = std::max(0, static_cast<int>(std::floor(low.y() - 0.5)));
  const int r1 = std::min(image.rows() - 1, static_cast<int>(std::ceil(high.y() - 0.5)));
  for (int r = r0; r <= r1; ++r) {
    for (int c = c0; c <= c1; ++c) {
      if (t.contains({c + 0.5, r + 0.5})) image.at(c, r) = value;
    }
  }
}

/// The mean over a window of 2·radius + 1 pixels along one row or column, cut at the ends.
void blur_line(const float* values, float* means, int count, std::ptrdiff_t stride, int radius) {
  std::vector<double> sums(static_cast<std::size_t>(count) + 1, 0.0);
  for (int i = 0; i < count; ++i) {
    sums[static_cast<std::size_t>(i) + 1] = sums[static_cast<std::size_t>(i)] + values[i * stride];
  }
  for (int i = 0; i < count; ++i) {
    const int first = std::max(0, i - radius);
    const int last = std::min(count, i + radius + 1);
    const double sum = sums[static_cast<std::size_t>(last)] - sums[static_cast<std::size_t>(first)];
    means[i * stride] = static_cast<float>(sum / (last - first));
  }
}

Image blurred(const Image& image, int radius) {
  const int columns = image.columns();
  const int rows = image.rows();
  Image along_rows(columns, rows);
  for (int r = 0; r < rows; ++r) {
    const std::ptrdiff_t start = static_cast<std::ptrdiff_t>(r) * columns;
    blur_line(image.values().data() + start, along_rows.values().data() + start, columns, 1,
              radius);
  }
  Image means(columns, rows);
  for (int c = 0; c < columns; ++c) {
    blur_line(along_rows.values().data() + c, means.values().data() + c, rows, columns, radius);
  }
  return means;
}

/// Takes most of the broad swells away, under which the picture's own creases would not show.
void flatten_swells(Image& image) {
  const int radius = std::max(1, std::max(image.columns(), image.rows()) / kSwellShare);
  const Image swells = blurred(blurred(image, radius), radius);
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    image.values()[i] -= kFlattening * swells.values()[i];
  }
}

/// Maps the values, but for the clipped ends, onto display values 0 … 1; flat becomes mid-grey.
void stretch_contrast(Image& image) {
  std::vector<float> sorted(image.values().begin(), image.values().end());
  std::sort(sorted.begin(), sorted.end());
  const auto clipped = static_cast<std::size_t>(kStretch * static_cast<double>(sorted.size()));
  const double low = sorted[clipped];
  const double high = sorted[sorted.size() - 1 - clipped];
  const double range = high - low;
  for (float& value : image.values()) {
    const double shown = range > 0.0 ? std::clamp((value - low) / range, 0.0, 1.0) : 0.5;
    value = static_cast<float>(decode(shown));
  }
}

void paste(Image& page, const Image& panel, int column) {
  for (int r = 0; r < panel.rows(); ++r) {
    for (int c = 0; c < panel.columns(); ++c) page.at(column + c, r) = panel.at(c, r);
  }
}

/// The surface alone, linear light.
Image draw_relief(const SurfaceMesh& mesh, const OpticalSetup& setup, int columns, int rows) {
  OpticalSetup seen = setup;
  seen.image_origin = Eigen::Vector2d::Zero();
  seen.image_size = setup.lens_size;
  seen.pixels = {columns * kReliefSamples, rows * kReliefSamples};
  const ImagePlane plane(seen);
  const double toward_left = plane.pixels_per_mm().x() > 0.0 ? -1.0 : 1.0;
  Image image(seen.pixels.x(), seen.pixels.y());
  for (std::int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const Eigen::Vector3d a = mesh.corner(t, 0);
    const Eigen::Vector3d b = mesh.corner(t, 1);
    const Eigen::Vector3d c = mesh.corner(t, 2);
    const Eigen::Vector3d normal = area_normal(mesh, t);
    if (!(normal.z() > 0.0)) continue;
    const PixelTriangle shown{plane.to_pixels(a.head<2>()), plane.to_pixels(b.head<2>()),
                              plane.to_pixels(c.head<2>())};
    fill(image, shown, static_cast<float>(raking_light(normal, toward_left)));
  }
  flatten_swells(image);
  stretch_contrast(image);
  return resample(image, columns, rows);
}

}  // namespace

Image draw_overview(const Lens& lens, const std::vector<Image>& pictures) {
  const int longer = std::max(lens.target.columns(), lens.target.rows());
  const int columns = std::max(1, lens.target.columns() * kPanelSide / longer);
  const int rows = std::max(1, lens.target.rows() * kPanelSide / longer);
  std::vector<Image> panels = {resample(lens.target, columns, rows)};
  for (const Image& picture : pictures) panels.push_back(resample(picture, columns, rows));
  const bool shaped = lens.setup.outline.has_value();
  panels.push_back(draw_relief(shaped ? lens_part(lens, Executor::serial()).mesh : lens.surface,
                               lens.setup, columns, rows));
  const int count = static_cast<int>(panels.size());
  Image page(count * (columns + kGap) - kGap, rows, 1.0F);
  for (int i = 0; i < count; ++i) {
    paste(page, panels[static_cast<std::size_t>(i)], i * (columns + kGap));
  }
  return page;
}

}  // namespace lensforge

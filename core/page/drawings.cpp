// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/page/drawings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>
#include <variant>
#include <vector>

#include "core/compute/scalar.h"
#include "core/image/color.h"
#include "core/image/image_io.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"
#include "core/optics/screen.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kWidth = 760.0;      ///< Width of the drawing; all lengths are in its units.
constexpr double kViewMargin = 60.0;  ///< Around a view, for its labels.
constexpr double kTallest = 300.0;    ///< Maximum height of a view.
constexpr double kLine = 18.0;        ///< Line height of text.
/// Maximum extent of a drawing to scale, in diagonals of the part; beyond it the part is a dot.
constexpr double kLargestToScale = 20.0;

constexpr const char* kRay = "stroke=\"#c98a00\" stroke-width=\"1.5\"";
constexpr const char* kDistance = "stroke=\"#56616b\" stroke-dasharray=\"5 4\"";

std::string number(double value) { return trimmed_decimal(value, 1); }

/// Positions of all objects, mm in the lens frame.
struct Scene {
  explicit Scene(const OpticalSetup& setup, double part_height)
      : high(setup.lens_size.x(), setup.lens_size.y(), part_height),
        unit(high.norm()),
        middle(0.5 * setup.lens_size.x(), 0.5 * setup.lens_size.y(), part_height),
        centre(setup.screen_centre()),
        across(0.5 * setup.image_size.x() * setup.screen_x),
        upwards(0.5 * setup.image_size.y() * setup.screen_y),
        normal(setup.screen_x.cross(setup.screen_y)),
        lamp(lamp_before(setup.lamp, middle, 1.5 * unit)) {
    const double side = setup.view == ViewSide::kFront ? -1.0 : 1.0;
    eye = centre + 0.3 * (centre - middle).norm() * side * normal + 1.4 * upwards;
    double farthest = 0.0;
    for (const Vector3d& p :
         {lamp, eye, Vector3d(centre + across + upwards), Vector3d(centre - across - upwards)}) {
      farthest = std::max(farthest, (p - middle).norm());
    }
    to_scale = farthest <= kLargestToScale * unit;
  }

  /// Drawn position of a point relative to the part's middle. Its direction is kept; if the drawing
  /// is not to scale, its distance d is shown as asinh(d).
  [[nodiscard]] Vector3d shown(const Vector3d& p) const {
    Vector3d from = p - middle;
    const double d = from.norm() / unit;
    if (to_scale || d == 0.0) return from;
    return from * (std::asinh(d) / d);
  }

  /// A point offset along x or y by half the part's size.
  [[nodiscard]] Vector3d beside(const Vector3d& p, int axis, double side) const {
    return p + 0.5 * side * high[axis] * Vector3d::Unit(axis);
  }

  Vector3d low{0.0, 0.0, 0.0};
  Vector3d high;
  double unit;      ///< mm, the part's diagonal.
  Vector3d middle;  ///< Middle of the part's upper side.
  Vector3d centre;
  Vector3d across;  ///< From the picture's centre to its edges.
  Vector3d upwards;
  Vector3d normal;
  Vector3d lamp;  ///< For parallel light a point on its way.
  Vector3d eye;
  bool to_scale = true;
};

/// One view: z to the right, x or y up.
class View {
 public:
  View(const Scene& scene, int up) : scene_(scene), up_(up) {
    for (const Vector3d& p : {scene.low, scene.high, scene.lamp, scene.eye}) box_.extend(flat(p));
    for (const double a : {-1.0, 1.0}) {
      box_.extend(flat(scene.beside(scene.lamp, up, a)));
      for (const double b : {-1.0, 1.0}) box_.extend(flat(corner(a, b)));
    }
  }

  [[nodiscard]] double largest_scale() const {
    return std::min((kWidth - 2.0 * kViewMargin) / box_.sizes().x(), kTallest / box_.sizes().y());
  }
  void set(double scale, double top) {
    scale_ = scale;
    top_ = top + kViewMargin;
  }
  [[nodiscard]] double bottom() const {
    return top_ + scale_ * box_.sizes().y() + 0.6 * kViewMargin;
  }
  [[nodiscard]] int up() const { return up_; }

  /// A corner of the picture.
  [[nodiscard]] Vector3d corner(double a, double b) const {
    return scene_.centre + a * scene_.across + b * scene_.upwards;
  }
  [[nodiscard]] Vector2d at(const Vector3d& p) const {
    const Vector2d f = flat(p) - box_.min();
    return {kViewMargin + scale_ * f.x(), top_ + scale_ * (box_.sizes().y() - f.y())};
  }

 private:
  [[nodiscard]] Vector2d flat(const Vector3d& p) const {
    const Vector3d shown = scene_.shown(p);
    return {shown.z(), shown[up_]};
  }

  const Scene& scene_;
  int up_;  ///< 0: x, 1: y
  Eigen::AlignedBox2d box_;
  double scale_ = 1.0;
  double top_ = 0.0;
};

std::string pair(const Vector2d& p) {
  return decimal_text(p.x(), 1) + "," + decimal_text(p.y(), 1);
}

std::string line(const Vector2d& from, const Vector2d& to, const std::string& style) {
  return "<path d=\"M" + pair(from) + "L" + pair(to) + "\" fill=\"none\" " + style + "/>\n";
}

std::string words(const Vector2d& at, const std::string& text, const std::string& style = "") {
  return "<text x=\"" + decimal_text(at.x(), 1) + "\" y=\"" + decimal_text(at.y(), 1) + "\" " +
         style + ">" + text + "</text>\n";
}

std::string polygon(const std::vector<Vector2d>& corners, const std::string& style) {
  std::string points;
  for (const Vector2d& p : corners) points += pair(p) + " ";
  return "<polygon points=\"" + points + "\" " + style + "/>\n";
}

std::string dot(const Vector2d& at, double radius, const std::string& colour) {
  return "<circle cx=\"" + decimal_text(at.x(), 1) + "\" cy=\"" + decimal_text(at.y(), 1) +
         "\" r=\"" + decimal_text(radius, 0) + "\" fill=\"" + colour + "\"/>\n";
}

/// A dashed line with its true length below it, in the view that shows nearly all of it.
std::string distance(const View& view, const Vector3d& from, const Vector3d& to) {
  const Vector2d a = view.at(from);
  const Vector2d b = view.at(to);
  const Vector3d way = to - from;
  const bool foreshortened = std::hypot(way.z(), way[view.up()]) < 0.8 * way.norm();
  if (foreshortened || (b - a).norm() < 4.0 * kLine) return "";
  return line(a, b, kDistance) + words(0.6 * a + 0.4 * b + Vector2d(0.0, 15.0),
                                       number(way.norm()) + " mm", "text-anchor=\"middle\"");
}

std::string lamp(const OpticalSetup& setup, const Scene& scene, const View& view) {
  if (!lamp_place(setup.lamp)) {
    const Vector2d lowest = view.at(scene.beside(scene.lamp, view.up(), -1.0));
    return words(lowest + Vector2d(0.0, kLine), traits(setup.lamp).name, "text-anchor=\"middle\"");
  }
  const Vector2d at = view.at(scene.lamp);
  return distance(view, scene.lamp, scene.middle) + dot(at, 6.0, "#ffcf4d") +
         words(at + Vector2d(0.0, -12.0), "lamp", "text-anchor=\"middle\"");
}

/// Rays from the lamp through the part's edges and middle to the picture's.
std::string rays(const OpticalSetup& setup, const Scene& scene, const View& view) {
  std::string svg;
  for (const double side : {-1.0, 1.0}) {
    const Vector3d edge = scene.beside(scene.middle, view.up(), side);
    const Vector3d from =
        lamp_place(setup.lamp) ? scene.lamp : scene.beside(scene.lamp, view.up(), side);
    const Vector3d half = view.up() == 0 ? scene.across : scene.upwards;
    svg += line(view.at(from), view.at(edge), std::string(kRay) + " marker-end=\"url(#tip)\"") +
           line(view.at(edge), view.at(scene.centre + side * half), kRay);
  }
  return svg;
}

/// Section of a curved front through its middle, from below to above.
std::vector<Vector2d> front_line(const OpticalSetup& setup, const Scene& scene, const View& view) {
  const Front& shape = setup.front.value();
  const int parts = std::holds_alternative<HeightFront>(shape) ? 400 : 40;
  const FrontSurface front(shape);
  std::vector<Vector2d> line;
  for (int i = 0; i <= parts; ++i) {
    Vector3d p = scene.middle;
    p[view.up()] = scene.high[view.up()] * i / parts;
    p.z() = front.height(p.head<2>());
    line.push_back(view.at(p));
  }
  return line;
}

std::string part(const OpticalSetup& setup, const Scene& scene, const View& view) {
  const Vector2d a = view.at(scene.low);
  const Vector2d b = view.at(scene.high);
  const double back = std::min(a.x(), b.x() - 3.0);  // A thin part is drawn visibly thick.
  std::vector<Vector2d> outline{{back, a.y()}, {back, b.y()}};
  if (setup.front) outline = front_line(setup, scene, view);
  outline.insert(outline.end(), {b, {b.x(), a.y()}});
  return polygon(outline, "fill=\"#b9d3ea\" stroke=\"#0b5cad\" stroke-width=\"1.5\"") +
         words({b.x(), std::max(a.y(), b.y()) + kLine}, traits(setup.body).name,
               "text-anchor=\"middle\"");
}

std::string screen(const Scene& scene, const View& view) {
  const std::vector<Vector2d> corners{
      view.at(view.corner(-1.0, -1.0)), view.at(view.corner(1.0, -1.0)),
      view.at(view.corner(1.0, 1.0)), view.at(view.corner(-1.0, 1.0))};
  const auto lowest =
      std::max_element(corners.begin(), corners.end(),
                       [](const Vector2d& a, const Vector2d& b) { return a.y() < b.y(); });
  return polygon(corners,
                 "fill=\"#1a1f24\" fill-opacity=\"0.15\" stroke=\"#1a1f24\" stroke-width=\"3\" "
                 "stroke-linejoin=\"round\"") +
         words(*lowest + Vector2d(0.0, kLine), "screen", "text-anchor=\"middle\"") +
         distance(view, scene.middle, scene.centre);
}

std::string viewer(const Scene& scene, const View& view) {
  const Vector2d eye = view.at(scene.eye);
  const Vector2d way = view.at(scene.centre) - eye;
  return line(eye, eye + 0.5 * way, "stroke=\"#2b7a3d\" marker-end=\"url(#look)\"") +
         dot(eye, 5.0, "#2b7a3d") +
         words(eye + Vector2d(0.0, -10.0), "viewer", "text-anchor=\"middle\" fill=\"#2b7a3d\"");
}

std::string drawn(const OpticalSetup& setup, const Scene& scene, const View& view) {
  return rays(setup, scene, view) + part(setup, scene, view) + screen(scene, view) +
         lamp(setup, scene, view) + viewer(scene, view);
}

std::string front_words(const OpticalSetup& setup) {
  if (!setup.front) return "its flat face at z 0, towards the lamp";
  if (std::holds_alternative<HeightFront>(*setup.front)) {
    return "its front, a height map, towards the lamp";
  }
  const double radius = std::get<SphericalFront>(*setup.front).radius;
  return std::string(radius > 0.0 ? "its bulging" : "its hollow") + " front, of radius " +
         number(std::abs(radius)) + " mm, towards the lamp";
}

std::vector<std::string> description(const OpticalSetup& setup, const Scene& scene) {
  const double tilt = std::acos(std::clamp(scene.normal.z(), -1.0, 1.0)) / kDegree;
  return {capitalised(traits(setup.body).name) + ": " + number(setup.lens_size.x()) + " × " +
              number(setup.lens_size.y()) + " mm, its lower left corner at x 0, y 0, " +
              (setup.outline ? outline_words(*setup.outline) + ", " : "") +
              (traits(setup.body).transmits ? front_words(setup)
                                            : "its shaped side towards lamp and screen"),
          "Light: " + lamp_words(setup),
          "Picture: " + number(setup.image_size.x()) + " × " + number(setup.image_size.y()) +
              " mm, its centre at " + place_words(scene.centre),
          std::string("Screen: ") + (setup.screen_is_turned()
                                         ? "tilted by " + number(tilt) + "° from the part's plane"
                                         : "parallel to the part"),
          std::string("Viewer: ") + (setup.view == ViewSide::kFront
                                         ? "on the part's side of the screen"
                                         : "behind the screen, which lets light through"),
          scene.to_scale ? "Drawn to scale."
                         : "Not to scale: directions from the part are right, distances are not."};
}

/// A drawing of this height, with a text alternative.
std::string framed(const std::string& attributes, double height, const std::string& content) {
  const auto tip = [](const char* id, const char* colour) {
    return std::string("<marker id=\"") + id +
           "\" viewBox=\"0 -4 8 8\" refX=\"8\" markerWidth=\"8\" markerHeight=\"8\" "
           "orient=\"auto\"><path d=\"M0-4L8 0L0 4z\" fill=\"" +
           colour + "\"/></marker>";
  };
  const std::string size =
      "width=\"" + decimal_text(kWidth, 0) + "\" height=\"" + decimal_text(height, 0) + "\"";
  return "<svg " + attributes + size + " viewBox=\"0 0 " + decimal_text(kWidth, 0) + " " +
         decimal_text(height, 0) +
         "\" role=\"img\" aria-label=\"Lamp, part, screen and viewer\" "
         "font-family=\"sans-serif\" font-size=\"13\">\n<!-- " +
         program_mark() + " -->\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<defs>" +
         tip("tip", "#c98a00") + tip("look", "#2b7a3d") + "</defs>\n" + content + "</svg>\n";
}

std::string drawing(const std::string& attributes, const OpticalSetup& setup, double part_height) {
  const Scene scene(setup, part_height);
  std::array views{View(scene, 1), View(scene, 0)};
  const double scale = std::min(views[0].largest_scale(), views[1].largest_scale());
  views[0].set(scale, 0.0);
  views[1].set(scale, views[0].bottom());
  std::string svg;
  double y = kLine;
  for (const View& view : views) {
    svg += words({8.0, y},
                 view.up() == 1 ? "From the side: y up, z to the right"
                                : "From above: x up, z to the right",
                 "font-weight=\"bold\"") +
           drawn(setup, scene, view);
    y = view.bottom() + kLine;
  }
  for (const std::string& sentence : description(setup, scene)) {
    svg += words({8.0, y}, sentence);
    y += kLine;
  }
  return framed(attributes, y, svg);
}

}  // namespace

std::string light_drawing(const OpticalSetup& setup, double part_height) {
  return drawing("", setup, part_height);
}

std::string light_drawing_file(const OpticalSetup& setup, double part_height) {
  return drawing("xmlns=\"http://www.w3.org/2000/svg\" ", setup, part_height);
}

namespace {

constexpr double kPlotWidth = 900.0;
constexpr double kPlotHeight = 300.0;
constexpr double kPlotLeft = 70.0;
constexpr double kPlotMargin = 30.0;
constexpr std::array<std::string_view, 8> kColors{"#0b5cad", "#a3161a", "#1b6b36", "#7a4fa3",
                                                  "#a35a00", "#007a7a", "#5c5c5c", "#b0307a"};
/// Layout of the names in lines above the plot.
constexpr std::size_t kNamesPerLine = 4;
constexpr double kNameWidth = 190.0;
constexpr double kNameHeight = 18.0;
/// Lower values, such as 0, are drawn at this one.
constexpr double kFloor = 1e-12;

/// Maps seconds and values to drawing coordinates.
class Axes {
 public:
  explicit Axes(const std::vector<PlotCurve>& curves) {
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const PlotCurve& curve : curves) {
      for (const Eigen::Vector2d& point : curve.points) {
        seconds_ = std::max(seconds_, point.x());
        least = std::min(least, decade_of(point.y()));
        most = std::max(most, decade_of(point.y()));
      }
    }
    low_ = static_cast<int>(std::floor(least));
    high_ = std::max(low_ + 1, static_cast<int>(std::ceil(most)));
    const std::size_t lines = (curves.size() - 1) / kNamesPerLine;
    top_ += kNameHeight * static_cast<double>(lines);
  }

  [[nodiscard]] double seconds() const { return seconds_; }
  [[nodiscard]] int low() const { return low_; }
  [[nodiscard]] int high() const { return high_; }
  [[nodiscard]] double x(double seconds) const {
    return kPlotLeft + (kPlotWidth - kPlotLeft - kPlotMargin) * seconds / seconds_;
  }
  [[nodiscard]] double y(double decade) const {
    return kPlotHeight - kPlotMargin -
           (kPlotHeight - kPlotMargin - top_) * (decade - low_) / (high_ - low_);
  }
  [[nodiscard]] std::string drawn(const Eigen::Vector2d& point) const {
    return decimal_text(x(point.x()), 1) + "," + decimal_text(y(decade_of(point.y())), 1) + " ";
  }

 private:
  static double decade_of(double value) { return std::log10(std::max(std::abs(value), kFloor)); }

  double top_ = kPlotMargin;
  double seconds_ = 1e-3;
  int low_ = 0;
  int high_ = 1;
};

std::string plot_words(double x, double y, std::string_view attributes, std::string_view text) {
  return element(
      "text",
      joined({"x=\"", decimal_text(x, 1), "\" y=\"", decimal_text(y, 1), "\" ", attributes}),
      escape_html(text));
}

std::string decades(const Axes& axes) {
  std::string lines;
  for (int decade = axes.low(); decade <= axes.high(); ++decade) {
    const std::string y = decimal_text(axes.y(decade), 1);
    lines += joined({"<path d=\"M", decimal_text(kPlotLeft, 0), " ", y, "H",
                     decimal_text(kPlotWidth - kPlotMargin, 0), "\" stroke=\"#c9d0d6\"/>"});
    lines += plot_words(kPlotLeft - 8.0, axes.y(decade) + 4.0, "text-anchor=\"end\"",
                        "1e" + std::to_string(decade));
  }
  return lines;
}

/// The curves, each with its name.
std::string lines_of(const std::vector<PlotCurve>& curves, const Axes& axes) {
  std::string lines;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    std::string points;
    for (const Eigen::Vector2d& point : curves[i].points) points += axes.drawn(point);
    const std::string_view color = kColors[i % kColors.size()];
    lines += joined({"<polyline points=\"", points, "\" fill=\"none\" stroke-width=\"2\" stroke=\"",
                     color, "\"/>"});
    const std::size_t line = i / kNamesPerLine;
    lines += plot_words(kPlotLeft + kNameWidth * static_cast<double>(i % kNamesPerLine),
                        kPlotMargin - 10.0 + kNameHeight * static_cast<double>(line),
                        joined({"fill=\"", color, "\""}), curves[i].name);
  }
  return lines;
}

}  // namespace

std::string decade_plot(const std::vector<PlotCurve>& curves, std::string_view label) {
  std::size_t points = 0;
  for (const PlotCurve& curve : curves) points += curve.points.size();
  if (points < 2) return "";
  const Axes axes(curves);
  const std::string end = decimal_text(axes.seconds(), 1) + " s";
  return element(
      "svg",
      joined({"xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 ", decimal_text(kPlotWidth, 0),
              " ", decimal_text(kPlotHeight, 0), "\" role=\"img\" aria-label=\"",
              escape_html(label),
              "\" font-size=\"13\" font-family=\"Arial, sans-serif\" style=\"background:#fff\""}),
      decades(axes) + lines_of(curves, axes) + plot_words(kPlotLeft, kPlotHeight - 8.0, "", "0 s") +
          plot_words(kPlotWidth - kPlotMargin, kPlotHeight - 8.0, "text-anchor=\"end\"", end));
}

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

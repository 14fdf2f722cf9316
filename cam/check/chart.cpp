// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/chart.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "cam/check/wall_view.h"
#include "cam/coupon/coupon_fit.h"
#include "core/error.h"
#include "core/image/color.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/outline.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

constexpr int kCells = 4;                       ///< Of a mark's code, along each side.
constexpr double kMark = 0.4;                   ///< Side of a mark, bars.
constexpr double kCell = kMark / (kCells + 2);  ///< A black cell is around the code.

struct Mark {
  /// Its cells row by row from the upper left one, the first is bit 15; 1: white.
  std::uint16_t code;
  Eigen::Vector2d at;  ///< Its upper left corner, bars.
};

const std::array<Mark, 4>& marks() {
  static const std::array<Mark, 4> kMarks = {{{0xB532, {0.14, 0.14}},
                                              {0x0F9A, {0.94, 0.14}},
                                              {0x332D, {0.14, 1.56}},
                                              {0x9946, {0.94, 1.56}}}};
  return kMarks;
}

bool is_white(std::uint16_t code, int column, int row) {
  return ((code >> static_cast<unsigned>(15 - kCells * row - column)) & 1U) != 0;
}

void draw_mark(const Mark& mark, double bar, SvgWriter& svg) {
  const Eigen::Vector2d corner = bar * mark.at;
  const double cell = bar * kCell;
  svg.rectangle(corner, Eigen::Vector2d::Constant(bar * kMark), "fill=\"#000\"");
  std::string white;  // One path, so that no line shows between neighbours.
  for (int k = 0; k < kCells * kCells; ++k) {
    if (!is_white(mark.code, k % kCells, k / kCells)) continue;
    const Eigen::Vector2d at = corner + cell * Eigen::Vector2d(1 + k % kCells, 1 + k / kCells);
    const std::string side = svg.number(cell);
    white += joined({"M", svg.pair(at), "h", side, "v", side, "h-", side, "z"});
  }
  svg.path(white, "fill=\"#fff\"");
}

}  // namespace

Eigen::Vector2d chart_size() { return {1.48, 2.1}; }

std::string chart_drawing(double bar) {
  constexpr int kTicks = 10;
  SvgWriter svg(3, SvgWriter::Zeros::kTrimmed, "\n");
  const Eigen::Vector2d size = bar * chart_size();
  const std::string thin = svg.attribute("stroke-width", 0.003 * bar);
  svg.add({"<desc>", program_mark(), "</desc>"});
  svg.rectangle({0.0, 0.0}, size, joined({R"(fill="#fff" stroke="#999" )", thin}));
  for (const Mark& mark : marks()) draw_mark(mark, bar, svg);
  const Eigen::Vector2d start = bar * Eigen::Vector2d(0.24, 0.98);
  const Eigen::Vector2d end = start + Eigen::Vector2d(bar, 0.0);
  const std::string pen = joined({R"(stroke="#000" )", thin});
  svg.line(start, end, pen);
  for (int k = 0; k <= kTicks; ++k) {
    const Eigen::Vector2d at = start + k * (end - start) / kTicks;
    svg.line(at, at - Eigen::Vector2d(0.0, (k % kTicks == 0 ? 0.1 : 0.05) * bar), pen);
  }
  const auto write = [&](double y, double height, const std::string& text) {
    svg.text(bar * Eigen::Vector2d(0.74, y),
             joined({R"(text-anchor="middle" font-family="sans-serif" )",
                     svg.attribute("font-size", height * bar)}),
             text);
  };
  const std::string length = trimmed_decimal(bar, 3) + " mm";
  write(0.84, 0.07, length);
  write(1.12, 0.05, "Print this without scaling, measure the bar");
  write(1.19, 0.05, "(other than " + length + ": check --chart-bar),");
  write(1.26, 0.05, "and fasten it flat on the wall beside");
  write(1.33, 0.05, "the picture, both in one photograph.");
  const std::string width = svg.number(size.x());
  const std::string height = svg.number(size.y());
  return svg.drawing(
             joined({R"(xmlns="http://www.w3.org/2000/svg" width=")", width, R"(mm" height=")",
                     height, R"(mm" viewBox="0 0 )", width, " ", height, "\""})) +
         "\n";
}

namespace {

/// Corners in the order upper left, upper right, lower right, lower left, as seen.
using Quad = std::array<Eigen::Vector2d, 4>;

Eigen::Vector2d corner_of(const Mark& mark, std::size_t k) {
  const Eigen::Vector2d right(kMark, 0.0);
  const Eigen::Vector2d down(0.0, kMark);
  return std::array<Eigen::Vector2d, 4>{mark.at, mark.at + right, mark.at + right + down,
                                        mark.at + down}[k];
}

Eigen::Vector2d mapped(const Eigen::Matrix3d& map, const Eigen::Vector2d& p) {
  return (map * p.homogeneous()).hnormalized();
}

/// The perspective that takes places to others: least squares of its equations times w.
Eigen::Matrix3d perspective_of(const std::vector<Eigen::Vector2d>& from,
                               const std::vector<Eigen::Vector2d>& to) {
  Eigen::MatrixXd rows(2 * std::ssize(from), 8);
  Eigen::VectorXd right(rows.rows());
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector2d& p = from[i];
    const Eigen::Vector2d& q = to[i];
    const auto row = 2 * static_cast<Eigen::Index>(i);
    rows.row(row) << p.x(), p.y(), 1.0, 0.0, 0.0, 0.0, -q.x() * p.x(), -q.x() * p.y();
    rows.row(row + 1) << 0.0, 0.0, 0.0, p.x(), p.y(), 1.0, -q.y() * p.x(), -q.y() * p.y();
    right.segment<2>(row) = q;
  }
  const Eigen::VectorXd h = rows.colPivHouseholderQr().solve(right);
  Eigen::Matrix3d map;
  map << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0;
  return map;
}

/// Half widths of the windows whose means are thresholds: light may change from place to place, and
/// a window must be wider than a mark's cells. Pixels.
constexpr std::array<int, 4> kWindows = {6, 14, 32, 72};
/// A pixel is dark below this share of the mean display value around it.
constexpr double kDark = 0.8;
/// Shortest side of a mark, pixels of the search.
constexpr double kShortest = 14.0;

/// Sums of an image's values over rectangles from its upper left corner.
class Sums {
 public:
  explicit Sums(const Image& image)
      : columns_(image.columns()),
        rows_(image.rows()),
        sums_(static_cast<std::size_t>(columns_ + 1) * static_cast<std::size_t>(rows_ + 1)) {
    for (int r = 0; r < rows_; ++r) {
      double row = 0.0;
      for (int c = 0; c < columns_; ++c) {
        row += image.at(c, r);
        sums_[index(c + 1, r + 1)] = sums_[index(c + 1, r)] + row;
      }
    }
  }

  /// Mean of the window around a pixel, as far as it is within the image.
  [[nodiscard]] double mean(int column, int row, int half) const {
    const int left = std::max(column - half, 0);
    const int top = std::max(row - half, 0);
    const int right = std::min(column + half + 1, columns_);
    const int bottom = std::min(row + half + 1, rows_);
    return (sums_[index(right, bottom)] - sums_[index(left, bottom)] - sums_[index(right, top)] +
            sums_[index(left, top)]) /
           (1.0 * (right - left) * (bottom - top));
  }

 private:
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_ + 1) +
           static_cast<std::size_t>(column);
  }

  int columns_, rows_;
  std::vector<double> sums_;
};

/// The convex hull of places sorted by y, then x (Andrew 1979), clockwise as seen.
std::vector<Eigen::Vector2d> hull_of(const std::vector<Eigen::Vector2d>& sorted) {
  std::vector<Eigen::Vector2d> hull;
  const auto add = [&](const Eigen::Vector2d& p, std::size_t first) {
    while (hull.size() > first + 1 &&
           cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(p);
  };
  for (const Eigen::Vector2d& p : sorted) add(p, 0);
  const std::size_t turn = hull.size() - 1;
  for (auto p = sorted.rbegin() + 1; p != sorted.rend(); ++p) add(*p, turn);
  hull.pop_back();
  return hull;
}

/// The hull's quadrilateral between its longest diagonal and the places farthest from that; none if
/// it is another shape, or small.
std::optional<Quad> quad_of(const std::vector<Eigen::Vector2d>& hull) {
  constexpr double kSame = 0.85;  // Of areas: pixels round corners.
  if (hull.size() < 4) return std::nullopt;
  const auto farthest = [&](const auto& measure) {
    return *std::max_element(hull.begin(), hull.end(),
                             [&](const auto& a, const auto& b) { return measure(a) < measure(b); });
  };
  Eigen::Vector2d middle(0.0, 0.0);
  for (const Eigen::Vector2d& p : hull) middle += p / static_cast<double>(hull.size());
  const Eigen::Vector2d a = farthest([&](const auto& p) { return (p - middle).squaredNorm(); });
  const Eigen::Vector2d c = farthest([&](const auto& p) { return (p - a).squaredNorm(); });
  const Eigen::Vector2d b = farthest([&](const auto& p) { return -cross(c - a, p - a); });
  const Eigen::Vector2d d = farthest([&](const auto& p) { return cross(c - a, p - a); });
  const Quad quad = {a, b, c, d};
  for (std::size_t k = 0; k < 4; ++k) {
    if ((quad[(k + 1) % 4] - quad[k]).norm() < kShortest) return std::nullopt;
  }
  if (polygon_area({quad.begin(), quad.end()}) < kSame * polygon_area(hull)) return std::nullopt;
  return quad;
}

/// Quadrilaterals among the connected dark shapes of an image of display values.
class DarkShapes {
 public:
  DarkShapes(const Image& image, const Sums& sums, int window)
      : columns_(image.columns()), rows_(image.rows()), dark_(image.values().size()) {
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        dark_[index(c, r)] = image.at(c, r) < kDark * sums.mean(c, r, window) ? 1 : 0;
      }
    }
  }

  [[nodiscard]] std::vector<Quad> quads() {
    std::vector<Quad> found;
    for (int r = 0; r < rows_; ++r) {
      for (int c = 0; c < columns_; ++c) {
        if (dark_[index(c, r)] == 0) continue;
        if (const auto quad = quad_of(hull_of(take(c, r)))) found.push_back(*quad);
      }
    }
    return found;
  }

 private:
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  /// Corners of the first and last pixels in every row of the shape at a pixel, which is erased.
  std::vector<Eigen::Vector2d> take(int column, int row) {
    std::vector<std::pair<int, int>> ends;  // By rows from this one, the shape's uppermost.
    std::vector<std::pair<int, int>> open{{column, row}};
    dark_[index(column, row)] = 0;
    while (!open.empty()) {
      const auto [c, r] = open.back();
      open.pop_back();
      const auto line = static_cast<std::size_t>(r - row);
      if (line >= ends.size()) ends.resize(line + 1, {columns_, -1});
      ends[line] = {std::min(ends[line].first, c), std::max(ends[line].second, c)};
      for (const auto& [x, y] : {std::pair(c + 1, r), {c - 1, r}, {c, r + 1}, {c, r - 1}}) {
        if (x < 0 || y < 0 || x >= columns_ || y >= rows_ || dark_[index(x, y)] == 0) continue;
        dark_[index(x, y)] = 0;
        open.emplace_back(x, y);
      }
    }
    std::vector<Eigen::Vector2d> corners;
    for (std::size_t line = 0; line < 2 * ends.size(); ++line) {
      const std::size_t below = (line + 1) / 2;
      const double y = row + static_cast<double>(below);
      corners.emplace_back(ends[line / 2].first, y);
      corners.emplace_back(ends[line / 2].second + 1, y);
    }
    std::sort(corners.begin(), corners.end(), [](const auto& a, const auto& b) {
      return std::pair(a.y(), a.x()) < std::pair(b.y(), b.x());
    });
    return corners;
  }

  int columns_, rows_;
  std::vector<unsigned char> dark_;
};

/// A line: a place on it and its direction.
struct Line {
  Eigen::Vector2d at;
  Eigen::Vector2d along;

  [[nodiscard]] Eigen::Vector2d crossing(const Line& other) const {
    return at + cross(other.at - at, other.along) / cross(along, other.along) * along;
  }
};

/// How far outside a place on a mark's side, between dark inside and white outside, its edge lies:
/// where light is half of either, if it falls on both sides alike. None if there is no edge.
/// @param out  across the side, as long as what is looked at.
std::optional<double> edge_beyond(const Image& light, const Eigen::Vector2d& at,
                                  const Eigen::Vector2d& out) {
  constexpr int kAcross = 21;  // Samples, of which a quarter at each end gives the levels.
  constexpr int kEnd = kAcross / 4;
  constexpr double kLeastRise = 1.5;
  double dark = 0.0;
  double white = 0.0;
  double mean = 0.0;
  for (int i = 0; i < kAcross; ++i) {
    const Eigen::Vector2d place = at + (2.0 * i / (kAcross - 1) - 1.0) * out;
    const double seen = bilinear(light, place);
    mean += seen / kAcross;
    if (i < kEnd) dark += seen / kEnd;
    if (i >= kAcross - kEnd) white += seen / kEnd;
  }
  if (!(white > kLeastRise * dark)) return std::nullopt;
  return 1.0 - 2.0 * std::clamp((mean - dark) / (white - dark), 0.0, 1.0);
}

/// The line of a mark's side, clockwise, to parts of a pixel: least squares through its edge. None
/// if no side is there.
std::optional<Line> side_line(const Image& light, const Eigen::Vector2d& from,
                              const Eigen::Vector2d& to) {
  const double length = (to - from).norm();
  const Eigen::Vector2d along = (to - from) / length;
  const double reach = std::max(0.5 * length / (kCells + 2), 2.0);
  const Eigen::Vector2d out = reach * Eigen::Vector2d(along.y(), -along.x());
  const int count = std::clamp(static_cast<int>(length), 12, 200);
  std::vector<Eigen::Vector2d> places;
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector2d at = from + (0.1 + 0.8 * (k + 0.5) / count) * (to - from);
    if (const auto edge = edge_beyond(light, at, out)) places.emplace_back(at + *edge * out);
  }
  if (2 * std::ssize(places) < count) return std::nullopt;
  Eigen::Vector2d mean(0.0, 0.0);
  for (const Eigen::Vector2d& p : places) mean += p / static_cast<double>(places.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& p : places) spread += (p - mean) * (p - mean).transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(spread);
  return Line{mean, axes.eigenvectors().col(1)};
}

/// The same quadrilateral with the corners of its sides' lines.
std::optional<Quad> refined(const Image& light, Quad quad) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    std::array<Line, 4> sides;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto line = side_line(light, quad[k], quad[(k + 1) % 4]);
      if (!line) return std::nullopt;
      sides[k] = *line;
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d corner = sides[(k + 3) % 4].crossing(sides[k]);
      const double away = (corner - quad[k]).norm();
      if (!(away < 0.25 * (quad[(k + 1) % 4] - quad[k]).norm())) return std::nullopt;
      quad[k] = corner;
    }
  }
  return quad;
}

/// A mark as seen. Its corners begin with its upper left one.
struct SeenMark {
  std::size_t number;
  Quad corners;

  [[nodiscard]] Eigen::Vector2d middle() const {
    return 0.25 * (corners[0] + corners[1] + corners[2] + corners[3]);
  }
};

/// The cells of a quadrilateral and of the white around it.
class SeenCells {
 public:
  static constexpr int kSide = kCells + 4;

  SeenCells(const Image& light, const Quad& quad) {
    constexpr int kParts = 3;
    const double end = kSide - 1.0;
    const std::vector<Eigen::Vector2d> square = {{1.0, 1.0}, {end, 1.0}, {end, end}, {1.0, end}};
    const Eigen::Matrix3d map = perspective_of(square, {quad.begin(), quad.end()});
    std::array<double, 2> levels{};  // Of the white around, and of the mark's rim.
    for (int k = 0; k < kSide * kSide; ++k) {
      double& cell = cells_[static_cast<std::size_t>(k)];
      const Eigen::Vector2i corner(k % kSide, k / kSide);
      for (int part = 0; part < kParts * kParts; ++part) {
        const Eigen::Vector2i inside(part % kParts, part / kParts);
        const Eigen::Vector2d at =
            (corner.cast<double>() + 0.2 * inside.cast<double>()).array() + 0.3;
        cell += bilinear(light, mapped(map, at)) / (kParts * kParts);
      }
      const int ring = ring_of(k);
      if (ring < 2) levels[static_cast<std::size_t>(ring)] += cell / (4 * (kSide - 1 - 2 * ring));
    }
    middle_ = 0.5 * (levels[0] + levels[1]);
  }

  /// True if all around is white, and the rim black.
  [[nodiscard]] bool is_framed() const {
    for (int k = 0; k < kSide * kSide; ++k) {
      if (ring_of(k) < 2 && is_bright(k) != (ring_of(k) == 0)) return false;
    }
    return true;
  }
  /// True if the code's cells are a mark's, turned clockwise by quarters.
  [[nodiscard]] bool show(std::uint16_t code, std::size_t quarters) const {
    for (int k = 0; k < kCells * kCells; ++k) {
      int c = k % kCells;
      int r = k / kCells;
      for (std::size_t q = 0; q < quarters; ++q) {
        const int before = c;
        c = kCells - 1 - r;
        r = before;
      }
      if (is_bright((r + 2) * kSide + c + 2) != is_white(code, k % kCells, k / kCells))
        return false;
    }
    return true;
  }

 private:
  static int ring_of(int k) {
    return std::min({k % kSide, k / kSide, kSide - 1 - k % kSide, kSide - 1 - k / kSide});
  }
  [[nodiscard]] bool is_bright(int k) const {
    return cells_[static_cast<std::size_t>(k)] > middle_;
  }

  std::array<double, std::size_t{kSide} * kSide> cells_{};
  double middle_ = 0.0;  ///< Between black and white.
};

/// The mark in a quadrilateral; none if it is another thing.
std::optional<SeenMark> mark_in(const Image& light, const Quad& quad) {
  const SeenCells cells(light, quad);
  if (!cells.is_framed()) return std::nullopt;
  for (std::size_t turn = 0; turn < 4; ++turn) {
    for (std::size_t number = 0; number < marks().size(); ++number) {
      if (!cells.show(marks()[number].code, turn)) continue;
      SeenMark mark{number, quad};
      std::rotate(mark.corners.begin(), mark.corners.begin() + static_cast<std::ptrdiff_t>(turn),
                  mark.corners.end());
      return mark;
    }
  }
  return std::nullopt;
}

/// All marks in sight, each once. @throw InputError if one is there twice.
std::vector<SeenMark> marks_in(const Image& light, const std::string& name) {
  constexpr int kSide = 1600;  // Of the picture in which shapes are looked for.
  const int by = (std::max(light.columns(), light.rows()) + kSide - 1) / kSide;
  Image small = resample(light, std::max(light.columns() / by, 1), std::max(light.rows() / by, 1));
  const Eigen::Vector2d scale(1.0 * light.columns() / small.columns(),
                              1.0 * light.rows() / small.rows());
  for (float& value : small.values()) value = static_cast<float>(encode(value));
  const Sums sums(small);
  std::vector<SeenMark> found;
  for (const int window : kWindows) {
    for (Quad quad : DarkShapes(small, sums, window).quads()) {
      for (Eigen::Vector2d& corner : quad) corner = corner.cwiseProduct(scale);
      const auto exact = refined(light, quad);
      const auto mark = exact ? mark_in(light, *exact) : std::nullopt;
      if (!mark) continue;
      const auto before = std::find_if(found.begin(), found.end(), [&](const SeenMark& other) {
        return other.number == mark->number;
      });
      if (before == found.end()) {
        found.push_back(*mark);
      } else if ((before->middle() - mark->middle()).norm() >
                 0.5 * (mark->corners[1] - mark->corners[0]).norm()) {
        throw InputError(name + ": shows two charts; leave one on the wall");
      }
    }
  }
  return found;
}

}  // namespace

Eigen::Matrix3d SeenChart::perspective(const Image& photo) const {
  std::vector<Eigen::Vector2d> from;
  std::vector<Eigen::Vector2d> to;
  for (const Corner& corner : corners) {
    from.push_back(place_in(photo, corner.pixel));
    to.push_back(corner.at);
  }
  return perspective_of(from, to);
}

std::optional<SeenChart> find_chart(const Image& light, const std::string& name) {
  SeenChart chart;
  for (const SeenMark& mark : marks_in(light, name)) {
    for (std::size_t k = 0; k < 4; ++k) {
      chart.corners.push_back({mark.corners[k], corner_of(marks()[mark.number], k)});
    }
  }
  if (chart.corners.empty()) return std::nullopt;
  chart.error = corner_error(chart, light);
  // A sheet that is not flat, or marks of several things.
  constexpr double kMostOff = 0.02;
  const double side = (chart.corners[1].pixel - chart.corners[0].pixel).norm();
  if (chart.error > kMostOff * side + 0.5) return std::nullopt;
  return chart;
}

namespace {

/// Values of a view that say where a pixel sees the wall.
constexpr int kPlaces = view::kDistortion + 2;

/// A step of each: differences are exact to 1e-8.
constexpr double kPlaceStep = 1e-5;

}  // namespace

ChartTie::ChartTie(const SeenChart& chart, const Image& photo)
    : places_(2, std::ssize(chart.corners)),
      chart_(places_.cols()),
      weights_(places_.cols()),
      half_(0.5 * chart.picture) {
  const Eigen::Matrix3d map = chart.perspective(photo);
  const double pixel = 2.0 / std::hypot(photo.columns(), photo.rows());
  for (Eigen::Index i = 0; i < places_.cols(); ++i) {
    const SeenChart::Corner& corner = chart.corners[static_cast<std::size_t>(i)];
    places_.col(i) = place_in(photo, corner.pixel);
    chart_[i] = chart.bar * std::complex<double>(corner.at.x(), corner.at.y());
    // The area of a place's surroundings on the chart, by that in the photograph.
    const double w = map.row(2).dot(places_.col(i).homogeneous());
    const double wide = chart.bar * pixel * std::sqrt(std::abs(map.determinant() / (w * w * w)));
    weights_[i] = 1.0 / (chart.error * wide);
  }
}

Eigen::VectorXcd ChartTie::seen(const Eigen::VectorXd& view) const {
  Eigen::VectorXcd z(places_.cols());
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const Eigen::Vector2d at = wall_of(view, places_.col(i)).cwiseProduct(half_);
    z[i] = {at.x(), at.y()};
  }
  return z;
}

ChartTie::Similarity ChartTie::similarity(const Eigen::VectorXcd& z) const {
  const Eigen::VectorXcd shares =
      (weights_.cwiseAbs2() / weights_.squaredNorm()).cast<std::complex<double>>();
  const std::complex<double> middle = shares.dot(chart_);
  const std::complex<double> seen_middle = shares.dot(z);
  const Eigen::VectorXcd m = chart_.array() - middle;
  const Eigen::VectorXcd weighted = shares.cwiseProduct((z.array() - seen_middle).matrix());
  const std::complex<double> upright = m.dot(weighted);  // Σ conj(m) z
  const std::complex<double> mirrored = m.conjugate().dot(weighted);
  const double all = shares.real().dot(m.cwiseAbs2());
  if (std::abs(mirrored) <= std::abs(upright)) {
    const std::complex<double> a = upright / all;
    return {a, seen_middle - a * middle, false};
  }
  const std::complex<double> a = mirrored / all;
  return {a, seen_middle - a * std::conj(middle), true};
}

double ChartTie::scale(const Eigen::VectorXd& view) const {
  return std::abs(similarity(seen(view)).a);
}

Eigen::VectorXd ChartTie::residuals(const Eigen::VectorXd& view, double log_size) const {
  const Eigen::VectorXcd z = seen(view);
  const Similarity s = similarity(z);
  Eigen::VectorXd rest(size());
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const std::complex<double> at = (z[i] - s.b) / s.a;
    const std::complex<double> off = (s.mirrored ? std::conj(at) : at) - chart_[i];
    rest.segment<2>(2 * i) = weights_[i] * Eigen::Vector2d(off.real(), off.imag());
  }
  rest[size() - 1] = (std::log(std::abs(s.a)) + log_size) / kBarError;
  return rest;
}

Eigen::MatrixXd ChartTie::derivatives(const Eigen::VectorXd& view) const {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(size(), view.size());
  for (int k = 0; k < kPlaces; ++k) {
    Eigen::VectorXd more = view;
    Eigen::VectorXd less = view;
    more[k] += kPlaceStep;
    less[k] -= kPlaceStep;
    rows.col(k) = (residuals(more, 0.0) - residuals(less, 0.0)) / (2.0 * kPlaceStep);
  }
  return rows;
}

double corner_error(const SeenChart& chart, const Image& photo) {
  constexpr double kLeast = 0.1;  // Marks of 25 and more pixels are found to some 0.05.
  const Eigen::Index free = 2 * std::ssize(chart.corners) - kPlaces;
  if (free <= 0) return kLeast;
  SeenChart even = chart;
  even.error = 1.0;
  even.picture.setConstant(2.0 * even.bar);
  const ChartTie tie(even, photo);
  LeastSquares problem;
  problem.residuals = [&](const Eigen::VectorXd& view) {
    return Eigen::VectorXd(tie.residuals(view, 0.0).head(tie.size() - 1));
  };
  problem.free.resize(kPlaces);
  std::iota(problem.free.begin(), problem.free.end(), 0);
  problem.steps = Eigen::VectorXd::Constant(view::kCount, kPlaceStep);
  problem.longest = Eigen::VectorXd::Ones(view::kCount);
  problem.least_gain = 1e-6;
  Eigen::Vector2d middle(0.0, 0.0);
  for (const SeenChart::Corner& corner : chart.corners) {
    middle += place_in(photo, corner.pixel) / static_cast<double>(chart.corners.size());
  }
  const Eigen::VectorXd view = minimize(
      problem, view_by_chart(even, photo, middle, {0.0, 0.0}, Eigen::Matrix2d::Identity()));
  const double square = problem.residuals(view).squaredNorm();
  return std::max(std::sqrt(square / static_cast<double>(free)), kLeast);
}

namespace {

/// The orthogonal factor of a matrix's polar decomposition: a reflection where it mirrors.
Eigen::Matrix2d nearest_turn(const Eigen::Matrix2d& map) {
  const double side = map.determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector2d first(map(0, 0) + side * map(1, 1), map(1, 0) - side * map(0, 1));
  const Eigen::Vector2d unit = first.normalized();
  return (Eigen::Matrix2d() << unit.x(), -side * unit.y(), unit.y(), side * unit.x()).finished();
}

}  // namespace

Eigen::VectorXd view_by_chart(const SeenChart& chart, const Image& photo,
                              const Eigen::Vector2d& place, const Eigen::Vector2d& at,
                              const Eigen::Matrix2d& turn) {
  Eigen::Matrix3d map = chart.perspective(photo);
  const Eigen::Vector3d seen = map * place.homogeneous();
  const Eigen::Matrix2d slope =
      (map.topLeftCorner<2, 2>() - seen.hnormalized() * map.block<1, 2>(2, 0)) / seen.z();
  const Eigen::Matrix2d upright = nearest_turn(slope).transpose();
  const Eigen::Matrix2d to_wall =
      (2.0 * chart.bar * turn * upright).array().colwise() / chart.picture.array();
  map.topRows<2>() = to_wall * map.topRows<2>();
  const Eigen::Vector2d by = at - (map * place.homogeneous()).hnormalized();
  map.topRows<2>() += by * map.row(2);
  Eigen::VectorXd view = Eigen::VectorXd::Zero(view::kCount);
  view.head(view::kDistortion) << map.row(0).transpose(), map.row(1).transpose(), map(2, 0),
      map(2, 1);
  return view;
}

}  // namespace lensforge

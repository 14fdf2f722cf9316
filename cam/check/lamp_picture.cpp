// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/check/lamp_picture.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cam/check/causes.h"
#include "cam/check/wall_model.h"
#include "core/error.h"
#include "core/optics/light_source.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Light beyond this share of the brightest is the lamp's: what a camera and the wall scatter is
/// less.
constexpr double kEdge = 0.05;

/// Columns and rows, from and up to.
struct Box {
  int left = 0, top = 0, right = 0, bottom = 0;

  [[nodiscard]] int side() const { return std::max(right - left, bottom - top); }
  /// A square about the same middle, this much wider to all sides.
  [[nodiscard]] Box square(int more) const {
    const int wide = side() + 2 * more;
    const int x = (left + right - wide) / 2;
    const int y = (top + bottom - wide) / 2;
    return {x, y, x + wide, y + wide};
  }
};

/// Around all pixels that are `lit(column, row)`.
template <class Lit>
Box box_of(int columns, int rows, const Lit& lit) {
  Box box{columns, rows, 0, 0};
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (!lit(c, r)) continue;
      box = {std::min(box.left, c), std::min(box.top, r), std::max(box.right, c + 1),
             std::max(box.bottom, r + 1)};
    }
  }
  return box;
}

/// A part of an image, dark beyond its sides.
Image cut_out(const Image& image, const Box& box) {
  Image part(box.right - box.left, box.bottom - box.top);
  for (int r = 0; r < part.rows(); ++r) {
    for (int c = 0; c < part.columns(); ++c) {
      const int column = box.left + c;
      const int row = box.top + r;
      const bool inside = column >= 0 && row >= 0 && column < image.columns() && row < image.rows();
      if (inside) part.at(c, r) = image.at(column, row);
    }
  }
  return part;
}

float brightest(const Image& image) {
  return *std::max_element(image.values().begin(), image.values().end());
}

void brightest_to_one(Image& image) {
  const float most = brightest(image);
  for (float& value : image.values()) value /= most;
}

double middle_value(std::vector<double> values) {
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// ---- A pinhole ----

/// The wall without the lamp: a plane over the photograph, and the standard deviation from it.
struct Background {
  Eigen::Vector3d plane{0.0, 0.0, 0.0};  ///< Constant, per column, per row.
  double noise = 0.0;

  [[nodiscard]] double at(int c, int r) const { return plane.dot(Eigen::Vector3d(1.0, c, r)); }
};

/// Least squares over the photograph's borders, without what is far from the plane of the round
/// before.
Background background_of(const Image& light) {
  constexpr int kRounds = 5;
  constexpr double kFar = 3.0;         // Standard deviations.
  constexpr double kDeviation = 1.48;  // Over the median of absolute values, of a normal variable.
  constexpr double kLeastNoise = 5e-4;
  const int frame = std::max(2, std::min(light.columns(), light.rows()) / 25);
  Background result;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
    Eigen::Vector3d product = Eigen::Vector3d::Zero();
    const auto visit = [&](const auto& take) {
      for (int r = 0; r < light.rows(); ++r) {
        const bool edge = r < frame || r >= light.rows() - frame;
        for (int c = 0; c < light.columns(); ++c) {
          if (edge || c < frame || c >= light.columns() - frame) take(c, r);
        }
      }
    };
    visit([&](int c, int r) {
      const double off = std::abs(light.at(c, r) - result.at(c, r));
      if (round > 0 && off > kFar * result.noise) return;
      const Eigen::Vector3d row(1.0, c, r);
      square += row * row.transpose();
      product += light.at(c, r) * row;
    });
    result.plane = square.ldlt().solve(product);
    std::vector<double> off;
    visit([&](int c, int r) { off.push_back(std::abs(light.at(c, r) - result.at(c, r))); });
    result.noise = std::max(kDeviation * middle_value(std::move(off)), kLeastNoise);
  }
  return result;
}

/// The median of a pixel and its neighbours: single hot pixels vanish.
Image without_specks(const Image& image) {
  Image result(image.columns(), image.rows());
  for (int r = 0; r < image.rows(); ++r) {
    for (int c = 0; c < image.columns(); ++c) {
      std::array<float, 9> around{};
      for (int k = 0; k < 9; ++k) {
        around.at(static_cast<std::size_t>(k)) =
            image.at(std::clamp(c + k % 3 - 1, 0, image.columns() - 1),
                     std::clamp(r + k / 3 - 1, 0, image.rows() - 1));
      }
      std::nth_element(around.begin(), around.begin() + 4, around.end());
      result.at(c, r) = around[4];
    }
  }
  return result;
}

/// What is brighter than the wall, and where the lamp is.
struct LitWall {
  Image light;
  Image smooth;
  double most = 0.0;
  double noise = 0.0;
  double threshold = 0.0;

  [[nodiscard]] bool is_lamp(int c, int r) const { return smooth.at(c, r) > threshold; }
};

LitWall lit_wall(const Image& photo) {
  constexpr double kCounts = 5.0;  // Standard deviations of the wall's light.
  const Background wall = background_of(photo);
  LitWall lit;
  lit.light = photo;
  for (int r = 0; r < photo.rows(); ++r) {
    for (int c = 0; c < photo.columns(); ++c) {
      lit.light.at(c, r) -= static_cast<float>(wall.at(c, r));
    }
  }
  lit.smooth = without_specks(lit.light);
  lit.most = brightest(lit.smooth);
  lit.noise = wall.noise;
  lit.threshold = std::max(kEdge * lit.most, kCounts * wall.noise);
  return lit;
}

/// Share of the lamp's image that is clipped.
double clipped_share_of(const Photograph& photo, const LitWall& lit) {
  double all = 0.0;
  double clipped = 0.0;
  for (int r = 0; r < lit.light.rows(); ++r) {
    for (int c = 0; c < lit.light.columns(); ++c) {
      const bool is_clipped = !photo.is_usable(c, r);
      clipped += is_clipped ? 1.0 : 0.0;
      all += is_clipped || lit.is_lamp(c, r) ? 1.0 : 0.0;
    }
  }
  return all > 0.0 ? clipped / all : 0.0;
}

/// @throw InputError if it is too dark, clipped, or nothing is brighter than the wall.
void require_lamp(const Photograph& photo, const LitWall& lit) {
  constexpr double kTooDark = 0.02;
  constexpr double kMostClipped = 0.005;
  constexpr double kShows = 10.0;  // Standard deviations of the wall's light.
  const double white = brightest(photo.light);
  if (white < kTooDark) {
    throw InputError(photo.name + ": is too dark: the brightest wall has " +
                     number_text(100.0 * white, 2) +
                     " % of white, must be 2 % or more; expose longer");
  }
  const double clipped = clipped_share_of(photo, lit);
  if (clipped > kMostClipped) {
    throw InputError(photo.name + ": " + decimal_text(100.0 * clipped, 1) +
                     " % of the lamp's image is clipped, at most 0.5 %; expose a quarter as long");
  }
  if (lit.most < kShows * lit.noise) {
    throw InputError(photo.name +
                     ": shows no lamp: nothing is brighter than the wall at the photograph's "
                     "borders");
  }
}

/// Of the lamp's image. @throw InputError
Box lamp_box(const Photograph& photo, const LitWall& lit) {
  constexpr int kFewest = 8;
  const Box box = box_of(lit.light.columns(), lit.light.rows(),
                         [&](int c, int r) { return lit.is_lamp(c, r); });
  const bool touches = box.left < 2 || box.top < 2 || box.right > lit.light.columns() - 2 ||
                       box.bottom > lit.light.rows() - 2;
  if (touches) {
    throw InputError(photo.name +
                     ": the lamp's image touches the photograph's border; take one with dark wall "
                     "all around");
  }
  if (box.side() < kFewest) {
    throw InputError(photo.name + ": the lamp's image is " + std::to_string(box.side()) +
                     " pixels wide, must be 8 or more; go nearer");
  }
  return box;
}

}  // namespace

LampPicture lamp_by_pinhole(const Photograph& photo, const Pinhole& pinhole) {
  constexpr int kAround = 2;  // Pixels of the lamp's soft edge.
  constexpr int kMostSide = 256;
  const LitWall lit = lit_wall(photo.light);
  require_lamp(photo, lit);
  const Box box = lamp_box(photo, lit);
  const Box square = box.square(kAround);
  Image light = cut_out(lit.light, square);
  const Image smooth = cut_out(lit.smooth, square);
  for (std::size_t i = 0; i < light.values().size(); ++i) {
    float& value = light.values()[i];
    value = smooth.values()[i] > 0.5 * lit.threshold ? std::max(value, 0.0F) : 0.0F;
  }
  LampPicture lamp;
  lamp.pixels = box.side();
  const int side = light.columns();
  lamp.lit = static_cast<double>(box.side()) / side;
  lamp.width = side * pinhole.photo_width / photo.light.columns() / pinhole.distance;
  // Upside down: the hole swaps right and left, too, but so does turning round from wall to lamp.
  const Image small = resample(light, std::min(side, kMostSide), std::min(side, kMostSide));
  lamp.light = Image(small.columns(), small.rows());
  for (int r = 0; r < small.rows(); ++r) {
    for (int c = 0; c < small.columns(); ++c) {
      lamp.light.at(c, r) = small.at(c, small.rows() - 1 - r);
    }
  }
  brightest_to_one(lamp.light);
  return lamp;
}

namespace {

// ---- A lens ----

/// Cells of a lamp's picture, row by row from the top.
struct LampGrid {
  int side = 1;
  double width = 0.0;  ///< rad or mm
  Eigen::Vector2d middle{0.0, 0.0};

  [[nodiscard]] int cells() const { return side * side; }
  [[nodiscard]] double cell() const { return width / side; }
  /// Middle of a cell: to the right and up.
  [[nodiscard]] Eigen::Vector2d at(int k) const {
    const int column = k % side;
    const int row = k / side;
    return middle + cell() * Eigen::Vector2d(column + 0.5 - 0.5 * side, 0.5 * side - 0.5 - row);
  }
};

/// Where light of a lamp's points lands, in the wall's coordinates.
class LampToWall {
 public:
  explicit LampToWall(OpticalSetup setup, double height) {
    setup.extent = {};
    // Any width: the motion is that of small ones.
    setup.extent.width = 1e-3 * lamp_distance(setup).value_or(1.0);
    const Eigen::Vector2d half = 0.5 * setup.pixels.cast<double>();
    map_ = half.cwiseInverse().asDiagonal() * source_motion(setup, height);
    pixel_ = 1.0 / (map_ * Eigen::Vector2d::UnitX()).cwiseProduct(half).norm();
  }

  [[nodiscard]] Eigen::Vector2d way(const Eigen::Vector2d& at) const { return map_ * at; }
  /// Width on the lamp of a pixel of the lens's picture.
  [[nodiscard]] double pixel() const { return pixel_; }

 private:
  Eigen::Matrix2d map_;
  double pixel_;
};

/// The picture moved by ways on the wall, summed with weights.
WallPicture moved(const WallPicture& wall, const std::vector<Eigen::Vector2d>& ways,
                  const Eigen::VectorXd& weights, const Executor& executor) {
  WallPicture sum{Image(wall.light.columns(), wall.light.rows()), wall.margin};
  parallel_for(executor, "moved picture", wall.light.rows(), [&](std::int64_t row) {
    const int r = static_cast<int>(row);
    for (int c = 0; c < wall.light.columns(); ++c) {
      const Eigen::Vector2d at(2.0 * (c + 0.5 - wall.margin) / wall.inner_columns() - 1.0,
                               2.0 * (r + 0.5 - wall.margin) / wall.inner_rows() - 1.0);
      double light = 0.0;
      for (std::size_t k = 0; k < ways.size(); ++k) {
        const double weight = weights[static_cast<Eigen::Index>(k)];
        if (weight > 0.0) light += weight * wall.at(at - ways[k]).value;
      }
      sum.light.at(c, r) = static_cast<float>(std::max(light, 0.0));
    }
  });
  return sum;
}

/// Least squares ½ xᵀAx − bᵀx by Gauss-Seidel steps with x_i ≥ 0 for i < `positive`.
Eigen::VectorXd nonnegative(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                            Eigen::Index positive) {
  constexpr int kMostSweeps = 5000;
  constexpr double kNear = 1e-6;  // Of the largest value.
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0.0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      double next = x[i] + (b[i] - a.col(i).dot(x)) / a(i, i);
      if (i < positive) next = std::max(next, 0.0);
      change = std::max(change, std::abs(next - x[i]));
      x[i] = next;
    }
    if (change < kNear * x.cwiseAbs().maxCoeff()) break;
  }
  return x;
}

/// Adds w Σ (k_i − k_j)² over neighbours i, j of a grid to half of a square form; cells beyond its
/// sides are dark.
void add_smoothness(int side, double w, Eigen::MatrixXd& square) {
  const auto add = [&](int i, int j) {
    square(i, i) += w;
    if (j < 0) return;
    square(j, j) += w;
    square(i, j) -= w;
    square(j, i) -= w;
  };
  for (int k = 0; k < side * side; ++k) {
    const int column = k % side;
    const int row = k / side;
    if (column == 0) add(k, -1);
    if (row == 0) add(k, -1);
    add(k, column + 1 < side ? k + 1 : -1);
    add(k, row + 1 < side ? k + side : -1);
  }
}

/// The view of a picture in the light of a disc, of which only the width is guessed: the best of
/// several. @param own  of the lens's own lamp, rad. @throw InputError as find_picture()
Eigen::VectorXd find_by_any_lamp(const Photograph& photo, const WallModel& model, double own) {
  constexpr double kWider = 2.0;
  const double widest =
      std::sqrt(deviation_limits(model.lens().setup).most[index_of(Deviation::kLampSize)]);
  Eigen::VectorXd best;
  double score = -1.0;
  std::optional<InputError> refusal;
  for (double width = own; width <= std::max(own, widest); width *= kWider) {
    Deviations lamp = Deviations::Zero();
    lamp[index_of(Deviation::kLampSize)] = width * width;
    const WallPicture wall = wall_picture(model, lamp);
    try {
      const Eigen::VectorXd view = find_picture(photo, wall);
      const double match = SeenPixels(photo, view, 1.0).correlation(view, wall);
      if (match <= score) break;
      score = match;
      best = view;
    } catch (const InputError& error) {
      if (!refusal) refusal = error;
    }
  }
  if (best.size() == 0) throw InputError(*refusal);
  return best;
}

/// Finds a lamp's picture and the camera's view by turns.
class LampSearch {
 public:
  /// @param lens  with its own lamp. @param model  in the light of a point.
  LampSearch(const Lens& lens, const WallModel& model, const Photograph& photo,
             const Executor& executor, const RunControl& control);

  LampPicture run();

 private:
  /// What a grid shows, and the grid around the lamp's cells.
  struct Found {
    LampPicture lamp;
    LampGrid next;
    bool whole = false;  ///< None of them is at the grid's sides.
  };

  [[nodiscard]] std::vector<Eigen::Vector2d> ways(const LampGrid& grid) const;
  /// The forecast in the light of one cell in the lamp's middle.
  [[nodiscard]] WallPicture of_cell(const LampGrid& grid) const;
  /// A grid of this width with cells that the photograph resolves.
  [[nodiscard]] LampGrid grid_of(double width, const Eigen::Vector2d& middle) const;
  [[nodiscard]] Eigen::VectorXd solve(const LampGrid& grid, const SeenPixels& pixels,
                                      const WallPicture& cell) const;
  [[nodiscard]] Found found(const LampGrid& grid, const Eigen::VectorXd& light) const;

  LampToWall to_wall_;
  WallPicture sharp_;
  const Executor& executor_;
  const RunControl& control_;
  Eigen::VectorXd view_;
  Photograph photo_;
  double first_ = 0.0;       ///< Width of the first grid.
  double seen_pixel_ = 0.0;  ///< Width on the lamp of a pixel of the photograph.
};

LampSearch::LampSearch(const Lens& lens, const WallModel& model, const Photograph& photo,
                       const Executor& executor, const RunControl& control)
    : to_wall_(lens.setup, lens.surface.vertices.row(2).mean()),
      sharp_(wall_picture(model, Deviations::Zero())),
      executor_(executor),
      control_(control) {
  constexpr double kFinePerPixel = 2.0;  // Pixels of the photograph per pixel of the picture.
  constexpr double kLeastPixels = 2.0;   // Width of a first guess, in pixels of the picture.
  constexpr double kAround = 3.0;        // Width of the first grid, in widths of that.
  const OpticalSetup& setup = lens.setup;
  const double away = lamp_distance(setup).value_or(1.0);
  const double own = std::max(lamp_angle(setup), kLeastPixels * to_wall_.pixel() / away);
  view_ = find_by_any_lamp(photo, model, own);
  first_ = kAround * own * away;
  photo_ = shrunk(photo, pixels_across(photo, view_) / (kFinePerPixel * setup.pixels.x()));
  seen_pixel_ = to_wall_.pixel() * setup.pixels.x() / pixels_across(photo_, view_);
}

std::vector<Eigen::Vector2d> LampSearch::ways(const LampGrid& grid) const {
  std::vector<Eigen::Vector2d> ways;
  ways.reserve(static_cast<std::size_t>(grid.cells()));
  for (int k = 0; k < grid.cells(); ++k) ways.push_back(to_wall_.way(grid.at(k)));
  return ways;
}

WallPicture LampSearch::of_cell(const LampGrid& grid) const {
  constexpr double kPerPixel = 5.0;  // Parts of a cell in a pixel of the lens's picture.
  const int parts =
      std::max(1, static_cast<int>(std::ceil(kPerPixel * grid.cell() / to_wall_.pixel())));
  const LampGrid fine{parts, grid.cell(), {0.0, 0.0}};
  return moved(sharp_, ways(fine), Eigen::VectorXd::Constant(fine.cells(), 1.0 / fine.cells()),
               executor_);
}

LampGrid LampSearch::grid_of(double width, const Eigen::Vector2d& middle) const {
  const int side = std::clamp(static_cast<int>(std::lround(width / seen_pixel_)), 3, kMaxShapeSide);
  return {side, width, middle};
}

Eigen::VectorXd LampSearch::solve(const LampGrid& grid, const SeenPixels& pixels,
                                  const WallPicture& cell) const {
  constexpr double kSmooth = 1e-3;        // Of the mean square of a cell's light.
  constexpr Eigen::Index kMost = 20'000;  // Pixels; some hundred values are sought.
  const SeenPixels::LightRows rows = pixels.light_rows(view_, cell, ways(grid), kMost, executor_);
  Eigen::MatrixXd square = rows.of.transpose() * rows.of;
  const Eigen::VectorXd right = rows.of.transpose() * rows.seen;
  const double mean = square.diagonal().head(grid.cells()).mean();
  add_smoothness(grid.side, kSmooth * mean, square);
  Eigen::VectorXd light = nonnegative(square, right, grid.cells()).head(grid.cells());
  if (!(light.maxCoeff() > 0.0)) {
    throw InputError(photo_.name + ": shows no light of the lens");
  }
  return light;
}

LampSearch::Found LampSearch::found(const LampGrid& grid, const Eigen::VectorXd& light) const {
  const double most = light.maxCoeff();
  const Box box = box_of(grid.side, grid.side,
                         [&](int c, int r) { return light[r * grid.side + c] > kEdge * most; });
  Found found;
  found.lamp.light = Image(grid.side, grid.side);
  for (int k = 0; k < grid.cells(); ++k) {
    found.lamp.light.values()[static_cast<std::size_t>(k)] = static_cast<float>(light[k] / most);
  }
  found.lamp.width = grid.width;
  found.lamp.lit = static_cast<double>(box.side()) / grid.side;
  found.lamp.pixels = box.side() * grid.cell() / seen_pixel_;
  found.whole = box.left > 0 && box.top > 0 && box.right < grid.side && box.bottom < grid.side;
  const Eigen::Vector2d middle =
      grid.middle +
      0.5 * grid.cell() *
          Eigen::Vector2d(box.left + box.right - grid.side, grid.side - box.top - box.bottom);
  found.next = grid_of((box.side() + 2) * grid.cell(), middle);
  return found;
}

LampPicture LampSearch::run() {
  constexpr double kReach = 1.2;
  constexpr int kMostGrids = 8;
  constexpr double kSame = 0.05;  // Of the grid's width.
  constexpr double kWider = 1.5;  // Per round, until the grid holds the lamp.
  bool whole = false;
  LampGrid grid = grid_of(first_, {0.0, 0.0});
  for (int round = 1;; ++round) {
    if (control_.stop_requested()) throw Interrupted();
    control_.report({"check", 0.0, 0.0, "finding the lamp, round " + std::to_string(round)});
    const SeenPixels pixels(photo_, view_, kReach);
    const WallPicture cell = of_cell(grid);
    const Eigen::VectorXd light = solve(grid, pixels, cell);
    const WallPicture seen = moved(cell, ways(grid), light / light.sum(), executor_);
    view_ = fit_view(pixels, seen, view_, view_problem().free);
    Found now = found(grid, light);
    now.lamp.residual = (pixels.shown(view_, seen) - pixels.seen()).norm() /
                        std::sqrt(static_cast<double>(pixels.size()));
    const bool same = std::abs(now.next.width - grid.width) < kSame * grid.width;
    if (round == kMostGrids || (same && whole)) return now.lamp;
    // Cells grow until they hold the whole lamp, and then close around it.
    whole = whole || now.whole;
    grid = whole ? now.next : grid_of(kWider * grid.width, grid.middle);
  }
}

}  // namespace

LampPicture lamp_by_lens(const Lens& lens, const CamOptions& options, const Photograph& photo,
                         const Executor& own_executor, const RunControl& control) {
  constexpr int kFine = 5;  // As in check_photograph().
  const Executor executor = own_executor.with_stop(control.stop_token());
  require_light(photo);
  Lens by_point = lens;
  by_point.setup.extent = {};
  const WallModel model(by_point, options, kFine, executor, control);
  LampPicture lamp = LampSearch(lens, model, photo, executor, control).run();
  constexpr double kFewest = 3.0;  // Pixels.
  if (lamp.pixels < kFewest) {
    throw InputError(photo.name + ": the lamp's image is " + decimal_text(lamp.pixels, 1) +
                     " pixels wide, must be 3 or more; take the image of a pinhole");
  }
  return lamp;
}

}  // namespace lensforge

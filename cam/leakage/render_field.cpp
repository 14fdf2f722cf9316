// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/render_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/optics/front.h"
#include "core/optics/light_path.h"
#include "core/optics/light_source.h"
#include "core/optics/optical_setup.h"
#include "design/flux/flux_image.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

/// Seen along z, as far as light passes, mm².
double area_of(const GridWindow& grid, const std::optional<Outline>& outline) {
  if (outline) return polygon_area(outline->points);
  return grid.spacing.x() * static_cast<double>(grid.columns - 1) * grid.spacing.y() *
         static_cast<double>(grid.rows - 1);
}

}  // namespace

SurfaceTile::SurfaceTile(const OpticalSetup& setup, const GridWindow& grid, double whole)
    : light_(setup),
      outline_(setup.outline ? std::optional<OutlineIndex>(*setup.outline) : std::nullopt),
      grid_(grid) {
  take_light(setup, whole);
}

void SurfaceTile::take_light(const OpticalSetup& setup, double whole) {
  light_ = LightPath(setup);
  lens_area_ = whole > 0.0 ? whole : area_of(grid_, setup.outline);
  triangle_flux_ = 0.5 * grid_.spacing.prod() / lens_area_;
}

void SurfaceTile::load(const SurfaceField& field, const CellRange& range,
                       const Executor& executor) {
  range_ = range;
  halo_columns_ = std::min<std::int64_t>(1, range.column);
  halo_rows_ = std::min<std::int64_t>(1, range.row);
  const GridWindow window = window_of(grid_, range, 1);
  field.sample(window, executor, patch_);
  patch_.window = window;
  const std::int64_t count = window.size();
  LF_CHECK(static_cast<std::int64_t>(patch_.z.size()) == count, std::to_string(patch_.z.size()));
  land(executor);
  if (outline_) find_rim(executor);
}

void SurfaceTile::relight(const OpticalSetup& setup, double whole, const Executor& executor) {
  take_light(setup, whole);
  land(executor);
}

void SurfaceTile::land(const Executor& executor) {
  const std::int64_t count = patch_.window.size();
  landing_.resize(static_cast<std::size_t>(count));
  if (light_.varies()) entries_.resize(static_cast<std::size_t>(count));
  parallel_for(executor, "land nodes", count, [this](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    const Eigen::Vector2d at =
        patch_.window.node(i % patch_.window.columns, i / patch_.window.columns);
    if (light_.varies()) entries_[k] = light_.ray_to({at.x(), at.y(), patch_.z[k]});
    landing_[k] =
        land_of(light_, at, patch_.z[k], {patch_.slope_x[k], patch_.slope_y[k]}, entry(k));
  });
  if (patch_.cut.empty()) sharpen_landing(executor);
}

void SurfaceTile::find_rim(const Executor& executor) {
  sides_.resize(static_cast<std::size_t>(cells()));
  parallel_for(executor, "find rim", cells(), [this](std::int64_t cell) {
    const std::int64_t i = cell % range_.columns;
    const std::int64_t j = cell / range_.columns;
    sides_[static_cast<std::size_t>(cell)] = outline_->side_of({place(i, j), place(i + 1, j + 1)});
  });
}

void SurfaceTile::sharpen_landing(const Executor& executor) {
  const std::int64_t columns = patch_.window.columns;
  const std::int64_t rows = patch_.window.rows;
  sharpened_.resize(landing_.size());
  const auto sharpen_row = [&](std::int64_t j) {
    const bool inner_row = j > 0 && j + 1 < rows;
    for (std::int64_t i = 0; i < columns; ++i) {
      const bool inner_column = i > 0 && i + 1 < columns;
      const auto n = static_cast<std::size_t>(j * columns + i);
      sharpened_[n] = sharp_landing(landing_, n, columns, {inner_column, inner_row});
    }
  };
  parallel_for(executor, "sharpen landing", rows, sharpen_row, 16);
  landing_.swap(sharpened_);
}

/// Derivative of the slope along one axis, from neighbours on the same cut; zero without any, which
/// keeps the node's own beam.
Eigen::Vector2d SurfaceTile::bend_along(std::size_t node, std::int64_t step, bool has_before,
                                        bool has_after) const {
  const auto offset = static_cast<std::size_t>(step);
  const std::int32_t cut = patch_.cut[node];
  const bool before = has_before && patch_.cut[node - offset] == cut;
  const bool after = has_after && patch_.cut[node + offset] == cut;
  const std::size_t low = before ? node - offset : node;
  const std::size_t high = after ? node + offset : node;
  if (low == high) return {0.0, 0.0};
  const double spacing = step == 1 ? grid_.spacing.x() : grid_.spacing.y();
  const double distance = spacing * static_cast<double>(int{before} + int{after});
  return Eigen::Vector2d(patch_.slope_x[high] - patch_.slope_x[low],
                         patch_.slope_y[high] - patch_.slope_y[low]) /
         distance;
}

Eigen::Vector3d SurfaceTile::point(std::size_t node) const {
  const std::int64_t columns = patch_.window.columns;
  const auto index = static_cast<std::int64_t>(node);
  const Eigen::Vector2d at = patch_.window.node(index % columns, index / columns);
  return {at.x(), at.y(), patch_.z[node]};
}

SurfaceSide SurfaceTile::side_of(std::size_t node) const {
  const GridWindow& window = patch_.window;
  const std::int64_t i = static_cast<std::int64_t>(node) % window.columns;
  const std::int64_t j = static_cast<std::int64_t>(node) / window.columns;
  SurfaceSide side;
  side.place = window.node(i, j);
  side.z = patch_.z[node];
  side.slope = {patch_.slope_x[node], patch_.slope_y[node]};
  side.cut = patch_.cut[node];
  const Eigen::Vector2d by_x = bend_along(node, 1, i > 0, i + 1 < window.columns);
  const Eigen::Vector2d by_y = bend_along(node, window.columns, j > 0, j + 1 < window.rows);
  const double twist = 0.5 * (by_x.y() + by_y.x());
  side.bend << by_x.x(), twist, twist, by_y.y();
  return side;
}

OpticalSetup FieldRenderSetup::optics_in_parts(const SourceKernel& kernel) const {
  OpticalSetup fine = optics;
  fine.pixels *= kernel.parts;
  return fine;
}

namespace {

/// Adds the picture of a loaded tile in light of every colour.
void add_colors(SurfaceTile& tile, const FieldRenderSetup& setup,
                const std::vector<LightColor>& colors, const Executor& executor, FluxImage& image) {
  for (std::size_t color = 0; color < colors.size(); ++color) {
    const double share = colors[color].share;
    if (colors.size() > 1) tile.relight(colors[color].setup, setup.whole_in(color), executor);
    image.add(executor, tile.cells(), [&](std::int64_t cell, const FluxAccumulator& sum) {
      tile.visit_cell(cell, [&](ImageTriangle piece) {
        piece.flux *= share;
        deposit(piece, sum);
      });
    });
  }
}

/// Surfaces as height maps, at the nodes of a grid over the lens.
/// @param level  from which heights count, mm: 32 bits of a thick lens's would be coarse.
std::vector<HeightFront> height_maps(std::span<const SurfaceField* const> fields, double level,
                                     const FieldRenderSetup& setup, const Executor& executor,
                                     const RunControl& control, const TileObserver& observe = {}) {
  const GridWindow& grid = setup.grid;
  const auto columns = static_cast<std::size_t>(grid.columns);
  std::vector<HeightGrid> heights(
      fields.size(), {static_cast<int>(grid.columns), static_cast<int>(grid.rows),
                      std::vector<float>(columns * static_cast<std::size_t>(grid.rows))});
  SurfacePatch patch;
  for (const CellRange& tile : tiles_of(all_cells(grid), setup.tile)) {
    for (std::size_t f = 0; f < fields.size(); ++f) {
      if (control.stop_requested()) throw Interrupted();
      const GridWindow window = window_of(grid, tile, 1);
      fields[f]->sample(window, executor, patch);
      patch.window = window;
      if (observe) observe(*fields[f], tile, patch);
      for (std::int64_t j = 0; j < window.rows; ++j) {
        const auto from_top = static_cast<std::size_t>(grid.rows - 1 - window.first_row - j);
        const auto* const row = patch.z.data() + j * window.columns;
        std::transform(row, row + window.columns,
                       heights[f].heights.begin() +
                           static_cast<std::ptrdiff_t>(from_top * columns) + window.first_column,
                       [level](double z) { return static_cast<float>(z - level); });
      }
    }
  }
  const Eigen::Vector2d size = grid.spacing.cwiseProduct(
      Eigen::Vector2d(static_cast<double>(grid.columns - 1), static_cast<double>(grid.rows - 1)));
  std::vector<HeightFront> fronts;
  fronts.reserve(heights.size());
  for (HeightGrid& one : heights) {
    fronts.push_back({std::make_shared<const HeightSpline>(std::move(one)), size, grid.origin});
  }
  return fronts;
}

/// Rays followed from a height map to the optical surface behind it and to the screen.
class FrontTrace {
 public:
  /// @param optics  with the front; must outlive this, as must `back`, its heights above `level`.
  FrontTrace(const OpticalSetup& optics, const HeightFront& back, double level)
      : light_(optics),
        before_(LightSource(optics).before_front()),
        front_(*optics.front),
        back_(back),
        level_(level),
        edge_(optics.outline.value_or(rectangle(optics.lens_size))) {}

  /// A ray: where it leaves the lens and where it lands; NaN where it does not.
  struct Ray {
    IncidentRay inside{};
    Eigen::Vector3d exit = FrontRefraction::unknown();
  };

  [[nodiscard]] Ray from(const Eigen::Vector2d& entry, Eigen::Vector2d& landing) const {
    const FrontRefraction ray(front_, before_, entry);
    Ray found{ray.ray(Eigen::Matrix2d::Identity())};
    landing.setConstant(std::numeric_limits<double>::quiet_NaN());
    if (!ray.lit || !(ray.b.z() > 0.0)) return found;
    double along = (level_ - ray.e.z()) / ray.b.z();
    FrontPoint back{};
    for (int step = 0; step < kSteps; ++step) {
      found.exit = ray.e + along * ray.b;
      back = back_.at(found.exit.head<2>());
      const double above = back.z + level_ - found.exit.z();
      if (std::abs(above) < kNear) break;
      along -= above / (back.gradient.dot(ray.b.head<2>()) - ray.b.z());
    }
    landing = land_of(light_, found.exit.head<2>(), found.exit.z(), back.gradient, &found.inside);
    return found;
  }

  /// Passes the parts of a triangle of light that leave within the lens's edge to `sink`.
  template <class Sink>
  void visit(const std::array<const Ray*, 3>& rays, ImageTriangle image, double whole,
             const Sink& sink) const {
    const Corners corners{rays[0]->exit, rays[1]->exit, rays[2]->exit};
    image.flux =
        light_.intake(corners, {&rays[0]->inside, &rays[1]->inside, &rays[2]->inside}) / whole;
    PlanTriangle plan;
    Eigen::AlignedBox2d box;
    for (std::size_t k = 0; k < 3; ++k) box.extend(plan[k] = rays[k]->exit.head<2>());
    if (!std::isfinite(image.flux + box.sizes().sum())) return;
    const OutlineIndex::Side side = edge_.side_of(box);
    if (side == OutlineIndex::Side::kInside) sink(image);
    if (side != OutlineIndex::Side::kAcross) return;
    const Eigen::Vector2d u = plan[1] - plan[0];
    const Eigen::Vector2d v = plan[2] - plan[0];
    if (u.x() * v.y() < u.y() * v.x()) {  // Folded.
      std::swap(plan[1], plan[2]);
      std::swap(image.p1, image.p2);
    }
    for (const TrianglePiece& piece : edge_.inside(plan)) sink(image_of(image, piece));
  }

 private:
  static constexpr int kSteps = 20;       ///< Newton's; smooth faces need three or four.
  static constexpr double kNear = 1e-10;  ///< mm

  static Outline rectangle(const Eigen::Vector2d& size) {
    return {OutlineKind::kPolygon, 0.0, {{0.0, 0.0}, {size.x(), 0.0}, size, {0.0, size.y()}}};
  }

  LightPath light_;
  FrontLight before_;
  FrontSurface front_;
  FrontSurface back_;
  double level_;
  OutlineIndex edge_;
};

/// Cells of a side of the tiles that are traced at once: 12 MB.
constexpr std::int64_t kTracedTile = 256;

/// Adds the light that enters one tile of a grid of entries.
/// @param whole  of which fluxes are shares, mm².
void add_traced(const FrontTrace& trace, const GridWindow& entries, const CellRange& tile,
                double whole, const Executor& executor, FluxImage& image) {
  const GridWindow window = window_of(entries, tile, 1);
  const auto count = static_cast<std::size_t>(window.size());
  std::vector<FrontTrace::Ray> rays(count);
  std::vector<Eigen::Vector2d> landing(count);
  parallel_for(executor, "trace from front", window.size(), [&](std::int64_t i) {
    const auto k = static_cast<std::size_t>(i);
    rays[k] = trace.from(window.node(i % window.columns, i / window.columns), landing[k]);
  });
  const auto sharp = [&](std::int64_t node) {
    const std::int64_t column = node % window.columns;
    const std::int64_t row = node / window.columns;
    return sharp_landing(
        landing, static_cast<std::size_t>(node), window.columns,
        {column > 0 && column + 1 < window.columns, row > 0 && row + 1 < window.rows});
  };
  const std::int64_t first =
      (tile.row - window.first_row) * window.columns + tile.column - window.first_column;
  image.add(executor, tile.columns * tile.rows, [&](std::int64_t cell, const FluxAccumulator& sum) {
    const std::int64_t a = first + cell / tile.columns * window.columns + cell % tile.columns;
    const std::int64_t d = a + window.columns;
    for (const std::array<std::int64_t, 3>& t :
         {std::array{a, a + 1, d + 1}, std::array{a, d + 1, d}}) {
      const auto ray = [&](std::size_t k) { return &rays[static_cast<std::size_t>(t[k])]; };
      trace.visit({ray(0), ray(1), ray(2)}, {sharp(t[0]), sharp(t[1]), sharp(t[2]), 0.0}, whole,
                  [&](const ImageTriangle& piece) {
                    if (piece.p0.allFinite() && piece.p1.allFinite() && piece.p2.allFinite()) {
                      deposit(piece, sum);
                    }
                  });
    }
  });
}

/// The lens's grid and as many cells around it as its light enters beyond it.
GridWindow entries_of(const FieldRenderSetup& setup) {
  GridWindow entries = setup.grid;
  const Eigen::Vector2d cells = (setup.beyond / setup.grid.spacing.array()).ceil();
  entries.origin -= cells.cwiseProduct(entries.spacing);
  entries.columns += 2 * static_cast<std::int64_t>(cells.x());
  entries.rows += 2 * static_cast<std::int64_t>(cells.y());
  return entries;
}

/// The pictures of setup.back behind each of the surfaces.
std::vector<FluxPicture> render_behind(std::span<const SurfaceField* const> fields,
                                       const FieldRenderSetup& setup, const Executor& executor,
                                       const RunControl& control, const TileObserver& observe) {
  const Eigen::Vector2i& pixels = setup.optics.pixels;
  const SourceKernel kernel = setup.blur();
  SourceBlurOn<Executor> blur(kernel, pixels.x(), pixels.y(), executor);
  const double level = setup.surface_height;
  const HeightFront back = height_maps({&setup.back, 1}, level, setup, executor, control).front();
  const GridWindow entries = entries_of(setup);
  OpticalSetup optics = setup.optics_in_parts(kernel);
  std::vector<FluxPicture> pictures;
  for (const HeightFront& front : height_maps(fields, 0.0, setup, executor, control, observe)) {
    optics.front = front;
    FluxImage image(optics.pixels.x(), optics.pixels.y());
    image.begin(executor);
    const std::vector<LightColor> colors = light_colors(optics);
    for (std::size_t color = 0; color < colors.size(); ++color) {
      const FrontTrace trace(colors[color].setup, back, level);
      const double all = setup.whole_in(color);
      const double whole = all > 0.0 ? all : area_of(setup.grid, optics.outline);
      for (const CellRange& tile : tiles_of(all_cells(entries), kTracedTile)) {
        if (control.stop_requested()) throw Interrupted();
        add_traced(trace, entries, tile, whole / colors[color].share, executor, image);
      }
    }
    const std::span<const double> flux = blur.apply(executor, image.resolve(executor));
    pictures.push_back({pixels.x(), pixels.y(), {flux.begin(), flux.end()}});
    control.report({"render fronts", static_cast<double>(pictures.size()),
                    static_cast<double>(fields.size()), "fronts"});
  }
  return pictures;
}

std::vector<FluxPicture> render_parts(std::span<const SurfaceField* const> fields,
                                      const FieldRenderSetup& setup, const CellRange& cells,
                                      const Executor& executor, const RunControl& control,
                                      const TileObserver& observe = {}) {
  if (setup.back != nullptr) {
    LF_CHECK(cells.columns * cells.rows == (setup.grid.columns - 1) * (setup.grid.rows - 1),
             "a part of a front");
    return render_behind(fields, setup, executor, control, observe);
  }
  const Eigen::Vector2i pixels = setup.optics.pixels;
  const SourceKernel kernel = setup.blur();
  const OpticalSetup optics = setup.optics_in_parts(kernel);
  SourceBlurOn<Executor> blur(kernel, pixels.x(), pixels.y(), executor);
  std::vector<FluxImage> images;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    images.emplace_back(optics.pixels.x(), optics.pixels.y()).begin(executor);
  }
  const std::vector<LightColor> colors = light_colors(optics);
  SurfaceTile tile(colors.front().setup, setup.grid, setup.whole_in(0));
  const std::vector<CellRange> tiles = tiles_of(cells, setup.tile);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    for (std::size_t f = 0; f < fields.size(); ++f) {
      if (control.stop_requested()) throw Interrupted();
      tile.load(*fields[f], tiles[t], executor);
      if (observe) observe(*fields[f], tiles[t], tile.patch());
      add_colors(tile, setup, colors, executor, images[f]);
    }
    control.report({"render surfaces", static_cast<double>(t + 1),
                    static_cast<double>(tiles.size()), "tiles"});
  }
  std::vector<FluxPicture> pictures;
  for (FluxImage& image : images) {
    const std::span<const double> flux = blur.apply(executor, image.resolve(executor));
    pictures.push_back({pixels.x(), pixels.y(), {flux.begin(), flux.end()}});
  }
  return pictures;
}

}  // namespace

std::vector<FluxPicture> render_fields(std::span<const SurfaceField* const> fields,
                                       const FieldRenderSetup& setup, const Executor& executor,
                                       const RunControl& control, const TileObserver& observe) {
  return render_parts(fields, setup, all_cells(setup.grid), executor, control, observe);
}

FluxPicture render_field(const SurfaceField& field, const FieldRenderSetup& setup,
                         const Executor& executor, const RunControl& control) {
  return render_cells(field, setup, all_cells(setup.grid), executor, control);
}

FluxPicture render_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                         const CellRange& cells, const Executor& executor,
                         const RunControl& control) {
  const SurfaceField* const one = &field;
  return std::move(render_parts({&one, 1}, setup, cells, executor, control).front());
}

FluxPicture light_of_cells(const SurfaceField& field, const FieldRenderSetup& setup,
                           const CellRange& cells, const std::optional<WaveOptions>& waves,
                           const Executor& executor, const RunControl& control) {
  if (!waves) return render_cells(field, setup, cells, executor, control);
  const Eigen::Vector2i& pixels = setup.optics.pixels;
  return {pixels.x(), pixels.y(),
          wave_flux_of({setup.grid, cells, setup.whole}, setup.optics, field, *waves, executor,
                       control)};
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/waves/wave_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "core/optics/picture_blur.h"
#include "core/optics/screen.h"
#include "core/spline/control_net.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/flux/columns.h"
#include "design/flux/flux_image.h"
#include "design/waves/wave_tile.h"

namespace lensforge {
namespace {

/// Tiles whose light is held at the same time.
constexpr std::int64_t kBatch = 16;

/// Fields of a picture that are kept for its adjoint, bytes, but for those of a batch: a third of
/// the time for as many as there are. A 128² portrait on 25 mm has 2.3e9.
constexpr double kKeptBytes = 1.5e9;

/// @param tile, overlap  cells; 0: one stretch.
std::vector<Stretch> stretches(std::int64_t cells, double tile, double overlap) {
  const auto all = static_cast<double>(cells);
  const std::int64_t count =
      tile > 0.0 ? std::max<std::int64_t>(1, std::llround(std::min(all, all / tile))) : 1;
  const std::int64_t ramp =
      std::llround(std::min(overlap, std::floor(all / static_cast<double>(count))));
  std::vector<Stretch> parts;
  for (std::int64_t k = 0; k < count; ++k) {
    Stretch one{cells * k / count, cells * (k + 1) / count, 0, 0};
    if (k > 0) {
      one.begin -= ramp / 2;
      one.rise = ramp;
    }
    if (k + 1 < count) {
      one.end += ramp - ramp / 2;
      one.fall = ramp;
    }
    parts.push_back(one);
  }
  return parts;
}

void add_to(const PixelLight& part, const Eigen::Vector2i& pixels, std::vector<double>& flux) {
  for (const auto& [pixel, light] : part.rays) flux[static_cast<std::size_t>(pixel)] += light;
  for (int row = 0; row < part.rows; ++row) {
    for (int column = 0; column < part.columns; ++column) {
      const int to = (part.first.y() + row) * pixels.x() + part.first.x() + column;
      flux[static_cast<std::size_t>(to)] +=
          part.light[static_cast<std::size_t>(row) * static_cast<std::size_t>(part.columns) +
                     static_cast<std::size_t>(column)];
    }
  }
}

/// A surface's picture in one wavelength, of a lamp's middle, as far as it was summed.
struct PointPicture {
  std::vector<double> flux;
  double whole = 0.0;

  /// Factor of this light in the picture.
  [[nodiscard]] double scale(const WaveColor& color) const {
    // What a lens takes in depends on its surface, but for light along z.
    const bool all = color.light.intake_is_plan_area() || whole == 0.0;
    return color.share / (all ? 1.0 : whole);
  }
  /// Adds its share of the brightness to a picture.
  void add_to(const WaveColor& color, std::vector<double>& sum) const {
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += scale(color) * flux[i];
  }
};

/// Light of a lamp's middle from several surfaces.
class PointLightOf {
 public:
  PointLightOf(const WaveScene& scene, std::size_t surfaces)
      : scene_(scene),
        surfaces_(surfaces),
        pixels_(scene.colors.front().setup.pixels),
        pictures_(surfaces * scene.colors.size(),
                  {std::vector<double>(static_cast<std::size_t>(pixels_.prod()), 0.0)}) {}

  /// Number of tiles to add at once.
  [[nodiscard]] std::int64_t batch() const {
    return std::max<std::int64_t>(1, kBatch / static_cast<std::int64_t>(pictures_.size()));
  }

  /// @param nodes  of every tile those of all surfaces in turn.
  /// @throw Interrupted.
  void add(std::span<const Tile> tiles, const std::vector<SurfaceNodes>& nodes,
           const Executor& executor) {
    const std::size_t colors = scene_.colors.size();
    const std::vector<std::size_t> first = first_equal(nodes);
    std::vector<std::vector<PixelLight>> lights(nodes.size() * colors);
    const auto work = [&](std::int64_t job) {
      const auto k = static_cast<std::size_t>(job);
      if (first[k / colors] != k / colors) return;
      lights[k] = tile_light(scene_, scene_.colors[k % colors], nodes[k / colors],
                             tiles[k / colors / surfaces_]);
    };
    parallel_for(executor, "waves", static_cast<std::int64_t>(lights.size()), work, 1);
    if (scene_.control.stop_requested()) throw Interrupted();
    for (std::size_t k = 0; k < lights.size(); ++k) {
      PointPicture& picture = pictures_[k % pictures_.size()];
      for (const PixelLight& part : lights[first[k / colors] * colors + k % colors]) {
        add_to(part, pixels_, picture.flux);
        picture.whole += part.whole;
      }
    }
  }

  /// A surface's light in all wavelengths.
  [[nodiscard]] std::vector<double> of(std::size_t surface) const {
    std::vector<double> sum(static_cast<std::size_t>(pixels_.prod()), 0.0);
    for (std::size_t c = 0; c < scene_.colors.size(); ++c) {
      pictures_[surface * scene_.colors.size() + c].add_to(scene_.colors[c], sum);
    }
    return sum;
  }

 private:
  /// For every surface of a tile the first that has the same nodes: a ball changes nothing where it
  /// reaches the surface.
  [[nodiscard]] std::vector<std::size_t> first_equal(const std::vector<SurfaceNodes>& nodes) const {
    std::vector<std::size_t> first(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      first[k] = k - k % surfaces_;
      while (first[k] < k && !same(nodes[first[k]], nodes[k])) ++first[k];
    }
    return first;
  }
  static bool same(const SurfaceNodes& a, const SurfaceNodes& b) {
    return a.place == b.place && a.slope == b.slope;
  }

  const WaveScene& scene_;
  std::size_t surfaces_;
  Eigen::Vector2i pixels_;
  std::vector<PointPicture> pictures_;  ///< By surface, then wavelength.
};

/// The nodes of a sampled window.
SurfaceNodes nodes_of(const SurfacePatch& patch) {
  const GridWindow& window = patch.window;
  SurfaceNodes nodes{window.columns, window.first_column, window.first_row, window.spacing, {}, {}};
  for (std::int64_t j = 0; j < window.rows; ++j) {
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const auto n = static_cast<std::size_t>(j * window.columns + i);
      nodes.place.emplace_back(window.x(i), window.y(j), patch.z[n]);
      nodes.slope.emplace_back(patch.slope_x[n], patch.slope_y[n]);
    }
  }
  return nodes;
}

/// Height of a surface in the middle of its lens, mm.
double middle_height(const GridWindow& grid, const SurfaceField& surface) {
  GridWindow one = grid;
  one.first_column += grid.columns / 2;
  one.first_row += grid.rows / 2;
  one.columns = 1;
  one.rows = 1;
  SurfacePatch patch;
  surface.sample(one, Executor::serial(), patch);
  return patch.z.front();
}

/// Distance on the lens up to which waves interfere in a pixel's mean, λ f / pixel, and at least
/// √(λ f), to which diffraction reaches, mm.
double coherence_length(const OpticalSetup& setup, double height, double wavelength) {
  const double spot = spot_area(setup, height, wavelength);
  return std::max(std::sqrt(spot), spot / pixel_width(setup));
}

/// The wavelengths of a setup's light, shortest first.
std::vector<WaveColor> wave_colors(const OpticalSetup& setup, double wavelength) {
  std::vector<WaveColor> colors;
  for (const LightColor& color : light_colors(setup)) {
    const std::size_t k = colors.size();
    const bool one = setup.spectrum.none();
    colors.emplace_back(color.setup, one ? wavelength : kMmPerNm * setup.spectrum.wavelengths[k],
                        color.share);
  }
  return colors;
}

}  // namespace

namespace {

/// Setup with pixels as the source's blur asks for.
OpticalSetup in_parts(const OpticalSetup& setup, const SourceKernel& kernel) {
  OpticalSetup parts = setup;
  parts.pixels *= kernel.parts;
  return parts;
}

WaveScene scene_of(const OpticalSetup& setup, const SourceKernel& kernel,
                   const WaveOptions& options, const RunControl& control) {
  WaveScene scene{options, control, wave_colors(in_parts(setup, kernel), options.wavelength), {}};
  if (setup.outline) scene.edge.emplace(*setup.outline);
  return scene;
}

/// Divides a grid of nodes into tiles.
/// @param spacing  of the nodes, mm.
std::vector<Tile> wave_tiles(const WaveScene& scene, const OpticalSetup& setup, double height,
                             const CellRange& cells, const Eigen::Vector2d& spacing) {
  const double length = coherence_length(setup, height, scene.colors.back().wavelength);
  const auto along = [&](std::int64_t count, int axis) {
    const double unit = length / spacing[axis];
    return stretches(count, scene.options.tile * unit, scene.options.overlap * unit);
  };
  std::vector<Tile> tiles;
  for (const Stretch& y : along(cells.rows, 1)) {
    for (const Stretch& x : along(cells.columns, 0)) tiles.push_back({x, y, {}});
  }
  return tiles;
}

}  // namespace

std::vector<std::vector<double>> wave_flux(const OpticalSetup& setup, const GridWindow& grid,
                                           std::span<const SurfaceField* const> surfaces,
                                           const WaveOptions& options, const Executor& executor,
                                           const RunControl& control) {
  const double height = middle_height(grid, *surfaces.front());
  const SourceKernel kernel = source_kernel(setup, height);
  const WaveScene scene = scene_of(setup, kernel, options, control);
  const std::vector<Tile> tiles = wave_tiles(scene, setup, height, all_cells(grid), grid.spacing);
  PointLightOf light(scene, surfaces.size());
  const auto count = static_cast<std::int64_t>(tiles.size());
  for (std::int64_t first = 0; first < count; first += light.batch()) {
    const std::int64_t size = std::min(light.batch(), count - first);
    const auto batch =
        std::span(tiles).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(size));
    std::vector<SurfaceNodes> nodes;
    SurfacePatch patch;
    for (const Tile& tile : batch) {
      for (const SurfaceField* const surface : surfaces) {
        if (control.stop_requested()) throw Interrupted();
        surface->sample(window_of(grid, tile.cells(), 0), executor, patch);
        nodes.push_back(nodes_of(patch));
      }
    }
    light.add(batch, nodes, executor);
    control.report(
        {"waves", static_cast<double>(first + size), static_cast<double>(count), "tiles"});
  }
  SourceBlurOn<Executor> blur(kernel, setup.pixels.x(), setup.pixels.y(), executor);
  std::vector<std::vector<double>> pictures;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const std::vector<double> parts = light.of(s);
    const std::span<const double> flux = blur.apply(executor, parts);
    pictures.emplace_back(flux.begin(), flux.end());
  }
  return pictures;
}

namespace {

/// How the picture is divided into patches, and how far from one rays count, all in √(λ f): the
/// window is 1 up to kFlat and falls to 0 on kRamp. A portrait's picture is 1.6e-4 (MAE) from that
/// in one piece; 1.1e-4 with 4 and 8 in three times the time, 3.2e-4 with patches of 8 in 1.5
/// times.
constexpr double kFlat = 3.0;
constexpr double kRamp = 3.0;

/// Every so many nodes show where the rays of all land.
constexpr int kShownStride = 4;

/// Patches of a picture, and which parts of a lens send rays to each.
class PatchGrid {
 public:
  /// @param unit  √(λ f), pixels along x and y. @param side  of a patch, units; 0: one patch, to
  ///              which all rays count.
  PatchGrid(const Eigen::Vector2i& pixels, const Eigen::Vector2d& unit, double side) {
    if (side > 0.0) {
      flat_ = kFlat * unit;
      ramp_ = kRamp * unit;
    }
    for (int axis = 0; axis < 2; ++axis) {
      const double most = side > 0.0 ? side * unit[axis] : HUGE_VAL;
      const int count = std::max(1, static_cast<int>(std::lround(pixels[axis] / most)));
      for (int k = 0; k <= count; ++k) edges_[axis].push_back(pixels[axis] * k / count);
    }
  }

  [[nodiscard]] std::size_t count() const { return columns() * (edges_[1].size() - 1); }

  [[nodiscard]] Patch patch(std::size_t k) const {
    const std::size_t i = k % columns();
    const std::size_t j = k / columns();
    return {{Eigen::Vector2i(edges_[0][i], edges_[1][j]),
             Eigen::Vector2i(edges_[0][i + 1], edges_[1][j + 1])},
            flat_,
            ramp_};
  }

  /// For each patch the box of the nodes' columns and rows from which rays get through its window.
  /// @param nodes  all of a lens.
  [[nodiscard]] std::vector<Eigen::AlignedBox2i> sources(const WaveColor& color,
                                                         const SurfaceNodes& nodes,
                                                         const Executor& executor) const {
    std::vector<Eigen::Vector2d> landings(nodes.place.size());
    parallel_for(executor, "landings", static_cast<std::int64_t>(landings.size()),
                 [&](std::int64_t n) {
                   const auto at = static_cast<std::size_t>(n);
                   landings[at] = landing_of(color, nodes.place[at], nodes.slope[at]);
                 });
    std::vector<Eigen::AlignedBox2i> boxes(count());
    for (std::size_t n = 0; n < landings.size(); ++n) {
      if (!landings[n].allFinite()) continue;
      const auto number = static_cast<std::int64_t>(n);
      const Eigen::Vector2i node(static_cast<int>(number % nodes.columns),
                                 static_cast<int>(number / nodes.columns));
      const auto [left, right] = near(0, landings[n].x());
      const auto [top, bottom] = near(1, landings[n].y());
      for (std::size_t j = top; j < bottom; ++j) {
        for (std::size_t i = left; i < right; ++i) {
          boxes[j * columns() + i].extend(node);
        }
      }
    }
    return boxes;
  }

 private:
  [[nodiscard]] std::size_t columns() const { return edges_[0].size() - 1; }

  /// First patch along an axis to whose window a place belongs, and one past the last.
  [[nodiscard]] std::pair<std::size_t, std::size_t> near(int axis, double at) const {
    const std::vector<int>& edges = edges_[axis];
    const double margin = flat_[axis] + ramp_[axis];
    const auto first = std::upper_bound(edges.begin() + 1, edges.end(), at - margin);
    const auto last = std::lower_bound(edges.begin(), edges.end() - 1, at + margin);
    return {static_cast<std::size_t>(first - edges.begin() - 1),
            static_cast<std::size_t>(last - edges.begin())};
  }

  std::array<std::vector<int>, 2> edges_;  ///< Of the patches along x and y, pixels.
  Eigen::Vector2d flat_{HUGE_VAL, HUGE_VAL}, ramp_{1.0, 1.0};
};

/// √(λ f) of the longest waves in pixels along x and y.
Eigen::Vector2d wave_unit(const WaveScene& scene, double height) {
  const OpticalSetup& setup = scene.colors.front().setup;
  const double unit = diffraction_width(setup, height, scene.colors.back().wavelength);
  return unit * setup.pixels.cast<double>().cwiseQuotient(setup.image_size);
}

/// The stretch of an axis of a grid around what a stretch of every `stride`-th node shows.
/// @param last  node of the axis.
Stretch stretch_around(int first_shown, int last_shown, int stride, std::int64_t last) {
  const std::int64_t begin = std::max<std::int64_t>(std::int64_t{stride} * (first_shown - 1), 0);
  const std::int64_t end = std::int64_t{stride} * (last_shown + 1);
  // Shown nodes may end before the axis does.
  const bool to_rim = end + stride > last;
  // Windows of patches are zero at the nodes that a ramp of one cell leaves out.
  return {begin, to_rim ? last : end, begin == 0 ? 0 : 1, to_rim ? 0 : 1};
}

/// The lit patches of a picture with their parts of the lens, for one wavelength after the other.
/// @param nodes   every `stride`-th of each axis. @param size  columns and rows of all.
/// @return by patch and wavelength; without cells where no light goes.
std::vector<Tile> patch_tiles(const WaveScene& scene, const PatchGrid& grid,
                              const SurfaceNodes& nodes, int stride, const CellCounts& size,
                              const Executor& executor) {
  const std::size_t colors = scene.colors.size();
  std::vector<Tile> tiles(grid.count() * colors, Tile{{}, {}, {}});
  for (std::size_t c = 0; c < colors; ++c) {
    const auto boxes = grid.sources(scene.colors[c], nodes, executor);
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      const Eigen::AlignedBox2i& box = boxes[k];
      if (box.isEmpty()) continue;
      tiles[k * colors + c] = {stretch_around(box.min().x(), box.max().x(), stride, size.x() - 1),
                               stretch_around(box.min().y(), box.max().y(), stride, size.y() - 1),
                               grid.patch(k)};
    }
  }
  return tiles;
}

/// The cells of all tiles with a patch, and between them.
CellRange cells_of(std::span<const Tile> tiles) {
  CellRange all;
  for (const Tile& tile : tiles) {
    if (!tile.patch) continue;
    const CellRange cells = tile.cells();
    if (all.columns == 0) all = cells;
    const std::int64_t right = std::max(all.column + all.columns, cells.column + cells.columns);
    const std::int64_t top = std::max(all.row + all.rows, cells.row + cells.rows);
    all.column = std::min(all.column, cells.column);
    all.row = std::min(all.row, cells.row);
    all.columns = right - all.column;
    all.rows = top - all.row;
  }
  return all;
}

/// Pictures of one surface by wavelength, patch by patch.
class PatchPictures {
 public:
  explicit PatchPictures(const WaveScene& scene)
      : scene_(scene),
        pictures_(scene.colors.size(),
                  {std::vector<double>(
                       static_cast<std::size_t>(scene.colors.front().setup.pixels.prod()), 0.0),
                   0.0}) {}

  /// Adds `count` tiles from `first` on. @throw Interrupted.
  void add(const std::vector<Tile>& tiles, std::size_t first, std::size_t count,
           const SurfaceNodes& nodes, std::vector<PatchMemory>& memory, const Executor& executor) {
    const std::size_t colors = scene_.colors.size();
    std::vector<PixelLight> lights(count);
    const auto work = [&](std::int64_t job) {
      const auto k = static_cast<std::size_t>(job);
      if (!tiles[first + k].patch) return;
      lights[k] = patch_light(scene_, scene_.colors[(first + k) % colors], nodes, tiles[first + k],
                              memory[first + k]);
    };
    parallel_for(executor, "waves", static_cast<std::int64_t>(lights.size()), work, 1);
    if (scene_.control.stop_requested()) throw Interrupted();
    const Eigen::Vector2i& pixels = scene_.colors.front().setup.pixels;
    for (std::size_t k = 0; k < lights.size(); ++k) {
      add_to(lights[k], pixels, pictures_[(first + k) % colors].flux);
    }
    scene_.control.report({"waves", static_cast<double>(first + count),
                           static_cast<double>(tiles.size()), "patches"});
  }

  /// @param whole  all light of a wavelength.
  void set_whole(std::size_t color, double whole) { pictures_[color].whole = whole; }

  /// Factors of the wavelengths' light in the picture.
  [[nodiscard]] std::vector<double> scales() const {
    std::vector<double> all;
    for (std::size_t c = 0; c < pictures_.size(); ++c) {
      all.push_back(pictures_[c].scale(scene_.colors[c]));
    }
    return all;
  }

  [[nodiscard]] std::vector<double> sum() const {
    std::vector<double> sum(pictures_.front().flux.size(), 0.0);
    for (std::size_t c = 0; c < pictures_.size(); ++c) pictures_[c].add_to(scene_.colors[c], sum);
    return sum;
  }

 private:
  const WaveScene& scene_;
  std::vector<PointPicture> pictures_;
};

/// Light that a whole surface takes in, as its pictures' scale needs it.
/// @param nodes  of the whole surface.
double light_taken_in(const WaveColor& color, const SurfaceNodes& nodes) {
  if (color.light.intake_is_plan_area()) return 0.0;
  double sum = 0.0;
  const auto last_row = static_cast<std::int64_t>(nodes.place.size()) / nodes.columns - 1;
  for (std::int64_t j = 0; j < last_row; ++j) {
    for (std::int64_t i = 0; i + 1 < nodes.columns; ++i) {
      const Eigen::Vector3d &a = nodes.place[nodes.at(i, j)], &b = nodes.place[nodes.at(i + 1, j)],
                            &c = nodes.place[nodes.at(i + 1, j + 1)],
                            &d = nodes.place[nodes.at(i, j + 1)];
      sum += flux_of(color.light, {a, b, c}) + flux_of(color.light, {a, c, d});
    }
  }
  return sum;
}

}  // namespace

/// What of a surface's waves stays while it changes, and what its last picture left.
struct NodeWaves::State {
  State(const OpticalSetup& optics, const GridShape& shape, double height,
        const WaveOptions& wave_options, const Executor& on, const RunControl& run)
      : options(wave_options),
        control(run),
        executor(on),
        kernel(source_kernel(optics, height)),
        scene(scene_of(optics, kernel, options, control)),
        blur(kernel, optics.pixels.x(), optics.pixels.y(), executor),
        patches(scene.colors.front().setup.pixels, wave_unit(scene, height), options.patch),
        memory(patches.count() * scene.colors.size()) {
    const Eigen::Vector2d cells(shape.columns - 1, shape.rows - 1);
    nodes.columns = shape.columns;
    nodes.spacing = optics.lens_size.cwiseQuotient(cells);
    nodes.place.resize(static_cast<std::size_t>(shape.columns) *
                       static_cast<std::size_t>(shape.rows));
    nodes.slope.resize(nodes.place.size());
  }

  WaveOptions options;
  RunControl control;
  Executor executor;
  SourceKernel kernel;
  WaveScene scene;
  SourceBlurOn<Executor> blur;
  PatchGrid patches;
  SurfaceNodes nodes;
  std::vector<Tile> tiles;          ///< patch_tiles() of the last look.
  std::vector<double> scales;       ///< PointPicture::scale() of the last look, by wavelength.
  std::vector<PatchMemory> memory;  ///< Of the tiles.

  [[nodiscard]] double kept_bytes() const {
    double sum = 0.0;
    for (const PatchMemory& of : memory) {
      if (of.field) sum += of.field->bytes();
    }
    return sum;
  }
};

NodeWaves::NodeWaves(const OpticalSetup& setup, const GridShape& nodes, double height,
                     const WaveOptions& options, const Executor& executor,
                     const RunControl& control)
    : state_(std::make_unique<State>(setup, nodes, height, options, executor, control)) {}
NodeWaves::~NodeWaves() = default;

std::vector<double> NodeWaves::look(const double* positions, const double* normals) {
  State& s = *state_;
  for (std::size_t n = 0; n < s.nodes.place.size(); ++n) {
    const auto at = static_cast<std::int64_t>(n);
    const Eigen::Vector3d normal = column3(normals, at);
    s.nodes.place[n] = column3(positions, at);
    s.nodes.slope[n] = -normal.head<2>() / normal.z();
  }
  const auto rows = static_cast<std::int64_t>(s.nodes.place.size()) / s.nodes.columns;
  s.tiles = patch_tiles(s.scene, s.patches, s.nodes, 1, {s.nodes.columns, rows}, s.executor);
  for (PatchMemory& memory : s.memory) memory.field.reset();
  PatchPictures pictures(s.scene);
  for (std::size_t first = 0; first < s.tiles.size(); first += kBatch) {
    const std::size_t count = std::min<std::size_t>(kBatch, s.tiles.size() - first);
    const bool keeps = s.kept_bytes() < kKeptBytes;
    for (PatchMemory& of : std::span(s.memory).subspan(first, count)) of.keeps_field = keeps;
    pictures.add(s.tiles, first, count, s.nodes, s.memory, s.executor);
  }
  for (std::size_t c = 0; c < s.scene.colors.size(); ++c) {
    pictures.set_whole(c, light_taken_in(s.scene.colors[c], s.nodes));
  }
  s.scales = pictures.scales();
  const std::vector<double> parts = pictures.sum();
  const std::span<const double> flux = s.blur.apply(s.executor, parts);
  return {flux.begin(), flux.end()};
}

void NodeWaves::look_adjoint(std::span<const double> by_pixel, double* positions_bar) {
  State& s = *state_;
  std::vector<double> parts_bar(by_pixel.begin(), by_pixel.end());
  if (!s.blur.none()) {
    std::copy(by_pixel.begin(), by_pixel.end(), s.blur.bar().begin());
    parts_bar.assign(static_cast<std::size_t>(s.scene.colors.front().setup.pixels.prod()), 0.0);
    s.blur.apply_adjoint(s.executor, parts_bar);
  }
  const std::size_t colors = s.scene.colors.size();
  std::vector<std::vector<double>> bars(s.tiles.size());
  const auto work = [&](std::int64_t job) {
    const auto k = static_cast<std::size_t>(job);
    if (!s.tiles[k].patch) return;
    bars[k] = patch_heights_bar(s.scene, s.scene.colors[k % colors], s.nodes, s.tiles[k], parts_bar,
                                s.memory[k]);
  };
  parallel_for(s.executor, "waves adjoint", static_cast<std::int64_t>(bars.size()), work, 1);
  if (s.control.stop_requested()) throw Interrupted();
  std::vector<double> heights_bar(s.nodes.place.size(), 0.0);
  for (std::size_t k = 0; k < bars.size(); ++k) {
    const CellRange cells = s.tiles[k].cells();
    std::size_t from = 0;
    if (bars[k].empty()) continue;
    for (std::int64_t row = cells.row; row <= cells.row + cells.rows; ++row) {
      for (std::int64_t column = cells.column; column <= cells.column + cells.columns; ++column) {
        heights_bar[s.nodes.at(column, row)] += s.scales[k % colors] * bars[k][from++];
      }
    }
  }
  // A node that moves aside takes its height along.
  for (std::size_t n = 0; n < heights_bar.size(); ++n) {
    column3(positions_bar, static_cast<std::int64_t>(n)) << -heights_bar[n] * s.nodes.slope[n],
        heights_bar[n];
  }
}

std::vector<double> smooth_wave_flux(const OpticalSetup& setup, const GridWindow& grid,
                                     const SurfaceField& surface, const WaveOptions& options,
                                     const Executor& executor, const RunControl& control) {
  const double height = middle_height(grid, surface);
  const SourceKernel kernel = source_kernel(setup, height);
  const WaveScene scene = scene_of(setup, kernel, options, control);
  const PatchGrid patches(scene.colors.front().setup.pixels, wave_unit(scene, height),
                          options.patch);
  GridWindow shown = grid;
  shown.spacing *= kShownStride;
  shown.columns = (grid.columns - 1) / kShownStride + 1;
  shown.rows = (grid.rows - 1) / kShownStride + 1;
  SurfacePatch patch;
  surface.sample(shown, executor, patch);
  const SurfaceNodes few = nodes_of(patch);
  const std::vector<Tile> tiles =
      patch_tiles(scene, patches, few, kShownStride, {grid.columns, grid.rows}, executor);
  PatchPictures pictures(scene);
  std::vector<PatchMemory> memory(tiles.size());
  for (std::size_t first = 0; first < tiles.size(); first += kBatch) {
    if (control.stop_requested()) throw Interrupted();
    const auto batch = std::span(tiles).subspan(first);
    const std::size_t count = std::min<std::size_t>(kBatch, batch.size());
    // The parts of neighbours overlap.
    surface.sample(window_of(grid, cells_of(batch.first(count)), 0), executor, patch);
    pictures.add(tiles, first, count, nodes_of(patch), memory, executor);
  }
  for (std::size_t c = 0; c < scene.colors.size(); ++c) {
    pictures.set_whole(c, light_taken_in(scene.colors[c], few));
  }
  SourceBlurOn<Executor> blur(kernel, setup.pixels.x(), setup.pixels.y(), executor);
  const std::vector<double> parts = pictures.sum();
  const std::span<const double> flux = blur.apply(executor, parts);
  return {flux.begin(), flux.end()};
}

double wave_seconds(const OpticalSetup& setup, double wavelength) {
  constexpr double kPerInterference =
      3700.0;  // Per lens area · λ / f, which is the number of nodes.
  const std::size_t colors = std::max<std::size_t>(1, setup.spectrum.wavelengths.size());
  const double spot = spot_area(setup, 0.0, wavelength);
  return kPerInterference * static_cast<double>(colors) * setup.lens_size.prod() * wavelength *
         wavelength / spot;
}

GridWindow wave_grid(const OpticalSetup& setup, const OpticalSurface& surface) {
  const auto* const spline = dynamic_cast<const SplineSurface*>(&surface);
  const double pieces = spline != nullptr
                            ? static_cast<double>(spline->net().cell_count())
                            : 0.5 * static_cast<double>(surface.mesh().triangle_count());
  return lens_grid(setup.lens_size, 0.25 * std::sqrt(surface.box().volume() / pieces));
}

}  // namespace lensforge

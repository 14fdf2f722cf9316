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

/// Surfaces of one grid whose heights differ by less, in wavelengths, have the same waves.
constexpr double kSamePath = 1e-5;

/// A stretch of an axis of `all` cells, with ramps of a width but at the ends of the axis.
Stretch stretch_of(std::int64_t begin, std::int64_t count, std::int64_t all, double ramp) {
  const std::int64_t end = begin + count;
  // A ramp neither leaves the axis nor meets the other.
  const auto width = [&](std::int64_t room) {
    return std::min({static_cast<std::int64_t>(std::llround(ramp)), 2 * room, count});
  };
  Stretch one{begin, end, width(begin), width(all - end)};
  one.begin -= one.rise / 2;
  one.end += one.fall - one.fall / 2;
  return one;
}

/// @param tile, overlap  cells; 0: one stretch.
std::vector<Stretch> stretches(std::int64_t cells, double tile, double overlap) {
  const auto all = static_cast<double>(cells);
  const std::int64_t count =
      tile > 0.0 ? std::max<std::int64_t>(1, std::llround(std::min(all, all / tile))) : 1;
  const double ramp = std::min(overlap, std::floor(all / static_cast<double>(count)));
  std::vector<Stretch> parts;
  for (std::int64_t k = 0; k < count; ++k) {
    const std::int64_t begin = cells * k / count;
    parts.push_back(stretch_of(begin, cells * (k + 1) / count - begin, cells, ramp));
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
    if (color.whole > 0.0) return color.share / color.whole;
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
  /// @param memory  by tile, surface and wavelength; may be null.
  /// @throw Interrupted.
  void add(std::span<const Tile> tiles, const std::vector<const SurfaceNodes*>& nodes,
           const Executor& executor, TileMemory* memory) {
    const std::size_t colors = scene_.colors.size();
    const std::vector<std::size_t> first = first_equal(nodes);
    std::vector<std::vector<PixelLight>> lights(nodes.size() * colors);
    const auto work = [&](std::int64_t job) {
      const auto k = static_cast<std::size_t>(job);
      if (first[k / colors] != k / colors) return;
      lights[k] =
          tile_light(scene_, scene_.colors[k % colors], *nodes[k / colors],
                     tiles[k / colors / surfaces_], memory != nullptr ? memory + k : nullptr);
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

  /// Factors of the first surface's light in its picture, by wavelength.
  [[nodiscard]] std::vector<double> scales() const {
    std::vector<double> all;
    for (std::size_t c = 0; c < scene_.colors.size(); ++c) {
      all.push_back(pictures_[c].scale(scene_.colors[c]));
    }
    return all;
  }

 private:
  /// For every surface of a tile the first that has the same nodes, but for rounding: a ball
  /// changes nothing where it reaches the surface.
  [[nodiscard]] std::vector<std::size_t> first_equal(
      const std::vector<const SurfaceNodes*>& nodes) const {
    const double least = kSamePath * scene_.colors.front().wavelength;
    std::vector<std::size_t> first(nodes.size());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      first[k] = k - k % surfaces_;
      while (first[k] < k && !same(*nodes[first[k]], *nodes[k], least)) ++first[k];
    }
    return first;
  }
  /// @param least  mm
  static bool same(const SurfaceNodes& a, const SurfaceNodes& b, double least) {
    const double per_node = least / a.spacing.maxCoeff();
    for (std::size_t n = 0; n < a.place.size(); ++n) {
      if (std::abs(a.place[n].z() - b.place[n].z()) > least) return false;
      if ((a.slope[n] - b.slope[n]).lpNorm<Eigen::Infinity>() > per_node) return false;
    }
    return true;
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
    for (const Stretch& x : along(cells.columns, 0)) tiles.push_back({x, y});
  }
  return tiles;
}

/// Adds the tiles batch by batch.
/// @param nodes_of  makes the nodes of a batch of tiles.
/// @param memory_of  TileMemory of the batch that begins with a tile, or null.
template <class Nodes, class Memory>
void add_tiles(const std::vector<Tile>& tiles, const WaveScene& scene, PointLightOf& light,
               const Executor& executor, const Nodes& nodes_of, const Memory& memory_of) {
  const auto count = static_cast<std::int64_t>(tiles.size());
  for (std::int64_t first = 0; first < count; first += light.batch()) {
    const std::int64_t size = std::min(light.batch(), count - first);
    const auto begin = static_cast<std::size_t>(first);
    const auto batch = std::span(tiles).subspan(begin, static_cast<std::size_t>(size));
    light.add(batch, nodes_of(batch), executor, memory_of(begin));
    scene.control.report(
        {"waves", static_cast<double>(first + size), static_cast<double>(count), "tiles"});
  }
}

/// Pictures of surfaces that are sampled tile by tile.
std::vector<std::vector<double>> pictures_of(const WaveScene& scene, const SourceKernel& kernel,
                                             const std::vector<Tile>& tiles, const GridWindow& grid,
                                             std::span<const SurfaceField* const> surfaces,
                                             const Executor& executor) {
  PointLightOf light(scene, surfaces.size());
  std::vector<SurfaceNodes> sampled;
  const auto sample = [&](std::span<const Tile> batch) {
    sampled.clear();
    SurfacePatch patch;
    for (const Tile& tile : batch) {
      for (const SurfaceField* const surface : surfaces) {
        if (scene.control.stop_requested()) throw Interrupted();
        surface->sample(window_of(grid, tile.cells(), 0), executor, patch);
        sampled.push_back(nodes_of(patch));
      }
    }
    std::vector<const SurfaceNodes*> nodes;
    nodes.reserve(sampled.size());
    for (const SurfaceNodes& one : sampled) nodes.push_back(&one);
    return nodes;
  };
  const auto none = [](std::size_t /*tile*/) { return nullptr; };
  add_tiles(tiles, scene, light, executor, sample, none);
  const Eigen::Vector2i pixels = scene.colors.front().setup.pixels / kernel.parts;
  SourceBlurOn<Executor> blur(kernel, pixels.x(), pixels.y(), executor);
  std::vector<std::vector<double>> pictures;
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const std::vector<double> parts = light.of(s);
    const std::span<const double> flux = blur.apply(executor, parts);
    pictures.emplace_back(flux.begin(), flux.end());
  }
  return pictures;
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
  return pictures_of(scene, kernel, tiles, grid, surfaces, executor);
}

std::vector<double> wave_flux_of(const WavePart& part, const OpticalSetup& setup,
                                 const SurfaceField& surface, const WaveOptions& options,
                                 const Executor& executor, const RunControl& control) {
  const GridWindow& grid = part.grid;
  const double height = middle_height(grid, surface);
  const SourceKernel kernel = source_kernel(setup, height);
  WaveScene scene = scene_of(setup, kernel, options, control);
  for (std::size_t c = 0; c < scene.colors.size(); ++c) {
    WaveColor& color = scene.colors[c];
    if (!part.whole.empty()) color.light = color.light.sharing(part.whole[c]);
    color.whole = 1.0;
  }
  const CellRange& cells = part.cells;
  const CellRange all = all_cells(grid);
  const double ramp = ramp_width(setup, height, options);
  const Tile tile{stretch_of(cells.column, cells.columns, all.columns, ramp / grid.spacing.x()),
                  stretch_of(cells.row, cells.rows, all.rows, ramp / grid.spacing.y())};
  const SurfaceField* const one = &surface;
  return std::move(pictures_of(scene, kernel, {tile}, grid, {&one, 1}, executor).front());
}

double ramp_width(const OpticalSetup& setup, double height, const WaveOptions& options) {
  const double longest = wave_colors(setup, options.wavelength).back().wavelength;
  return options.overlap * coherence_length(setup, height, longest);
}

/// What of a surface's waves stays while it changes, and what its last picture left.
struct NodeWaves::State {
  State(const OpticalSetup& optics, const GridShape& shape, double height,
        const WaveOptions& wave_options, const Executor& on, const RunControl& run)
      : options(wave_options),
        control(run),
        executor(on),
        kernel(source_kernel(optics, height)),
        scene(scene_of(optics, kernel, options, control)),
        blur(kernel, optics.pixels.x(), optics.pixels.y(), executor) {
    const Eigen::Vector2d cells(shape.columns - 1, shape.rows - 1);
    nodes.columns = shape.columns;
    nodes.spacing = optics.lens_size.cwiseQuotient(cells);
    nodes.place.resize(static_cast<std::size_t>(shape.columns) *
                       static_cast<std::size_t>(shape.rows));
    nodes.slope.resize(nodes.place.size());
    tiles =
        wave_tiles(scene, optics, height, {0, 0, shape.columns - 1, shape.rows - 1}, nodes.spacing);
  }

  WaveOptions options;
  RunControl control;
  Executor executor;
  SourceKernel kernel;
  WaveScene scene;
  SourceBlurOn<Executor> blur;
  std::vector<Tile> tiles;
  SurfaceNodes nodes;
  std::vector<double> scales;  ///< PointLightOf::scales()
  std::vector<TileMemory>
      memory;  ///< By tile and wavelength; without fields where there was no room.

  [[nodiscard]] double kept_bytes() const {
    double sum = 0.0;
    for (const TileMemory& of : memory) {
      for (const PlaneField& field : of.fields) sum += field.bytes();
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
  PointLightOf light(s.scene, 1);
  const std::size_t colors = s.scene.colors.size();
  s.memory.resize(s.tiles.size() * colors);
  for (TileMemory& memory : s.memory) {
    memory.fields.clear();
    memory.strayed = false;
  }
  const auto nodes_of = [&](std::span<const Tile> batch) {
    return std::vector<const SurfaceNodes*>(batch.size(), &s.nodes);
  };
  add_tiles(s.tiles, s.scene, light, s.executor, nodes_of, [&](std::size_t tile) {
    TileMemory* const first = s.memory.data() + tile * colors;
    const bool keeps = s.kept_bytes() < kKeptBytes;
    const std::size_t count =
        std::min(s.memory.size() - tile * colors, static_cast<std::size_t>(light.batch()) * colors);
    for (TileMemory& memory : std::span(first, count)) memory.keeps_fields = keeps;
    return first;
  });
  const auto strayed = [](const TileMemory& memory) { return memory.strayed; };
  if (std::any_of(s.memory.begin(), s.memory.end(), strayed)) return {};
  s.scales = light.scales();
  const std::vector<double> parts = light.of(0);
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
  std::vector<std::vector<double>> bars(s.tiles.size() * colors);
  const auto work = [&](std::int64_t job) {
    const auto k = static_cast<std::size_t>(job);
    bars[k] = tile_heights_bar(s.scene, s.scene.colors[k % colors], s.nodes, s.tiles[k / colors],
                               parts_bar, s.memory[k]);
  };
  parallel_for(s.executor, "waves adjoint", static_cast<std::int64_t>(bars.size()), work, 1);
  if (s.control.stop_requested()) throw Interrupted();
  std::vector<double> heights_bar(s.nodes.place.size(), 0.0);
  for (std::size_t k = 0; k < bars.size(); ++k) {
    const CellRange cells = s.tiles[k / colors].cells();
    std::size_t from = 0;
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

double wave_seconds(const OpticalSetup& setup, double wavelength) {
  constexpr double kPerInterference =
      1100.0;  // Per lens area · λ / f, which is about the number of nodes.
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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/predict/prediction.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "cam/leakage/render_field.h"
#include "cam/milled/creases.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/mould.h"
#include "cam/milled/polished_field.h"
#include "cam/plan/cut_plan.h"
#include "cam/plan/finishing.h"
#include "cam/predict/part_surfaces.h"
#include "cam/tolerance/part_model.h"
#include "cam/tolerance/tolerance_forecast.h"
#include "cam/workshop/tool.h"
#include "core/compute/executor.h"
#include "core/error.h"
#include "core/lens/lens.h"
#include "core/lens/surface_field.h"
#include "core/optics/light_path.h"
#include "core/optics/optical_setup.h"
#include "core/optics/outline.h"
#include "core/optics/picture_blur.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/waves/wave_picture.h"

namespace lensforge {
namespace {

/// Side of the cells in which leaking light is located, mm: an operator can find a groove a few of
/// them long.
constexpr double kLeakCell = 1.0;

/// Nodes along the longer side of the surface shown in the report.
constexpr double kViewNodes = 240.0;

constexpr double kMicrometres = 1e3;

/// A cut's first order of diffraction goes to λ / pitch from its rays; with its own width, this
/// much farther.
constexpr double kOrderWidth = 1.2;

/// nm, for the light that a roughness which is not stated might scatter.
constexpr double kExampleRoughness = 10.0;

/// "Haze: 0.313 % of the light, spread over 33.1 pixels."
std::string haze_words(const Haze& haze, const Haze& example) {
  if (!haze.none()) {
    return joined({"Haze: ", percent_text(haze.share), " of the light, spread over ",
                   decimal_text(haze.width(), 1), " pixels."});
  }
  return joined({"Haze is not counted, because the polish's roughness is not stated: ",
                 decimal_text(example.roughness.rms, 0), " nm would scatter ",
                 percent_text(example.share), " of the light."});
}

/// Samples a whole surface coarsely.
SurfacePatch coarse_patch(const SurfaceField& field, const Lens& lens, double spacing,
                          const Executor& executor) {
  SurfacePatch patch;
  field.sample(lens_grid(lens.setup.lens_size, spacing), executor, patch);
  return patch;
}

/// LightPath::intake() of the lens inside of its outline, mm².
double lit_intake(const Lens& lens, const LightPath& light, const Executor& executor) {
  const std::optional<Outline>& outline = lens.setup.outline;
  if (!outline) return intake_of(lens.surface, light);
  return intake_inside(lens.surface, cut_mesh(lens.surface, *outline, executor), light);
}

LensRaster raster_of(const SurfacePatch& patch) {
  LensRaster raster;
  raster.columns = static_cast<int>(patch.window.columns);
  raster.rows = static_cast<int>(patch.window.rows);
  raster.values.assign(patch.z.begin(), patch.z.end());
  return raster;
}

/// Height map from the cells of a leak map.
ReportMap height_map(const LeakMap& map) {
  ReportMap heights{"Height",
                    "Polished part against the design, the largest difference in every square; "
                    "below 0 too much is taken off.",
                    "µm",
                    {static_cast<int>(map.columns), static_cast<int>(map.rows), {}}};
  for (const HeightDifference& difference : map.height) {
    heights.raster.values.push_back(static_cast<float>(kMicrometres * difference.value));
  }
  return heights;
}

/// Largest differences of a front that is cut from the designed one, from the nodes of the part's
/// layers; it lies turned over, so that material is left where it is lower.
LeakMap front_map(const LayeredImage& layers, const SurfaceField& designed,
                  const Eigen::Vector2d& lens_size, const Executor& executor) {
  GridWindow nodes;
  nodes.columns = layers.columns();
  nodes.rows = layers.rows();
  nodes.spacing = lens_size.cwiseQuotient(Eigen::Vector2d(layers.columns() - 1, layers.rows() - 1));
  SurfacePatch patch;
  designed.sample(nodes, executor, patch);
  LeakMap map;
  map.columns = std::max<std::int64_t>(1, std::llround(lens_size.x() / kLeakCell));
  map.rows = std::max<std::int64_t>(1, std::llround(lens_size.y() / kLeakCell));
  map.height.resize(static_cast<std::size_t>(map.columns * map.rows));
  const std::span<const float> part = layers.layer(layer_of(part_layer::kPart));
  for (std::int64_t j = 0; j < nodes.rows; ++j) {
    for (std::int64_t i = 0; i < nodes.columns; ++i) {
      const std::int64_t column = std::min(map.columns - 1, i * map.columns / nodes.columns);
      const std::int64_t row = std::min(map.rows - 1, j * map.rows / nodes.rows);
      const auto from_top = static_cast<std::size_t>((nodes.rows - 1 - j) * nodes.columns + i);
      const double left = patch.z[static_cast<std::size_t>(j * nodes.columns + i)] -
                          static_cast<double>(part[from_top]);
      HeightDifference& most = map.height[static_cast<std::size_t>(row * map.columns + column)];
      if (std::abs(left) > std::abs(most.value)) most = {left, nodes.node(i, j)};
    }
  }
  return map;
}

/// Where the part leaks what the judged picture has too much. Places and remedies are those of the
/// surface. Haze is no place's: with it the map's total would be less than the leakage, and pixels
/// that it alone lights would count light of good places.
LeakMap leak_map(const LeakageChain& chain, const Prediction& prediction,
                 const FieldRenderSetup& setup, const Executor& executor) {
  const LeakageResult& judged = prediction.judged();
  const std::vector<double> weights =
      pixels_with_surplus(judged.clear_part().picture, judged.designed.picture);
  return map_leakage(chain.designed, chain.part(), setup, weights, kLeakCell, executor);
}

}  // namespace

Eigen::Vector2d order_angles(double wavelength, const Passes& passes) {
  Eigen::Vector2d angles = Eigen::Vector2d::Constant(kOrderWidth * wavelength / passes.pitch);
  if (!passes.cross) angles[passes.axis] = 0.0;
  return angles;
}

double smoothing_blur(const OpticalSetup& setup, double sigma) {
  const double enlarged = setup.image_size.cwiseQuotient(setup.lens_size).maxCoeff();
  return kGaussianWidth * sigma * enlarged / pixel_width(setup);
}

std::vector<PictureBlur> part_blurs(const OpticalSetup& setup, const CamOptions& options,
                                    const Passes& passes, double height, double wavelength) {
  std::vector<PictureBlur> blurs = light_blurs(setup, height, wavelength);
  const PolishModel& polish = options.workshop.polish;
  blurs.push_back({"polish", smoothing_blur(setup, polish.sigma)});
  // The ripple reaches twice as far as its steepest slope moves a ray. Of a parabola's p²/(8 R) its
  // amplitude is p²/(2π² R).
  constexpr double kPi = std::numbers::pi;
  const double k = 2.0 * kPi / passes.pitch;
  const double amplitude = passes.pitch * passes.pitch /
                           (2.0 * kPi * kPi * finishing_ball(options).radius()) *
                           transfer_of(polish).at(k);
  const double moved = LightPath(setup).reach(2.0 * k * amplitude, height);
  blurs.push_back({"pitch", moved / pixel_width(setup)});
  return blurs;
}

namespace {

/// The designed back behind a front that is cut; null if the back itself is cut.
std::unique_ptr<MeantSurface> back_behind(const CutSetup& cut) {
  if (!cut.is_front()) return nullptr;
  return meant_surface(optical_surface(*cut.lens, cut.lens->model));
}

FieldRenderSetup render_setup(const Lens& lens, const GridWindow& grid, const Executor& executor) {
  FieldRenderSetup setup{lens.setup, grid};
  setup.surface_height = lens.surface.vertices.row(2).mean();
  for (const LightColor& color : light_colors(lens.setup)) {
    const LightPath light(color.setup);
    if (!light.intake_is_plan_area()) setup.whole.push_back(lit_intake(lens, light, executor));
  }
  return setup;
}

/// A part's chain and its light.
struct ChainLight {
  const CutSetup& cut;
  const LeakageChain& chain;
  FieldRenderSetup setup;
  const Executor& executor;
  const RunControl& control;
};

/// A screen's picture to come, and what is judged by it.
struct PartGoal {
  const Image& target;
  const FluxPicture& designed;
  const Haze& haze;
};

/// The part with its other face as that was made, too. Rays are followed from the front.
RenderedSurface with_made(ChainLight light, const HeightFront& made, const PartGoal& goal) {
  const Lens& lens = *light.cut.lens;
  const HeightMapField other(made);
  const SurfaceField& own = *light.chain.part().field;
  light.setup.back = light.cut.is_front() ? &other : &own;
  light.setup.beyond = overhang(lens.surface, lens.setup);
  const SurfaceField& front = light.cut.is_front() ? own : other;
  RenderedSurface both{
      surface_name::kBoth, render_field(front, light.setup, light.executor, light.control), {}};
  FluxPicture& picture = both.picture;
  if (!goal.haze.none()) {
    picture.flux = hazed(goal.haze, picture.flux, {picture.columns, picture.rows}, light.executor);
  }
  both.quality = PictureJudge(goal.target, goal.designed, light.cut.options.leakage).judge(picture);
  return both;
}

/// The part on the second screen, by rays; and with its other face as made, if that is known.
LeakageResult on_second(ChainLight light, const std::optional<HeightFront>& made) {
  const Image& target = light.cut.lens->second->target;
  light.setup.optics = on_second_screen(light.setup.optics);
  LeakageChain two;
  two.designed = {light.chain.designed.name, light.chain.designed.field};
  two.steps = {{surface_name::kPolished, light.chain.part().field}};
  LeakageResult result = measure_leakage(two, target, light.setup, light.cut.options.leakage,
                                         light.executor, light.control);
  if (made) {
    result.others.push_back(with_made(light, *made, {target, result.designed.picture, Haze()}));
  }
  return result;
}

/// What only a lens of two shaped faces has: its other face as made, and a second picture.
void add_two_faces(const ChainLight& light, Prediction& result) {
  const Lens& lens = *light.cut.lens;
  const std::optional<HeightFront> made = made_face(light.cut);
  if (made) {
    const PartGoal goal{lens.target, result.leakage.designed.picture, result.haze};
    result.leakage.others.push_back(with_made(light, *made, goal));
  }
  if (lens.second) result.second = on_second(light, made);
}

/// The milled surface, for the view and as a mesh.
void add_shape(const PartSurfaces& surfaces, const CutSetup& cut, const Executor& executor,
               Prediction& result) {
  const Lens& lens = *cut.lens;
  const double spacing = lens.setup.lens_size.maxCoeff() / kViewNodes;
  // The view shows a front as it lies on the machine, with the tools' paths.
  const SurfaceField& shown = cut.is_front() ? surfaces.cut() : surfaces.milled();
  result.surface = raster_of(coarse_patch(shown, lens, spacing, executor));
  result.milled = mesh_of(coarse_patch(surfaces.milled(), lens, kMeshSpacing, executor));
}

/// Where the light of a back is lost, and how a face differs from the designed one.
void add_places(const PartSurfaces& surfaces, const LeakageChain& places_chain,
                const ChainLight& light, Prediction& result) {
  if (light.cut.is_front()) {
    result.height = height_map(front_map(result.surfaces, surfaces.designed(),
                                         light.cut.lens->setup.lens_size, light.executor));
    return;
  }
  const LeakMap map = leak_map(light.chain, result, light.setup, light.executor);
  result.places = worst_places(map, places_chain, result.judged(), light.setup, {}, light.executor);
  result.height = height_map(map);
}

}  // namespace

Prediction predict_part(const PartSurfaces& surfaces, const CutSetup& cut, const Executor& executor,
                        const RunControl& control) {
  const Lens& lens = *cut.lens;
  const CamOptions& options = cut.options;
  const Passes passes = cut.passes();
  Prediction result;
  LeakageChain chain = surfaces.chain();
  const Eigen::Vector2d spacings = sample_spacings(options, lens.setup, passes);
  const GridWindow grid = sampled_grid(lens.setup.lens_size, spacings);
  PartLayers layers(
      {{part_layer::kPolished, chain.steps.front().field}, {part_layer::kPart, &surfaces.part()}},
      lens.setup.lens_size, spacings);
  const std::unique_ptr<MeantSurface> back = back_behind(cut);
  FieldRenderSetup setup = render_setup(lens, grid, executor);
  if (back) {
    setup.back = &back->field();
    setup.beyond = overhang(lens.surface, lens.setup);
  }
  for (NamedSurface& other : chain.others) {
    if (other.name != surface_name::kMilled) continue;
    other.grid = lens_grid(lens.setup.lens_size, scallop_spacings(options, lens.setup, passes));
  }
  CreaseMapper creases(grid, {});
  chain.observe = [&](const SurfaceField& field, const CellRange& tile, const SurfacePatch& patch) {
    layers.take(field, patch, executor);
    if (&field == &surfaces.rounded()) creases.add(tile, patch, executor);
  };
  const double wavelength = middle_wavelength(lens.setup, kMmPerNm * options.wavelength_nm);
  const Roughness roughness = roughness_of(options.workshop.polish);
  const auto haze = [&](const Roughness& rough) {
    return haze_of(rough, lens.setup, setup.surface_height, wavelength);
  };
  result.haze = haze(roughness);
  chain.haze = &result.haze;
  result.haze_words = haze_words(result.haze, haze({kExampleRoughness, roughness.correlation}));
  result.leakage = measure_leakage(chain, lens.target, setup, options.leakage, executor, control);
  const LightChoice light =
      cut.is_front() ? LightChoice{false, "by rays: waves are computed of the back's cut alone"}
                     : light_choice(setup, options.light, cut.is_creased(), wavelength);
  result.light_words = light.words;
  result.blurs = part_blurs(lens.setup, options, passes, setup.surface_height, wavelength);
  LeakageChain places_chain = chain;
  if (light.waves) {
    LeakageChain by_waves =
        surfaces.short_chain(lens_grid(lens.setup.lens_size, spacings.maxCoeff()));
    by_waves.haze = &result.haze;
    result.light = {wavelength, order_angles(wavelength, passes)};
    by_waves.waves = {result.light.wavelength, result.light.scatter, &result.leakage.designed};
    result.waves = measure_waves(by_waves, lens.target, setup, options.leakage, executor, control);
    places_chain = by_waves;
  }
  result.sampling = check_sampling(chain, result.leakage, lens.target, setup, executor, control);
  result.surfaces = layers.layers();
  const ChainLight chain_light{cut, chain, setup, executor, control};
  add_places(surfaces, places_chain, chain_light, result);
  result.creases = creases.map();
  add_two_faces(chain_light, result);
  add_shape(surfaces, cut, executor, result);
  return result;
}

namespace {

/// A part of a grid, on that grid or a finer one.
struct CellGrid {
  GridWindow grid;
  CellRange cells;
};

/// Divides every cell into the same number of parts, none wider than `spacings`.
CellGrid refined(const GridWindow& grid, const CellRange& cells, const Eigen::Vector2d& spacings) {
  const auto parts = [&](int axis) {
    const double ratio = grid.spacing[axis] / spacings[axis];
    return std::max<std::int64_t>(1, std::llround(std::ceil(ratio * (1.0 - 1e-9))));
  };
  const std::int64_t across = parts(0);
  const std::int64_t up = parts(1);
  CellGrid fine{grid, cells};
  fine.grid.spacing.x() /= static_cast<double>(across);
  fine.grid.spacing.y() /= static_cast<double>(up);
  fine.grid.columns = (grid.columns - 1) * across + 1;
  fine.grid.rows = (grid.rows - 1) * up + 1;
  fine.cells = {cells.column * across, cells.row * up, cells.columns * across, cells.rows * up};
  return fine;
}

Eigen::AlignedBox2d box_of(const GridWindow& grid, const CellRange& cells) {
  return {grid.node(cells.column, cells.row),
          grid.node(cells.column + cells.columns, cells.row + cells.rows)};
}

/// Rectangle to cut for a rectangle of the lens: mirrored along x and larger in a mould
/// (CastFrame).
Eigen::AlignedBox2d in_mould(const Eigen::AlignedBox2d& lens,
                             const std::optional<CastFrame>& mould) {
  if (!mould) return lens;
  const double s = mould->scale;
  return {Eigen::Vector2d(s * (mould->width - lens.max().x()), s * lens.min().y()),
          Eigen::Vector2d(s * (mould->width - lens.min().x()), s * lens.max().y())};
}

/// Rectangle in the program for one to be cut by a stretched axis.
Eigen::AlignedBox2d as_written(Eigen::AlignedBox2d box, const AxisStretch& stretch) {
  box.min()[stretch.axis] /= stretch.factor;
  box.max()[stretch.axis] /= stretch.factor;
  return box;
}

Eigen::AlignedBox2d grown_within(const Eigen::AlignedBox2d& box, double beyond,
                                 const Eigen::AlignedBox2d& limits) {
  const Eigen::Vector2d all = Eigen::Vector2d::Constant(beyond);
  return Eigen::AlignedBox2d(box.min() - all, box.max() + all).intersection(limits);
}

/// The rows of a raster that cross a box, cut to its length, at the same places. They begin and end
/// within what the raster finishes: beyond that and a ball's reach there is no surface.
RasterPlan raster_around(const RasterPlan& whole, const Eigen::AlignedBox2d& box) {
  const int across = 1 - whole.options.along;
  const double begin = whole.surface.min()[across];
  Eigen::AlignedBox2d part = box;
  const Eigen::AlignedBox2d all = whole.finished();
  const double first = std::max(std::floor((box.min()[across] - begin) / whole.pitch),
                                std::ceil((all.min()[across] - begin) / whole.pitch));
  const double last = std::min(std::ceil((box.max()[across] - begin) / whole.pitch),
                               std::floor((all.max()[across] - begin) / whole.pitch));
  part.min()[across] = begin + first * whole.pitch;
  part.max()[across] = begin + last * whole.pitch;
  RasterOptions options = whole.options;
  options.pitch = whole.pitch;
  options.every = 1;
  options.apron = 0.0;
  RasterPlan plan = plan_finish_raster(part, whole.radius, options);
  plan.rest = whole.rest;
  return plan;
}

/// The runs of a valley's places that lie in a box.
std::vector<Valley> parts_in(const Valley& valley, const Eigen::AlignedBox2d& box) {
  std::vector<Valley> parts(1);
  for (const Eigen::Vector2d& place : valley) {
    if (box.contains(place)) {
      parts.back().push_back(place);
    } else if (!parts.back().empty()) {
      parts.emplace_back();
    }
  }
  std::erase_if(parts, [](const Valley& part) { return part.size() < 2; });
  return parts;
}

/// Change of a picture when the light `now` of a place replaces `before`.
struct Exchange {
  double leakage = 0.0;
  double dark_flux = 0.0;
};

Exchange exchange(const LeakageResult& predicted, const FluxPicture& before,
                  const FluxPicture& now) {
  const std::vector<double>& part = predicted.clear_part().picture.flux;
  const std::vector<double>& designed = predicted.designed.picture.flux;
  Exchange sum;
  for (std::size_t i = 0; i < part.size(); ++i) {
    const double more = now.flux[i] - before.flux[i];
    sum.leakage +=
        std::max(0.0, part[i] + more - designed[i]) - std::max(0.0, part[i] - designed[i]);
    sum.dark_flux += predicted.dark[i] * more;
  }
  return sum;
}

}  // namespace

TrialCut::TrialCut(const TrialSite& site, const CamOptions& changed, const Executor& executor)
    : site_(site), options_(changed), executor_(executor), balls_(site.passes.balls.get()) {
  const FinishGround ground = site.setup.ground();
  if (!same_balls(changed, site.setup.options, ground)) {
    own_ = std::make_unique<const FinishBalls>(site.setup.optical, changed, ground, executor);
    balls_ = own_.get();
  }
  passes_ = balls_->passes(changed, ground);
  for (FinishPass& pass : passes_) pass.plan.options.traces = false;
}

TrialCut::Work TrialCut::work(const RunControl& control) const {
  Work work;
  for (const FinishPass& pass : passes_) {
    const RasterPlan& plan = pass.plan;
    std::vector<Work> rows(kWorkRows);
    parallel_for(executor_, "remedies' work", kWorkRows, [&](std::int64_t i) {
      if (control.stop_requested()) return;
      const std::int64_t number = plan.rows * (2 * i + 1) / (2 * kWorkRows);
      Work& one = rows[static_cast<std::size_t>(i)];
      for (const RowSpan& span : plan.row_spans(number)) {
        Eigen::AlignedBox2d axis(span.line.at(span.from));
        axis.extend(span.line.at(span.to));
        const RowCurves curves(*pass.surface, axis, Executor::serial());
        one.moves += static_cast<double>(cut_row(curves, plan, number, span).moves.size());
        one.minutes += (span.to - span.from + plan.pitch) / pass.tool.feed;
      }
    });
    if (control.stop_requested()) throw Interrupted();
    for (const Work& one : rows) {
      work.moves += one.moves * static_cast<double>(plan.rows) / kWorkRows;
      work.minutes += one.minutes * static_cast<double>(plan.rows) / kWorkRows;
    }
  }
  return work;
}

std::vector<BallPath> TrialCut::paths_around(const Eigen::AlignedBox2d& box,
                                             const RunControl& control) const {
  const AxisStretch stretch = AxisStretch::of(options_.workshop.process.finish);
  std::vector<BallPath> paths;
  for (const FinishPass& pass : passes_) {
    BallPath& path = paths.emplace_back(pass.tool.radius(), 0.0);
    const auto add = [&](const RasterRow& row) { add_way(row, stretch, path); };
    const RasterPlan plan = raster_around(pass.plan, box);
    if (!cut_raster(*pass.surface, plan, executor_, add, control).complete) throw Interrupted();
  }
  if (options_.workshop.process.finish.pencil) {
    BallPath& path = paths.emplace_back(finishing_ball(options_).radius(), 0.0);
    add_pencil(box, path_sink(path, stretch), control);
  }
  return paths;
}

void TrialCut::add_pencil(const Eigen::AlignedBox2d& box, const MoveSink& sink,
                          const RunControl& control) const {
  const PencilOptions pencil =
      pencil_options(options_, site_.setup.z_offset, site_.setup.box.max().z());
  std::vector<Valley> inside;
  for (const Valley& valley :
       find_valleys(site_.setup.mesh(), finishing_ball(options_).radius(), pencil)) {
    for (Valley& part : parts_in(valley, box)) inside.push_back(std::move(part));
  }
  if (inside.empty()) return;
  const FinishRun run{"pencil", finishing_ball(options_), site_.setup.blank.max().z(), {}, {}};
  if (!cut_pencil(balls_->surface(), inside, pencil, run, sink, control).complete) {
    throw Interrupted();
  }
}

/// Rows extend beyond the place by the polish's reach and a diameter, because the last radius of a
/// row is level and its cut extends a radius farther.
LeakTrial TrialCut::at(const LeakPlace& place, const RunControl& control) const {
  const RunControl silent(control.stop_token(), {});
  const CamOptions& before = site_.setup.options;
  const OpticalSetup& optics = site_.setup.lens->setup;
  const GridWindow grid =
      sampled_grid(optics.lens_size, sample_spacings(before, optics, site_.setup.passes()));
  const Passes passes = passes_on_lens(options_, site_.setup.ground());
  const CellGrid fine = refined(grid, place.cells, sample_spacings(options_, optics, passes));
  const std::optional<CastFrame> mould = site_.setup.turned();
  const PolishModel& polish = options_.workshop.polish;
  const double polished =
      polish_reach(polish) * polish.sigma + (1.0 + kCreaseHalo) * grid.spacing.maxCoeff();
  std::optional<WaveOptions> waves = site_.waves.options();
  if (waves) waves->scatter = waves->scatter.cwiseMax(order_angles(waves->wavelength, passes));
  const double height = site_.setup.lens->surface.vertices.row(2).mean();
  const double seen = polished + (waves ? 0.5 * ramp_width(optics, height, *waves) : 0.0);
  const double beyond = (mould ? mould->scale : 1.0) * seen + passes_.front().tool.diameter;
  const AxisStretch stretch = AxisStretch::of(options_.workshop.process.finish);
  const Eigen::AlignedBox2d box =
      grown_within(as_written(in_mould(box_of(grid, place.cells), mould), stretch), beyond,
                   site_.setup.cut_rectangle());
  const MilledField milled(paths_around(box, silent), site_.setup.blank.max().z());
  std::optional<CastField> cast;
  if (mould) cast.emplace(milled, *mould);
  const SurfaceField& raw = cast ? static_cast<const SurfaceField&>(*cast) : milled;
  const PolishedField part(raw, {Eigen::Vector2d(0.0, 0.0), optics.lens_size},
                           options_.workshop.polish);
  FieldRenderSetup setup{.optics = optics, .grid = grid, .surface_height = height};
  const FluxPicture predicted =
      light_of_cells(site_.part, setup, place.cells, waves, executor_, silent);
  setup.grid = fine.grid;
  const FluxPicture now = light_of_cells(part, setup, fine.cells, waves, executor_, silent);
  const Exchange change = exchange(site_.leakage, predicted, now);
  LeakTrial trial;
  trial.leakage = place.leakage + change.leakage;
  trial.dark_flux = place.dark_flux + change.dark_flux;
  return trial;
}

namespace {

constexpr std::size_t kMaxBalls = 3;   ///< Sizes tried.
constexpr std::size_t kMaxCauses = 2;  ///< The larger ones of a place.
constexpr double kMinPart = 0.1;       ///< Minimum share of a leak for its cause to be tried.
constexpr double kHalf = 0.5;

/// A change of one thing, and its name.
struct Change {
  std::string words;
  CamOptions options;
};

std::string length_words(double mm) { return trimmed_decimal(mm, 4) + " mm"; }

Change with_ball(const CamOptions& options, double diameter) {
  Change change{joined({"a ", length_words(diameter), " ball"}), options};
  const int number = finishing_ball(options).number;
  for (Tool& tool : change.options.workshop.tools) {
    if (tool.number == number) tool = resized(tool, diameter);
  }
  return change;
}

Change with_half_the_pitch(const CamOptions& options, double pitch) {
  Change change{joined({"a pitch of ", length_words(kHalf * pitch)}), options};
  change.options.workshop.process.finish.set_pitch(kHalf * pitch);
  return change;
}

/// Decimals are adapted unless they were chosen.
Change with_half_the_tolerances(const CamOptions& options) {
  Change change{"half the tolerances", options};
  FinishProcess& finish = change.options.workshop.process.finish;
  finish.tolerance *= kHalf;
  finish.slope_tolerance *= kHalf;
  return change;
}

std::optional<Change> with_another_decimal(const CamOptions& options) {
  Change change{"one more decimal", options};
  change.options.decimals = decimals_of(options) + 1;
  if (change.options.decimals > options.post.most_decimals) return std::nullopt;
  return change;
}

Change with_half_the_polish(const CamOptions& options) {
  Change change{"half as much polishing", options};
  change.options.workshop.polish.sigma *= kHalf;
  change.options.workshop.polish.rim_depth *= kHalf;
  return change;
}

/// Closer rows compensate for the scallops that less polishing leaves.
Change with_half_the_polish_and_pitch(const CamOptions& options, double pitch) {
  Change change = with_half_the_polish(with_half_the_pitch(options, pitch).options);
  change.words = with_half_the_pitch(options, pitch).words + " and " + change.words;
  return change;
}

/// Changes to try against a cause other than creases, in this order.
std::vector<Change> changes_against(const std::string& cause, const CutSetup& setup) {
  const CamOptions& options = setup.options;
  if (cause == leak_cause::kScallop) return {with_half_the_pitch(options, setup.pitch())};
  if (cause == leak_cause::kChord || cause == leak_cause::kPath) {
    return {with_half_the_tolerances(options)};
  }
  if (cause == leak_cause::kPolish) {
    return {with_half_the_polish(options), with_half_the_polish_and_pitch(options, setup.pitch())};
  }
  const auto finer = with_another_decimal(options);
  if (cause == leak_cause::kDecimals && finer) return {*finer};
  return {};
}

bool is_valid(const CamOptions& options, const Lens& lens) {
  try {
    validate(options, lens.setup);
  } catch (const InputError&) {
    return false;
  }
  return true;
}

/// Tries changes and reports progress.
class Trials {
 public:
  Trials(const TrialSite& site, const Executor& executor, const RunControl& control)
      : site_(site),
        executor_(executor),
        control_(control),
        now_(TrialCut(site, site.setup.options, executor).work(control)) {}

  void run(const Change& change, const std::vector<LeakPlace*>& places) {
    if (places.empty() || !is_valid(change.options, *site_.setup.lens)) return;
    const TrialCut cut(site_, change.options, executor_);
    const TrialCut::Work& work = work_of(change, cut);
    for (LeakPlace* place : places) {
      if (control_.stop_requested()) throw Interrupted();
      LeakTrial trial = cut.at(*place, control_);
      trial.change = change.words;
      trial.moves = work.moves / now_.moves;
      trial.minutes = work.minutes / now_.minutes;
      place->trials.push_back(trial);
      control_.report({"remedies", ++done_, 0.0, change.words});
    }
  }

 private:
  /// Cached: the same change may be tried for several places.
  const TrialCut::Work& work_of(const Change& change, const TrialCut& cut) {
    const auto known = works_.find(change.words);
    if (known != works_.end()) return known->second;
    return works_.emplace(change.words, cut.work(control_)).first->second;
  }

  const TrialSite& site_;
  const Executor& executor_;
  const RunControl& control_;
  TrialCut::Work now_;
  std::map<std::string, TrialCut::Work> works_;  ///< By the changes' names.
  double done_ = 0.0;
};

/// Causes that add to a place's leak, largest first.
std::vector<std::string> causes_of(const LeakPlace& place) {
  std::vector<CausePart> parts = place.parts;
  std::erase_if(parts,
                [&](const CausePart& part) { return part.leakage < kMinPart * place.leakage; });
  std::stable_sort(parts.begin(), parts.end(),
                   [](const CausePart& a, const CausePart& b) { return a.leakage > b.leakage; });
  std::vector<std::string> causes(parts.size());
  std::transform(parts.begin(), parts.end(), causes.begin(),
                 [](const CausePart& part) { return part.cause; });
  return causes;
}

bool is_halved(const LeakPlace* place) {
  return std::any_of(place->trials.begin(), place->trials.end(), [&](const LeakTrial& trial) {
    return trial.leakage <= kHalf * place->leakage;
  });
}

}  // namespace

void try_remedies(const TrialSite& site, std::vector<LeakPlace>& places, const Executor& executor,
                  const RunControl& control) {
  Trials trials(site, executor, control);
  const CamOptions& options = site.setup.options;
  for (std::size_t rank = 0; rank < kMaxCauses; ++rank) {
    std::vector<LeakPlace*> creased;
    for (LeakPlace& place : places) {
      const std::vector<std::string> causes = causes_of(place);
      if (rank >= causes.size() || is_halved(&place)) continue;
      if (causes[rank] == leak_cause::kCrease) creased.push_back(&place);
      for (const Change& change : changes_against(causes[rank], site.setup)) {
        if (!is_halved(&place)) trials.run(change, {&place});
      }
    }
    for (const double diameter : smaller_balls(finishing_ball(options).diameter, kMaxBalls)) {
      trials.run(with_ball(options, diameter), creased);
      std::erase_if(creased, is_halved);
    }
  }
}

namespace {

/// Nominal values that a cut's programs assume.
PartPlan part_plan(const CutSetup& setup, const Haze& haze) {
  const Workshop& shop = setup.options.workshop;
  return {
      setup.lens->setup,     setup.passes(),
      shop.polish,           shop.polish.sigma * (1.0 + kSigmaBound * shop.tolerances.polish_sigma),
      setup.apron_on_lens(), haze};
}

/// Draws parts with the workshop's errors and predicts them. @throw Interrupted
ToleranceForecast draw_parts(const CutSetup& setup, const PartDraws& draws,
                             const PartSurfaces& surfaces, const Prediction& prediction,
                             const Executor& executor, const RunControl& control) {
  const CamOptions& options = setup.options;
  const Lens& lens = *setup.lens;
  const PartPlan plan = part_plan(setup, prediction.haze);
  const PartModel model(surfaces.milled(), plan, executor, control);
  const ErrorSource source{options.workshop.tolerances, lens.setup.lens_size, plan.passes,
                           static_cast<std::uint64_t>(options.tolerance_seed)};
  const PictureJudge judge(lens.target, prediction.leakage.designed.picture, options.leakage);
  return forecast_parts(model, source, judge, draws, executor, control);
}

/// Parts for the range alone.
constexpr int kRangeParts = 12;

}  // namespace

PartDraws part_draws(const CamOptions& options, const OpticalSetup& setup) {
  if (options.tolerances > 0) return ranking_draws(options.tolerances);
  const bool drawn = options.range && options.render && tolerance_fault(options, setup).empty();
  return {drawn ? kRangeParts : 0, 0};
}

namespace {

/// What errors of the front against the back do to the designed pictures.
std::vector<FaceError> errors_between_faces(const CutSetup& cut, const Executor& executor,
                                            const RunControl& control) {
  const Lens& lens = *cut.lens;
  const auto back = meant_surface(optical_surface(lens, lens.model));
  return face_errors(lens, back->field(), render_setup(lens, {}, executor),
                     cut.options.workshop.tolerances, executor, control);
}

}  // namespace

Prediction predict_cut(const CutSetup& setup, const CutPasses& passes, const CutSurfaces& cut,
                       const Executor& executor, const RunControl& control) {
  const CamOptions& options = setup.options;
  const PartSurfaces& surfaces = cut.surfaces();
  Prediction prediction = predict_part(surfaces, setup, executor, control);
  if (options.remedies && !setup.is_front()) {
    try_remedies({setup, passes, surfaces.part(), prediction.judged(), prediction.light},
                 prediction.places, executor, control);
  }
  const PartDraws draws = part_draws(options, setup.lens->setup);
  if (draws.parts > 0) {
    prediction.tolerances = draw_parts(setup, draws, surfaces, prediction, executor, control);
  }
  if (setup.frame && options.range)
    prediction.faces = errors_between_faces(setup, executor, control);
  return prediction;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/plan/cut_plan.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "cam/milled/mould.h"
#include "cam/path/pencil.h"
#include "cam/path/rough.h"
#include "core/error.h"
#include "core/lens/continued_surface.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge {
namespace {

/// Distance of the points kept in a path for display, mm.
constexpr double kSketchSpacing = 0.5;

/// Unit of a program's last decimal where nothing is rounded, mm.
constexpr double kUnrounded = 1e-9;

/// Height of the blank's top while the back of a lens is cut, mm, lens frame.
double top_of_back(const Lens& lens, CamOptions options) {
  options.face = CutFace::kBack;
  options.z_zero = ZZero::kStock;
  return cut_setup(lens, options).blank.max().z();
}

std::shared_ptr<const Lens> lens_to_turn(const Lens& lens, const CamOptions& options,
                                         double back_top) {
  if (options.face == CutFace::kFront) {
    return std::make_shared<const Lens>(front_lens(lens, back_top));
  }
  if (options.part == PartKind::kLens) return nullptr;
  return std::make_shared<const Lens>(mould_lens(lens, {options.shrinkage}));
}

/// Height of the frame that the front's cut leaves, mm, lens frame: below the front. The blank of
/// both cuts has one thickness.
double frame_height(const Lens& lens, CamOptions options) {
  options.face = CutFace::kFront;
  options.z_zero = ZZero::kStock;
  return cut_setup(lens, options).frame.value();
}

/// @throw InputError if the lens is no spline and one is to be cut.
SurfaceModel model_to_cut(const Lens& lens, const CamOptions& options) {
  if (options.face == CutFace::kFront) return SurfaceModel::kSpline;
  const SurfaceModel model = options.surface.value_or(lens.model);
  if (model != SurfaceModel::kSpline || lens.spline) return model;
  throw InputError("--surface spline: must be facet or smooth, since this lens was designed as " +
                   model_name(lens.model));
}

/// @throw InputError if the surface is below the table, where no tool can cut.
void require_above_table(const Eigen::AlignedBox3d& box) {
  if (box.min().z() >= 0.0) return;
  throw InputError("surface: reaches " + decimal_text(-box.min().z(), 4) +
                   " mm below the blank's underside, z = 0, where the table is: design with a "
                   "larger --thickness");
}

Eigen::AlignedBox3d with_heights(Eigen::AlignedBox3d box, const SurfaceMesh& mesh) {
  box.min().z() = std::min(box.min().z(), mesh.vertices.row(2).minCoeff());
  box.max().z() = std::max(box.max().z(), mesh.vertices.row(2).maxCoeff());
  return box;
}

GcodeMotion moved(GcodeMotion motion, const Eigen::Vector2d& by) {
  motion.start.head<2>() += by;
  motion.end.head<2>() += by;
  if (motion.arc) motion.arc->centre.head<2>() += by;
  return motion;
}

double z_offset_of(ZZero zero, double surface_top, const Eigen::AlignedBox3d& blank) {
  switch (zero) {
    case ZZero::kStock:
      return -blank.max().z();
    case ZZero::kLens:
      return -surface_top;
    case ZZero::kTable:
      break;
  }
  return 0.0 - blank.min().z();
}

}  // namespace

CutSetup cut_setup(const Lens& lens, const CamOptions& options) {
  CutSetup setup;
  setup.lens = &lens;
  setup.options = options;
  if (setup.is_front()) setup.back_top = top_of_back(lens, options);
  setup.turned_lens = lens_to_turn(lens, options, setup.back_top);
  setup.model = model_to_cut(lens, options);
  if (options.light == LightModel::kWaves && setup.is_creased()) {
    throw InputError(joined({"--light-model waves: the part has creases, ",
                             setup.model == SurfaceModel::kFacet ? "those of facets" : "unpolished",
                             ", which a wave does not show as rays do; use auto or rays"}));
  }
  setup.apron = apron_to_cut(options);
  const Lens& part = setup.turned_lens ? *setup.turned_lens : lens;
  setup.field = inspect_height_field(part.surface, size_to_cut(options, lens.setup));
  const double scale = setup.turned() ? setup.turned()->scale : 1.0;
  setup.optical =
      continued_surface(optical_surface(part, setup.model), setup.apron, {scale * RunOut{}.length});
  setup.box = with_heights(setup.field.box, setup.mesh());
  require_above_table(setup.box);
  setup.blank = options.workshop.stock.box(setup.box);
  if (setup.is_front()) setup.frame = setup.back_top - setup.blank.max().z();
  if (lies_on_frame(options, lens.setup)) {
    setup.frame = frame_height(lens, options);
    setup.blank.min().z() = *setup.frame;
  }
  setup.z_offset = z_offset_of(options.z_zero, setup.field.box.max().z(), setup.blank);
  return setup;
}

Eigen::AlignedBox3d box_to_cut(const Lens& lens, const CamOptions& options) {
  return cut_setup(lens, options).box;
}

Eigen::AlignedBox2d CutSetup::cut_rectangle() const {
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(apron);
  return {rectangle().min() - around, rectangle().max() + around};
}

double CutSetup::apron_on_lens() const {
  const std::optional<CastFrame> cast = turned();
  return cast ? apron / cast->scale : apron;
}

std::optional<CastFrame> CutSetup::turned() const {
  if (is_front()) return CastFrame{1.0, lens->setup.lens_size.x(), back_top, 0.0};
  if (options.part == PartKind::kLens) return std::nullopt;
  const auto& vertices = lens->surface.vertices;
  return CastFrame{1.0 / (1.0 - options.shrinkage), vertices.row(0).maxCoeff(),
                   vertices.row(2).maxCoeff(), MouldOptions{}.thickness};
}

double CutSetup::safe_z() const {
  return to_resolution(safe_height_of(options.workshop, blank) + z_offset, resolution_of(options)) -
         z_offset;
}

OutlineCut CutSetup::outline_cut() const {
  const RoughProcess& rough = options.workshop.process.rough;
  const int number = options.outline_tool > 0 ? options.outline_tool : rough.tool;
  // The program's last decimal must not round it below the blank.
  const double unit = resolution_of(options);
  const double bottom = std::ceil((blank.min().z() + z_offset) / unit) * unit - z_offset;
  return with_tabs_that_fit(edge_of(lens->setup), {options.workshop.tool(number), options.tabs,
                                                   rough.stepdown, rough.ramp_angle_deg, safe_z(),
                                                   bottom, options.workshop.process.clearance});
}

CutPasses cut_passes(const CutSetup& setup, const Executor& executor) {
  CutPasses passes;
  passes.profile = std::make_shared<const ProfileCutter>(setup.mesh());
  passes.balls =
      std::make_shared<const FinishBalls>(setup.optical, setup.options, setup.ground(), executor);
  passes.finish = passes.balls->passes(setup.options, setup.ground());
  if (setup.cuts_outline())
    require_outline_cut(edge_of(setup.lens->setup), setup.outline_cut(), setup.blank);
  return passes;
}

CutRecord::CutRecord(const CutSetup& setup)
    : stock(whole_blank(setup.options.workshop, setup.box)) {}

std::vector<ReportPath> CutRecord::shown_path() const {
  std::vector<ReportPath> paths;
  for (const auto& sketch : sketches) paths.push_back(sketch->path());
  return paths;
}

namespace {

/// The pencil pass, at a resolution of its own.
OperationSummary run_pencil(const CutSetup& setup, const CutPasses& passes, double resolution,
                            const MoveSink& sink, const RunControl& control) {
  const Tool& ball = finishing_ball(setup.options);
  PencilOptions pencil = pencil_options(setup.options, setup.z_offset, setup.box.max().z());
  pencil.resolution = resolution;
  return cut_pencil(passes.balls->surface(), find_valleys(setup.mesh(), ball.radius(), pencil),
                    pencil, {"pencil", ball, setup.safe_z(), {}, {}}, sink, control);
}

/// The operations of one part, which stream what setup and passes say and fill the record.
struct Operations {
  const CutSetup& setup;
  const CutPasses& passes;
  CutRecord& record;
  Executor executor;
  const RunControl& control;

  [[nodiscard]] const Process& process() const { return setup.options.workshop.process; }
  [[nodiscard]] const Tool& tool(int number) const { return setup.options.workshop.tool(number); }

  /// A sink that sketches the operation and passes its moves to `sink`.
  [[nodiscard]] MoveSink sketched(const std::string& operation, const MoveSink& sink) const {
    record.sketches.push_back(std::make_unique<PathSketch>(operation, kSketchSpacing));
    PathSketch* const sketch = record.sketches.back().get();
    return [sketch, sink](std::span<const PathMove> moves) {
      sketch->add(moves);
      sink(moves);
    };
  }

  [[nodiscard]] RoughSite site() const {
    return {*passes.profile, setup.options.workshop, record.stock};
  }

  [[nodiscard]] ProgramOperation rough() const {
    return {"rough", tool(process().rough.tool), {}, [all = *this](const MoveSink& sink) {
              return cut_rough(all.site(), all.executor, all.sketched("rough", sink), all.control)
                  .summary;
            }};
  }

  [[nodiscard]] ProgramOperation semi() const {
    return {"semi", tool(process().semi.tool), {}, [all = *this](const MoveSink& sink) {
              return cut_semi(all.site(), all.executor, all.sketched("semi", sink), all.control)
                  .summary;
            }};
  }

  [[nodiscard]] OperationSummary run_finish(const FinishPass& pass, const MoveSink& sink) const {
    FinishRun run{pass.name, pass.tool, setup.safe_z(), process().clearance, {}};
    if (pass.plan.options.traces) {
      record.rows.ideal.emplace_back(pass.plan.radius, 0.0);
      record.rows.fitted.emplace_back(pass.plan.radius, 0.0);
      run.look = [&rows = record.rows](const RasterRow& row) { add_row(row, rows); };
    }
    return cut_finish(*pass.surface, pass.plan, run, executor, sketched(pass.name, sink), control);
  }

  [[nodiscard]] ProgramOperation finish(const FinishPass& pass) const {
    const std::string rows = std::to_string(pass.plan.rows) + " rows along " +
                             (pass.plan.options.along == 0 ? "X" : "Y") + ", stepover " +
                             decimal_text(pass.plan.pitch, 5) + " mm";
    return {pass.name, pass.tool, {rows}, [all = *this, pass](const MoveSink& sink) {
              return all.run_finish(pass, sink);
            }};
  }

  [[nodiscard]] ProgramOperation pencil() const {
    return {"pencil", finishing_ball(setup.options), {}, [all = *this](const MoveSink& sink) {
              return run_pencil(all.setup, all.passes, resolution_of(all.setup.options),
                                all.sketched("pencil", sink), all.control);
            }};
  }

  [[nodiscard]] ProgramOperation outline() const {
    const OutlineCut cut = setup.outline_cut();
    const std::string tabs = std::to_string(cut.tabs.count) + " tabs, " +
                             trimmed_decimal(cut.tabs.width, 3) + " mm wide and " +
                             trimmed_decimal(cut.tabs.height, 3) + " mm high";
    return {"outline", cut.tool, {tabs}, [all = *this, cut](const MoveSink& sink) {
              return cut_outline(edge_of(all.setup.lens->setup), cut, all.record.stock,
                                 all.sketched("outline", sink), all.control);
            }};
  }
};

/// What the operator of a lens of two cut faces has to know of this one.
std::vector<std::string> face_comments(const CutSetup& setup) {
  if (!setup.frame) return {};
  const double margin = setup.options.workshop.stock.margin;
  const std::string left = decimal_text(-margin, 3);
  const std::string right = decimal_text(setup.lens->setup.lens_size.x() + margin, 3);
  if (setup.is_front()) {
    return {"setup 1 of 2: the front, cut into the flat blank",
            joined({"edges of the blank: left X ", left, ", lower Y ", left}),
            joined({"then turn it over about the axis along Y: left edge to X ", right}),
            "the back is cut with cam --face back --z-zero table"};
  }
  return {"setup 2 of 2: the back; the blank lies on the frame around its front",
          joined({"blank turned over: the left edge of setup 1 is right, X ", right}),
          joined({"lower edge of the blank: Y ", left})};
}

}  // namespace

ProgramPlan plan_programs(const CutSetup& setup, const CutPasses& passes, CutRecord& record,
                          const Executor& executor, const RunControl& control) {
  const CamOptions& options = setup.options;
  const Process& process = options.workshop.process;
  const double top = setup.blank.max().z() + setup.z_offset;
  const Operations all{setup, passes, record, executor, control};
  ProgramPlan plan;
  plan.job = options.job;
  plan.z_offset = setup.z_offset;
  plan.safe_z = setup.safe_z() + setup.z_offset;
  plan.comments = {"units: mm; X0 Y0: lower left corner of the lens",
                   std::string("Z0: ") + words_for(options.z_zero),
                   "top of the blank: Z " + decimal_text(top, decimals_of(options))};
  for (const std::string& words : face_comments(setup)) plan.comments.push_back(words);
  if (process.rough.enabled) plan.operations.push_back(all.rough());
  if (process.semi.enabled) plan.operations.push_back(all.semi());
  for (const FinishPass& pass : passes.finish) plan.operations.push_back(all.finish(pass));
  if (process.finish.pencil) plan.operations.push_back(all.pencil());
  if (setup.cuts_outline()) plan.operations.push_back(all.outline());
  return plan;
}

ProgramSettings program_settings(const CamOptions& options) {
  ProgramSettings settings;
  settings.decimals = decimals_of(options);
  settings.blend_tolerance = options.workshop.process.finish.tolerance;
  settings.spin_up = options.spin_up;
  settings.spindle_by_hand = options.workshop.machine.spindle_by_hand;
  settings.coolant = options.coolant;
  settings.grouping = options.grouping;
  settings.largest_file = options.largest_file;
  settings.planner = planner_settings(options.workshop.machine);
  return settings;
}

namespace {

/// Passes all motions at feed with a tool in the part's operations to `take`, x and y in the lens
/// frame.
void read_motions(const PartPrograms& programs, int tool,
                  const std::function<void(const GcodeMotion&)>& take, const RunControl& control) {
  for (const WrittenProgram& file : programs.files.files) {
    const auto any = [&](const auto& holds) {
      return std::any_of(file.operations.begin(), file.operations.end(), holds);
    };
    if (!any([&](const OperationTime& time) {
          return programs.files.summaries[time.operation].tool == tool;
        })) {
      continue;
    }
    const auto take_own = [&](const GcodeMotion& motion) {
      const bool own = any([&](const OperationTime& time) {
        return motion.line >= time.line && motion.line < time.end;
      });
      if (own) take(moved(motion, -programs.corner));
    };
    read_path(file.beside.empty() ? file.path : file.beside, programs.files.reader, tool, take_own,
              control);
  }
}

}  // namespace

FinishPaths finish_paths(const CutSetup& setup, const CutPasses& passes, FinishPaths rows,
                         const PartPrograms& programs, const RunControl& control) {
  const FinishProcess& finish = setup.options.workshop.process.finish;
  const Tool& ball = finishing_ball(setup.options);
  FinishPaths paths = std::move(rows);
  if (finish.pencil) {
    // The pencil has no rows: its points are already on the drop surface, so nothing is more exact.
    BallPath pencil(ball.radius(), 0.0);
    if (!run_pencil(setup, passes, kUnrounded, path_sink(pencil), control).complete) {
      throw Interrupted();
    }
    paths.ideal.push_back(pencil);
    paths.fitted.push_back(std::move(pencil));
  }
  const AxisStretch stretch = AxisStretch::of(finish);
  std::vector<Tool> balls{ball};
  if (const Tool* const large = larger_ball(setup.options)) balls.insert(balls.begin(), *large);
  for (const Tool& tool : balls) {
    BallPath written(tool.radius(), setup.z_offset);
    BallPath stretched(tool.radius(), setup.z_offset);
    const auto take = [&](const GcodeMotion& motion) {
      written.add(motion);
      if (stretch.any()) add_stretched(motion, stretch, stretched);
    };
    read_motions(programs, tool.number, take, control);
    paths.written.push_back(std::move(written));
    if (stretch.any()) paths.stretched.push_back(std::move(stretched));
  }
  return paths;
}

}  // namespace lensforge

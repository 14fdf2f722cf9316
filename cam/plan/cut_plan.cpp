// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/plan/cut_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cam/milled/mould.h"
#include "cam/path/rough_passes.h"
#include "core/error.h"
#include "core/text/number_text.h"

namespace lensforge {
namespace {

/// Distance of the points kept in a path for display, mm.
constexpr double kSketchSpacing = 0.5;

/// Unit of a program's last decimal where nothing is rounded, mm.
constexpr double kUnrounded = 1e-9;

std::optional<Lens> mould_to_cut(const Lens& lens, const CamOptions& options) {
  if (options.part == PartKind::kLens) return std::nullopt;
  return mould_lens(lens, {options.shrinkage});
}

/// @throw InputError if the lens is no spline and one is to be cut.
SurfaceModel model_to_cut(const Lens& lens, const CamOptions& options) {
  const SurfaceModel model = options.surface.value_or(lens.model);
  if (model != SurfaceModel::kSpline || lens.spline) return model;
  throw InputError("--surface spline: must be facet or smooth, since this lens was designed as " +
                   model_name(lens.model));
}

/// @throw InputError if the surface is below the table, where no tool can cut.
HeightField above_table(const HeightField& field) {
  if (field.box.min().z() >= 0.0) return field;
  throw InputError("surface: reaches " + decimal_text(-field.box.min().z(), 4) +
                   " mm below the blank's underside, z = 0, where the table is: design with a "
                   "larger --thickness");
}

GcodeMotion moved(GcodeMotion motion, const Eigen::Vector2d& by) {
  motion.start.head<2>() += by;
  motion.end.head<2>() += by;
  if (motion.arc) motion.arc->centre.head<2>() += by;
  return motion;
}

double z_offset_of(ZZero zero, double surface_top, double blank_top) {
  switch (zero) {
    case ZZero::kStock:
      return -blank_top;
    case ZZero::kLens:
      return -surface_top;
    case ZZero::kTable:
      break;
  }
  return 0.0;
}

}  // namespace

CutPlan::CutPlan(const Lens& lens, const CamOptions& options, const Executor& executor,
                 const CutPlace& place)
    : lens_(lens),
      options_(options),
      place_(place),
      executor_(executor),
      mould_lens_(mould_to_cut(lens, options)),
      model_(model_to_cut(lens, options)),
      field_(above_table(inspect_height_field(mesh(), size_to_cut(options, lens.setup)))),
      blank_(options_.workshop.stock.box(field_.box)),
      z_offset_(z_offset_of(options.z_zero, field_.box.max().z(), blank_.max().z())),
      decimals_(decimals_of(options_)),
      profile_(mesh()),
      stock_(whole_blank(options_.workshop, field_.box)),
      optical_(optical_surface(cut(), model_)),
      balls_(optical_, options_, ground(), executor),
      collisions_(profile_, options_.workshop, stock_),
      watch_(collisions_, options_.workshop.tools, z_offset_,
             highest_obstacle(options_.workshop, blank_)) {
  if (cuts_outline(options_, lens_.setup))
    require_outline_cut(edge_of(lens_.setup), outline_cut(), blank_);
}

std::optional<CastFrame> CutPlan::mould() const {
  if (options_.part == PartKind::kLens) return std::nullopt;
  const auto& lens = lens_.surface.vertices;
  return CastFrame{1.0 / (1.0 - options_.shrinkage), lens.row(0).maxCoeff(), lens.row(2).maxCoeff(),
                   MouldOptions{}.thickness};
}

double CutPlan::safe_z() const {
  return to_resolution(safe_height_of(options_.workshop, blank_) + z_offset_,
                       resolution_of(options_)) -
         z_offset_;
}

MoveSink CutPlan::sketched(const std::string& operation, const MoveSink& sink) {
  sketches_.push_back(std::make_unique<PathSketch>(operation, kSketchSpacing));
  PathSketch* const sketch = sketches_.back().get();
  return [sketch, sink](std::span<const PathMove> moves) {
    sketch->add(moves);
    sink(moves);
  };
}

std::vector<ReportPath> CutPlan::shown_path() const {
  std::vector<ReportPath> paths;
  for (const auto& sketch : sketches_) paths.push_back(sketch->path());
  return paths;
}

ProgramOperation CutPlan::rough_operation(const RunControl& control) {
  const Tool& tool = options_.workshop.tool(options_.workshop.process.rough.tool);
  return {"rough", tool, {}, [this, &control](const MoveSink& sink) {
            const RoughSite site{profile_, options_.workshop, stock_};
            return cut_rough(site, executor_, sketched("rough", sink), control).summary;
          }};
}

ProgramOperation CutPlan::semi_operation(const RunControl& control) {
  const Tool& tool = options_.workshop.tool(options_.workshop.process.semi.tool);
  return {"semi", tool, {}, [this, &control](const MoveSink& sink) {
            const RoughSite site{profile_, options_.workshop, stock_};
            return cut_semi(site, executor_, sketched("semi", sink), control).summary;
          }};
}

ProgramOperation CutPlan::finish_operation(const FinishPass& pass, const RunControl& control) {
  const std::string rows = std::to_string(pass.plan.rows) + " rows along " +
                           (pass.plan.options.along == 0 ? "X" : "Y") + ", stepover " +
                           decimal_text(pass.plan.pitch, 5) + " mm";
  return {pass.name, pass.tool, {rows}, [this, pass, &control](const MoveSink& sink) {
            const RasterPlan& plan = pass.plan;
            FinishRun run{pass.name, pass.tool, safe_z(), options_.workshop.process.clearance, {}};
            if (plan.options.traces) {
              paths_.ideal.emplace_back(plan.radius, 0.0);
              paths_.fitted.emplace_back(plan.radius, 0.0);
              run.look = [this](const RasterRow& row) { add_row(row, paths_); };
            }
            return cut_finish(*pass.surface, plan, run, executor_, sketched(pass.name, sink),
                              control);
          }};
}

OperationSummary CutPlan::run_pencil(double resolution, const MoveSink& sink,
                                     const RunControl& control) const {
  PencilOptions pencil = pencil_options(options_, z_offset_, field_.box.max().z());
  pencil.resolution = resolution;
  return cut_pencil(surface(), find_valleys(mesh(), ball().radius(), pencil), pencil,
                    {"pencil", ball(), safe_z(), {}, {}}, sink, control);
}

ProgramOperation CutPlan::pencil_operation(const RunControl& control) {
  return {"pencil", ball(), {}, [this, &control](const MoveSink& sink) {
            return run_pencil(resolution_of(options_), sketched("pencil", sink), control);
          }};
}

OutlineCut CutPlan::outline_cut() const {
  const RoughProcess& rough = options_.workshop.process.rough;
  const int number = options_.outline_tool > 0 ? options_.outline_tool : rough.tool;
  // The program's last decimal must not round it below the blank.
  const double unit = resolution_of(options_);
  const double bottom = std::ceil((blank_.min().z() + z_offset_) / unit) * unit - z_offset_;
  return with_tabs_that_fit(edge_of(lens_.setup), {options_.workshop.tool(number), options_.tabs,
                                                   rough.stepdown, rough.ramp_angle_deg, safe_z(),
                                                   bottom, options_.workshop.process.clearance});
}

ProgramOperation CutPlan::outline_operation(const RunControl& control) {
  const OutlineCut cut = outline_cut();
  const std::string tabs = std::to_string(cut.tabs.count) + " tabs, " +
                           trimmed_decimal(cut.tabs.width, 3) + " mm wide and " +
                           trimmed_decimal(cut.tabs.height, 3) + " mm high";
  return {"outline", cut.tool, {tabs}, [this, cut, &control](const MoveSink& sink) {
            return cut_outline(edge_of(lens_.setup), cut, stock_, sketched("outline", sink),
                               control);
          }};
}

ProgramPlan CutPlan::programs(const RunControl& control) {
  ProgramPlan plan;
  plan.job = options_.job;
  plan.z_offset = z_offset_;
  plan.safe_z = safe_z() + z_offset_;
  plan.comments = {"units: mm; X0 Y0: lower left corner of the lens",
                   std::string("Z0: ") + words_for(options_.z_zero),
                   "top of the blank: Z " + decimal_text(blank_.max().z() + z_offset_, decimals_)};
  if (options_.workshop.process.rough.enabled) plan.operations.push_back(rough_operation(control));
  if (options_.workshop.process.semi.enabled) plan.operations.push_back(semi_operation(control));
  for (const FinishPass& pass : balls_.passes(options_, ground())) {
    plan.operations.push_back(finish_operation(pass, control));
  }
  if (finish().pencil) plan.operations.push_back(pencil_operation(control));
  if (cuts_outline(options_, lens_.setup)) plan.operations.push_back(outline_operation(control));
  for (const ProgramOperation& operation : plan.operations) {
    watched_.push_back(
        {operation.name, operation.tool, descent_rule(options_.workshop.process, operation.name)});
  }
  return plan;
}

ProgramSettings CutPlan::settings() {
  ProgramSettings settings;
  settings.decimals = decimals_;
  settings.blend_tolerance = finish().tolerance;
  settings.spin_up = options_.spin_up;
  settings.spindle_by_hand = options_.workshop.machine.spindle_by_hand;
  settings.coolant = options_.coolant;
  settings.grouping = options_.grouping;
  settings.largest_file = options_.largest_file;
  settings.planner = planner_settings(options_.workshop.machine);
  settings.look = [this](std::size_t operation, const ProgramLine& line) {
    watch_.take(watched_[operation], line);
  };
  return settings;
}

FinishPaths CutPlan::take_finish_paths(const ProgramFiles& programs, const RunControl& control) {
  FinishPaths paths = std::move(paths_);
  if (finish().pencil) {
    // The pencil has no rows: its points are already on the drop surface, so nothing is more exact.
    BallPath pencil(ball().radius(), 0.0);
    if (!run_pencil(kUnrounded, path_sink(pencil), control).complete) throw Interrupted();
    paths.ideal.push_back(pencil);
    paths.fitted.push_back(std::move(pencil));
  }
  const AxisStretch stretch = AxisStretch::of(finish());
  std::vector<Tool> balls{ball()};
  if (const Tool* const large = larger_ball(options_)) balls.insert(balls.begin(), *large);
  for (const Tool& tool : balls) {
    BallPath written(tool.radius(), z_offset_);
    BallPath stretched(tool.radius(), z_offset_);
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

void CutPlan::read_motions(const ProgramFiles& programs, int tool,
                           const std::function<void(const GcodeMotion&)>& take,
                           const RunControl& control) const {
  for (const WrittenProgram& file : programs.files) {
    const auto any = [&](const auto& holds) {
      return std::any_of(file.operations.begin(), file.operations.end(), holds);
    };
    if (!any([&](const OperationTime& time) {
          return programs.summaries[time.operation].tool == tool;
        })) {
      continue;
    }
    const auto take_own = [&](const GcodeMotion& motion) {
      const bool own = any([&](const OperationTime& time) {
        return motion.line >= time.line && motion.line < time.end;
      });
      if (own) take(moved(motion, -place_.corner));
    };
    read_path(file.beside.empty() ? file.path : file.beside, programs.reader, tool, take_own,
              control);
  }
}

}  // namespace lensforge

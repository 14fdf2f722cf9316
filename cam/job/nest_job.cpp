// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <utility>

#include "cam/cam.h"
#include "cam/contact/profile_cutter.h"
#include "cam/job/cut_report.h"
#include "cam/job/job_files.h"
#include "cam/job/nest_plan.h"
#include "cam/path/rough_passes.h"
#include "cam/plan/cut_plan.h"
#include "cam/post/program_writer.h"
#include "cam/predict/prediction.h"
#include "cam/report/report_json.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/version.h"

// Every lens has its own CutPlan, on its own blank: its rectangle and a margin so wide that no
// roughing breaks out of it, at the height of the common blank. The lenses' blanks overlap;
// material that one lens has cleared of its neighbour's counts as still there. The effect of the
// programs on the common blank is checked as a whole (CollisionCheck), including table, clamps and
// travel.
namespace lensforge {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

/// Cells of the common blank's model, mm, and their maximum number along its longer side.
constexpr double kStockCell = 0.1;
constexpr double kMaxCells = 2000.0;

/// Common checks of the programs of all lenses; blank's frame in x and y, lens's in z.
struct CommonBlank {
  CommonBlank(const std::vector<NestLens>& lenses, const NestLayout& layout, const CamOptions& cut,
              double z_offset)
      : workshop(cut.workshop),
        surface(all_surfaces(lenses, layout)),
        box(Eigen::Vector3d::Zero(), layout.blank),
        collisions(
            surface, workshop,
            StockMap(box, std::max(kStockCell, layout.blank.head<2>().maxCoeff() / kMaxCells))),
        watch(collisions, workshop.tools, z_offset, highest_obstacle(workshop, box)) {}

  static SurfaceMesh all_surfaces(const std::vector<NestLens>& lenses, const NestLayout& layout) {
    SurfaceMesh all;
    for (std::size_t k = 0; k < lenses.size(); ++k) {
      const SurfaceMesh& mesh = lenses[k].lens->surface;
      const Eigen::Index vertices = all.vertices.cols();
      const Eigen::Index triangles = all.triangles.cols();
      all.vertices.conservativeResize(3, vertices + mesh.vertices.cols());
      all.triangles.conservativeResize(3, triangles + mesh.triangles.cols());
      auto moved = all.vertices.rightCols(mesh.vertices.cols());
      moved = mesh.vertices;
      moved.topRows<2>().colwise() += layout.lenses[k].box.min();
      all.triangles.rightCols(mesh.triangles.cols()) =
          mesh.triangles.array() + static_cast<int>(vertices);
    }
    return all;
  }

  const Workshop& workshop;
  ProfileCutter surface;
  Eigen::AlignedBox3d box;
  CollisionCheck collisions;
  ProgramWatch watch;
};

/// An operation of one lens among those of the nest.
struct NestStep {
  std::size_t lens = 0;
  std::size_t operation = 0;  ///< In the lens's own plan.
};

/// Moves shifted to their place on the blank.
MoveSink shifted(const MoveSink& sink, const Eigen::Vector2d& by) {
  return [sink, by, held = std::vector<PathMove>()](std::span<const PathMove> moves) mutable {
    held.assign(moves.begin(), moves.end());
    for (PathMove& move : held) {
      move.end.head<2>() += by;
      move.centre.head<2>() += by;
    }
    sink(held);
  };
}

/// One run of make_nest().
class Job {
 public:
  Job(const std::vector<NestLens>& lenses, const NestOptions& options, fs::path folder,
      const Executor& executor, const RunControl& control)
      : lenses_(lenses),
        options_(options),
        folder_(std::move(folder)),
        executor_(executor.with_stop(control.stop_token())),
        control_(control) {
    NestPlan plan = plan_nest(lenses, options);
    layout_ = std::move(plan.layout);
    cuts_ = std::move(plan.cuts);
    const double z_offset = options.cam.z_zero == ZZero::kStock ? -layout_.blank.z() : 0.0;
    common_ = std::make_unique<CommonBlank>(lenses, layout_, options.cam, z_offset);
    for (std::size_t k = 0; k < lenses.size(); ++k) {
      plans_.push_back(std::make_unique<CutPlan>(
          *lenses[k].lens, cuts_[k], executor_,
          CutPlace{layout_.lenses[k].box.min(), &common_->collisions, &common_->watch}));
      programs_.push_back(plans_.back()->programs(control_));
    }
  }

  NestResult run() {
    const Clock::time_point start = Clock::now();
    const ProgramPlan whole = whole_plan();
    const ProgramSettings settings = settings_for_all();
    require_replaceable(whole, settings);
    PendingPrograms programs(whole, options_.cam.post, settings, folder_, control_);
    NestResult result;
    std::vector<PendingFiles> files;
    for (std::size_t k = 0; k < lenses_.size(); ++k) {
      files.push_back(report_files(k, programs.programs()));
    }
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    for (NestedLens& lens : layout_.lenses) lens.report.seconds = seconds;
    result.z_offset = plans_.front()->z_offset();
    describe(programs.programs(), result);
    result.layout = layout_;
    result.message = verdict_words(result.missed(), result.passes() ? 0 : 1);
    publish(programs, files, result);
    return result;
  }

 private:
  /// All of one operation, lens by lens, then all of the next.
  [[nodiscard]] ProgramPlan whole_plan() {
    ProgramPlan whole;
    whole.job = options_.cam.job;
    whole.z_offset = programs_.front().z_offset;
    whole.safe_z = programs_.front().safe_z;
    whole.comments = programs_.front().comments;
    whole.comments.front() = "units: mm; X0 Y0: lower left corner of the blank";
    for (std::size_t k = 0; k < lenses_.size(); ++k) whole.comments.push_back(place_words(k));
    for (const std::string_view name : kOperationNames) {
      for (std::size_t k = 0; k < lenses_.size(); ++k) add_step(name, k, whole);
    }
    std::size_t count = 0;
    for (const ProgramPlan& plan : programs_) count += plan.operations.size();
    LF_CHECK(count == steps_.size(), "an operation without a place in the order");
    return whole;
  }

  [[nodiscard]] std::string place_words(std::size_t k) const {
    const Eigen::Vector2d corner = layout_.lenses[k].box.min();
    return "lens " + std::to_string(k + 1) + " of " + std::to_string(lenses_.size()) + ", X " +
           trimmed_decimal(corner.x(), 2) + " Y " + trimmed_decimal(corner.y(), 2) + ": " +
           lenses_[k].name;
  }

  void add_step(std::string_view name, std::size_t k, ProgramPlan& whole) {
    for (std::size_t i = 0; i < programs_[k].operations.size(); ++i) {
      if (programs_[k].operations[i].name != name) continue;
      ProgramOperation operation = programs_[k].operations[i];
      operation.comments.insert(operation.comments.begin(), place_words(k));
      operation.stream = [stream = operation.stream,
                          corner = Eigen::Vector2d(layout_.lenses[k].box.min())](
                             const MoveSink& sink) { return stream(shifted(sink, corner)); };
      steps_.push_back({k, i});
      DescentRule rule = descent_rule(options_.cam.workshop.process, operation.name);
      rule.rim = layout_.lenses[k].box;
      watched_.push_back({operation.name + " of " + lenses_[k].name, operation.tool, rule});
      whole.operations.push_back(std::move(operation));
    }
  }

  [[nodiscard]] ProgramSettings settings_for_all() {
    ProgramSettings settings = plans_.front()->settings();
    settings.look = [this](std::size_t operation, const ProgramLine& line) {
      common_->watch.take(watched_[operation], line);
    };
    return settings;
  }

  [[nodiscard]] fs::path folder_of(std::size_t k) const { return folder_ / lenses_[k].name; }

  void require_replaceable(const ProgramPlan& whole, const ProgramSettings& settings) const {
    constexpr std::array kOwn{nest_file::kLayout, nest_file::kJson};
    if (fs::exists(folder_ / lens_file::kJson)) {
      throw InputError("--out " + folder_.string() + ": is a lens folder; name another one");
    }
    require_replaceable_cut(folder_,
                            programs_in_the_way(whole, options_.cam.post, settings, folder_), kOwn,
                            options_.cam.force);
    for (std::size_t k = 0; k < lenses_.size(); ++k) {
      if (fs::exists(folder_of(k) / lens_file::kJson)) {
        throw InputError("--out " + folder_.string() + ": the reports of " + lenses_[k].name +
                         " would come into the lens folder " + folder_of(k).string() +
                         "; name another folder");
      }
      require_replaceable_cut(folder_of(k), {}, cut_file_names(options_.cam), options_.cam.force);
    }
  }

  /// The programs, with this lens's operations alone.
  [[nodiscard]] ProgramFiles programs_of(std::size_t k, const ProgramFiles& all) const {
    ProgramFiles own;
    own.names = all.names;
    own.reader = all.reader;
    std::vector<std::optional<std::size_t>> numbers(steps_.size());
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      if (steps_[i].lens != k) continue;
      numbers[i] = own.summaries.size();
      own.summaries.push_back(all.summaries[i]);
      own.times.push_back(all.times[i]);
      own.total += all.times[i];
    }
    for (WrittenProgram file : all.files) {
      std::vector<OperationTime> kept;
      for (OperationTime time : file.operations) {
        if (!numbers[time.operation]) continue;
        time.operation = *numbers[time.operation];
        kept.push_back(time);
      }
      file.operations = std::move(kept);
      if (!file.operations.empty()) own.files.push_back(std::move(file));
    }
    return own;
  }

  /// Report files under temporary names.
  [[nodiscard]] PendingFiles report_files(std::size_t k, const ProgramFiles& all) {
    CutPlan& plan = *plans_[k];
    const Lens& lens = *lenses_[k].lens;
    const ProgramFiles own = programs_of(k, all);
    std::optional<Prediction> prediction;
    if (options_.cam.render) prediction = predict_cut(plan, lens, own, executor_, control_);
    ReportData& report = layout_.lenses[k].report;
    report = make_report(plan, own, prediction, lens);
    require_writable_folder(folder_of(k));
    PendingFiles files(folder_of(k));
    if (prediction) add_prediction_files(*prediction, lens, files);
    add_report_files(report, files);
    return files;
  }

  void describe(const ProgramFiles& all, NestResult& result) const {
    int last = -1;
    for (const WrittenProgram& file : all.files) {
      NestProgram program{
          file.path.filename().string(), {}, file.time.seconds / 60.0, file.time.lines};
      for (const OperationTime& time : file.operations) {
        const int tool = all.summaries[time.operation].tool;
        if (program.tools.empty() || program.tools.back() != tool) program.tools.push_back(tool);
        if (tool != last) ++result.tool_changes;
        last = tool;
      }
      result.programs.push_back(std::move(program));
    }
    for (const NestedLens& lens : layout_.lenses) {
      if (lens.cut_out) continue;
      result.warnings.push_back(lens.name +
                                ": stays joined to the blank and has to be sawn out; --cut-outline "
                                "always cuts it out");
    }
    const std::string advice = outline_advice();
    if (!advice.empty()) result.warnings.push_back(advice);
    const Eigen::Vector3d travel = options_.cam.workshop.machine.travel;
    if ((layout_.blank.array() > travel.array()).any()) {
      result.warnings.push_back("the blank is larger than the machine's travel of " +
                                decimal_text(travel.x(), 0) + " x " + decimal_text(travel.y(), 0) +
                                " x " + decimal_text(travel.z(), 0) + " mm");
    }
  }

  /// Advice on the outlines' tool; empty if it is long enough, or none is cut.
  [[nodiscard]] std::string outline_advice() const {
    const auto cut_out = [](const NestedLens& lens) { return lens.cut_out; };
    const auto first = std::find_if(layout_.lenses.begin(), layout_.lenses.end(), cut_out);
    if (first == layout_.lenses.end()) return "";
    const CutPlan& plan = *plans_[static_cast<std::size_t>(first - layout_.lenses.begin())];
    const double least = std::ceil(1e3 * least_thickness(lenses_, options_)) / 1e3;
    const std::string thinner =
        joined({"--blank ", trimmed_decimal(layout_.blank.x(), 3), ",",
                trimmed_decimal(layout_.blank.y(), 3), ",", trimmed_decimal(least, 3)});
    return outline_tool_advice(plan, layout_.blank.z(), {thinner, least});
  }

  /// Deletes the old reports first and publishes the new ones last.
  void publish(PendingPrograms& programs, std::vector<PendingFiles>& files, NestResult& result) {
    std::vector<fs::path> written;
    for (const WrittenProgram& file : programs.programs().files) written.push_back(file.path);
    const OtherPrograms others = other_programs(folder_, written);
    if (!others.kept.empty()) {
      result.warnings.push_back(
          "the folder holds programs of another job, which were kept: do not run them with it");
    }
    PendingFiles own(folder_);
    own.add(nest_file::kLayout, nest_svg(layout_));
    result.files = written;
    constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
    own.add(nest_file::kJson, nest_json(result, false).dump(1, ' ', false, kReplace) + "\n");
    remove_older();
    programs.publish();
    for (const fs::path& path : others.earlier) {
      std::error_code ignored;
      fs::remove(path, ignored);
    }
    for (PendingFiles& some : files) append(some.publish(), result.files);
    append(own.publish(), result.files);
  }

  static void append(const std::vector<fs::path>& some, std::vector<fs::path>& all) {
    all.insert(all.end(), some.begin(), some.end());
  }

  /// Removes reports of an earlier nest, including those of lenses that are no longer in it.
  void remove_older() const {
    if (!written_by_lensforge(folder_ / nest_file::kJson)) return;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder_, none)) {
      if (!entry.is_directory(none) || fs::exists(entry.path() / lens_file::kJson)) continue;
      remove_prediction(entry.path());
      const bool used = std::any_of(lenses_.begin(), lenses_.end(), [&](const NestLens& one) {
        return one.name == entry.path().filename().string();
      });
      if (!used) fs::remove(entry.path(), none);  // If it is empty.
    }
  }

  const std::vector<NestLens>& lenses_;
  const NestOptions& options_;
  fs::path folder_;
  Executor executor_;
  const RunControl& control_;
  NestLayout layout_;
  std::vector<CamOptions> cuts_;
  std::unique_ptr<CommonBlank> common_;
  std::vector<std::unique_ptr<CutPlan>> plans_;
  std::vector<ProgramPlan> programs_;  ///< Of each lens.
  std::vector<NestStep> steps_;        ///< Of the whole plan's operations.
  std::vector<WatchedOperation> watched_;
};

nlohmann::json lens_json(const NestedLens& lens, bool whole) {
  nlohmann::json json = {{"name", lens.name},
                         {"at", {lens.box.min().x(), lens.box.min().y()}},
                         {"size", {lens.box.sizes().x(), lens.box.sizes().y()}},
                         {"cut_out", lens.cut_out},
                         {"passes", lens.report.verdict.passes()}};
  if (whole) json["report"] = report_json(lens.report);
  return json;
}

}  // namespace

bool NestResult::passes() const {
  return std::all_of(layout.lenses.begin(), layout.lenses.end(),
                     [](const NestedLens& lens) { return lens.report.verdict.passes(); });
}

int NestResult::missed() const {
  int count = 0;
  for (const NestedLens& lens : layout.lenses) count += lens.report.verdict.missed();
  return count;
}

double NestResult::minutes() const {
  double sum = 0.0;
  for (const NestProgram& program : programs) sum += program.minutes;
  return sum;
}

nlohmann::json nest_json(const NestResult& result, bool reports) {
  const NestLayout& layout = result.layout;
  nlohmann::json json = {{"program", program_mark()},
                         {"blank", {layout.blank.x(), layout.blank.y(), layout.blank.z()}},
                         {"zero", "lower left corner of the blank"},
                         {"z_offset", result.z_offset},
                         {"gap", layout.gap},
                         {"edge", layout.edge},
                         {"slot", layout.slot},
                         {"minutes", result.minutes()},
                         {"tool_changes", result.tool_changes},
                         {"programs", nlohmann::json::array()},
                         {"lenses", nlohmann::json::array()}};
  for (const NestProgram& program : result.programs) {
    json["programs"].push_back({{"file", program.file},
                                {"tools", program.tools},
                                {"minutes", program.minutes},
                                {"lines", program.lines}});
  }
  for (const NestedLens& lens : layout.lenses) json["lenses"].push_back(lens_json(lens, reports));
  return json;
}

bool is_name_of_nest(const std::string& name) {
  return name == nest_file::kLayout || name == nest_file::kJson || is_name_of_cut(name);
}

NestResult make_nest(const std::vector<NestLens>& lenses, const NestOptions& options,
                     const fs::path& folder, const Executor& executor, const RunControl& control) {
  try {
    Job job(lenses, options, folder, executor, control);
    require_writable_folder(folder);
    return job.run();
  } catch (const Interrupted&) {
    NestResult result;
    result.status = NestResult::Status::kInterrupted;
    result.message = "interrupted";
    return result;
  }
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cam/plan/cam_options.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/compute/work_estimate.h"
#include "core/lens/lens.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// Names of the files that make_cut() writes beside the programs.
namespace cam_file {
inline constexpr const char* kMilledMesh = "milled.ply";
inline constexpr const char* kMilledPicture = "milled.png";  ///< By rays.
inline constexpr const char* kWall = "wall.png";  ///< As the part is judged: by waves or rays.
inline constexpr const char* kLeakage = "leakage.png";
/// Target, picture as designed, wall.png, and the surface.
inline constexpr const char* kOverview = "overview.png";
inline constexpr const char* kReport = "report.json";
inline constexpr const char* kPage = "report.html";
}  // namespace cam_file

/// Result of a job, whether its blank holds one part or several.
struct JobResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::string message;                       ///< Why it ended, in one line.
  std::vector<std::filesystem::path> files;  ///< Files written, programs first.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
  void interrupt() {
    status = Status::kInterrupted;
    message = "interrupted";
  }
};

/// Result of a cut.
struct CamResult : JobResult {
  ReportData report;  ///< Empty if it was interrupted.
};

/// Makes everything that an operator needs to cut a lens: programs for roughing, semi-finishing and
/// finishing, the surface that they leave, the picture that the part will project, and the report.
/// All files are written under temporary names and renamed together at the end: an interrupted or
/// failed cut leaves the job of an earlier run unchanged. Programs of an earlier run that this cut
/// does not write are removed then; programs that were changed since, or that no cut wrote, are
/// kept and named in the report. The same bytes for any number of threads.
/// @throw InputError naming option, value and rule if an option breaks its rule; naming the surface
///        if it has no triangles, is no height field over the lens's rectangle or does not cover
///        it; naming files that would be replaced but were changed since, or were not written by a
///        cut, without CamOptions::force.
/// @throw RunError if the files cannot be written (disk full, …).
CamResult make_cut(const Lens& lens, const CamOptions& options, const std::filesystem::path& folder,
                   const Executor& executor, const RunControl& control);

/// Removes the files that make_cut() wrote into a folder and nobody has changed since; other files
/// stay.
void remove_cut(const std::filesystem::path& folder);

/// Estimates what make_cut() takes: time, bytes of programs, and memory for the finishing ball's
/// paths where the part is rendered. It uses only area, pitch, tolerances, passes and sample
/// spacing, and is good to a factor of about three because surfaces differ in how often they bend.
/// @param threads  number of threads, ≥ 1. @pre validate() passed.
WorkEstimate estimate_cut(const CamOptions& options, const OpticalSetup& setup, int threads);
/// The same of a lens, whose model counts where the options name none.
WorkEstimate estimate_cut(CamOptions options, const Lens& lens, int threads);

/// Limits of a cut's estimate: six weeks of one processor core, 100 GB of programs.
inline constexpr double kMaxCutSeconds = 1000.0 * 3600.0;
inline constexpr double kMaxCutBytes = 1e11;

/// @throw InputError naming the option that asks for most (--pitch, --sample-spacing, …) and a
///        value that would fit, if the disk of `folder` or the memory is too small for the cut, or
///        if the cut exceeds kMaxCutSeconds of one core or kMaxCutBytes of programs.
void require_room_for_cut(const CamOptions& options, const OpticalSetup& setup,
                          const WorkEstimate& estimate, const std::filesystem::path& folder);

/// Choices to compare: every tool with every pitch, slope tolerance and larger ball.
struct CutChoices {
  std::vector<double> tools;    ///< Diameters of the finishing ball, mm; empty: the workshop's.
  std::vector<double> pitches;  ///< mm; empty: the workshop's.
  /// Numbers of the larger ball, 0 for none; empty: the workshop's.
  std::vector<int> large = {};
  std::vector<double> slopes = {};  ///< Slope tolerances, rad; empty: the workshop's.
  double goal_mae = 0.0;  ///< MAE of the part: the quickest that reaches it wins; 0: none.
};

/// Maximum number of combinations.
inline constexpr std::size_t kMaxChoices = 64;

/// Reads words such as "tool=0.3,0.4mm", "pitch=0.04", "large=0,4", "slope=3e-5" and "mae=0.004".
/// @param option  the words' option, for messages.
/// @throw InputError naming option, word and rule.
CutChoices parse_choices(std::span<const std::string> words, const std::string& option);

/// Name of the page with compare_cuts()'s table.
inline constexpr const char* kComparePage = "compare.html";

struct CutComparison {
  bool complete = false;              ///< False if it was stopped.
  std::vector<ReportChoice> ranking;  ///< Least leakage first, then least hours; finishing only.
  /// Choice to take for CutChoices::goal_mae, or how close the best one comes; empty without a
  /// goal.
  std::string advice;
  std::filesystem::path page;  ///< Page written; empty unless complete.
};

/// Estimates a comparison, whose combinations are computed one after another.
/// @throw InputError if an option breaks its rule in some combination, or disk or memory is too
///        small.
WorkEstimate require_room_for_comparison(const Lens& lens, const CamOptions& options,
                                         const CutChoices& choices,
                                         const std::filesystem::path& folder, int threads);

/// Plans, times and predicts the finishing of every combination as make_cut() does, and ranks them.
/// Programs are written to a temporary folder below `folder` and removed again. Roughing and
/// semi-finishing are left out because they are the same for all.
/// @throw InputError before any work if an option breaks its rule in some combination, or if the
///        page exists and lensforge did not write it, without CamOptions::force; RunError.
CutComparison compare_cuts(const Lens& lens, const CamOptions& options, const CutChoices& choices,
                           const std::filesystem::path& folder, const Executor& executor,
                           const RunControl& control);

/// One of the lenses that share a blank.
struct NestLens {
  std::string name;  ///< Name of its folder of reports; unique.
  const Lens* lens = nullptr;
};

/// Layout of lenses on a blank; mm. Clamps are placed from the blank's lower left corner.
struct NestOptions {
  CamOptions cam;  ///< For all lenses; stock.margin is kept free at the blank's edge.
  Eigen::Vector2d blank = Eigen::Vector2d::Zero();
  std::optional<double> thickness;  ///< Of the blank; none: what the highest lens needs.
  double gap = 0.0;                 ///< Between lenses; 0: the minimum that the tools need.
};

/// A lens's place on the blank.
struct NestedLens {
  std::string name;
  Eigen::AlignedBox2d box;               ///< Its rectangle from the blank's corner, mm.
  std::vector<Eigen::Vector2d> outline;  ///< From the blank's corner, counter-clockwise.
  bool cut_out = false;                  ///< Else it stays joined to the blank.
  ReportData report;
};

/// Layout of a nest.
struct NestLayout {
  Eigen::Vector3d blank = Eigen::Vector3d::Zero();  ///< mm
  double gap = 0.0;
  double edge = 0.0;
  double slot = 0.0;  ///< Width of the cut around lenses, mm; 0 if none is cut out.
  std::vector<NestedLens> lenses;
  std::vector<KeepOut> keep_outs;
};

/// The options of each lens's cut, in the order of the lenses, and the layout.
struct NestPlan {
  NestLayout layout;
  std::vector<CamOptions> cuts;
};

/// Minimum thickness of the common blank: the highest lens with the stock above it, mm.
double least_thickness(const std::vector<NestLens>& lenses, const NestOptions& options);

/// Lays out a nest. @throw InputError as make_nest().
NestPlan plan_nest(const std::vector<NestLens>& lenses, const NestOptions& options);

/// Estimates make_nest(): the sum of estimate_cut() over the lenses.
WorkEstimate estimate_nest(const NestPlan& plan, const std::vector<NestLens>& lenses, int threads);

/// Names of the files that make_nest() writes beside programs and folders of reports.
namespace nest_file {
inline constexpr const char* kLayout = "layout.svg";
inline constexpr const char* kJson = "nest.json";
}  // namespace nest_file

/// One program of the nest.
struct NestProgram {
  std::string file;
  std::vector<int> tools;  ///< In the order of their use; empty where the program names none.
  double minutes = 0.0;
  std::int64_t lines = 0;
};

/// Result of a nest.
struct NestResult : JobResult {
  NestLayout layout;
  std::vector<NestProgram> programs;  ///< In the order in which they are run.
  int tool_changes = 0;               ///< Includes the first tool.
  double z_offset = 0.0;              ///< Program Z − lens-frame z, mm.
  std::vector<std::string> warnings;  ///< Of the nest as a whole.

  [[nodiscard]] bool passes() const;
  /// Number of missed limits, over all lenses.
  [[nodiscard]] int missed() const;
  [[nodiscard]] double minutes() const;
};

/// Makes programs that mill several lenses of one blank with one zero, X0 Y0 in the blank's lower
/// left corner. Each operation is done on all lenses before the next begins, so each tool is loaded
/// only as often as a single lens needs it; outlines come last. A lens's moves are those of its own
/// cut with the nest's margin and allowance, shifted (NestJob.MovesAreThoseOfSingleCuts). Writes
/// the programs, layout.svg and nest.json into `folder`, and each lens's other make_cut() files
/// into a subfolder with the lens's name. All files appear at the end, or none.
/// @throw InputError naming option or lens, value and rule if the lenses do not fit the blank or
///        cannot share one; as make_cut(). @throw RunError
NestResult make_nest(const std::vector<NestLens>& lenses, const NestOptions& options,
                     const std::filesystem::path& folder, const Executor& executor,
                     const RunControl& control);

/// Layout, programs and verdicts in the format of nest.json. @param reports  adds every lens's
/// whole report.
nlohmann::json nest_json(const NestResult& result, bool reports);

/// True if a nest may write a file of this name.
bool is_name_of_nest(const std::string& name);

/// @throw InputError naming a lens folder in which the files of a nest in `folder` would come.
void require_no_lens_folder(const std::vector<NestLens>& lenses,
                            const std::filesystem::path& folder);

}  // namespace lensforge

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
#include "core/compute/run_control.h"
#include "core/compute/work_estimate.h"
#include "core/optics/optical_setup.h"
#include "core/surface/lens.h"

namespace lensforge {

/// Names of the files that make_cut() writes beside the programs.
namespace cam_file {
inline constexpr const char* kMilledMesh = "milled.ply";
inline constexpr const char* kMilledPicture = "milled.png";
inline constexpr const char* kLeakage = "leakage.png";
inline constexpr const char* kReport = "report.json";
inline constexpr const char* kPage = "report.html";
}  // namespace cam_file

/// What came out of a cut.
struct CamResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::string message;                       ///< Why it ended, in one line.
  std::vector<std::filesystem::path> files;  ///< What was written, programs first.
  ReportData report;                         ///< Empty if it was interrupted.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// Makes everything that an operator needs to cut a lens: programs for roughing, semi-finishing and
/// finishing, the surface that they leave, the picture that the part will project, and the report.
/// All files are made beside their names and get them together in the end: what is interrupted or
/// fails before leaves the job of an earlier run as it was. Programs of an earlier run that this
/// one does not write are removed then; programs that were changed since, or are not the cut's, are
/// kept and named in the report. Same bytes for any number of threads.
/// @throw InputError naming option, value and rule if an option breaks its rule; naming the surface
///        if it has no triangles, is no height field over the lens's rectangle or does not cover
///        it; naming files that would be replaced though no cut wrote them as they stand, without
///        CamOptions::force.
/// @throw RunError if the files cannot be written (disk full, …).
CamResult make_cut(const Lens& lens, const CamOptions& options, const std::filesystem::path& folder,
                   const Executor& executor, const RunControl& control);

/// Removes what make_cut() wrote into a folder and nobody changed since; other files stay.
void remove_cut(const std::filesystem::path& folder);

/// What make_cut() is about to take: time, bytes of programs, and memory for the ways of the
/// finishing ball where the part is rendered. From area, pitch, tolerances, passes and sample
/// spacing alone, so good to a factor of three or so: surfaces differ in how often they bend.
/// @param threads  that work at the same time, ≥ 1. @pre validate() passed.
WorkEstimate estimate_cut(const CamOptions& options, const OpticalSetup& setup, int threads);

/// More than anybody waits for or a controller stores: six weeks of one processor core, 100 GB.
inline constexpr double kMaxCutSeconds = 1000.0 * 3600.0;
inline constexpr double kMaxCutBytes = 1e11;

/// @throw InputError naming --pitch, --sample-spacing or what else asks for most, and a value that
///        would fit, if the disk of `folder` or the memory do not hold what the cut takes, or if it
///        takes more than kMaxCutSeconds of one core or kMaxCutBytes of programs.
void require_room_for_cut(const CamOptions& options, const OpticalSetup& setup,
                          const WorkEstimate& estimate, const std::filesystem::path& folder);

/// What is to be compared: every tool with every pitch, slope tolerance and larger ball.
struct CutChoices {
  std::vector<double> tools;    ///< Diameters of the finishing ball, mm; none: the workshop's.
  std::vector<double> pitches;  ///< mm; none: the workshop's.
  /// Numbers of the larger ball, 0 for no such; none: the workshop's.
  std::vector<int> large = {};
  std::vector<double> slopes = {};  ///< Slope tolerances, rad; none: the workshop's.
  double goal_mae = 0.0;  ///< Of the part: the quickest that reaches it is chosen; 0: none.
};

/// Combinations at most.
inline constexpr std::size_t kMaxChoices = 64;

/// Reads words such as "tool=0.3,0.4mm", "pitch=0.04", "large=0,4", "slope=3e-5" and "mae=0.004".
/// @param option  where they come from, for messages.
/// @throw InputError naming option, word and rule.
CutChoices parse_choices(std::span<const std::string> words, const std::string& option);

/// Where compare_cuts() writes its table.
inline constexpr const char* kComparePage = "compare.html";

struct CutComparison {
  bool complete = false;              ///< False if it was stopped.
  std::vector<ReportChoice> ranking;  ///< Least leakage first, then least hours; finishing only.
  /// What to take for CutChoices::goal_mae, or how close the best comes; empty without a goal.
  std::string advice;
  std::filesystem::path page;  ///< What was written; empty unless complete.
};

/// What a comparison takes: one combination is worked on after the other.
/// @throw InputError if an option breaks its rule in some combination, or disk or memory do not
///        hold it.
WorkEstimate require_room_for_comparison(const Lens& lens, const CamOptions& options,
                                         const CutChoices& choices,
                                         const std::filesystem::path& folder, int threads);

/// Plans, times and predicts the finishing of every combination as make_cut() does, and ranks
/// them. Programs are made in a folder of their own below `folder` and removed again. Roughing and
/// semi-finishing are left out: they are the same for all.
/// @throw InputError before any work if an option breaks its rule in some combination, or if there
///        is a page already that is not ours, without CamOptions::force; RunError.
CutComparison compare_cuts(const Lens& lens, const CamOptions& options, const CutChoices& choices,
                           const std::filesystem::path& folder, const Executor& executor,
                           const RunControl& control);

/// One of the lenses that share a blank.
struct NestLens {
  std::string name;  ///< Of its folder of reports: no two have the same.
  const Lens* lens = nullptr;
};

/// How lenses share a blank; mm. Clamps are placed from the blank's lower left corner.
struct NestOptions {
  CamOptions cam;  ///< Of all lenses; stock.margin is kept free at the blank's edge.
  Eigen::Vector2d blank = Eigen::Vector2d::Zero();
  std::optional<double> thickness;  ///< Of the blank; none: what the highest lens needs.
  double gap = 0.0;                 ///< Between lenses; 0: the least that the tools need.
};

/// A lens where it lies on the blank.
struct NestedLens {
  std::string name;
  Eigen::AlignedBox2d box;               ///< Its rectangle from the blank's corner, mm.
  std::vector<Eigen::Vector2d> outline;  ///< Likewise, counter-clockwise.
  bool cut_out = false;                  ///< Else it stays joined to the blank.
  ReportData report;
};

/// How a nest is laid out.
struct NestLayout {
  Eigen::Vector3d blank = Eigen::Vector3d::Zero();  ///< mm
  double gap = 0.0;
  double edge = 0.0;
  double slot = 0.0;  ///< Width of the cut around lenses, mm; 0 if none is cut out.
  std::vector<NestedLens> lenses;
  std::vector<KeepOut> keep_outs;
};

/// The options of each lens's cut in the order of the lenses, and where they lie.
struct NestPlan {
  NestLayout layout;
  std::vector<CamOptions> cuts;
};

/// Of the common blank, at least: the highest lens with the stock above it, mm.
double least_thickness(const std::vector<NestLens>& lenses, const NestOptions& options);

/// @throw InputError as make_nest().
NestPlan plan_nest(const std::vector<NestLens>& lenses, const NestOptions& options);

/// What make_nest() takes: all that estimate_cut() says of each lens.
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

/// What came out of a nest.
struct NestResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::string message;                       ///< Why it ended, in one line.
  std::vector<std::filesystem::path> files;  ///< What was written, programs first.
  NestLayout layout;
  std::vector<NestProgram> programs;  ///< In the order in which they are run.
  int tool_changes = 0;               ///< The first tool counts, too.
  double z_offset = 0.0;              ///< Program Z − lens-frame z, mm.
  std::vector<std::string> warnings;  ///< Of the nest as a whole.

  [[nodiscard]] bool done() const { return status == Status::kDone; }
  [[nodiscard]] bool passes() const;
  /// Limits that are missed, over all lenses.
  [[nodiscard]] int missed() const;
  [[nodiscard]] double minutes() const;
};

/// Makes programs that mill several lenses of one blank with one zero, X0 Y0 in the blank's lower
/// left corner: all of one operation and then all of the next, so that every tool is changed once
/// where one lens needs it once, outlines last of all. A lens's moves are those of its own cut with
/// the margin and the allowance that the nest gives it, shifted
/// (NestJob.MovesAreThoseOfSingleCuts). Writes the programs, layout.svg and nest.json into
/// `folder`, and into a folder of its name below what make_cut() writes of each lens beside
/// programs. All appear in the end or none.
/// @throw InputError naming option or lens, value and rule: the lenses do not fit the blank, or not
///        one blank; as make_cut(). @throw RunError
NestResult make_nest(const std::vector<NestLens>& lenses, const NestOptions& options,
                     const std::filesystem::path& folder, const Executor& executor,
                     const RunControl& control);

/// The layout, programs and verdicts as nest.json has them. @param reports  every lens's whole
/// report, too.
nlohmann::json nest_json(const NestResult& result, bool reports);

/// Whether a file of this name may be one of a nest's own.
bool is_name_of_nest(const std::string& name);

}  // namespace lensforge

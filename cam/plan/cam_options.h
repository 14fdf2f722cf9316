// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cam/leakage/leakage.h"
#include "cam/path/operation.h"
#include "cam/post/post_description.h"
#include "cam/report/verdict.h"
#include "cam/workshop/workshop.h"
#include "core/lens/optical_surface.h"
#include "core/optics/optical_setup.h"
#include "design/spline/made_by.h"

namespace lensforge {

class Description;
struct Passes;

/// Position of program Z = 0.
enum class ZZero {
  kStock,  ///< Top of the blank.
  /// What the blank lies on: z = 0 of the lens frame, or below a front that is a height map the
  /// frame that its cut leaves (lies_on_frame()).
  kTable,
  kLens,  ///< Highest point of the finished surface.
};

/// The face of a lens that is cut.
enum class CutFace {
  kBack,  ///< The optical surface, where light leaves the lens.
  /// A height map where light enters. It is cut first, into a flat blank, turned over about the
  /// lens's y axis (front_lens()).
  kFront,
};

/// The part that is made.
enum class PartKind {
  kLens,
  kMould,  ///< The negative, from which lenses are cast.
  kPrint,  ///< The lens, printed and levelled by a film; it is not cut.
};

/// Parts to be cut out of their blank, last of all.
enum class OutlineWish {
  kIfShaped,  ///< A lens that has an outline.
  kAlways,    ///< A rectangular one, too.
  kNever,
};

/// All options of a lens's cut and of its prediction, except the lens itself.
struct CamOptions {
  Workshop workshop;  ///< Machine, blank, clamps, tools, process.
  PostDescription post = find_post("linuxcnc", "--post");
  ProgramGrouping grouping = ProgramGrouping::kOperation;
  std::uintmax_t largest_file = 0;  ///< Bytes of a program, ≥ 65536; 0 for the dialect's limit.
  double spin_up = 3.0;             ///< Dwell after the spindle was switched on, s, 0 … 3600.
  Coolant coolant = Coolant::kOff;
  /// Digits after the point in the programs, 4 … 6; 0: as many as the tolerances require.
  int decimals = 0;
  bool arcs = true;  ///< Arcs in the finishing rows if the dialect has them.
  ZZero z_zero = ZZero::kStock;
  std::string job = "lens";  ///< Name of the part.

  PartKind part = PartKind::kLens;
  CutFace face = CutFace::kBack;
  /// Folder of the cut of the other face, whose part is predicted with this one; none if empty.
  std::filesystem::path other_cut;
  double shrinkage = 0.0;  ///< Of casts from a mould, share of a length, 0 … 0.2.
  /// Surface to cut: the mesh's facets, the smooth surface over the mesh (SmoothSurface), or the
  /// lens's own spline; none: the model that the lens was designed with.
  std::optional<SurfaceModel> surface;

  OutlineWish cut_outline = OutlineWish::kIfShaped;
  int outline_tool = 0;  ///< Tool::number, a flat end mill; 0 takes the roughing tool.
  TabOptions tabs;

  bool force = false;  ///< Replace files that no cut wrote or that were changed since.

  bool render = true;    ///< Compute the picture of the part; else programs only.
  bool remedies = true;  ///< Try remedies where most light leaks, if the picture is computed.
  int tolerances = 0;    ///< Number of parts drawn with errors (Workshop::tolerances), 0 or ≥ 10.
  bool range = true;     ///< Without `tolerances`, draw a few where it can be done, for the range.
  int tolerance_seed = 1;  ///< Of the random numbers for drawing them, ≥ 0.
  /// Of the rendered surface, mm, 0.001 … 1; 0: the larger of a sixth of the pitch and a third of
  /// the polish's σ.
  double sample_spacing = 0.0;
  LightModel light = LightModel::kAuto;  ///< Of the picture that the verdict judges.
  double wavelength_nm = 550.0;          ///< Of waves, for a lens without a spectrum.
  LeakageOptions leakage;
  CutLimits limits;
  std::set<std::string> stated_limits;  ///< Keys of CutLimits that are limits, not advice.
};

/// Minimum and maximum of the options below; for those of the workshop see workshop_limits().
namespace cam_limit {
inline constexpr double kDark = 1e3;   ///< Of LeakageOptions::dark_below: above any picture.
inline constexpr double kLimit = 1e6;  ///< Of each of CutLimits, in its own unit.
inline constexpr double kFinestSample = 1e-3;   ///< mm
inline constexpr double kCoarsestSample = 1.0;  ///< mm
/// Number of drawn parts: fewer than 10 have no tenth, and 100,000 take a day.
inline constexpr int kFewestParts = 10;
inline constexpr int kMaxParts = 100000;
inline constexpr int kLargestSeed = 999999;
/// Of tabs, mm: a thinner tab does not hold, and a wider one cannot be snapped by hand.
inline constexpr double kThinnestTab = 0.1;
inline constexpr double kWidestTab = 50.0;
inline constexpr double kHighestTab = 10.0;
inline constexpr int kMaxTabs = 100;
}  // namespace cam_limit

/// Size of the surface to cut seen from above, mm: the lens's, or that of the larger mould.
Eigen::Vector2d size_to_cut(const CamOptions& options, const OpticalSetup& setup);

/// Sample spacing of the surface across the passes, mm. @param passes  on the lens.
double sample_spacing(const CamOptions& options, const Passes& passes);
/// The same along x and y: up to three times as large along passes that do not cross, as far as
/// polish and pixels allow.
Eigen::Vector2d sample_spacings(const CamOptions& options, const OpticalSetup& setup,
                                const Passes& passes);
/// The same for an unpolished surface: another three times as large along passes.
Eigen::Vector2d scallop_spacings(const CamOptions& options, const OpticalSetup& setup,
                                 const Passes& passes);

/// The lens's edge: its outline, or its rectangle; counter-clockwise, mm.
std::vector<Eigen::Vector2d> edge_of(const OpticalSetup& setup);

/// True if the outline is cut.
bool cuts_outline(const CamOptions& options, const OpticalSetup& setup);

/// Minimum width of the frame that a front's cut leaves, mm: as wide as a tab, which holds a part;
/// and of a tool's radius, less than which roughing takes off.
inline constexpr double kMinFrame = 3.0;

/// Width of the blank's rim that the cut of a front leaves flat on every side, mm; below 0 where
/// the tools go beyond the blank. @pre the front is a height map.
double frame_width(const CamOptions& options, const OpticalSetup& setup);

/// Least stock.margin with which both faces can be cut in two setups, up to the next tenth, mm.
/// @pre the front is a height map.
double margin_for_frame(const CamOptions& options, const OpticalSetup& setup);

/// True if the blank lies on such a frame while its back is cut.
bool lies_on_frame(const CamOptions& options, const OpticalSetup& setup);

/// Why CamOptions::tolerances cannot draw parts of such a lens, or so cut; empty if it can.
std::string tolerance_fault(const CamOptions& options, const OpticalSetup& setup);

/// @throw InputError naming option, value and rule if an option breaks its rule on its own or
///        against the size of the lens.
void validate(const CamOptions& options, const OpticalSetup& setup);

/// The process that a design shapes a part for: the finishing ball's passes and the polish, of a
/// mould those of its cast, of a print its pixels and the film. The slopes that a scallop's pitch
/// depends on are not known before the design. @param robust  two parts, polished less and more by
/// Tolerances::polish_sigma.
MadeBy made_by(const CamOptions& options, bool robust);

/// @throw InputError if a shrinkage is stated of anything but casts from a mould.
void validate_shrinkage(const CamOptions& options);

/// Names in plain words: "top of the blank".
const char* words_for(ZZero zero);
const char* words_for(SurfaceModel surface);

/// The command's options. Numbers of the workshop file use its values and limits.
void describe(Description& d, CamOptions& options);
/// Of these the light's model and wavelength alone. @param picture  that they are of, in words.
void describe_light(Description& d, CamOptions& options, const std::string& picture);

}  // namespace lensforge

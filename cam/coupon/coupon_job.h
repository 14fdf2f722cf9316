// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/profile_cutter.h"
#include "cam/coupon/coupon.h"
#include "cam/coupon/coupon_fit.h"
#include "cam/path/collision.h"
#include "cam/plan/program_watch.h"
#include "cam/post/program_writer.h"
#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"

namespace lensforge {

/// Plan of a coupon: one operation of the finishing ball, whose pads are cut as `cam` cuts a plane.
class CouponPlan {
 public:
  /// @throw InputError as coupon_layout() does.
  CouponPlan(const CouponOptions& options, const Executor& executor);
  CouponPlan(const CouponPlan&) = delete;
  CouponPlan& operator=(const CouponPlan&) = delete;

  /// The program's plan. Its operation uses this object and can run once.
  [[nodiscard]] ProgramPlan program(const RunControl& control);
  /// The programs' settings, whose read-back lines go to this object's checks.
  [[nodiscard]] ProgramSettings settings();

  [[nodiscard]] const CouponLayout& layout() const { return layout_; }
  [[nodiscard]] const Eigen::AlignedBox3d& blank() const { return blank_; }
  /// Faults of the program as it was read back: collisions, unknown motions, motion beyond the
  /// machine's travel. A sentence each.
  [[nodiscard]] std::vector<std::string> faults() const;

 private:
  [[nodiscard]] const Tool& ball() const;
  [[nodiscard]] double top() const { return blank_.max().z(); }
  [[nodiscard]] double resolution() const;
  /// Rounded to a number of the program.
  [[nodiscard]] double rounded(double z) const;
  [[nodiscard]] double safe_z() const;
  OperationSummary cut(const MoveSink& sink, const RunControl& control);
  void cut_groove(const CouponGroove& groove, const MoveSink& sink,
                  OperationSummary& summary) const;
  [[nodiscard]] bool cut_pad(const CouponPad& pad, const MoveSink& sink, const RunControl& control,
                             OperationSummary& summary) const;

  CouponOptions options_;
  Executor executor_;
  CouponLayout layout_;
  Eigen::AlignedBox3d blank_;
  int decimals_;
  SurfaceMesh floor_;        ///< At the pads' depth.
  ProfileCutter deepest_;    ///< Lowest surface allowed to any cut.
  FacetCutSurface surface_;  ///< The floor for the finishing ball.
  CollisionCheck collisions_;
  ProgramWatch watch_;
};

/// Names of the files that make_coupon() writes beside its program.
namespace coupon_file {
inline constexpr const char* kSheet = "coupon.html";
inline constexpr const char* kReadings = "measured.toml";
}  // namespace coupon_file

/// Result of make_coupon().
struct CouponResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::vector<std::filesystem::path> files;  ///< Programs first.
  CouponLayout layout;
  CouponFit known;  ///< Has the uncertainties that the template states.
  double minutes = 0.0;
  /// Faults of the program: collisions, unknown motions, motion beyond the travel.
  std::vector<std::string> faults;

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// True if a file of this name may belong to a coupon.
bool is_name_of_coupon(const std::string& name);

/// Writes everything that calibrates a workshop: the coupon's program, the sheet with its drawing
/// and measuring instructions, and the file for the readings. All files get their names together at
/// the end. Same bytes for any number of threads.
/// @throw InputError as validate(), and naming files that would be replaced but hold readings, or
///        were changed or not written by lensforge, without CouponOptions::force.
/// @throw RunError if the files cannot be written.
CouponResult make_coupon(const CouponOptions& options, const std::filesystem::path& folder,
                         const Executor& executor, const RunControl& control);

/// Content of the measuring sheet of a coupon.
struct CouponSheet {
  CouponLayout layout;
  CouponReadings expected;
  CouponFit known;    ///< Uncertainty of each value if all readings are taken.
  std::string tool;   ///< In words.
  std::string files;  ///< Names of the programs.
  double minutes = 0.0;
  double thickness = 0.0;  ///< Of the blank, mm.
  std::vector<std::string> warnings;
};

/// One printable page: drawing, steps, quantities to measure, tools, and the keys for the readings.
std::string coupon_sheet(const CouponSheet& sheet);

/// The drawing alone, SVG: the coupon from above with its dimensions, marks, grooves and pads.
std::string coupon_drawing(const CouponLayout& layout);

}  // namespace lensforge

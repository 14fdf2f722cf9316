// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/profile_cutter.h"
#include "cam/coupon/coupon_fit.h"
#include "cam/coupon/coupon_layout.h"
#include "cam/path/collision.h"
#include "cam/plan/program_watch.h"
#include "cam/post/program_writer.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// A coupon's cut: one operation of the finishing ball, whose pads are cut as `cam` cuts a plane.
class CouponPlan {
 public:
  /// @throw InputError as coupon_layout() does.
  CouponPlan(const CouponOptions& options, const Executor& executor);
  CouponPlan(const CouponPlan&) = delete;
  CouponPlan& operator=(const CouponPlan&) = delete;

  /// The program's plan. Its operation works on this object, once.
  [[nodiscard]] ProgramPlan program(const RunControl& control);
  /// What is read back of the program is looked over by this object.
  [[nodiscard]] ProgramSettings settings();

  [[nodiscard]] const CouponLayout& layout() const { return layout_; }
  [[nodiscard]] const Eigen::AlignedBox3d& blank() const { return blank_; }
  /// What the machine must not do, of the program as it was read back: collisions, ways that nobody
  /// can know, motion beyond the machine's travel. A sentence each.
  [[nodiscard]] std::vector<std::string> faults() const;

 private:
  [[nodiscard]] const Tool& ball() const;
  [[nodiscard]] double top() const { return blank_.max().z(); }
  [[nodiscard]] double resolution() const;
  /// As a number of the program.
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
  SurfaceMesh floor_;        ///< In the height of the pads.
  ProfileCutter deepest_;    ///< No cut goes below it.
  FacetCutSurface surface_;  ///< The floor, for the finishing ball.
  CollisionCheck collisions_;
  ProgramWatch watch_;
};

/// Names of the files that make_coupon() writes beside its program.
namespace coupon_file {
inline constexpr const char* kSheet = "coupon.html";
inline constexpr const char* kReadings = "measured.toml";
}  // namespace coupon_file

/// What came out.
struct CouponResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kDone;
  std::vector<std::filesystem::path> files;  ///< Programs first.
  CouponLayout layout;
  CouponFit known;  ///< With the uncertainties that the template states.
  double minutes = 0.0;
  /// What the machine must not do: collisions, unknown ways, motion beyond the travel.
  std::vector<std::string> faults;

  [[nodiscard]] bool done() const { return status == Status::kDone; }
};

/// Whether a file of this name may be one of a coupon.
bool is_name_of_coupon(const std::string& name);

/// Writes everything that calibrates a workshop: the coupon's program, the sheet with its drawing
/// and what to measure, and the file that the readings go into. All files get their names together
/// in the end. Same bytes for any number of threads.
/// @throw InputError as validate(), and naming files that would be replaced though lensforge did
///        not write them as they stand, or though they hold readings, without CouponOptions::force.
/// @throw RunError if the files cannot be written.
CouponResult make_coupon(const CouponOptions& options, const std::filesystem::path& folder,
                         const Executor& executor, const RunControl& control);

}  // namespace lensforge

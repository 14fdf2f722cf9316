// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/contact/profile_cutter.h"
#include "cam/coupon/coupon_layout.h"
#include "cam/coupon/coupon_options.h"
#include "cam/path/collision.h"
#include "cam/plan/program_watch.h"
#include "cam/post/program_plan.h"
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

}  // namespace lensforge

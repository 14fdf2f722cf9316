// SPDX-License-Identifier: GPL-3.0-or-later
// All programs of cuts of hostile surfaces, read back and followed in small steps: no point of any
// motion is lower than the certificates say, found by drop-cutters at that very point.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "cam/adversarial_meshes.h"
#include "cam/cam.h"
#include "cam/contact/profile_cutter.h"
#include "cam/plan/cut_plan.h"
#include "cam/post/program_reader.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::TempFolder;

constexpr double kSide = 4.0;
constexpr double kStep = 0.01;  ///< mm along motions.

Lens lens_of(const SurfaceMesh& mesh) {
  Lens lens;
  lens.setup.lens_size = {kSide, kSide};
  lens.surface = mesh;
  return lens;
}

CamOptions coarse_programs() {
  CamOptions options;
  options.surface = SurfaceModel::kFacet;
  options.render = false;
  Process& process = options.workshop.process;
  process.finish.pitch = 0.35;
  process.finish.pencil = false;
  process.semi.stepover = 0.5;
  process.rough.entry = EntryStyle::kHelix;
  return options;
}

/// Lowest and highest of what motions at feed are above the drop surface of `profile`, as far as
/// the axis is over the lens.
struct Heights {
  double least = HUGE_VAL;
  double most = -HUGE_VAL;
};

class Follower {
 public:
  Follower(const ProfileCutter& surface, const CutterProfile& profile, double z_offset)
      : surface_(surface), profile_(profile), z_offset_(z_offset) {}

  void follow(const GcodeMotion& motion) {
    if (motion.rapid) return;
    const double length =
        motion.arc ? 2.0 * (motion.end - motion.start).norm() : (motion.end - motion.start).norm();
    const auto steps = static_cast<int>(length / kStep) + 1;
    for (int i = 0; i <= steps; ++i) {
      const double part = static_cast<double>(i) / steps;
      const Eigen::Vector3d tip =
          motion.arc ? motion.arc->at(part)
                     : Eigen::Vector3d(motion.start + part * (motion.end - motion.start));
      look({tip.x(), tip.y(), tip.z() - z_offset_});
    }
  }
  [[nodiscard]] const Heights& heights() const { return heights_; }

 private:
  void look(const Eigen::Vector3d& tip) {
    const Eigen::Vector2d p = tip.head<2>();
    if (p.minCoeff() < 0.0 || p.maxCoeff() > kSide) return;
    near_ = surface_.drop(profile_, p, near_);
    heights_.least = std::min(heights_.least, tip.z() - near_.tip);
    heights_.most = std::max(heights_.most, tip.z() - near_.tip);
  }

  const ProfileCutter& surface_;
  CutterProfile profile_;
  double z_offset_;
  CutterLocation near_;
  Heights heights_;
};

TEST(CutAdversarial, NoMotionIsLowerThanItsCertificateSays) {
  for (const auto& [name, mesh] : testing::adversarial_meshes()) {
    if (name == "soup") continue;  // No height field: refused.
    const TempFolder folder;
    const CamOptions options = coarse_programs();
    const CamResult result = make_cut(lens_of(mesh), options, folder.path(), Executor::cpu(2), {});
    ASSERT_TRUE(result.done()) << name;
    const Lens lens = lens_of(mesh);
    const ProfileCutter surface(cut_setup(lens, options).mesh());
    for (const ReportOperation& operation : result.report.operations) {
      const OperationSummary& summary = operation.summary;
      const Tool& tool = options.workshop.tool(summary.tool);
      Follower follower(surface, grown(cutting_profile(tool), summary.allowance),
                        result.report.z_offset);
      read_program(folder / operation.file, options.post.reader,
                   [&](const GcodeMotion& motion, int) { follower.follow(motion); }, {});
      ASSERT_TRUE(summary.certified) << name << " " << summary.name;
      const double rounding = summary.allowance > 0.0 ? 1e-6 : 1e-9;
      EXPECT_GE(follower.heights().least, -summary.certificate.gouge.value - rounding)
          << name << " " << summary.name;
      if (summary.name != "finish") continue;
      EXPECT_LE(follower.heights().most, summary.certificate.excess.value + 1e-9) << name;
    }
  }
}

}  // namespace
}  // namespace lensforge

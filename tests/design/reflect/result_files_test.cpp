// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/result_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ReflectResult sample_result() {
  ReflectResult result;
  result.reference = result.mesh = shapes::octahedron();
  result.before = {0.4, 0.5};
  result.after = {0.02, 0.05};
  result.mean_displacement = 0.01;
  result.max_displacement = 0.02;
  result.updates = {{1, "rim-spoke", 0.5, 0.0, 0.0, 1.0},
                    {2, "rim-spoke", 0.2, 0.0, 0.0, 2.0},
                    {3, "face", 0.05, 0.0, 0.0, 4.0}};
  return result;
}

std::string report(const ReflectResult& result, const ReflectOptions& options = {}) {
  const ColorImage pixel{1, 1, {0, 0, 0}};
  return reflect_report(result, options, {pixel, pixel});
}

TEST(ReflectReport, StatesEnergiesAndDisplacements) {
  const std::string html = report(sample_result());
  EXPECT_THAT(html, HasSubstr("verdict good"));
  EXPECT_THAT(html, HasSubstr("10.0 % of the energy before"));
  EXPECT_THAT(html, HasSubstr("5.00 %"));
  // The octahedron's bounding box has the diagonal 2√3.
  EXPECT_THAT(html, HasSubstr("2.00 % of the diagonal, 0.0693"));
}

TEST(ReflectReport, JudgesByTheGoal) {
  ReflectOptions options;
  options.goal = GoalKind::kPoint;
  EXPECT_THAT(report(sample_result(), options), HasSubstr("verdict bad"));
  ReflectResult broken = sample_result();
  broken.unmet = {"--keep-volume: <9 %>"};
  EXPECT_THAT(report(broken), HasSubstr("A constraint is broken"));
  EXPECT_THAT(report(broken), HasSubstr("--keep-volume: &lt;9 %&gt;"));
}

TEST(ReflectReport, AGainOfLessThanATenthIsNotGreen) {
  ReflectResult result = sample_result();
  result.after.total = 0.48;
  result.unmet = {"less than a tenth"};
  EXPECT_THAT(report(result), HasSubstr("verdict bad"));
  EXPECT_THAT(report(result), HasSubstr("96.0 % of the energy before"));
  EXPECT_THAT(report(result), HasSubstr("<b>Not met</b>"));
}

TEST(ReflectReport, OfAnInterruptedRunHasNoEnergiesAfter) {
  ReflectResult result = sample_result();
  result.status = ReflectResult::Status::kInterrupted;
  const std::string html = report(result);
  EXPECT_THAT(html, HasSubstr("Interrupted"));
  EXPECT_THAT(html, Not(HasSubstr("10.0 %")));
}

TEST(ReflectReport, EscapesWhatTheUserWrote) {
  ReflectOptions options;
  options.fix_vertices = "<script>alert('x')</script>";
  EXPECT_THAT(report(sample_result(), options), Not(HasSubstr("<script>alert")));
}

TEST(ReflectReport, DrawsTheEnergyOfEveryStage) {
  const std::string html = report(sample_result());
  EXPECT_THAT(html, HasSubstr("aria-label=\"Energy over time\""));
  EXPECT_THAT(html, HasSubstr(">rim-spoke<"));
  EXPECT_THAT(html, HasSubstr(">face<"));
}

}  // namespace
}  // namespace lensforge::reflect

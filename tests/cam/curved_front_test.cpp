// SPDX-License-Identifier: GPL-3.0-or-later
// Lenses whose blank has a spherical front before the first cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/plan/cut_plan.h"
#include "cam/small_cuts.h"
#include "core/error.h"
#include "core/optics/front.h"
#include "core/optics/height_fronts.h"
#include "core/temp_folder.h"
#include "core/text/number_text.h"
#include "design/render.h"

namespace lensforge::curved_front_test {
namespace {

using lensforge::testing::coarse;
using lensforge::testing::message_of;
using lensforge::testing::programs_only;
using lensforge::testing::read_bytes;
using lensforge::testing::run_cut;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

Lens lens_with_front(double radius) {
  Lens lens = small_lens();
  lens.setup.front = spherical_front(radius, lens.setup.lens_size);
  return lens;
}

/// The picture that a lens projects by its vertex normals.
Image picture_of(const Lens& lens) {
  Image picture(lens.setup.pixels.x(), lens.setup.pixels.y());
  (void)evaluate(lens, SurfaceModel::kSmooth, &picture, Executor::serial());
  return picture;
}

/// Largest difference of the designed surface's picture from another one, in pixels of an even one.
double difference(const LeakageResult& leakage, const Image& other) {
  const Image designed = leakage.designed.picture.image(other.total());
  double largest = 0.0;
  for (std::size_t i = 0; i < other.values().size(); ++i) {
    largest = std::max(largest, std::abs(double{designed.values()[i]} - other.values()[i]));
  }
  return largest;
}

TEST(CurvedFrontCut, ALensWithASphericalFrontIsPredictedBehindIt) {
  for (const double radius : {20.0, -20.0}) {
    const TempFolder folder;
    const Lens lens = lens_with_front(radius);
    const ReportData report = run_cut(lens, coarse(), folder).report;
    // Between so few vertices the sampled surface is another than their normals tell: behind a flat
    // front 0.09, behind these 0.04 and 0.20; the flat front's picture is 1.5 and 0.85 off.
    const double other = difference(report.leakage, picture_of(small_lens()));
    EXPECT_GT(other, 0.5);
    EXPECT_LT(difference(report.leakage, picture_of(lens)), 0.3 * other);
  }
}

TEST(CurvedFrontCut, AReportSaysWhereASphericalFrontHasToLie) {
  const TempFolder folder;
  const Lens lens = lens_with_front(20.0);
  const ReportData report = run_cut(lens, programs_only(), folder).report;
  const auto& front = std::get<SphericalFront>(*lens.setup.front);
  ASSERT_TRUE(report.setup.front.has_value());
  EXPECT_EQ(report.setup.blank.min().z(), front.apex.z());
  const double top = box_to_cut(lens, programs_only()).max().z() + Stock().allowance;
  EXPECT_NEAR(report.setup.blank.max().z(), top, 1e-12);
  EXPECT_NEAR(report.z_offset, -top, 1e-12);
  EXPECT_THAT(report.setup.front_words,
              AllOf(HasSubstr("bulging sphere of radius 20.00 mm"),
                    HasSubstr("X 1.500 Y 1.000 Z " + decimal_text(front.apex.z() - top, 3)),
                    HasSubstr(decimal_text(top - front.apex.z(), 3) + " mm below the top")));
  const auto json = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_EQ(json["setup"]["front"]["radius"].get<double>(), 20.0);
  const std::string html = read_bytes(folder / "report.html");
  EXPECT_THAT(html, AllOf(HasSubstr("in a nest"), HasSubstr("Section through the apex")));
  const TempFolder flat;
  EXPECT_EQ(run_cut(small_lens(), programs_only(), flat).report.z_offset, report.z_offset);
}

TEST(CurvedFrontCut, ALensWithAHeightMapForAFrontIsPredictedBehindItAndItsReportSaysWhereItLies) {
  const TempFolder folder;
  Lens lens = small_lens();
  lens.setup.front =
      testing::height_front(lens.setup.lens_size, {31, 21}, [](const Eigen::Vector2d& at) {
        return -0.08 + 0.08 * std::sin(2.0 * at.x()) * std::cos(1.5 * at.y());
      });
  const ReportData report = run_cut(lens, coarse(), folder).report;
  const double other = difference(report.leakage, picture_of(small_lens()));
  EXPECT_GT(other, 0.3);
  EXPECT_LT(difference(report.leakage, picture_of(lens)), 0.3 * other);
  // Beyond the lens it goes on straight to the blank's edge.
  const Eigen::AlignedBox3d& blank = report.setup.blank;
  EXPECT_EQ(blank.min().z(),
            lowest_of(*lens.setup.front, {Eigen::Vector2d(blank.min().head<2>()),
                                          Eigen::Vector2d(blank.max().head<2>())}));
  EXPECT_LT(blank.min().z(), -0.16);
  EXPECT_THAT(report.setup.front_words, AllOf(HasSubstr("height map"), HasSubstr("X 3.000 Y 2.000"),
                                              HasSubstr("its height 0")));
  const auto json = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_EQ(json["setup"]["front"]["file"], "front.exr");
  EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr("Section through the middle"));
}

TEST(CurvedFrontCut, ABlankThatASphericalFrontCannotHaveIsRefused) {
  const TempFolder folder;
  const auto refusal = [&](const CamOptions& options) {
    return message_of<InputError>([&] { run_cut(lens_with_front(8.0), options, folder); });
  };
  CamOptions options = programs_only();
  options.z_zero = ZZero::kTable;
  EXPECT_THAT(refusal(options), HasSubstr("--z-zero table"));
  options = programs_only();
  options.workshop.stock.margin = 5.0;
  // √((1.5 + 4.4)² + (1 + 4.4)²) is 7.998.
  EXPECT_THAT(refusal(options),
              AllOf(HasSubstr("stock.margin 5"), HasSubstr("radius 8 mm"), HasSubstr("4.4 mm")));
  options.workshop.stock.margin = 4.4;
  EXPECT_NO_THROW(run_cut(lens_with_front(8.0), options, folder));
}

TEST(CurvedFrontCut, ABlankNarrowerThanTheLightBehindACurvedFrontIsWarnedOf) {
  const TempFolder folder;
  CamOptions options = programs_only();
  options.workshop.polish.sigma = 0.0;  // The margin need not be wider than the ball's radius.
  const auto warnings = [&] {
    return run_cut(lens_with_front(6.1), options, folder).report.warnings;
  };
  EXPECT_THAT(warnings(), ::testing::Not(::testing::Contains(HasSubstr("rim stays dark"))));
  options.workshop.stock.margin = 0.2;
  EXPECT_THAT(warnings(), ::testing::Contains(HasSubstr("stock.margin is at least")));
}

}  // namespace
}  // namespace lensforge::curved_front_test

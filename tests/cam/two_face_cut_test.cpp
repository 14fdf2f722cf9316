// SPDX-License-Identifier: GPL-3.0-or-later
// Lenses whose two faces are both cut.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/leakage/render_field.h"
#include "cam/plan/cut_plan.h"
#include "cam/plan/finishing.h"
#include "cam/predict/part_surfaces.h"
#include "cam/program_ways.h"
#include "cam/small_cuts.h"
#include "cam/tolerance/tolerance_forecast.h"
#include "core/error.h"
#include "core/lens/continued_surface.h"
#include "core/lens/surface_field.h"
#include "core/optics/front.h"
#include "core/optics/height_fronts.h"
#include "core/temp_folder.h"

namespace lensforge::two_face_cut_test {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::programs_only;
using lensforge::testing::read_bytes;
using lensforge::testing::run_cut;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Hollow, so that all light enters within the edges, and neither even nor odd along x or y, so
/// that a face that is mirrored wrongly shows.
double front_height(const Eigen::Vector2d& at) {
  return -0.06 + 0.05 * std::sin(1.7 * at.x() + 0.3) * std::cos(1.2 * at.y()) -
         0.06 * (at - Eigen::Vector2d(1.4, 1.0)).squaredNorm();
}

Lens two_face_lens(double width = 3.0, double height = 2.0) {
  Lens lens = small_lens(width, height);
  // Without the creases of that, which a front's trace sees as sharp as its samples are.
  lens.surface = testing::grid_mesh(21, 17, width, height, [](double x, double y) {
    return 6.0 + 0.12 * std::sin(1.6 * x + 0.4) * std::cos(1.3 * y) + 0.03 * y;
  });
  lens.setup.front = testing::height_front(lens.setup.lens_size, {25, 17}, front_height);
  return lens;
}

double front_at(const Lens& lens, const Eigen::Vector2d& at) {
  return FrontSurface(*lens.setup.front).height(at);
}

/// Straight moves of the finishing ball alone, which the tests' own reader knows.
CamOptions finishing(CutFace face) {
  CamOptions options = programs_only();
  options.face = face;
  options.arcs = false;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.workshop.stock.margin = 8.0;
  if (face == CutFace::kBack) options.z_zero = ZZero::kTable;
  return options;
}

/// Height that a ball leaves at a place, by brute force over all moves at feed; program
/// coordinates.
double left_at(const std::vector<testing::Way>& ways, double radius, const Eigen::Vector2d& at) {
  constexpr int kSteps = 4;
  double lowest = 1e9;
  for (const testing::Way& way : ways) {
    if (way.rapid || !way.from.allFinite()) continue;
    const Eigen::Vector2d low = way.from.head<2>().cwiseMin(way.to.head<2>());
    const Eigen::Vector2d high = way.from.head<2>().cwiseMax(way.to.head<2>());
    if (((at - low).array() < -radius).any() || ((at - high).array() > radius).any()) continue;
    const int steps = 1 + kSteps * static_cast<int>(std::ceil((way.to - way.from).norm() / 0.02));
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3d tip = way.from + (way.to - way.from) * (double(i) / steps);
      const double aside = (tip.head<2>() - at).norm();
      if (aside >= radius) continue;
      lowest = std::min(lowest, tip.z() + radius - std::sqrt(radius * radius - aside * aside));
    }
  }
  return lowest;
}

/// Ridges between rows of the default ball, and a little.
constexpr double kRidges = 3.5e-3;
constexpr double kBelow = 1e-3;

TEST(TwoFaceCut, BothProgramsReadBackLeaveTheDesignedFrontAndTheDesignedThicknessAboveTheFrame) {
  const TempFolder folder;
  const Lens lens = two_face_lens();
  const CamOptions front = finishing(CutFace::kFront);
  const CamOptions back = finishing(CutFace::kBack);
  std::filesystem::create_directory(folder / "front");
  std::filesystem::create_directory(folder / "back");
  make_cut(lens, front, folder / "front", Executor::cpu(2), {});
  make_cut(lens, back, folder / "back", Executor::cpu(2), {});
  const auto front_ways = testing::ways_of(folder / "front/finish.ngc");
  const auto back_ways = testing::ways_of(folder / "back/finish.ngc");
  const double radius = finishing_ball(front).radius();
  const auto exit = optical_surface(lens, lens.model);
  const double width = lens.setup.lens_size.x();
  double first = 0.0;
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(0.4, 0.3), Eigen::Vector2d(2.7, 0.35), Eigen::Vector2d(1.5, 1.0),
        Eigen::Vector2d(0.35, 1.75), Eigen::Vector2d(2.55, 1.6)}) {
    // Turned over about the axis along Y; Z 0 is the blank's top, the frame that it lies on later.
    const double depth = 0.0 - left_at(front_ways, radius, {width - at.x(), at.y()});
    const double high = left_at(back_ways, radius, at);
    const double thickness = high - depth;
    const double designed = exit->at(at)->z - front_at(lens, at);
    EXPECT_GT(thickness, designed - 2.0 * kBelow) << at.transpose();
    EXPECT_LT(thickness, designed + 2.0 * kRidges) << at.transpose();
    const double frame = front_at(lens, at) - depth;
    if (first == 0.0) first = frame;
    EXPECT_NEAR(frame, first, kRidges + kBelow) << at.transpose();
  }
  // The frame is the allowance below the lowest place that is cut.
  EXPECT_LT(first, FrontSurface(*lens.setup.front).height({1.0, 0.1}) - 0.5);
  EXPECT_NEAR(first, cut_setup(lens, front).frame.value(), kRidges);
}

TEST(TwoFaceCut, AFrontsOwnSplineIsWhatIsCut) {
  const Lens lens = two_face_lens();
  const ControlNet net = net_of(std::get<HeightFront>(*lens.setup.front));
  for (const Eigen::Vector2d& uv : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.4, 15.7),
                                    Eigen::Vector2d(11.3, 1.2), Eigen::Vector2d(24.0, 16.0)}) {
    const SplineFrame frame = net.at(uv);
    const Eigen::Vector2d at = frame.point.head<2>();
    EXPECT_NEAR(frame.point.z(), front_at(lens, at), 1e-13);
    const FrontPoint point = FrontSurface(*lens.setup.front).at(at);
    EXPECT_LT((frame.shape().slope - point.gradient).norm(), 1e-11);
  }
}

TEST(TwoFaceCut, TheFrameStaysFlatUnderRoughingToo) {
  const Lens lens = two_face_lens();
  CamOptions options = programs_only();
  options.face = CutFace::kFront;
  options.workshop.stock.margin = 9.0;
  const TempFolder folder;
  const ReportData report = run_cut(lens, options, folder).report;
  const double frame = frame_width(options, lens.setup);
  EXPECT_GT(frame, kMinFrame);
  const Eigen::Vector2d keep = Eigen::Vector2d::Constant(9.0 - frame);
  for (const ReportOperation& operation : report.operations) {
    const double radius = options.workshop.tool(operation.summary.tool).radius();
    const Eigen::AlignedBox3d& tip = operation.summary.tip;
    EXPECT_LT((-keep - (tip.min().head<2>().array() - radius).matrix()).maxCoeff(), 1e-9)
        << operation.summary.name;
    EXPECT_LT(
        ((tip.max().head<2>().array() + radius).matrix() - lens.setup.lens_size - keep).maxCoeff(),
        1e-9)
        << operation.summary.name;
  }
  EXPECT_EQ(report.verdict.missed(), 0);
}

TEST(TwoFaceCut, TheOperatorIsToldHowTheBlankIsTurnedInProgramsAndReports) {
  const Lens lens = two_face_lens();
  const TempFolder folder;
  CamOptions options = finishing(CutFace::kFront);
  options.workshop.process.finish.set_pitch(0.3);
  const ReportData front = run_cut(lens, options, folder).report;
  EXPECT_THAT(read_bytes(folder / "finish.ngc"),
              AllOf(HasSubstr("setup 1 of 2"), HasSubstr("axis along Y"),
                    HasSubstr("left X -8.000"), HasSubstr("left edge to X 11.000")));
  EXPECT_THAT(front.setup.other_words,
              AllOf(HasSubstr("first of two setups"), HasSubstr("about the axis along Y"),
                    HasSubstr("--z-zero table"), HasSubstr("X -8.000"), HasSubstr("X 11.000")));
  const auto json = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_EQ(json["setup"]["two_setups"], front.setup.other_words);
  EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr("first of two setups"));

  const TempFolder other;
  options = finishing(CutFace::kBack);
  options.workshop.process.finish.set_pitch(0.3);
  const ReportData back = run_cut(lens, options, other).report;
  EXPECT_THAT(read_bytes(other / "finish.ngc"),
              AllOf(HasSubstr("setup 2 of 2"), HasSubstr("is right, X 11.000"),
                    HasSubstr("lower edge of the blank: Y -8.000")));
  EXPECT_THAT(back.setup.other_words, HasSubstr("second of two setups"));
  // One blank: as thick in both reports, and Z 0 of the second is the plane of the frame.
  EXPECT_NEAR(back.setup.blank.sizes().z(), front.setup.blank.sizes().z(), 1e-9);
  EXPECT_NEAR(back.z_offset, -back.setup.frame.value(), 1e-12);
  EXPECT_THAT(read_bytes(other / "report.html"), HasSubstr("the table is below the frame"));
}

TEST(TwoFaceCut, WithoutTheOptionNothingIsSaidOfASecondSetup) {
  const TempFolder folder;
  const ReportData report = run_cut(two_face_lens(), programs_only(), folder).report;
  EXPECT_EQ(report.setup.other_words, "");
  EXPECT_FALSE(report.setup.frame.has_value());
  EXPECT_THAT(report.setup.front_words, HasSubstr("there before the first cut"));
  EXPECT_THAT(read_bytes(folder / "finish.ngc"), ::testing::Not(HasSubstr("setup")));
}

TEST(TwoFaceCut, WhatCannotBeCutOrHeldIsRefusedInOneLine) {
  const TempFolder folder;
  const auto refusal = [&](const Lens& lens, const auto& change) {
    CamOptions options = finishing(CutFace::kFront);
    change(options);
    return message_of<InputError>([&] { run_cut(lens, options, folder); });
  };
  const auto none = [](CamOptions&) {};
  EXPECT_THAT(refusal(small_lens(), none), AllOf(HasSubstr("--face front"), HasSubstr("is flat")));
  Lens sphere = small_lens();
  sphere.setup.front = spherical_front(20.0, sphere.setup.lens_size);
  EXPECT_THAT(refusal(sphere, none), AllOf(HasSubstr("--face front"), HasSubstr("a sphere")));
  const Lens lens = two_face_lens();
  EXPECT_THAT(refusal(lens, [](CamOptions& o) { o.part = PartKind::kMould; }),
              HasSubstr("a mould is cut from one side"));
  EXPECT_THAT(refusal(lens, [](CamOptions& o) { o.z_zero = ZZero::kTable; }),
              AllOf(HasSubstr("--z-zero table"), HasSubstr("use stock or lens")));
  EXPECT_THAT(refusal(lens, [](CamOptions& o) { o.surface = SurfaceModel::kFacet; }),
              HasSubstr("--surface facet"));
  EXPECT_THAT(refusal(lens, [](CamOptions& o) { o.cut_outline = OutlineWish::kAlways; }),
              HasSubstr("--cut-outline always"));
  EXPECT_THAT(refusal(lens, [](CamOptions& o) { o.light = LightModel::kWaves; }),
              HasSubstr("--light-model waves"));
  Lens steep = small_lens();
  steep.setup.front = testing::height_front(
      steep.setup.lens_size, {31, 21},
      [](const Eigen::Vector2d& at) { return -0.5 + 0.4 * std::sin(3.0 * at.x()); });
  EXPECT_THAT(refusal(steep, none), AllOf(HasSubstr("rises by 1.2"), HasSubstr("too steep")));

  // The margin that the refusal names works; both faces need it.
  const auto narrow = [](CamOptions& o) { o.workshop.stock.margin = 3.0; };
  EXPECT_THAT(refusal(lens, narrow), AllOf(HasSubstr("stock.margin 3"), HasSubstr("3 mm wide"),
                                           HasSubstr("--margin 3.9mm works")));
  CamOptions wide = finishing(CutFace::kFront);
  wide.workshop.stock.margin = 3.9;
  EXPECT_NO_THROW(validate(wide, lens.setup));
  EXPECT_THAT(refusal(lens,
                      [&](CamOptions& o) {
                        o = finishing(CutFace::kBack);
                        narrow(o);
                      }),
              AllOf(HasSubstr("--z-zero table"), HasSubstr("--margin 3.9mm")));
}

const RenderedSurface* find(const ReportData& report, const std::string& name) {
  const auto& others = report.leakage.others;
  const auto found = std::find_if(others.begin(), others.end(),
                                  [&](const RenderedSurface& one) { return one.name == name; });
  return found == others.end() ? nullptr : &*found;
}

TEST(TwoFaceCut, EitherFaceAsMadeIsPredictedAndBothOnceBothAreThereAlikeFromEitherSide) {
  const TempFolder folder;
  Lens lens = two_face_lens(2.0, 1.5);
  lens.provenance = nlohmann::json{{"fingerprint", "0123456789abcdef"}};
  lens.setup.second = SecondScreen{30.0, {2.0, 1.5}, {0.0, 0.0}};
  lens.second = SecondPicture{lens.target, {}, {}};
  const auto cut = [&](CutFace face) {
    CamOptions options = finishing(face);
    const bool front = face == CutFace::kFront;
    options.render = true;
    options.light = LightModel::kRays;
    options.remedies = false;
    options.range = false;
    options.sample_spacing = 0.02;
    options.workshop.process.finish.set_pitch(0.1);
    options.workshop.process.finish.slope_tolerance = 5e-4;
    options.other_cut = folder / (front ? "cam" : "cam-front");
    const std::filesystem::path own = folder / (front ? "cam-front" : "cam");
    std::filesystem::create_directory(own);
    return make_cut(lens, options, own, Executor::cpu(2), {}).report;
  };
  const ReportData alone = cut(CutFace::kFront);
  EXPECT_EQ(find(alone, surface_name::kBoth), nullptr);
  EXPECT_THAT(alone.face_words, HasSubstr("cut the back, too"));
  EXPECT_EQ(nlohmann::json::parse(read_bytes(folder / "cam-front/report.json"))["face"], "front");
  const ReportData back = cut(CutFace::kBack);
  const ReportData front = cut(CutFace::kFront);
  ASSERT_NE(find(back, surface_name::kBoth), nullptr);
  ASSERT_NE(find(front, surface_name::kBoth), nullptr);
  // The designed front as a height map sampled from its field, and as it is.
  const auto apart = [](const FluxPicture& a, const FluxPicture& b) {
    return leakage_share(a, b) + leakage_share(b, a);
  };
  // Rays that are followed from the front, and those that are found for places of the back.
  EXPECT_LT(apart(front.leakage.designed.picture, back.leakage.designed.picture), 2e-3);
  ASSERT_TRUE(front.second && back.second);
  EXPECT_LT(apart(front.second->designed.picture, back.second->designed.picture), 0.02);
  const FluxPicture& both = find(front, surface_name::kBoth)->picture;
  const double error = apart(both, find(back, surface_name::kBoth)->picture);
  // Either face alone is another picture.
  EXPECT_GT(apart(both, front.leakage.part().picture), 3.0 * error);
  EXPECT_GT(apart(both, back.leakage.part().picture), 3.0 * error);
  // The ridges of so wide a pitch scatter light past the picture; none is lost in the lens.
  EXPECT_NEAR(front.leakage.part().picture.inside(), front.leakage.designed.picture.inside(), 0.03);
  EXPECT_GT(front.second->part().quality.leakage, 0.0);
  ASSERT_EQ(front.second->others.size(), 1U);
  ASSERT_EQ(back.second->others.size(), 1U);
  EXPECT_LT(apart(front.second->others[0].picture, back.second->others[0].picture), 1e-3);

  // Another design's cut is none of this lens.
  CamOptions options = finishing(CutFace::kBack);
  options.other_cut = folder / "cam-front";
  EXPECT_TRUE(made_face(cut_setup(lens, options)).has_value());
  lens.provenance = nlohmann::json{{"fingerprint", "fedcba9876543210"}};
  EXPECT_FALSE(made_face(cut_setup(lens, options)).has_value());
}

TEST(TwoFaceCut, AThickerLensIsOneWhoseBackAndScreenAreFartherAway) {
  Lens lens = two_face_lens();
  Tolerances tolerances;
  tolerances.face_thickness = 0.2;
  FieldRenderSetup setup{lens.setup, {}};
  const auto surface = optical_surface(lens, lens.model);
  const OpticalField back(*surface);
  const std::vector<FaceError> errors =
      face_errors(lens, back, setup, tolerances, Executor::cpu(2), {});
  ASSERT_EQ(errors.size(), 6U);
  for (std::size_t i = 1; i < errors.size(); ++i) {
    EXPECT_GE(errors[i - 1].worst(), errors[i].worst());
  }
  EXPECT_THAT(face_error_words(errors), HasSubstr("the " + errors.front().name + " matters most"));

  const auto mae_with = [&](double farther) {
    Lens moved = lens;
    moved.surface.vertices.row(2).array() += farther;
    moved.setup.focal_length += farther;
    const auto moved_surface = optical_surface(moved, moved.model);
    const OpticalField field(*moved_surface);
    FieldRenderSetup even{moved.setup, lens_grid(moved.setup.lens_size, 3.0 / 72)};
    const FluxPicture picture = render_field(field, even, Executor::cpu(2), {});
    return PictureJudge(lens.target, picture, {}).judge(picture).metrics.mae;
  };
  const double expected = std::max(mae_with(0.2), mae_with(-0.2)) - mae_with(0.0);
  const auto thickness = std::find_if(errors.begin(), errors.end(), [](const FaceError& error) {
    return error.name == "thickness";
  });
  EXPECT_GT(std::abs(expected), 1e-4);
  EXPECT_NEAR(thickness->mae.front(), expected, 1e-6 + 0.02 * std::abs(expected));
}

}  // namespace
}  // namespace lensforge::two_face_cut_test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/leakage/render_field.h"
#include "cam/plan/finishing.h"
#include "cam/post_plans.h"
#include "cam/predict/part_surfaces.h"
#include "cam/predict/prediction.h"
#include "cam/report/verdict.h"
#include "cam/workshop/tool.h"
#include "core/temp_folder.h"

namespace lensforge::remedies_test {
namespace {

using lensforge::testing::TempFolder;
using lensforge::testing::write_programs;
using ::testing::ElementsAre;

/// A lens with a groove along y, whose light leaves a gap on the wall.
Lens grooved_lens() {
  Lens lens;
  lens.setup.lens_size = {3.0, 2.0};
  lens.setup.image_size = {6.0, 2.0};
  lens.setup.image_origin = {-1.5, 0.0};
  lens.setup.pixels = {24, 8};
  lens.setup.focal_length = 12.0;
  lens.surface = testing::grid_mesh(31, 11, 3.0, 2.0,
                                    [](double x, double) { return 6.0 + 0.2 * std::abs(x - 1.5); });
  lens.target = Image(24, 8, 1.0F);
  for (int r = 0; r < 8; ++r) {
    for (int c = 8; c < 16; ++c) lens.target.at(c, r) = 0.0F;
  }
  return lens;
}

CamOptions facets_polished() {
  CamOptions options;
  options.surface = SurfaceModel::kFacet;
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  return options;
}

/// A cut and the prediction of it, with all that trials need.
class Predicted {
 public:
  Predicted(Lens lens, const CamOptions& options)
      : lens_(std::move(lens)),
        options_(options),
        setup_(cut_setup(lens_, options_)),
        passes_(cut_passes(setup_, executor_)) {
    const TempFolder folder;
    const RunControl control;
    CutRecord record(setup_);
    const ProgramFiles programs =
        write_programs(plan_programs(setup_, passes_, record, executor_, control), options_.post,
                       program_settings(options_), folder.path(), {});
    cut_.emplace(setup_, passes_,
                 finish_paths(setup_, passes_, std::move(record.rows), {programs}, control),
                 executor_);
    prediction_ = predict_part(surfaces(), setup_, executor_, control);
  }

  [[nodiscard]] TrialSite site() const {
    return {setup_, passes_, surfaces().part(), prediction_.judged(), prediction_.light};
  }
  [[nodiscard]] const Executor& executor() const { return executor_; }
  [[nodiscard]] const PartSurfaces& surfaces() const { return cut_->surfaces(); }
  [[nodiscard]] const Prediction& prediction() const { return prediction_; }

 private:
  Lens lens_;
  CamOptions options_;
  Executor executor_ = Executor::cpu(2);
  CutSetup setup_;
  CutPasses passes_;
  std::optional<CutSurfaces> cut_;
  Prediction prediction_;
};

TEST(TrialCut, WithNothingChangedLeaksWhatWasPredicted) {
  for (const PartKind part : {PartKind::kLens, PartKind::kMould}) {
    const bool lens = part == PartKind::kLens;
    CamOptions options = facets_polished();
    options.part = part;
    options.shrinkage = lens ? 0.0 : 0.004;
    options.workshop.process.finish.cross = lens;
    options.workshop.process.finish.pencil = lens;
    const Predicted cut(grooved_lens(), options);
    ASSERT_FALSE(cut.prediction().places.empty());
    const LeakPlace& place = cut.prediction().places[0];
    ASSERT_GT(place.leakage, 1e-4);
    const LeakTrial trial = TrialCut(cut.site(), options, cut.executor()).at(place, {});
    // Moves join at other places where rows begin elsewhere.
    EXPECT_NEAR(trial.leakage, place.leakage, 0.01 * place.leakage);
    EXPECT_NEAR(trial.dark_flux, place.dark_flux, 0.01 * place.leakage);
  }
}

TEST(TrialCut, OfAMachineThatGoesTooFarLeaksWhatWasPredicted) {
  CamOptions options = facets_polished();
  options.workshop.process.finish.pitch_error = 0.01;
  const Predicted cut(grooved_lens(), options);
  const LeakPlace& place = cut.prediction().places.at(0);
  const LeakTrial trial = TrialCut(cut.site(), options, cut.executor()).at(place, {});
  EXPECT_NEAR(trial.leakage, place.leakage, 0.01 * place.leakage);
}

/// A place in the middle, beside which the lens goes on.
TEST(TrialCut, OfAPartOfTheLensLeaksAsThatPartDoes) {
  const CamOptions options = facets_polished();
  const Predicted cut(grooved_lens(), options);
  const FieldRenderSetup setup{
      cut.site().setup.lens->setup,
      sampled_grid({3.0, 2.0}, sample_spacings(options, cut.site().setup.lens->setup,
                                               cut.site().setup.passes()))};
  LeakPlace place = cut.prediction().places[0];
  const auto coarser = std::llround(setup.grid.spacing.x() / setup.grid.spacing.y());
  place.cells = {120 / coarser, 70, 60 / coarser, 40};
  const PartSurfaces& surfaces = cut.surfaces();
  const LeakageResult& leakage = cut.prediction().leakage;
  const auto light = [&](const SurfaceField& field) {
    return render_cells(field, setup, place.cells, cut.executor(), {});
  };
  const FluxPicture now = light(surfaces.part());
  const FluxPicture designed = light(surfaces.designed());
  const std::vector<double> more =
      pixels_with_surplus(leakage.part().picture, leakage.designed.picture);
  double leaks = 0.0;
  for (std::size_t i = 0; i < more.size(); ++i) {
    leaks += more[i] * (now.flux[i] - designed.flux[i]);
  }
  ASSERT_GT(leaks, 1e-4);
  place.leakage = leaks;
  const LeakTrial trial = TrialCut(cut.site(), options, cut.executor()).at(place, {});
  EXPECT_NEAR(trial.leakage, leaks, 0.01 * leaks);
}

/// A lens whose picture diffraction blurs, of a size that one place covers.
Lens wavy_lens() {
  Lens lens;
  lens.setup.lens_size = {3.2, 3.2};
  lens.setup.image_size = {6.4, 6.4};
  lens.setup.image_origin = {-1.6, -1.6};
  lens.setup.pixels = {32, 32};
  lens.setup.focal_length = 80.0;
  lens.surface = testing::grid_mesh(65, 65, 3.2, 3.2, [](double x, double y) {
    return 5.0 + 5e-4 * std::sin(2.0 * x) * std::cos(1.5 * y);
  });
  lens.target = Image(32, 32, 0.0F);
  for (int r = 8; r < 24; ++r) {
    for (int c = 8; c < 24; ++c) lens.target.at(c, r) = 1.0F;
  }
  return lens;
}

CamOptions smooth_by_waves() {
  CamOptions options = facets_polished();
  options.surface = SurfaceModel::kSmooth;
  options.light = LightModel::kWaves;
  options.workshop.process.finish.pitch = 0.08;
  options.workshop.polish.sigma = 0.03;
  options.workshop.process.finish.slope_tolerance = 1e-5;  // Of a trial, chords lie elsewhere.
  return options;
}

TEST(TrialCut, ByWavesWithNothingChangedLeaksWhatWasPredicted) {
  const CamOptions options = smooth_by_waves();
  const Predicted cut(wavy_lens(), options);
  ASSERT_EQ(cut.prediction().places.size(), 1U);
  const LeakPlace& place = cut.prediction().places[0];
  EXPECT_NEAR(place.leakage, cut.prediction().judged().part().quality.leakage,
              0.01 * place.leakage);
  EXPECT_EQ(main_cause(place), leak_cause::kScallop);
  const LeakTrial trial = TrialCut(cut.site(), options, cut.executor()).at(place, {});
  EXPECT_NEAR(trial.leakage, place.leakage, 0.01 * place.leakage);
}

/// What a trial says of a closer pitch is what a whole cut with it comes to, by waves.
TEST(TrialCut, ByWavesLeaksAsAWholeCutDoes) {
  const Predicted cut(wavy_lens(), smooth_by_waves());
  ASSERT_EQ(cut.prediction().places.size(), 1U);
  CamOptions finer = smooth_by_waves();
  finer.workshop.process.finish.pitch = 0.06;
  const double trial =
      TrialCut(cut.site(), finer, cut.executor()).at(cut.prediction().places[0], {}).leakage;
  const double whole = Predicted(wavy_lens(), finer).prediction().judged().part().quality.leakage;
  const double leak = cut.prediction().places[0].leakage;
  EXPECT_LT(trial, 0.1 * leak);
  // A ray's slope does not fall with the pitch as a wave's order does.
  CamOptions by_rays = finer;
  by_rays.light = LightModel::kRays;
  EXPECT_GT(Predicted(wavy_lens(), by_rays).prediction().judged().part().quality.leakage,
            10.0 * trial);
  EXPECT_NEAR(trial, whole, 0.02 * leak);
}

/// What a trial says of a smaller ball is what a whole cut with it comes to.
TEST(Remedies, SmallerBallsAreTriedUntilTheLeakIsHalved) {
  const TempFolder folder;
  CamOptions options = facets_polished();
  // A ball whose fillet is wider than what polishing rounds.
  options.workshop.tools.back() = resized(options.workshop.tools.back(), 1.0);
  options.workshop.process.finish.pitch = 0.06;
  options.workshop.polish.sigma = 0.03;
  const Lens lens = grooved_lens();
  const ReportData report = make_cut(lens, options, folder.path(), Executor::cpu(2), {}).report;
  ASSERT_EQ(report.places.size(), 1U);
  const LeakPlace& place = report.places[0];
  EXPECT_EQ(main_cause(place), leak_cause::kCrease);
  ASSERT_FALSE(place.trials.empty());
  EXPECT_EQ(place.trials[0].change, "a 0.8 mm ball");
  EXPECT_LT(place.trials[0].leakage, place.leakage);
  ASSERT_GE(place.trials.size(), 3U);
  EXPECT_EQ(place.trials[2].change, "a 0.5 mm ball");
  for (std::size_t i = 1; i < place.trials.size(); ++i) {
    EXPECT_GT(place.trials[i - 1].leakage, 0.5 * place.leakage);
  }
  CamOptions smaller = options;
  smaller.workshop.tools.back() = resized(smaller.workshop.tools.back(), 0.8);
  smaller.remedies = false;
  const LeakageResult leakage =
      make_cut(lens, smaller, folder.path(), Executor::cpu(2), {}).report.leakage;
  const PictureQuality& part = leakage.part().quality;
  const double dark = part.dark_flux - leakage.designed.quality.dark_flux;
  // One place is the whole lens here.
  EXPECT_NEAR(place.trials[0].leakage, part.leakage, 0.05 * part.leakage);
  EXPECT_NEAR(place.trials[0].dark_flux, dark, 0.05 * part.leakage);
}

TEST(Remedies, EveryCauseHasOneOfItsOwn) {
  CamOptions options = facets_polished();
  options.decimals = 5;
  options.workshop.process.finish.slope_tolerance = 8e-4;  // Five decimals hold half of it, too.
  const Predicted cut(grooved_lens(), options);
  std::vector<LeakPlace> places;
  for (const char* cause :
       {leak_cause::kPolish, leak_cause::kScallop, leak_cause::kChord, leak_cause::kDecimals}) {
    places.push_back(cut.prediction().places[0]);
    places.back().parts = {{cause, 1.0, 0.0, 0.0}};
  }
  try_remedies(cut.site(), places, cut.executor(), {});
  std::vector<std::string> changes;
  for (const LeakPlace& place : places) {
    for (const LeakTrial& trial : place.trials) {
      changes.push_back(trial.change);
      EXPECT_TRUE(std::isfinite(trial.leakage));
      const bool closer = trial.change.find("pitch") != std::string::npos;
      EXPECT_NEAR(trial.minutes, closer ? 2.0 : 1.0, 0.2) << trial.change;
      if (closer) {
        EXPECT_NEAR(trial.moves, 2.0, 0.5) << trial.change;
      } else if (trial.change == "half the tolerances") {
        EXPECT_GT(trial.moves, 1.05);
        EXPECT_LT(trial.moves, 4.0);
      }
    }
  }
  EXPECT_THAT(
      changes,
      ElementsAre("half as much polishing", "a pitch of 0.0294 mm and half as much polishing",
                  "a pitch of 0.0294 mm", "half the tolerances", "one more decimal"));
}

TEST(Remedies, NoneIsTriedUnlessAskedFor) {
  const TempFolder folder;
  CamOptions options = facets_polished();
  options.remedies = false;
  const ReportData report =
      make_cut(grooved_lens(), options, folder.path(), Executor::cpu(2), {}).report;
  EXPECT_TRUE(report.places.at(0).trials.empty());
}

TEST(StandardBalls, AreTheNextSmallerOnes) {
  EXPECT_THAT(smaller_balls(0.4, 3), ElementsAre(0.3, 0.2, 0.1));
  EXPECT_THAT(smaller_balls(0.45, 2), ElementsAre(0.4, 0.3));
  EXPECT_THAT(smaller_balls(3.0, 1), ElementsAre(2.5));
  EXPECT_TRUE(smaller_balls(0.1, 3).empty());
}

}  // namespace
}  // namespace lensforge::remedies_test

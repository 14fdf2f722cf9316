// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/leakage/leakage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "cam/analytic_fields.h"
#include "cam/leakage/render_field.h"
#include "core/error.h"
#include "core/optics/polish_transfer.h"

namespace lensforge {
namespace {

using testing::AnalyticField;
using testing::SurfacePoint;

constexpr double kGroove = 2.0137;
constexpr double kSlope = 0.2;
constexpr double kRadius = 0.2;

/// A 4 mm lens with a V-groove along y: its beams leave a gap 10.94 columns wide on the wall, ten
/// of them wholly dark.
FieldRenderSetup groove_setup(double spacing = 0.02) {
  FieldRenderSetup setup;
  setup.optics.focal_length = 60.0;
  setup.optics.lens_size = {4.0, 4.0};
  setup.optics.image_size = {20.0, 20.0};
  setup.optics.image_origin = {-8.0, -8.0};
  setup.optics.pixels = {20, 20};
  setup.optics.view = ViewSide::kRear;
  setup.grid = lens_grid(setup.optics.lens_size, spacing);
  setup.tile = 64;
  return setup;
}

AnalyticField::Formula sharp_groove() {
  return [](const Eigen::Vector2d& p) {
    const double side = p.x() < kGroove ? -1.0 : 1.0;
    return SurfacePoint{
        5.0 + kSlope * std::abs(p.x() - kGroove), {side * kSlope, 0.0}, side < 0.0 ? 1 : 2};
  };
}

LeakageResult measure(const LeakageChain& chain, const Image& target,
                      const FieldRenderSetup& setup = groove_setup()) {
  return measure_leakage(chain, target, setup, {}, Executor::serial(), RunControl());
}

/// The sharp groove's projected picture, as a target.
Image groove_target() {
  const AnalyticField sharp(sharp_groove());
  return render_field(sharp, groove_setup(), Executor::serial(), RunControl()).image(400.0);
}

TEST(Leakage, OfARoundedGrooveIsTheLightOfItsFillet) {
  const AnalyticField sharp(sharp_groove());
  const AnalyticField rounded(testing::rounded_groove(kGroove, kSlope, kRadius));
  const Image target = groove_target();
  const LeakageResult result =
      measure({{"designed", &sharp}, {{leak_cause::kCrease, &rounded}}, {}}, target);
  // The fillet is 2 R sin(atan slope) wide and spreads its light evenly, to 2 %, over the gap.
  const double fillet = 2.0 * kRadius * kSlope / std::sqrt(1.0 + kSlope * kSlope) / 4.0;
  EXPECT_NEAR(result.part().quality.dark_flux, fillet * 10.0 / 10.94, 0.02 * fillet);
  EXPECT_GE(result.part().quality.leakage, result.part().quality.dark_flux - 1e-15);
  EXPECT_LE(result.part().quality.leakage, fillet);
  EXPECT_EQ(result.designed.quality.leakage, 0.0);
  EXPECT_EQ(result.designed.quality.dark_flux, 0.0);
  EXPECT_EQ(result.designed.quality.contrast(), std::numeric_limits<double>::infinity());
  EXPECT_LT(result.designed.quality.metrics.mae, 1e-6);
  EXPECT_GT(result.part().quality.metrics.mae, 1e-3);
  EXPECT_LT(result.part().quality.metrics.ssim, 1.0);
}

/// Haze is the last cause: what it adds is the difference of the part's picture with and without
/// it, and it is on the part wherever that is shown.
TEST(Leakage, HazeIsTheLastCause) {
  const AnalyticField sharp(sharp_groove());
  const AnalyticField rounded(testing::rounded_groove(kGroove, kSlope, kRadius));
  const Image target = groove_target();
  LeakageChain chain{{"designed", &sharp},
                     {{leak_cause::kCrease, &rounded}},
                     {{"milled", &sharp}, {"polished", &rounded}}};
  const LeakageResult clear = measure(chain, target);
  const Haze none;
  chain.haze = &none;
  const LeakageResult without = measure(chain, target);
  EXPECT_EQ(without.steps.size(), 1U);
  EXPECT_EQ(without.part().picture.flux, clear.part().picture.flux);

  const Haze haze = haze_of({10.0, 5.0}, groove_setup().optics, 5.0, 550e-6);
  chain.haze = &haze;
  const LeakageResult result = measure(chain, target);
  ASSERT_EQ(result.steps.size(), 2U);
  EXPECT_EQ(result.part().name, leak_cause::kHaze);
  EXPECT_EQ(result.clear_part().picture.flux, clear.part().picture.flux);
  EXPECT_EQ(result.part().picture.flux,
            hazed(haze, clear.part().picture.flux, {20, 20}, Executor::serial()));
  EXPECT_EQ(result.designed.picture.flux, clear.designed.picture.flux);
  EXPECT_EQ(result.others[0].picture.flux, clear.others[0].picture.flux);
  EXPECT_EQ(result.others[1].picture.flux, result.part().picture.flux);
  EXPECT_EQ(result.others[1].quality.metrics.mae, result.part().quality.metrics.mae);
  ASSERT_EQ(result.parts.size(), 2U);
  EXPECT_EQ(result.parts[1].cause, leak_cause::kHaze);
  EXPECT_EQ(result.parts[0].leakage, clear.parts[0].leakage);
  EXPECT_GT(result.parts[1].leakage, 0.2 * haze.share);
  EXPECT_LT(result.parts[1].leakage, haze.share);
  double leakage = 0.0;
  double dark_ratio = 0.0;
  for (const CausePart& part : result.parts) {
    leakage += part.leakage;
    dark_ratio += part.dark_ratio;
  }
  EXPECT_NEAR(leakage, result.part().quality.leakage, 1e-15);
  EXPECT_NEAR(dark_ratio, result.part().quality.dark_ratio, 1e-15);
  EXPECT_LT(result.part().quality.contrast(), clear.part().quality.contrast());
}

TEST(Leakage, OfATurnedHalfIsItsShareOfTheLens) {
  // By design the whole lens throws one spot; a quarter of the part throws another elsewhere.
  const AnalyticField designed([](const Eigen::Vector2d& p) {
    return SurfacePoint{5.0 - kSlope * (p.x() - 1.0), {-kSlope, 0.0}, 0};
  });
  const AnalyticField part([](const Eigen::Vector2d& p) {
    const bool turned = p.x() < 1.0;
    const double slope = turned ? kSlope : -kSlope;
    return SurfacePoint{5.0 + slope * (p.x() - 1.0), {slope, 0.0}, turned ? 1 : 2};
  });
  Image target(20, 20, 1.0F);
  for (int r = 0; r < 20; ++r) {
    for (int c = 10; c < 20; ++c) target.at(c, r) = 0.0F;
  }
  const LeakageResult result =
      measure({{"designed", &designed}, {{leak_cause::kChord, &part}}, {}}, target);
  EXPECT_NEAR(result.part().quality.leakage, 0.25, 1e-12);
  EXPECT_NEAR(result.part().quality.dark_flux, 0.25, 1e-12);
  EXPECT_NEAR(result.part().quality.contrast(), 3.0, 1e-9);
  EXPECT_EQ(result.dark_pixels, 200);
  EXPECT_EQ(result.bright_pixels, 200);
  const std::vector<double> map = surplus(result.part().picture, result.designed.picture);
  double mean = 0.0;
  for (const double value : map) mean += value / 400.0;
  EXPECT_NEAR(mean, 0.25, 1e-12);
}

/// Designed, and five surfaces that each differ a little from the one before.
class FiveCauses {
 public:
  FiveCauses() {
    for (int k = 0; k < 5; ++k) {
      fields_.push_back(std::make_unique<AnalyticField>([k](const Eigen::Vector2d& p) {
        SurfacePoint point = testing::rounded_groove(kGroove, kSlope, kRadius)(p);
        point.slope += 0.01 * k * Eigen::Vector2d(std::sin(3.0 * p.x() + k), std::cos(5.0 * p.y()));
        return point;
      }));
    }
    chain_.designed = {"designed", &sharp_};
    const char* causes[] = {leak_cause::kPolish, leak_cause::kCrease, leak_cause::kScallop,
                            leak_cause::kChord, leak_cause::kDecimals};
    for (std::size_t k = 0; k < 5; ++k) chain_.steps.push_back({causes[k], fields_[k].get()});
  }
  [[nodiscard]] const LeakageChain& chain() const { return chain_; }

 private:
  AnalyticField sharp_{sharp_groove()};
  std::vector<std::unique_ptr<AnalyticField>> fields_;
  LeakageChain chain_;
};

TEST(Leakage, PartsByCauseAddUp) {
  const FiveCauses causes;
  const LeakageResult result = measure(causes.chain(), groove_target());
  ASSERT_EQ(result.parts.size(), 5U);
  CausePart sum;
  for (const CausePart& part : result.parts) {
    sum.leakage += part.leakage;
    sum.dark_flux += part.dark_flux;
    sum.dark_ratio += part.dark_ratio;
    EXPECT_NE(part.leakage, 0.0) << part.cause;
  }
  EXPECT_NEAR(sum.leakage, result.part().quality.leakage, 1e-15);
  EXPECT_NEAR(sum.dark_flux, result.part().quality.dark_flux, 1e-15);
  EXPECT_NEAR(sum.dark_ratio, result.part().quality.dark_ratio, 1e-15);
}

TEST(Leakage, ACauseThatChangesNothingHasNoPart) {
  FiveCauses causes;
  LeakageChain chain = causes.chain();
  const AnalyticField twin(testing::rounded_groove(kGroove, kSlope, kRadius));
  const AnalyticField same(testing::rounded_groove(kGroove, kSlope, kRadius));
  chain.steps[1].field = &twin;
  chain.steps[2].field = &same;
  const LeakageResult result = measure(chain, groove_target());
  EXPECT_EQ(result.parts[2].leakage, 0.0);
  EXPECT_EQ(result.parts[2].dark_flux, 0.0);
  EXPECT_EQ(result.parts[2].dark_ratio, 0.0);
}

TEST(Leakage, PartsVanishWithTheirCause) {
  // Tool radius to 0: the crease part falls in proportion.
  const AnalyticField sharp(sharp_groove());
  const Image target = groove_target();
  double last = 1.0;
  for (const double radius : {0.2, 0.1, 0.05, 0.0}) {
    const AnalyticField rounded(testing::rounded_groove(kGroove, kSlope, radius));
    const LeakageResult result = measure(
        {{"designed", &sharp}, {{leak_cause::kCrease, &rounded}}, {}}, target, groove_setup(0.01));
    const double part = result.parts[0].leakage;
    if (radius == 0.0) {
      EXPECT_LT(part, 1e-15);
    } else {
      EXPECT_LT(part, 0.6 * last);
      EXPECT_GT(part, 0.0);
    }
    last = part;
  }
}

/// Counts the nodes it is asked for.
class CountingField : public AnalyticField {
 public:
  using AnalyticField::AnalyticField;
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override {
    nodes += window.size();
    AnalyticField::sample(window, executor, patch);
  }
  mutable std::int64_t nodes = 0;
};

TEST(Leakage, ASurfaceThatStandsTwiceIsRenderedOnce) {
  const CountingField field(testing::plane({0.1, 0.0}));
  const FieldRenderSetup setup = groove_setup();
  const Image target(20, 20, 1.0F);
  measure({{"designed", &field}, {{"polish", &field}, {"chord", &field}}, {{"milled", &field}}},
          target);
  EXPECT_LT(field.nodes, 1.1 * static_cast<double>(setup.grid.size()));
}

TEST(Leakage, SamplesMayBeFartherApartAlongThePasses) {
  // Rows along y: nothing changes along them, so the coarse grid throws the same picture.
  const AnalyticField scallops(testing::scalloped_plane(kRadius, 0.0606));
  const LeakageChain chain{{"designed", &scallops}, {{leak_cause::kScallop, &scallops}}, {}};
  const Image target(20, 20, 1.0F);
  FieldRenderSetup setup = groove_setup(0.01);
  const std::int64_t nodes = setup.grid.size();
  const LeakageResult fine = measure(chain, target, setup);
  setup.grid = lens_grid(setup.optics.lens_size, {0.01, 0.1});
  EXPECT_LT(setup.grid.size(), nodes / 9);
  const LeakageResult rough = measure(chain, target, setup);
  for (std::size_t i = 0; i < fine.part().picture.flux.size(); ++i) {
    EXPECT_NEAR(rough.part().picture.flux[i], fine.part().picture.flux[i], 1e-6);
  }
}

TEST(Leakage, RefusesDarkAboveBright) {
  const AnalyticField field(testing::plane({0.0, 0.0}));
  const LeakageChain chain{{"designed", &field}, {{"polish", &field}}, {}};
  const Image target(20, 20, 1.0F);
  EXPECT_THROW((void)measure_leakage(chain, target, groove_setup(), {0.5, 0.4}, Executor::serial(),
                                     RunControl()),
               InputError);
}

/// A plane puts its light evenly on a square of w = 4 of 20 mm. A square source of image b spreads
/// it: along each axis the mean of |s| / w over |s| ≤ b / 2 goes past its edges, b / 4w.
TEST(Leakage, TheSourcesPartIsTheLightThatItsExtentPutsIntoTheDark) {
  const AnalyticField plane(testing::plane({0.0, 0.0}));
  const AnalyticField rough(testing::scalloped_plane(kRadius, 0.0606));
  FieldRenderSetup setup = groove_setup();
  const Image target = render_field(plane, setup, Executor::serial(), RunControl()).image(400.0);
  setup.surface_height = 5.0;
  setup.optics.extent = {0.1, {1, 1, {1.0}}};
  const LeakageResult result =
      measure({{"designed", &plane}, {{leak_cause::kScallop, &rough}}, {}}, target, setup);
  ASSERT_EQ(result.parts.size(), 2U);
  const CausePart& source = result.parts[0];
  EXPECT_EQ(source.cause, leak_cause::kSource);
  const double image = 0.1 * (60.0 - 5.0);
  const double beside = 1.0 - std::pow(1.0 - image / (4.0 * 4.0), 2);
  EXPECT_NEAR(source.dark_flux, beside, 0.01 * beside);
  EXPECT_NEAR(result.point->moved, beside, 0.01 * beside);
  EXPECT_EQ(source.leakage, 0.0);
  EXPECT_LT(result.point->designed.quality.dark_flux, 1e-12);
  // With the other causes it is all that the part has.
  const PictureQuality& part = result.part().quality;
  EXPECT_NEAR(source.dark_flux + result.parts[1].dark_flux, part.dark_flux, 1e-12);
  EXPECT_NEAR(source.dark_ratio + result.parts[1].dark_ratio, part.dark_ratio, 1e-12);
  EXPECT_EQ(result.parts[1].leakage, part.leakage);
}

TEST(LeakMap, SumsToTheSurplusAndLiesWhereTheSurfaceDiffers) {
  const AnalyticField sharp(sharp_groove());
  const AnalyticField rounded(testing::rounded_groove(kGroove, kSlope, kRadius));
  const FieldRenderSetup setup = groove_setup();
  const LeakageChain chain{{"designed", &sharp}, {{leak_cause::kCrease, &rounded}}, {}};
  const LeakageResult result = measure(chain, groove_target());
  const std::vector<double> more =
      pixels_with_surplus(result.part().picture, result.designed.picture);
  const LeakMap map =
      map_leakage(chain.designed, chain.part(), setup, more, 0.1, Executor::serial());
  EXPECT_NEAR(map.total(), result.part().quality.leakage * result.designed.picture.inside(), 1e-12);
  EXPECT_EQ(map.columns, 40);
  for (std::size_t i = 0; i < map.leakage.size(); ++i) {
    const double x = 0.1 * static_cast<double>(i % 40);
    if (x + 0.1 > kGroove - 0.06 && x < kGroove + 0.06) continue;
    EXPECT_EQ(map.leakage[i], 0.0) << "cell at x " << x;
    EXPECT_EQ(map.height[i].value, 0.0);
  }
  const LeakMap threads =
      map_leakage(chain.designed, chain.part(), setup, more, 0.1, Executor::cpu(3));
  EXPECT_EQ(map.leakage, threads.leakage);
}

TEST(LeakMap, UnderAnExtendedSourceItStillSumsToTheSurplus) {
  const AnalyticField sharp(sharp_groove());
  const AnalyticField rounded(testing::rounded_groove(kGroove, kSlope, kRadius));
  FieldRenderSetup setup = groove_setup();
  setup.optics.extent.width = 0.05;
  setup.surface_height = 5.0;
  const LeakageChain chain{{"designed", &sharp}, {{leak_cause::kCrease, &rounded}}, {}};
  const LeakageResult result = measure(chain, groove_target(), setup);
  const std::vector<double> more =
      pixels_with_surplus(result.part().picture, result.designed.picture);
  const LeakMap map =
      map_leakage(chain.designed, chain.part(), setup, more, 0.1, Executor::serial());
  EXPECT_GT(map.total(), 0.001);
  EXPECT_NEAR(map.total(), result.part().quality.leakage * result.designed.picture.inside(), 1e-12);
}

TEST(LeakMap, NamesTheWorstPlacesWithTheirCauses) {
  // Two dents in a plane, the left one larger; they throw their light downwards on the wall.
  const auto dented = [](double small, double large) {
    return [=](const Eigen::Vector2d& p) {
      SurfacePoint point{5.0, {0.0, 0.0}, 0};
      const bool in_large = (p - Eigen::Vector2d(1.0, 3.0)).cwiseAbs().maxCoeff() < 0.2;
      const bool in_small = (p - Eigen::Vector2d(3.0, 1.0)).cwiseAbs().maxCoeff() < 0.1;
      if (in_large && large != 0.0) point = {5.003, {0.0, large}, 1};
      if (in_small && small != 0.0) point = {4.999, {0.0, small}, 2};
      return point;
    };
  };
  const AnalyticField designed(dented(0.0, 0.0));
  const AnalyticField first(dented(0.0, -0.15));
  const AnalyticField second(dented(-0.15, -0.15));
  const LeakageChain chain{{"designed", &designed},
                           {{leak_cause::kCrease, &first}, {leak_cause::kDecimals, &second}},
                           {}};
  const Image target =
      render_field(designed, groove_setup(), Executor::serial(), RunControl()).image(400.0);
  const LeakageResult result = measure(chain, target);
  const FieldRenderSetup setup = groove_setup();
  const LeakMap map = map_leakage(
      chain.designed, chain.part(), setup,
      pixels_with_surplus(result.part().picture, result.designed.picture), 0.2, Executor::serial());
  const std::vector<LeakPlace> places =
      worst_places(map, chain, result, setup, {}, Executor::serial());
  ASSERT_EQ(places.size(), 2U);  // A third does not exist.
  EXPECT_LT((places[0].place - Eigen::Vector2d(1.0, 3.0)).cwiseAbs().maxCoeff(), 0.25);
  EXPECT_LT((places[1].place - Eigen::Vector2d(3.0, 1.0)).cwiseAbs().maxCoeff(), 0.15);
  EXPECT_NEAR(places[0].leakage, 0.4 * 0.4 / 16.0, 1e-3);
  EXPECT_NEAR(places[0].dark_flux, places[0].leakage, 1e-12);
  EXPECT_NEAR(places[0].leakage + places[1].leakage, result.part().quality.leakage, 1e-9);
  EXPECT_EQ(places[0].parts[0].leakage, places[0].leakage);
  EXPECT_EQ(places[0].parts[1].leakage, 0.0);
  EXPECT_EQ(places[1].parts[0].leakage, 0.0);
  EXPECT_NEAR(places[0].height.value, 0.003, 1e-12);
  EXPECT_NEAR(places[1].height.value, -0.001, 1e-12);
  // A slope of −0.15 turns the light by about 0.0747 downwards: 55 mm further it is 4.1 mm lower.
  EXPECT_NEAR(places[0].lands.x(), 9.0, 0.6);
  EXPECT_NEAR(places[0].lands.y(), 20.0 - (3.0 - 4.1 + 8.0), 0.6);
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/tolerance/part_model.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/contact/cut_surface.h"
#include "cam/leakage/leakage.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/polished_field.h"
#include "cam/path/finish_raster.h"
#include "cam/plan/finishing.h"
#include "cam/predict/part_surfaces.h"
#include "core/error.h"
#include "core/lens/surface_field.h"
#include "core/optics/height_fronts.h"
#include "core/optics/light_path.h"

namespace lensforge::part_model_test {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kSide = 5.0;
constexpr double kRadius = 0.2;
constexpr double kPitch = 0.0625;
/// The surface goes on beyond the lens, so that rows do not turn on its rim: a ball of another
/// radius leaves a notch there, of some micrometres, that the model leaves out.
constexpr double kBeyond = 0.5;
constexpr std::int64_t kRowsBeyond = 8;
constexpr double kSigma = 0.03;
constexpr int kPixels = 18;  ///< 3.6 rows each: rows and pixels have no common period.

double relief(double x, double y) {
  return 3.0 + 0.03 * std::sin(kTwoPi * x / 4.7 + 0.4) * std::cos(kTwoPi * y / 6.1) +
         0.006 * std::sin(kTwoPi * (0.6 * x + 0.8 * y) / 2.3);
}

OpticalSetup setup() {
  OpticalSetup optics;
  optics.lens_size = {kSide, kSide};
  // What the rim lights lies outside.
  optics.image_size = {kSide - 1.0, kSide - 1.0};
  optics.image_origin = {0.5, 0.5};
  optics.pixels = {kPixels, kPixels};
  optics.focal_length = 18.0;
  return optics;
}

/// A way of the ball, moved aside row by row.
using RowShift = std::function<Eigen::Vector3d(std::int64_t)>;

Eigen::Vector3d unmoved(std::int64_t /*row*/) { return Eigen::Vector3d::Zero(); }

/// A surface and something that is added to it.
class Changed final : public SurfaceField {
 public:
  Changed(const SurfaceField& field, std::function<double(double, double)> by)
      : field_(field), by_(std::move(by)) {}
  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override {
    field_.sample(window, executor, patch);
    for (std::int64_t j = 0; j < window.rows; ++j) {
      for (std::int64_t i = 0; i < window.columns; ++i) {
        patch.z[static_cast<std::size_t>(j * window.columns + i)] += by_(window.x(i), window.y(j));
      }
    }
  }

 private:
  const SurfaceField& field_;
  std::function<double(double, double)> by_;
};

/// A small lens, cut by a raster; what cam's chain of surfaces and the model say of its parts.
class PartModelTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    constexpr double kWhole = kSide + 2.0 * kBeyond;
    SurfaceMesh mesh = testing::grid_mesh(31, 31, kWhole, kWhole, [](double x, double y) {
      return relief(x - kBeyond, y - kBeyond);
    });
    mesh.vertices.topRows<2>().array() -= kBeyond;
    const auto surface = optical_surface(mesh, SurfaceModel::kSmooth);
    meant_ = meant_surface(surface);
    RasterOptions raster;
    raster.pitch = kPitch;
    raster.tolerance = 2e-4;
    raster.slope_tolerance = 5e-5;
    raster.resolution = 1e-6;
    plan_ = plan_ = plan_finish_raster(
        {Eigen::Vector2d::Constant(-kBeyond), Eigen::Vector2d::Constant(kSide + kBeyond)}, kRadius,
        raster);
    const auto keep = [](const RasterRow& row) { rows_.push_back(row); };
    cut_raster(*surface_to_cut(surface, kRadius, executor()), plan_, executor(), keep, {});
    milled_ = milled(kRadius, unmoved);
    designed_ = render_field(meant_->field(), fine(setup()), executor(), {});
    target_ = designed_.image(kPixels * kPixels);
    model_ = std::make_unique<PartModel>(*milled_, part_plan(), executor(), RunControl());
    nominal_ = chain(*milled_, kSigma, setup());
    model_nominal_ = of_model({});
  }
  static void TearDownTestSuite() {
    model_.reset();
    milled_.reset();
    rows_.clear();
    meant_.reset();
  }

  static Executor executor() { return Executor::cpu(2); }

  static PartPlan part_plan() {
    Passes passes;
    passes.pitch = plan_.pitch;
    passes.ball_radius = kRadius;
    return {setup(), passes, {kSigma, 0.0, 1.0}, 1.3 * kSigma, kBeyond};
  }

  static FieldRenderSetup fine(const OpticalSetup& optics) {
    return {optics, lens_grid(optics.lens_size, kPitch / 6.0)};
  }

  /// What the raster leaves with a ball of another radius whose tip goes the same way.
  static std::unique_ptr<MilledField> milled(double radius, const RowShift& shift) {
    BallPath path(radius, 0.0);
    std::int64_t number = -plan_.rows_outside - kRowsBeyond;
    for (const RasterRow& row : rows_) {
      const MoveSink sink = path_sink(path);
      const Eigen::Vector3d by = shift(number++);
      const PathMove start{MoveKind::kRapid, row.start + by};
      sink({&start, 1});
      for (PathMove move : row.moves) {
        move.end += by;
        move.centre += by;
        sink({&move, 1});
      }
    }
    std::vector<BallPath> paths{std::move(path)};
    return std::make_unique<MilledField>(std::move(paths), 6.0);
  }

  static PictureQuality judged(const FluxPicture& picture) {
    PictureQuality quality = PictureJudge(target_, designed_, {}).judge(picture);
    // Part of the light lands beside the picture, as it does of the design.
    quality.metrics.mae = compare(picture.image(kPixels * kPixels), target_).mae;
    return quality;
  }

  /// By the surfaces of cam's chain: polished and rendered as finely as there.
  static PictureQuality chain(const SurfaceField& cut, double sigma, const OpticalSetup& optics) {
    const PolishedField part(cut, {Eigen::Vector2d(0, 0), Eigen::Vector2d(kSide, kSide)},
                             {sigma, 0.0, 1.0});
    return judged(render_field(part, fine(optics), executor(), {}));
  }

  static PictureQuality of_model(const PartError& error) {
    return judged(model_->render(error, executor()));
  }

  /// The change of both figures is the chain's to a fifth, or to 0.0003 of MAE and 0.1 % of light.
  static void expect_same_change(const PictureQuality& by_chain, const PictureQuality& by_model) {
    const double mae = by_chain.metrics.mae - nominal_.metrics.mae;
    const double leakage = by_chain.leakage - nominal_.leakage;
    EXPECT_NEAR(by_model.metrics.mae - model_nominal_.metrics.mae, mae,
                std::max(3e-4, 0.2 * std::abs(mae)));
    EXPECT_NEAR(by_model.leakage - model_nominal_.leakage, leakage,
                std::max(1e-3, 0.2 * std::abs(leakage)));
  }

  static std::unique_ptr<MeantSurface> meant_;
  static RasterPlan plan_;
  static std::vector<RasterRow> rows_;
  static std::unique_ptr<MilledField> milled_;
  static FluxPicture designed_;
  static Image target_;
  static std::unique_ptr<PartModel> model_;
  static PictureQuality nominal_, model_nominal_;
};

std::unique_ptr<MeantSurface> PartModelTest::meant_;
RasterPlan PartModelTest::plan_;
std::vector<RasterRow> PartModelTest::rows_;
std::unique_ptr<MilledField> PartModelTest::milled_;
FluxPicture PartModelTest::designed_;
Image PartModelTest::target_;
std::unique_ptr<PartModel> PartModelTest::model_;
PictureQuality PartModelTest::nominal_;
PictureQuality PartModelTest::model_nominal_;

TEST_F(PartModelTest, APartWithoutErrorsIsThatOfTheChain) {
  EXPECT_GT(nominal_.metrics.mae, 0.003);
  EXPECT_NEAR(model_nominal_.metrics.mae, nominal_.metrics.mae,
              std::max(5e-4, 0.1 * nominal_.metrics.mae));
  EXPECT_NEAR(model_nominal_.leakage, nominal_.leakage, 0.1 * nominal_.leakage);
}

/// Other kinds of light that a slope moves about as far over the picture.
OpticalSetup mirror_setup() {
  OpticalSetup optics = setup();
  optics.body = MirrorBody{};
  optics.lamp = ParallelLight{{0.5, 0.0, -std::sqrt(0.75)}};
  optics.focal_length = 6.7;
  optics.image_origin.x() += (6.7 - 3.0) * std::tan(std::asin(0.5));
  return optics;
}

OpticalSetup point_setup() {
  OpticalSetup optics = setup();
  optics.lamp = PointSource{{3.0, 2.2, -60.0}, Emission::kIsotropic};
  optics.image_size = {5.0, 5.0};
  optics.image_origin = {-0.12, 0.07};
  return optics;
}

OpticalSetup disc_setup() {
  OpticalSetup optics = point_setup();
  optics.extent.width = 0.6;
  return optics;
}

OpticalSetup tilted_setup() {
  OpticalSetup optics = setup();
  optics.screen_x = {std::cos(0.3), 0.0, std::sin(0.3)};
  return optics;
}

/// Within the fronts light is bent by up to 0.02 rad.
OpticalSetup sphere_setup() {
  OpticalSetup optics = setup();
  optics.front = SphericalFront{60.0, {2.3, 2.6, -0.5}};
  optics.image_size = {3.6, 3.6};
  optics.image_origin = {0.5, 0.8};
  return optics;
}

OpticalSetup height_setup() {
  OpticalSetup optics = setup();
  optics.front = testing::height_front(optics.lens_size, {40, 40}, [](const Eigen::Vector2d& at) {
    return -1.0 + 0.03 * std::sin(1.1 * at.x()) * std::cos(0.9 * at.y());
  });
  return optics;
}

/// The figures of a part without errors and of one before a screen that is farther, by a model that
/// is made for this light, are the chain's.
TEST_F(PartModelTest, UnderOtherLightAPartIsThatOfTheChain) {
  const SurfaceMesh mesh = testing::grid_mesh(51, 51, kSide, kSide, relief);
  const std::array<std::pair<const char*, OpticalSetup>, 6> lights{
      {{"mirror", mirror_setup()},
       {"point", point_setup()},
       {"disc", disc_setup()},
       {"tilted", tilted_setup()},
       {"behind a sphere", sphere_setup()},
       {"behind a height map", height_setup()}}};
  for (const auto& [name, optics] : lights) {
    SCOPED_TRACE(name);
    const auto render = [&](const SurfaceField& field, const OpticalSetup& by) {
      FieldRenderSetup rendering = fine(by);
      rendering.whole = {intake_of(mesh, LightPath(by))};
      return render_field(field, rendering, executor(), {});
    };
    const FluxPicture designed = render(meant_->field(), optics);
    const Image target = designed.image(kPixels * kPixels);
    const PictureJudge judge(target, designed, {});
    PartPlan plan = part_plan();
    plan.optics = optics;
    const PartModel model(*milled_, plan, executor(), RunControl());
    const PolishedField part(*milled_, {Eigen::Vector2d(0, 0), Eigen::Vector2d(kSide, kSide)},
                             {kSigma, 0.0, 1.0});
    for (const double farther : {0.0, 0.3}) {
      OpticalSetup moved = optics;
      const Eigen::Vector3d by = farther * optics.screen_x.cross(optics.screen_y);
      moved.image_origin += by.head<2>();
      moved.focal_length += by.z();
      PartError error;
      error.distance = farther;
      const PictureQuality chain = judge.judge(render(part, moved));
      const PictureQuality by_model = judge.judge(model.render(error, executor()));
      EXPECT_GT(chain.leakage, 0.003);
      EXPECT_NEAR(by_model.metrics.mae, chain.metrics.mae, std::max(5e-4, 0.1 * chain.metrics.mae));
      // A convolution misplaces 0.3 % of an extended source's light.
      EXPECT_NEAR(by_model.leakage, chain.leakage,
                  optics.extent.none() ? 0.1 * chain.leakage : 0.0035);
    }
  }
}

TEST_F(PartModelTest, AnotherPolishChangesItAsInTheChain) {
  for (const double sigma : {0.024, 0.025, 0.036}) {
    SCOPED_TRACE(sigma);
    PartError error;
    error.sigma_factor = sigma / kSigma;
    expect_same_change(chain(*milled_, sigma, setup()), of_model(error));
  }
}

/// A film, and both orders with a floor, whose scallops stay in part.
TEST_F(PartModelTest, PartsOfOtherPolishesAreThoseOfTheChain) {
  for (const auto& [order, floor] : {std::pair(4, 0.0), {2, 0.03}, {4, 0.03}}) {
    SCOPED_TRACE(std::to_string(order) + " floor " + std::to_string(floor));
    PartPlan plan = part_plan();
    plan.polish.order = order;
    plan.polish.floor = floor;
    const PartModel model(*milled_, plan, executor(), RunControl());
    for (const double factor : {1.0, 0.8, 1.2}) {
      PolishModel polish = plan.polish;
      polish.sigma *= factor;
      PartError error;
      error.sigma_factor = factor;
      const PolishedField part(*milled_, {Eigen::Vector2d(0, 0), Eigen::Vector2d(kSide, kSide)},
                               polish);
      const double samples = floor > 0.0 ? 24.4 : 6.1;  // Of a pitch, as cam's.
      const FieldRenderSetup as_cam{setup(), lens_grid(setup().lens_size, kPitch / samples)};
      const PictureQuality by_chain = judged(render_field(part, as_cam, executor(), {}));
      const PictureQuality by_model = judged(model.render(error, executor()));
      EXPECT_NEAR(by_model.metrics.mae, by_chain.metrics.mae,
                  std::max(5e-4, 0.1 * by_chain.metrics.mae))
          << factor;
      EXPECT_NEAR(by_model.leakage, by_chain.leakage, 0.2 * by_chain.leakage) << factor;
    }
  }
}

TEST_F(PartModelTest, PartsHaveTheHazeOfTheirRoughness) {
  PartPlan plan = part_plan();
  const PartModel clear(*milled_, plan, executor(), RunControl());
  plan.haze = haze_of({10.0, 5.0}, plan.optics, 3.0, 550e-6);
  const PartModel rough(*milled_, plan, executor(), RunControl());
  PartError error;
  error.roughness_factor = 1.3;
  EXPECT_EQ(rough.render(error, executor()).flux,
            hazed(plan.haze.times(1.3), clear.render(error, executor()).flux, plan.optics.pixels,
                  executor()));
}

/// A polish that is stronger everywhere by its pattern over the part, a wave without length.
TEST_F(PartModelTest, AFilmThatIsStrongerOverAPartIsAStrongerFilm) {
  PartPlan plan = part_plan();
  plan.polish.order = 4;
  const PartModel model(*milled_, plan, executor(), RunControl());
  PartError by_factor;
  by_factor.sigma_factor = 1.1;
  PartError by_pattern;
  by_pattern.sigma_within = 0.1 / std::sqrt(2.0);
  by_pattern.sigma_waves = {{{0.0, 0.0}, 0.0}};
  const double nominal = judged(model.render({}, executor())).metrics.mae;
  const double factor = judged(model.render(by_factor, executor())).metrics.mae;
  const double pattern = judged(model.render(by_pattern, executor())).metrics.mae;
  EXPECT_NEAR(pattern - nominal, factor - nominal,
              std::max(1e-4, 0.2 * std::abs(factor - nominal)));
}

TEST_F(PartModelTest, AnotherIndexAndDistanceChangeItAsInTheChain) {
  for (const double index : {-0.01, 0.01}) {
    SCOPED_TRACE(index);
    PartError error;
    error.index = index;
    OpticalSetup optics = setup();
    optics.ior += index;
    expect_same_change(chain(*milled_, kSigma, optics), of_model(error));
  }
  for (const double farther : {-0.5, 0.5}) {
    SCOPED_TRACE(farther);
    PartError error;
    error.distance = farther;
    OpticalSetup optics = setup();
    optics.focal_length += farther;
    expect_same_change(chain(*milled_, kSigma, optics), of_model(error));
  }
}

TEST_F(PartModelTest, AnotherBallOnTheSameWayChangesItAsInTheChain) {
  for (const double radius : {-0.01, 0.01}) {
    SCOPED_TRACE(radius);
    PartError error;
    error.radius = radius;
    expect_same_change(chain(*milled(kRadius + radius, unmoved), kSigma, setup()), of_model(error));
  }
}

TEST_F(PartModelTest, WavinessChangesItAsInTheChain) {
  PartError error;
  error.along_x = {{1e-4, kTwoPi / 1.3, 0.3}};
  error.along_y = {{5e-5, kTwoPi / 0.8, 1.0}};
  const Changed wavy(*milled_, [&](double x, double y) {
    return 1e-4 * std::cos(kTwoPi / 1.3 * x + 0.3) + 5e-5 * std::cos(kTwoPi / 0.8 * y + 1.0);
  });
  expect_same_change(chain(wavy, kSigma, setup()), of_model(error));
}

TEST_F(PartModelTest, RowsAtAnotherHeightChangeItAsInTheChain) {
  RowHeights rows;
  rows.length = kSide;
  rows.places = 2;
  const auto height = [](std::int64_t row) {
    return 5e-5 * std::sin(1.7 * static_cast<double>(row * row));
  };
  for (std::int64_t row = 0; row < plan_.rows - 2 * (plan_.rows_outside + kRowsBeyond); ++row) {
    rows.height.insert(rows.height.end(), 2, height(row));
  }
  PartError error;
  error.rows = rows;
  const auto cut =
      milled(kRadius, [&](std::int64_t row) { return Eigen::Vector3d(0.0, 0.0, height(row)); });
  expect_same_change(chain(*cut, kSigma, setup()), of_model(error));
}

TEST_F(PartModelTest, BacklashChangesItAsInTheChain) {
  PartError error;
  error.backlash = 0.006;
  const auto cut = milled(kRadius, [&](std::int64_t row) {
    return Eigen::Vector3d(row % 2 == 0 ? 0.003 : -0.003, 0.0, 0.0);
  });
  expect_same_change(chain(*cut, kSigma, setup()), of_model(error));
}

TEST_F(PartModelTest, ASourceBlursThePictureAsManyDirectionsDo) {
  PartError error;
  error.source = 0.01;
  const FluxPicture blurred = model_->render(error, executor());
  FluxPicture sum = designed_;
  std::fill(sum.flux.begin(), sum.flux.end(), 0.0);
  const int rings = 3;
  const int places = 12;
  for (int ring = 0; ring < rings; ++ring) {
    for (int k = 0; k < places; ++k) {
      const double angle = 0.5 * error.source * std::sqrt((ring + 0.5) / rings);
      const double heading = kTwoPi * (k + 0.5 * ring) / places;
      OpticalSetup optics = setup();
      const Eigen::Vector3d way(angle * std::cos(heading), angle * std::sin(heading), 1.0);
      optics.lamp = ParallelLight{way.normalized()};
      const PolishedField part(*milled_, {Eigen::Vector2d(0, 0), Eigen::Vector2d(kSide, kSide)},
                               {kSigma, 0.0, 1.0});
      FieldRenderSetup coarse{optics, lens_grid(optics.lens_size, kPitch / 4.0)};
      const FluxPicture one = render_field(part, coarse, executor(), {});
      for (std::size_t i = 0; i < sum.flux.size(); ++i) {
        sum.flux[i] += one.flux[i] / (rings * places);
      }
    }
  }
  expect_same_change(judged(sum), judged(blurred));
}

TEST_F(PartModelTest, GivesTheSameBitsForAnyNumberOfThreads) {
  PartError error;
  error.sigma_within = 0.05;
  error.sigma_waves = {{{0.7, 0.2}, 0.1}};
  error.tilt = {0.002, -0.001};
  error.source = 0.001;
  error.backlash = 0.001;
  EXPECT_EQ(model_->render(error, Executor::serial()).flux,
            model_->render(error, Executor::cpu(3)).flux);
}

TEST_F(PartModelTest, StopsWhenItIsAskedTo) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW((void)model_->render({}, executor().with_stop(stop.get_token())), Interrupted);
}

}  // namespace
}  // namespace lensforge::part_model_test

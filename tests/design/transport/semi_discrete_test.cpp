// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/transport/semi_discrete.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stop_token>
#include <string>

#include "core/error.h"
#include "core/mesh/surface_mesh.h"
#include "design/test_setups.h"
#include "design/transport_scenes.h"
#include "design/vector_lbfgs.h"
#include "fixtures/scenes/scenes.h"

namespace lensforge {
namespace {

using testing::cell_moments;
using testing::measure_cells;
using testing::minimize_lbfgs;
using testing::Random;
using testing::transport_energy;

TransportResult solve(const Eigen::Matrix2Xd& sites, const Image& density) {
  return solve_semi_discrete(sites, Eigen::VectorXd::Ones(sites.cols()), density, {},
                             Executor::cpu(2), {});
}

/// Largest relative mass error, measured anew.
double measured_error(const Eigen::Matrix2Xd& sites, const TransportResult& result,
                      const Image& density) {
  const PowerDiagram diagram(sites, result.weights, spatial_order(sites), {});
  const SummedDensity summed(density, static_cast<double>(sites.cols()));
  double worst = 0.0;
  for (const double mass : measure_cells(diagram, summed, Executor::serial()).mass) {
    worst = std::max(worst, std::fabs(mass - 1.0));
  }
  return worst;
}

void expect_balanced(const Image& density, int columns) {
  const Eigen::Matrix2Xd sites = testing::face_sites(columns, density.columns());
  const TransportResult result = solve(sites, density);
  ASSERT_TRUE(result.converged()) << result.message;
  EXPECT_LT(result.mass_error, 1e-4);
  EXPECT_LT(measured_error(sites, result, density), 1e-4);
  EXPECT_NEAR(result.weights.mean(), 0.0, 1e-6);
  EXPECT_TRUE(result.centroids.allFinite());
  EXPECT_GE(result.centroids.minCoeff(), 0.0);
  EXPECT_LE(result.centroids.maxCoeff(), density.columns());
}

TEST(SemiDiscrete, BalancesAnEvenPicture) { expect_balanced(Image(128, 128, 0.4F), 40); }

TEST(SemiDiscrete, BalancesASmoothPicture) { expect_balanced(testing::spot_picture(128, 128), 40); }

TEST(SemiDiscrete, BalancesALogoOnPureBlack) { expect_balanced(testing::logo_picture(256), 40); }

TEST(SemiDiscrete, BalancesAPictureLikeAPhotograph) {
  expect_balanced(fixtures::draw_lake(256), 40);
}

TEST(SemiDiscrete, EvenPictureOfRegularSitesHasEqualWeights) {
  Eigen::Matrix2Xd sites(2, 64);
  const Eigen::Vector2d half(0.5, 0.5);
  for (int i = 0; i < 64; ++i) sites.col(i) = Eigen::Vector2d(i % 8, i / 8) + half;
  const TransportResult result = solve(sites, Image(8, 8, 1.0F));
  ASSERT_TRUE(result.converged());
  EXPECT_LT(result.weights.cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((result.centroids - sites).cwiseAbs().maxCoeff(), 1e-4);
}

/// The paper's method: L-BFGS on H(w).
Eigen::VectorXd minimised_weights(const Eigen::Matrix2Xd& sites, const SummedDensity& density) {
  const Eigen::VectorXd wanted = Eigen::VectorXd::Ones(sites.cols());
  const std::vector<int> order = spatial_order(sites);
  const auto energy = [&](const Eigen::VectorXd& w, Eigen::VectorXd& gradient) {
    const PowerDiagram diagram(sites, w, order, {});
    const std::vector<Moments> cells = cell_moments(diagram, density, Executor::serial());
    gradient.resize(w.size());
    for (Eigen::Index i = 0; i < w.size(); ++i) {
      gradient[i] = cells[static_cast<std::size_t>(i)].mass - wanted[i];
    }
    return transport_energy(diagram, cells, wanted);
  };
  const auto scaled = [](const Eigen::VectorXd& g, Eigen::VectorXd& r) { r = 0.2 * g; };
  LbfgsOptions options;
  options.max_iterations = 2000;
  options.relative_decrease = 1e-15;
  options.stall_window = 60;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(sites.cols());
  minimize_lbfgs(
      energy, scaled, options, [](int, double) { return true; }, Executor::serial(), weights);
  return weights;
}

TEST(SemiDiscrete, AgreesWithTheMinimiserOfTheEnergy) {
  const Image picture = testing::spot_picture(24, 24);
  const Eigen::Matrix2Xd sites = testing::face_sites(10, 24);
  const TransportResult result = solve(sites, picture);
  ASSERT_TRUE(result.converged());
  Eigen::VectorXd reference =
      minimised_weights(sites, SummedDensity(picture, static_cast<double>(sites.cols())));
  reference.array() -= reference.mean();
  const double worst = (reference - result.weights).cwiseAbs().maxCoeff();
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(worst, 1e-3 * result.weights.cwiseAbs().maxCoeff());
}

TEST(SemiDiscrete, IsTheSameOnOneAndTwoThreads) {
  const Eigen::Matrix2Xd sites = testing::face_sites(30, 96);
  const Eigen::VectorXd masses = Eigen::VectorXd::Ones(sites.cols());
  const Image logo = testing::logo_picture(96);
  const TransportResult one = solve_semi_discrete(sites, masses, logo, {}, Executor::cpu(1), {});
  const TransportResult two = solve_semi_discrete(sites, masses, logo, {}, Executor::cpu(2), {});
  ASSERT_TRUE(one.converged());
  EXPECT_EQ(one.weights, two.weights);
  EXPECT_EQ(one.centroids, two.centroids);
}

TEST(SemiDiscrete, CoincidentSitesShareACell) {
  Eigen::Matrix2Xd sites = testing::face_sites(12, 32);
  sites.col(5) = sites.col(40);
  sites.col(6) = sites.col(40);
  const TransportResult result = solve(sites, testing::spot_picture(32, 32));
  ASSERT_TRUE(result.converged()) << result.message;
  EXPECT_EQ(result.centroids.col(5), result.centroids.col(40));
  EXPECT_EQ(result.weights[6], result.weights[40]);
}

TEST(SemiDiscrete, SitesMayLieOutsideAndFoldOver) {
  Eigen::Matrix2Xd sites = testing::face_sites(16, 40);
  for (Eigen::Index i = 0; i < sites.cols(); ++i) {
    const double x = sites(0, i);
    sites(0, i) = x < 20.0 ? 70.0 - x : x - 5.0;  // folded, and half of it beyond the border
    sites(1, i) = 1.7 * sites(1, i) - 12.0;
  }
  const Image picture = testing::logo_picture(40);
  const TransportResult result = solve(sites, picture);
  ASSERT_TRUE(result.converged()) << result.message;
  EXPECT_LT(result.mass_error, 1e-4);
}

TEST(SemiDiscrete, SitesOnALineCutStrips) {
  Eigen::Matrix2Xd sites(2, 50);
  for (Eigen::Index i = 0; i < 50; ++i) sites.col(i) = Eigen::Vector2d(7.0, 0.1 * double(i));
  const Image picture = testing::spot_picture(20, 30);
  const TransportResult result = solve(sites, picture);
  ASSERT_TRUE(result.converged()) << result.message;
  for (Eigen::Index i = 1; i < 50; ++i) {
    EXPECT_GT(result.centroids(1, i), result.centroids(1, i - 1));
  }
}

TEST(SemiDiscrete, ASingleSiteGetsThePicturesCentroid) {
  const TransportResult result = solve(Eigen::Vector2d(3.0, 900.0), Image(8, 6, 1.0F));
  ASSERT_TRUE(result.converged());
  EXPECT_LT((result.centroids - Eigen::Vector2d(4.0, 3.0)).norm(), 1e-12);
}

TEST(SemiDiscrete, SitesWithoutMassGetWhatLiesAround) {
  const Eigen::Matrix2Xd sites = testing::face_sites(16, 40);
  Eigen::VectorXd masses = Eigen::VectorXd::Ones(sites.cols());
  masses[100] = masses[101] = masses[333] = 0.0;
  const Image picture = testing::spot_picture(40, 40);
  const TransportResult result =
      solve_semi_discrete(sites, masses, picture, {}, Executor::cpu(2), {});
  ASSERT_TRUE(result.converged()) << result.message;
  EXPECT_TRUE(result.weights.allFinite());
  for (const Eigen::Index i : {100, 333}) {
    EXPECT_LT((result.centroids.col(i) - result.centroids.col(i + 2)).norm(), 6.0);
  }
}

TEST(SemiDiscrete, UnequalMassesAreMet) {
  Random random(21);
  const Eigen::Matrix2Xd sites = testing::face_sites(20, 48);
  const Eigen::VectorXd masses =
      Eigen::VectorXd::NullaryExpr(sites.cols(), [&] { return random.magnitude(0.05, 20.0); });
  const TransportResult result =
      solve_semi_discrete(sites, masses, testing::logo_picture(48), {}, Executor::cpu(2), {});
  ASSERT_TRUE(result.converged()) << result.message;
  EXPECT_LT(result.mass_error, 1e-4);
}

TEST(SemiDiscrete, RefusesWhatMakesNoSense) {
  const Eigen::Matrix2Xd sites = testing::face_sites(4, 8);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(sites.cols());
  const Image grey(8, 8, 0.5F);
  const auto run = [&](const Eigen::Matrix2Xd& s, const Eigen::VectorXd& m, const Image& image) {
    return solve_semi_discrete(s, m, image, {}, Executor::serial(), {});
  };
  Eigen::Matrix2Xd broken = sites;
  broken(1, 3) = std::numeric_limits<double>::infinity();
  EXPECT_THROW(run(broken, ones, grey), InputError);
  EXPECT_THROW(run(sites, -ones, grey), InputError);
  EXPECT_THROW(run(sites, 0.0 * ones, grey), InputError);
  EXPECT_THROW(run(sites, ones.head(3), grey), InputError);
  EXPECT_THROW(run(sites, ones, Image(8, 8, 0.0F)), InputError);
}

TEST(SemiDiscrete, LitAreasAddUpToWhatIsNotBlack) {
  const Image picture = testing::logo_picture(64);
  const TransportResult result = solve(testing::face_sites(24, 64), picture);
  ASSERT_TRUE(result.converged()) << result.message;
  const auto lit = std::count_if(picture.values().begin(), picture.values().end(),
                                 [](float value) { return value > 0.0F; });
  EXPECT_NEAR(result.lit_areas.sum(), static_cast<double>(lit), 1e-6);
  EXPECT_NEAR(result.areas.sum(), 64.0 * 64.0, 1e-6);
  EXPECT_GE((result.areas - result.lit_areas).minCoeff(), -1e-9);
}

TEST(SemiDiscrete, SaysThatAStageRanOutOfSteps) {
  TransportOptions options;
  options.max_stage_steps = 1;
  const Eigen::Matrix2Xd sites = testing::face_sites(16, 40);
  const TransportResult result =
      solve_semi_discrete(sites, Eigen::VectorXd::Ones(sites.cols()), testing::logo_picture(40),
                          options, Executor::serial(), {});
  EXPECT_EQ(result.status, TransportResult::Status::kNotConverged);
  for (const TransportStep& step : result.steps) EXPECT_EQ(step.number, 0);
  EXPECT_NE(result.message.find("limit"), std::string::npos);
}

TEST(SemiDiscrete, SaysHowMuchLightIsMisplaced) {
  const Eigen::Matrix2Xd sites = testing::face_sites(16, 40);
  const Image picture = testing::spot_picture(40, 40);
  EXPECT_LT(solve(sites, picture).misplaced, 1e-4);
  TransportOptions rough;
  rough.max_stage_steps = 1;  // Ends on a blurred picture.
  const auto count = static_cast<double>(sites.cols());
  const TransportResult result = solve_semi_discrete(sites, Eigen::VectorXd::Ones(sites.cols()),
                                                     picture, rough, Executor::serial(), {});
  ASSERT_EQ(result.weights.size(), sites.cols());
  const PowerDiagram diagram(sites, result.weights, spatial_order(sites), {});
  const std::vector<double> mass =
      measure_cells(diagram, SummedDensity(picture, count), Executor::serial()).mass;
  double wrong = 0.0;
  for (const double m : mass) wrong += 0.5 * std::fabs(m - 1.0);
  EXPECT_GT(result.misplaced, 1e-4);
  EXPECT_NEAR(result.misplaced, wrong / count, 1e-9);
}

TEST(SemiDiscrete, SaysThatItRanOutOfSteps) {
  TransportOptions options;
  options.max_newton_steps = 2;
  const Eigen::Matrix2Xd sites = testing::face_sites(16, 40);
  const TransportResult result =
      solve_semi_discrete(sites, Eigen::VectorXd::Ones(sites.cols()), testing::logo_picture(40),
                          options, Executor::serial(), {});
  EXPECT_EQ(result.status, TransportResult::Status::kNotConverged);
  EXPECT_EQ(result.steps.size(), 2U);
  EXPECT_NE(result.message.find("limit"), std::string::npos);
}

TEST(SemiDiscrete, EndsWhenAskedToStop) {
  std::stop_source stop;
  int reports = 0;
  const RunControl control(stop.get_token(), [&](const Progress&) {
    if (++reports == 3) stop.request_stop();
  });
  const Eigen::Matrix2Xd sites = testing::face_sites(40, 64);
  const TransportResult result =
      solve_semi_discrete(sites, Eigen::VectorXd::Ones(sites.cols()), testing::logo_picture(64), {},
                          Executor::cpu(2), control);
  EXPECT_EQ(result.status, TransportResult::Status::kStopped);
  EXPECT_EQ(result.steps.size(), 3U);
}

TEST(SemiDiscrete, ALevelThatCannotBeBalancedLeavesNoMap) {
  TransportOptions options;
  options.max_newton_steps = 4;  // All on the coarsest level.
  const Eigen::Matrix2Xd sites = testing::face_sites(40, 64);
  const TransportResult result =
      solve_semi_discrete(sites, Eigen::VectorXd::Ones(sites.cols()), testing::logo_picture(64),
                          options, Executor::serial(), {});
  EXPECT_EQ(result.status, TransportResult::Status::kNotConverged);
  EXPECT_EQ(result.message, "Newton step limit reached");
  EXPECT_EQ(result.centroids.cols(), 0);
  EXPECT_EQ(result.weights.size(), 0);
}

TEST(DensityBlur, KeepsTheTotalAndSpreadsExponentially) {
  Image picture(40, 30);
  picture.at(20, 11) = 1.0F;
  const Image soft = soften(picture, 2.0, 0.0);
  EXPECT_NEAR(soft.total(), 1.0, 1e-6);
  EXPECT_NEAR(soft.at(23, 11) / soft.at(20, 11), std::exp(-1.5), 1e-5);
  EXPECT_NEAR(soft.at(20, 13) / soft.at(20, 11), std::exp(-1.0), 1e-5);
}

TEST(DensityBlur, MirrorsAtBordersAndMixesInTheFloor) {
  const Image even = soften(Image(7, 5, 0.25F), 3.0, 0.1);
  for (const float v : even.values()) EXPECT_NEAR(v, 0.25F, 1e-6F);
  Image corner(9, 9);
  corner.at(0, 0) = 1.0F;
  EXPECT_NEAR(soften(corner, 50.0, 0.0).total(), 1.0, 1e-5);
  EXPECT_NEAR(soften(corner, 0.0, 0.5).at(8, 8), 0.5 / 81.0, 1e-7);
}

/// Light of an even lens: every face's area at its centroid.
struct EvenLens {
  Eigen::Matrix2Xd sites;
  Eigen::VectorXd masses;
};
EvenLens even_lens(int columns, double side) {
  const SurfaceMesh mesh = make_grid_mesh({side, side}, {columns + 1, columns * 115 / 100 + 1}, 0);
  EvenLens lens{Eigen::Matrix2Xd(2, mesh.triangle_count()), Eigen::VectorXd(mesh.triangle_count())};
  for (Eigen::Index f = 0; f < lens.masses.size(); ++f) {
    const Eigen::Vector3d a = mesh.corner(f, 0);
    const Eigen::Vector3d b = mesh.corner(f, 1);
    const Eigen::Vector3d c = mesh.corner(f, 2);
    lens.sites.col(f) = ((a + b + c) / 3.0).head<2>();
    lens.masses[f] = 0.5 * (b - a).cross(c - a).z();
  }
  return lens;
}

TransportResult solve(const EvenLens& lens, const Image& picture) {
  const auto& [sites, masses] = lens;
  return solve_semi_discrete(sites, masses, picture, {}, Executor::cpu(1), RunControl());
}

/// A picture with light only in its first `left` and last `right` columns.
Image two_bands(int pixels, int left, int right) {
  Image picture(pixels, pixels);
  for (int r = 0; r < pixels; ++r) {
    for (int c = 0; c < pixels; ++c) {
      picture.at(c, r) = c < left || c >= pixels - right ? 1.0F : 0.0F;
    }
  }
  return picture;
}

TEST(BrenierMap, OfAnEvenPictureIsTheIdentity) {
  const Image picture(32, 32, 0.5F);
  const EvenLens lens = even_lens(20, 32);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  testing::Random random(5);
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector2d p(random.between(2, 30), random.between(2, 30));
    EXPECT_LT((map(p) - p).norm(), 0.1) << p.transpose();
  }
}

// Both bands have the sites' density times 32/14: x is squeezed by that on each side of the crease
// at 32 · 6/14, and nothing lands between.
TEST(BrenierMap, JumpsOverBlackAtTheCreaseToHalfTheSitesSpacing) {
  const Image picture = two_bands(32, 6, 8);
  const EvenLens lens = even_lens(20, 32);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  const double crease = 32.0 * 6.0 / 14.0;
  const double squeeze = 14.0 / 32.0;
  testing::Random random(6);
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector2d p(random.between(1, 31), random.between(4, 28));
    // Sites are 1.6 pixels apart; the crease is found to half of that.
    if (std::fabs(p.x() - crease) < 0.8) continue;
    const double x = p.x() < crease ? squeeze * p.x() : 32.0 - squeeze * (32.0 - p.x());
    EXPECT_LT((map(p) - Eigen::Vector2d(x, p.y())).norm(), 0.3) << p.transpose();
  }
}

TEST(BrenierMap, SendsNoLightIntoBlack) {
  const Image picture = testing::logo_picture(64);
  const EvenLens lens = even_lens(40, 64);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  testing::Random random(7);
  for (int k = 0; k < 5000; ++k) {
    const Eigen::Vector2d p(random.between(0, 64), random.between(0, 64));
    const Eigen::Vector2d landing = map(p);
    const int column = std::min(63, static_cast<int>(landing.x()));
    const int row = std::min(63, static_cast<int>(landing.y()));
    EXPECT_GT(picture.at(column, row), 0.0F) << p.transpose() << " to " << landing.transpose();
  }
}

TEST(BrenierMap, GivesASiteOfItsOwnCellsCentroid) {
  const Image picture = testing::spot_picture(32, 32);
  const EvenLens lens = even_lens(20, 32);
  const TransportResult result = solve(lens, picture);
  const BrenierMap map(lens.sites, result, picture);
  for (Eigen::Index i = 0; i < lens.sites.cols(); ++i) {
    EXPECT_LT((map(lens.sites.col(i)) - result.centroids.col(i)).norm(), 1e-9) << i;
  }
}

}  // namespace

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <tuple>
#include <vector>

#include "core/image/color.h"
#include "core/optics/front.h"
#include "core/optics/optical_setup.h"
#include "design/design.h"
#include "design/finite_difference.h"
#include "design/objective_setups.h"
#include "design/render.h"
#include "design/setup/design_options.h"

namespace lensforge {
namespace {

/// The test lens of a material that spreads colours strongly, in light of three of them.
OpticalSetup colored_setup() {
  OpticalSetup setup = testing::kSetup;
  setup.spectrum = {{480.0, 550.0, 620.0}, {1.0, 0.5, 2.0}, 12.0};
  return setup;
}

/// Another property that a dispersing lens may have.
struct Kind {
  const char* name;
  void (*apply)(OpticalSetup&);
};
void nothing_else(OpticalSetup& /*setup*/) {}
void point_source(OpticalSetup& setup) { setup.lamp = PointSource{{15.0, 10.0, -150.0}, {}}; }
void curved_front(OpticalSetup& setup) {
  point_source(setup);
  setup.front = spherical_front(-120.0, setup.lens_size);
}
void disc(OpticalSetup& setup) { setup.outline = circle_outline(setup.lens_size); }
void disc_before_a_point(OpticalSetup& setup) {
  point_source(setup);
  disc(setup);
}
void wide_source(OpticalSetup& setup) { setup.extent.width = 0.05; }
void reflecting_faces(OpticalSetup& setup) { setup.fresnel = true; }
constexpr Kind kKinds[] = {{"Nothing", nothing_else},
                           {"PointSource", point_source},
                           {"CurvedFront", curved_front},
                           {"Outline", disc},
                           {"OutlineAndPointSource", disc_before_a_point},
                           {"WideSource", wide_source},
                           {"Fresnel", reflecting_faces}};

/// All weights above 0, to find terms that are counted once per colour.
constexpr ObjectiveWeights kWeights{1e2, 1e3, 1e-3, 2e1, 1e-8, 3e0, 2e-1, 2e0, 1e1};

class DispersedObjective : public ::testing::TestWithParam<std::tuple<SurfaceModel, Kind>> {
 protected:
  DispersedObjective() { std::get<1>(GetParam()).apply(setup_); }

  [[nodiscard]] SurfaceModel model() const { return std::get<0>(GetParam()); }
  [[nodiscard]] DesignObjective objective(const ObjectiveWeights& weights,
                                          const Executor& executor = Executor::serial()) const {
    ObjectiveOptions options = testing::options_of(model(), weights);
    options.surface_height = 5.0;
    return {mesh_, setup_, testing::target(), options, executor};
  }
  [[nodiscard]] Image picture(const OpticalSetup& setup) const {
    return render_surface(mesh_, setup, model(), Executor::serial()).image;
  }

  OpticalSetup setup_ = colored_setup();
  SurfaceMesh mesh_ = testing::rough_mesh();
};

TEST_P(DispersedObjective, GradientEqualsCentralDifferences) {
  DesignObjective function = objective(kWeights);
  EXPECT_LT(testing::gradient_error(function, mesh_.vertices, {1e-4, 1e-5, 2e-6, 5e-7, 1e-7, 5e-8}),
            1e-6);
}

/// Slow reference: a picture for each colour, each rendered on its own, summed by brightness. An
/// extended source is blurred in the objective and made of points in the picture.
TEST_P(DispersedObjective, ComparesTheSumOfThePicturesOfAllColors) {
  std::vector<double> sum(testing::target().values().size(), 0.0);
  double all = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double wavelength = setup_.spectrum.wavelengths[k];
    const double share = setup_.spectrum.powers[k] * color_matching(wavelength).y();
    const Image one = picture(in_color(setup_, wavelength));
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += share * static_cast<double>(one.values()[i]);
    }
    all += share;
  }
  const Image seen = picture(setup_);
  double absolute = 0.0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    EXPECT_NEAR(seen.values()[i], sum[i] / all, 1e-5);
    const double value = sum[i] / all / static_cast<double>(sum.size()) * testing::target().total();
    absolute += std::fabs(encode(value) - encode(double{testing::target().values()[i]}));
  }
  DesignObjective function = objective({});
  const bool approximate =
      !setup_.extent.none() || (setup_.outline && model() != SurfaceModel::kFacet);
  EXPECT_NEAR(testing::evaluate_at(function, mesh_.vertices).mae,
              absolute / static_cast<double>(sum.size()),
              approximate ? (setup_.extent.none() ? 1e-4 : 2e-3) : 1e-6);
}

/// The terms that have nothing to do with colour are those of a lens without a spectrum.
TEST_P(DispersedObjective, CountsTheShapeOnce) {
  DesignObjective colored = objective(kWeights);
  const EnergyValues of_all = testing::evaluate_at(colored, mesh_.vertices).energy;
  setup_ = in_color(setup_, setup_.spectrum.wavelengths.front());
  DesignObjective first = objective(kWeights);
  const EnergyValues of_one = testing::evaluate_at(first, mesh_.vertices).energy;
  EXPECT_EQ(of_all.face, of_one.face);
  EXPECT_EQ(of_all.edge, of_one.edge);
  EXPECT_EQ(of_all.laplacian, of_one.laplacian);
  EXPECT_EQ(of_all.barrier, of_one.barrier);
  EXPECT_NE(of_all.image, of_one.image);
}

TEST_P(DispersedObjective, HasTheSameBitsForAnyNumberOfThreads) {
  DesignObjective one = objective({});
  DesignObjective three = objective({}, Executor::cpu(3));
  Eigen::Matrix3Xd a;
  Eigen::Matrix3Xd b;
  EXPECT_EQ(one.evaluate(mesh_.vertices, a).energy.total,
            three.evaluate(mesh_.vertices, b).energy.total);
  EXPECT_EQ(a, b);
}

INSTANTIATE_TEST_SUITE_P(All, DispersedObjective,
                         ::testing::Combine(::testing::ValuesIn(testing::kModels),
                                            ::testing::ValuesIn(kKinds)),
                         [](const auto& test) {
                           const bool facet = std::get<0>(test.param) == SurfaceModel::kFacet;
                           std::string name = facet ? "facet" : "smooth";
                           name += std::get<1>(test.param).name;
                           return name;
                         });

/// Correspondences are of one index, that of the setup.
TEST(DispersedCorrespondence, IsThatOfTheMiddleColor) {
  const SurfaceMesh mesh = testing::rough_mesh();
  const ObjectiveOptions options = testing::options_of(SurfaceModel::kSmooth, {});
  DesignObjective colored(mesh, colored_setup(), testing::correspondence(), options,
                          Executor::serial());
  DesignObjective plain =
      testing::objective_of(mesh, options, Executor::serial(), testing::Goal::kCorrespondence);
  Eigen::Matrix3Xd a;
  Eigen::Matrix3Xd b;
  EXPECT_EQ(colored.evaluate(mesh.vertices, a).energy.total,
            plain.evaluate(mesh.vertices, b).energy.total);
  EXPECT_EQ(a, b);
}

TEST(DispersedDesign, IsBetterInWhiteLightThanOneOfASingleColor) {
  const Image target = testing::spot_picture(32, 32);
  DesignOptions options = default_design_options(SurfaceModel::kSmooth, target);
  options.width = 32.0;
  options.focal_length = 100.0;
  options.rounds = 1;
  options.iterations = 60;
  options.light.image_width = 96.0;
  const DesignResult single = design_lens(target, options, Executor::cpu(2), RunControl());
  options.light.spectrum = {{480.0, 550.0, 620.0}, {}, 20.0};
  const DesignResult white = design_lens(target, options, Executor::cpu(2), RunControl());
  ASSERT_TRUE(white.colors.has_value());
  EXPECT_GT(white.colors->fringe.mean, 0.1);
  EXPECT_EQ(white.colors->picture.columns, 32);
  EXPECT_FALSE(single.colors.has_value());
  Lens other = single.lens;
  other.setup = white.lens.setup;
  const double unaware = evaluate(other, SurfaceModel::kSmooth, nullptr, Executor::cpu(2)).mae;
  const double aware = white.lens.metrics.at(SurfaceModel::kSmooth).mae;
  EXPECT_LT(aware, 0.8 * unaware);
}

}  // namespace
}  // namespace lensforge

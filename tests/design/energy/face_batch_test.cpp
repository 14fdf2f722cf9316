// SPDX-License-Identifier: GPL-3.0-or-later
// Kernels for several faces or vertices at a time, in every light that they take.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "core/optics/light_path.h"
#include "core/optics/outline.h"
#include "design/energy/objective.h"
#include "design/objective_setups.h"

namespace lensforge::face_batch_test {

/// Runs kernels with vectors of this length, or for one face or vertex at a time.
class TestExecutor : public Executor {
 public:
  explicit TestExecutor(std::optional<Lanes> lanes) : Executor(Executor::serial()), lanes_(lanes) {}
  [[nodiscard]] const std::optional<Lanes>& lanes() const { return lanes_; }

 private:
  std::optional<Lanes> lanes_;
};

template <std::size_t N, class Kernel>
FinishedSum<N> pending_sum(const TestExecutor& executor, const char* name, std::int64_t count,
                           const Kernel& kernel) {
  if constexpr (SummedInLanes<Kernel>) {
    if (executor.lanes()) return sum_in_lanes(executor, name, count, kernel, *executor.lanes());
  }
  return {parallel_sum<N>(executor, name, count, kernel)};
}

template <class Kernel>
void parallel_for(const TestExecutor& executor, const char* name, std::int64_t count,
                  const Kernel& kernel) {
  if constexpr (requires { call_in_lanes(executor, name, count, kernel); }) {
    if (executor.lanes()) return call_in_lanes(executor, name, count, kernel, *executor.lanes());
  }
  for (std::int64_t i = 0; i < count; ++i) kernel(i);
}

template <class Source>
void parallel_for_worker(const TestExecutor& executor, const char* /*name*/, std::int64_t count,
                         const DepositFlux<Source>& kernel) {
  TriangleBatch batch;
  for (std::int64_t i = 0; i < count; i += TriangleBatch::kSize) {
    const int size = static_cast<int>(std::min<std::int64_t>(TriangleBatch::kSize, count - i));
    if (executor.lanes()) fill_batch(kernel.source, i, size, batch, *executor.lanes());
    for (int k = 0; k < size; ++k) {
      deposit(executor.lanes() ? batch.at(k) : kernel.source(i + k), kernel.first);
    }
  }
}

namespace {

using testing::kSetup;
using testing::rough_mesh;

/// A kind of light that LightPath::takes_lanes().
struct Light {
  const char* name;
  void (*apply)(OpticalSetup&);

  friend std::ostream& operator<<(std::ostream& out, const Light& light) {
    return out << light.name;
  }
};

void turn_screen(OpticalSetup& setup) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  setup.screen_x = turn.col(0);
  setup.screen_y = turn.col(1);
}
void tilt_light(OpticalSetup& setup) {
  setup.lamp = ParallelLight{Eigen::Vector3d(0.25, -0.15, 1.0).normalized()};
}
void tilt_both(OpticalSetup& setup) {
  tilt_light(setup);
  turn_screen(setup);
}
void mirror(OpticalSetup& setup) {
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{Eigen::Vector3d(0.5, 0.0, -std::sqrt(0.75))};
}
void mirror_to_turned_screen(OpticalSetup& setup) {
  mirror(setup);
  turn_screen(setup);
}
void outline(OpticalSetup& setup) { setup.outline = circle_outline(setup.lens_size); }

constexpr Light kLights[] = {{"AlongZ", [](OpticalSetup& /*setup*/) {}},
                             {"TurnedScreen", turn_screen},
                             {"Oblique", tilt_light},
                             {"ObliqueOnTurnedScreen", tilt_both},
                             {"Mirror", mirror},
                             {"MirrorToTurnedScreen", mirror_to_turned_screen},
                             {"Outline", outline}};

/// The setup in this light, its picture moved to where that goes.
OpticalSetup lit_by(const Light& light) {
  OpticalSetup setup = kSetup;
  light.apply(setup);
  const Eigen::Vector2d middle =
      0.5 * setup.lens_size + (setup.focal_length - 5.0) * LightPath(setup).chief_slope(5.0);
  setup.image_origin = middle - 0.5 * setup.image_size;
  return setup;
}

/// An evaluation of the rough mesh, and of one that a barrier refuses.
struct Result {
  EnergyValues energy;
  Eigen::Matrix3Xd gradient;
  std::vector<double> normals_bar;  ///< Of a spline.
  bool steep_is_feasible = true;
};

Result evaluated(const OpticalSetup& setup, SurfaceModel model, std::optional<Lanes> lanes) {
  SurfaceMesh mesh = rough_mesh();
  ObjectiveOptions options = testing::options_of(model, ObjectiveWeights{});
  if (model == SurfaceModel::kSpline) options.weights.smooth = 0.0;
  DesignObjectiveOn<TestExecutor> objective(mesh, setup, testing::target(), options,
                                            TestExecutor(lanes));
  Result result;
  result.gradient.resize(3, mesh.vertices.cols());
  if (model == SurfaceModel::kSpline) {
    const Eigen::Matrix3Xd normals = vertex_area_normals(mesh);
    std::copy(normals.reshaped().begin(), normals.reshaped().end(), objective.normals());
  }
  const ObjectiveEvaluation e = objective.evaluate(mesh.vertices.data(), result.gradient.data());
  EXPECT_TRUE(e.feasible);
  result.energy = e.energy;
  if (model == SurfaceModel::kSpline) {
    result.normals_bar.assign(objective.normals_bar(),
                              objective.normals_bar() + result.gradient.size());
  }
  mesh.vertices(2, mesh.vertices.cols() / 2) += 3.0;
  Eigen::Matrix3Xd ignored = result.gradient;
  result.steep_is_feasible = objective.evaluate(mesh.vertices.data(), ignored.data()).feasible;
  return result;
}

class FaceBatch : public ::testing::TestWithParam<Light> {};

INSTANTIATE_TEST_SUITE_P(Lights, FaceBatch, ::testing::ValuesIn(kLights),
                         [](const auto& one) { return std::string(one.param.name); });

TEST_P(FaceBatch, HasTheBitsOfSingleFacesAndVertices) {
  const OpticalSetup setup = lit_by(GetParam());
  ASSERT_TRUE(LightPath(setup).takes_lanes());
  for (const SurfaceModel model :
       {SurfaceModel::kFacet, SurfaceModel::kSmooth, SurfaceModel::kSpline}) {
    const Result single = evaluated(setup, model, std::nullopt);
    EXPECT_GT(single.gradient.norm(), 0.0);
    EXPECT_FALSE(single.steep_is_feasible);
    for (const Lanes lanes : {Lanes::kTwo, widest_lanes()}) {
      const Result several = evaluated(setup, model, lanes);
      const std::string what = model_name(model) + ", " + std::to_string(static_cast<int>(lanes));
      EXPECT_EQ((several.gradient - single.gradient).cwiseAbs().maxCoeff(), 0.0) << what;
      EXPECT_EQ(several.energy.total, single.energy.total) << what;
      EXPECT_EQ(several.energy.boundary, single.energy.boundary) << what;
      EXPECT_EQ(several.energy.barrier, single.energy.barrier) << what;
      EXPECT_TRUE(several.normals_bar == single.normals_bar) << what;
      EXPECT_FALSE(several.steep_is_feasible) << what;
    }
  }
}

}  // namespace
}  // namespace lensforge::face_batch_test

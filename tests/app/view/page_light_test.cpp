// SPDX-License-Identifier: GPL-3.0-or-later
// The light that a page draws in a real browser is that of the program, for every kind of light.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

#include "app/view/browser.h"
#include "app/view/lens_view.h"
#include "core/image/color.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/front.h"
#include "core/optics/height_fronts.h"
#include "core/optics/light_path.h"
#include "core/spline/control_net.h"
#include "core/temp_folder.h"
#include "design/render.h"

namespace lensforge {
namespace {

using testing::PageRun;

const Eigen::Vector2d kSize(24.0, 20.0);

struct KindOfLight {
  const char* name;
  void (*apply)(OpticalSetup&);
};

void along_z(OpticalSetup&) {}
void seen_from_the_rear(OpticalSetup& setup) { setup.view = ViewSide::kRear; }
void from_the_side(OpticalSetup& setup) {
  setup.lamp = ParallelLight{Eigen::Vector3d(0.25, -0.15, 1.0).normalized()};
}
void turned_screen(OpticalSetup& setup) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  setup.screen_x = turn.col(0);
  setup.screen_y = turn.col(1);
}
void point_source(OpticalSetup& setup) {
  setup.lamp = PointSource{{0.5 * kSize.x() + 5.0, 0.5 * kSize.y(), -90.0}, Emission::kLambertian};
}
void reflecting_faces(OpticalSetup& setup) {
  point_source(setup);
  setup.fresnel = true;
}
void mirror(OpticalSetup& setup) {
  setup.body = MirrorBody{};
  setup.lamp = ParallelLight{Eigen::Vector3d(0.5, 0.0, -std::sqrt(0.75))};
}
void lit_mirror(OpticalSetup& setup) {
  setup.body = MirrorBody{};
  setup.lamp = PointSource{{-90.0, 0.5 * kSize.y(), 150.0}, Emission::kIsotropic};
}
void convex_front(OpticalSetup& setup) { setup.front = spherical_front(120.0, kSize); }
void point_concave_front(OpticalSetup& setup) {
  point_source(setup);
  setup.front = spherical_front(-120.0, kSize);
}
void wavy_front(OpticalSetup& setup) {
  setup.front = testing::height_front(kSize, {49, 41}, [](const Eigen::Vector2d& at) {
    return -0.25 + 0.25 * std::sin(0.3 * at.x()) * std::cos(0.25 * at.y() + 0.3);
  });
}
void point_wavy_front(OpticalSetup& setup) {
  point_source(setup);
  wavy_front(setup);
}
void wide_source(OpticalSetup& setup) { setup.extent.width = 0.03; }
void wide_point(OpticalSetup& setup) {
  point_source(setup);
  setup.extent = {4.0, {2, 2, {1.0, 0.0, 0.5, 2.0}}};
}

constexpr KindOfLight kKinds[] = {{"AlongZ", along_z},
                                  {"SeenFromTheRear", seen_from_the_rear},
                                  {"Oblique", from_the_side},
                                  {"TurnedScreen", turned_screen},
                                  {"Point", point_source},
                                  {"ReflectingFaces", reflecting_faces},
                                  {"Mirror", mirror},
                                  {"PointOnMirror", lit_mirror},
                                  {"ConvexFront", convex_front},
                                  {"PointConcaveFront", point_concave_front},
                                  {"WavyFront", wavy_front},
                                  {"PointWavyFront", point_wavy_front},
                                  {"WideSource", wide_source},
                                  {"WidePoint", wide_point}};

/// A lens with a picture of its own making, some light of which passes beside it.
Lens bumpy_lens(const KindOfLight& kind, SurfaceModel model) {
  Lens lens;
  lens.model = model;
  lens.setup.lens_size = kSize;
  lens.setup.image_size = 1.1 * kSize;
  lens.setup.focal_length = 120.0;
  lens.setup.pixels = {48, 40};
  kind.apply(lens.setup);
  const Eigen::Vector2d middle =
      0.5 * kSize + (lens.setup.focal_length - 5.0) * LightPath(lens.setup).chief_slope(5.0);
  lens.setup.image_origin = middle - 0.5 * lens.setup.image_size;
  lens.surface = make_grid_mesh(kSize, {61, 59}, 5.0);
  for (auto p : lens.surface.vertices.colwise()) {
    p.z() += 0.05 * std::sin(0.5 * p.x() + 0.2) * std::cos(0.4 * p.y());
  }
  lens.target = Image(48, 40, 0.4F);
  const Executor executor = Executor::cpu(2);
  evaluate(lens.surface, lens.setup, model, lens.target, &lens.render, executor);
  return lens;
}

using Case = std::tuple<KindOfLight, SurfaceModel>;

class PageLight : public ::testing::TestWithParam<Case> {};

std::string name_of(const ::testing::TestParamInfo<Case>& one) {
  return std::get<0>(one.param).name + std::string("_") + model_name(std::get<1>(one.param));
}

INSTANTIATE_TEST_SUITE_P(Smooth, PageLight,
                         ::testing::Combine(::testing::ValuesIn(kKinds),
                                            ::testing::Values(SurfaceModel::kSmooth)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Facets, PageLight,
                         ::testing::Combine(::testing::Values(KindOfLight{"AlongZ", along_z},
                                                              KindOfLight{"Point",
                                                                          reflecting_faces},
                                                              KindOfLight{"Mirror", lit_mirror}),
                                            ::testing::Values(SurfaceModel::kFacet)),
                         name_of);

/// The picture of a page whose script gave it row by row.
Image picture_of(const nlohmann::json& values, const Image& like) {
  Image image(like.columns(), like.rows());
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    image.values()[i] = values.at(i).get<float>();
  }
  return image;
}

/// Largest amount, of display values, by which a pixel exceeds the program's picture more than all
/// its neighbours do.
double brightest_speck(const Image& drawn, const Image& own) {
  const auto excess = [&](int column, int row) {
    return encode(drawn.at(column, row)) - encode(own.at(column, row));
  };
  double most = 0.0;
  for (int row = 1; row + 1 < own.rows(); ++row) {
    for (int column = 1; column + 1 < own.columns(); ++column) {
      double beside = -1.0;
      for (int k = 0; k < 9; ++k) {
        if (k == 4) continue;
        beside = std::max<double>(beside, excess(column + k % 3 - 1, row + k / 3 - 1));
      }
      most = std::max(most, excess(column, row) - beside);
    }
  }
  return most;
}

TEST_P(PageLight, IsTheProgramsPicture) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  const Lens lens = bumpy_lens(std::get<0>(GetParam()), std::get<1>(GetParam()));
  const testing::TempFolder folder;
  const LensView view = view_of_lens(lens, "bumps", Executor::cpu(2));
  testing::write_bytes(folder / "view.html", view_page(view));
  const PageRun run = testing::run_page(
      folder / "view.html",
      "await lensView.finished(); return { picture: Array.from(lensView.picture()), "
      "said: lensView.error };");
  EXPECT_EQ(run.error, "");
  EXPECT_TRUE(run.console.empty()) << run.console.front();
  EXPECT_TRUE(run.requests.empty());
  ASSERT_TRUE(run.result.is_object());
  const double error = compare(picture_of(run.result["picture"], lens.render), lens.render).mae;
  const Image drawn = picture_of(run.result["picture"], lens.render);
  EXPECT_LT(error, lens.setup.extent.width > 0.0 ? 0.004 : 0.001);
  EXPECT_LT(brightest_speck(drawn, lens.render), 0.02);
  EXPECT_NEAR(run.result["said"].get<double>(), error, 1e-4);
  // Two pixels aside it would not be.
  Image moved = lens.render;
  std::rotate(moved.values().begin(), moved.values().begin() + 2, moved.values().end());
  EXPECT_GT(compare(moved, lens.render).mae, 2.0 * error);
}

/// The bumpy lens with a second, larger screen far behind the first.
Lens lens_of_two_screens(bool turned) {
  Lens lens = bumpy_lens({"AlongZ", along_z}, SurfaceModel::kSmooth);
  OpticalSetup far = lens.setup;
  if (turned) turned_screen(far);
  lens.setup.second = {300.0, 1.4 * kSize, {-1.0, -5.0}, far.screen_x, far.screen_y};
  lens.second = {Image(48, 40, 0.6F), {}, {}};
  evaluate(lens.surface, on_second_screen(lens.setup), lens.model, lens.second->target,
           &lens.second->render, Executor::cpu(2));
  return lens;
}

/// The picture half-way between the two screens, which are not turned.
Image half_way(const Lens& lens) {
  OpticalSetup setup = lens.setup;
  const SecondScreen& far = *setup.second;
  setup.focal_length = 0.5 * (setup.focal_length + far.focal_length);
  setup.image_size = 0.5 * (setup.image_size + far.image_size);
  setup.image_origin = 0.5 * (setup.image_origin + far.image_origin);
  Image picture;
  evaluate(lens.surface, setup, lens.model, Image(48, 40, 0.5F), &picture, Executor::cpu(2));
  return picture;
}

TEST(PageScreens, MoveFromTheFirstPictureToTheSecond) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  for (const bool turned : {false, true}) {
    const Lens lens = lens_of_two_screens(turned);
    const testing::TempFolder folder;
    testing::write_bytes(folder / "view.html",
                         view_page(view_of_lens(lens, "two", Executor::cpu(2))));
    const PageRun run = testing::run_page(
        folder / "view.html",
        "const see = async () => { await lensView.finished(); return { error: lensView.error, "
        "picture: Array.from(lensView.picture()), "
        "said: document.querySelector('[data-said]').textContent }; };"
        "const slider = document.querySelector('input[type=range]'); const seen = [await see()];"
        "for (let i = 0; i < 100; ++i) { if (i === 50) seen.push(await see());"
        "slider.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight' })); }"
        "seen.push(await see()); return { seen, words: slider.getAttribute('aria-valuetext') };");
    EXPECT_EQ(run.error, "");
    EXPECT_TRUE(run.console.empty()) << run.console.front();
    ASSERT_TRUE(run.result.is_object());
    EXPECT_EQ(run.result["words"], "z = 300 mm");
    const nlohmann::json& seen = run.result["seen"];
    const Image own[] = {lens.render, half_way(lens), lens.second->render};
    for (std::size_t k = 0; k < 3; ++k) {
      if (turned && k == 1) continue;
      const Image drawn = picture_of(seen[k]["picture"], own[k]);
      EXPECT_LT(compare(drawn, own[k]).mae, 0.001) << k;
      EXPECT_GT(compare(drawn, own[(k + 1) % 3]).mae, 0.01) << k;
    }
    EXPECT_TRUE(seen[1]["error"].is_null());
    EXPECT_LT(seen[2]["error"].get<double>(), 0.001);
    EXPECT_NE(seen[2]["said"].get<std::string>().find("from the second target"), std::string::npos);
  }
}

/// A spline whose knots are not even, so steep that its light folds over.
Lens folding_spline() {
  Lens lens = bumpy_lens({"AlongZ", along_z}, SurfaceModel::kSmooth);
  constexpr int kCells = 40;
  ControlNet net{{kCells + 3, kCells + 3}, {}};
  net.points.resize(3, (kCells + 3) * (kCells + 3));
  for (int j = 0; j < net.shape.rows; ++j) {
    for (int i = 0; i < net.shape.columns; ++i) {
      const double u = greville_point(i, kCells) / kCells;
      const double v = greville_point(j, kCells) / kCells;
      net.points.col(j * net.shape.columns + i) << kSize.x() * (u + 0.02 * std::sin(6.283185 * u)),
          kSize.y() * (v - 0.02 * std::sin(6.283185 * v)),
          5.0 + 0.4 * std::sin(9.0 * u) * std::cos(8.0 * v);
    }
  }
  lens.model = SurfaceModel::kSpline;
  lens.spline = net;
  const SampledSurface nodes = picture_nodes(net);
  evaluate(nodes.mesh, nodes.normals, lens.setup, lens.target, &lens.render, Executor::cpu(2));
  return lens;
}

TEST(PageSpline, ThatFoldsItsLightHasNoSpecks) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  const Lens lens = folding_spline();
  const testing::TempFolder folder;
  const LensView view = view_of_lens(lens, "folds", Executor::cpu(2));
  EXPECT_LT(view.surfaces.front().storage_error, 5e-4);
  testing::write_bytes(folder / "view.html", view_page(view));
  const PageRun run = testing::run_page(
      folder / "view.html", "await lensView.finished(); return Array.from(lensView.picture());");
  EXPECT_EQ(run.error, "");
  ASSERT_TRUE(run.result.is_array());
  const Image drawn = picture_of(run.result, lens.render);
  EXPECT_LT(compare(drawn, lens.render).mae, 1e-3);
  EXPECT_LT(brightest_speck(drawn, lens.render), 0.02);
}

TEST(PageFallback, OfAnInexactSurfaceIsTheProgramsUntilAControlMoves) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  const Lens lens = bumpy_lens({"AlongZ", along_z}, SurfaceModel::kSmooth);
  LensView view = view_of_lens(lens, "bumps", Executor::cpu(2));
  view.surfaces.front().storage_error = 0.02;
  const testing::TempFolder folder;
  testing::write_bytes(folder / "view.html", view_page(view));
  const PageRun run =
      testing::run_page(folder / "view.html",
                        "await lensView.finished(); const error = lensView.error, "
                        "said = document.querySelector('[data-said]').textContent; "
                        "lensView.set('turn', 8); await lensView.finished(); "
                        "return { error, said, moved: Array.from(lensView.picture()) };");
  EXPECT_EQ(run.error, "");
  ASSERT_TRUE(run.result.is_object());
  EXPECT_LT(run.result["error"].get<double>(), 1e-4);
  EXPECT_NE(run.result["said"].get<std::string>().find("This is the program's picture"),
            std::string::npos);
  EXPECT_GT(compare(picture_of(run.result["moved"], lens.render), lens.render).mae, 0.02);
}

TEST(PageScript, RefusesWhatDoesNotExistInOneSentence) {
  if (!testing::has_browser()) GTEST_SKIP() << "chromium is not installed";
  const Lens lens = bumpy_lens({"AlongZ", along_z}, SurfaceModel::kSmooth);
  const testing::TempFolder folder;
  testing::write_bytes(folder / "view.html",
                       view_page(view_of_lens(lens, "bumps", Executor::cpu(2))));
  const PageRun run = testing::run_page(
      folder / "view.html",
      "return [['foo', 1], ['toString', 1], ['surface', 'milled'], ['turn', '5']].map((one) => { "
      "try { lensView.set(...one); return 'taken'; } catch (e) { return e.message; } });");
  ASSERT_TRUE(run.result.is_array()) << run.error;
  EXPECT_EQ(run.result[0].get<std::string>().find("This page has no setting \"foo\"; it has "), 0U);
  EXPECT_EQ(run.result[1].get<std::string>().find("This page has no setting \"toString\""), 0U);
  EXPECT_EQ(run.result[2], "This page has no surface \"milled\"; it has designed.");
  EXPECT_EQ(run.result[3], "The setting turn must be a number, not \"5\".");
}

}  // namespace
}  // namespace lensforge

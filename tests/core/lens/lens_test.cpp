// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/lens/lens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/error.h"
#include "core/full_disk.h"
#include "core/image/image_io.h"
#include "core/io/lens_folder.h"
#include "core/mesh/mesh_files.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/height_fronts.h"
#include "core/spline/control_net.h"
#include "core/spline/sample_splines.h"
#include "core/temp_folder.h"
#include "core/test_meshes.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::FullDisk;
using lensforge::testing::grid_mesh;
using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

Image wave(int columns, int rows, double phase) {
  Image image(columns, rows);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      image.at(column, row) =
          static_cast<float>(0.5 + 0.4 * std::sin(0.3 * column + 0.2 * row + phase));
    }
  }
  return image;
}

Lens sample_lens() {
  Lens lens;
  lens.surface = grid_mesh(7, 5, 2.5, 5.25);
  lens.surface.vertices(2, 11) = 5.1234567890123456;
  lens.setup.ior = 1.4912345678901234;
  lens.setup.lens_size = {15.0, 10.0};
  lens.setup.image_size = {30.0, 20.0};
  lens.setup.image_origin = {-7.5, -5.0};
  lens.setup.pixels = {24, 16};
  lens.setup.view = ViewSide::kRear;
  lens.model = SurfaceModel::kSmooth;
  lens.target = wave(24, 16, 0.0);
  lens.render = wave(24, 16, 0.1);
  lens.metrics[SurfaceModel::kFacet] = {0.01, 31.5, 0.97, 0.005, 0.999};
  lens.metrics[SurfaceModel::kSmooth] = {0.0, std::numeric_limits<double>::infinity(), 1.0, 0.0,
                                         1.0};
  lens.provenance =
      json{{"program", "lensforge 0.1.0"}, {"options", {{"rounds", 6}}}, {"seconds", 1.5}};
  return lens;
}

void expect_equal(const ImageMetrics& a, const ImageMetrics& b) {
  EXPECT_EQ(a.mae, b.mae);
  EXPECT_EQ(a.psnr, b.psnr);
  EXPECT_EQ(a.ssim, b.ssim);
  EXPECT_EQ(a.mae_linear, b.mae_linear);
  EXPECT_EQ(a.flux_inside, b.flux_inside);
}

json read_json(const fs::path& path) { return json::parse(read_bytes(path)); }

TEST(Lens, ComesBackAsItWasWritten) {
  const TempFolder folder;
  const Lens lens = sample_lens();
  write_lens(lens, folder / "out");
  const Lens read = read_lens(folder / "out");
  EXPECT_EQ(read.surface.vertices, lens.surface.vertices);
  EXPECT_EQ(read.surface.triangles, lens.surface.triangles);
  EXPECT_EQ(read.surface.grid, lens.surface.grid);
  EXPECT_EQ(read.setup, lens.setup);
  EXPECT_EQ(read.model, lens.model);
  EXPECT_EQ(read.target, lens.target);
  EXPECT_EQ(read.render, lens.render);
  for (const SurfaceModel model : kMeshModels) {
    expect_equal(read.metrics.at(model), lens.metrics.at(model));
  }
  EXPECT_EQ(read.provenance.json(), lens.provenance.json());
}

Lens spline_lens() {
  Lens lens = sample_lens();
  lens.model = SurfaceModel::kSpline;
  lens.spline = testing::sample_spline();
  lens.surface = spline_nodes(*lens.spline, kMeshSamples).mesh;
  lens.metrics[SurfaceModel::kSpline] = {0.02, 30.0, 0.96, 0.006, 0.998};
  return lens;
}

TEST(Lens, ASplineComesBackAsItWasWritten) {
  const TempFolder folder;
  const Lens lens = spline_lens();
  write_lens(lens, folder / "out");
  const Lens read = read_lens(folder / "out");
  EXPECT_EQ(read.model, SurfaceModel::kSpline);
  ASSERT_TRUE(read.spline.has_value());
  EXPECT_EQ(read.spline->points, lens.spline->points);
  EXPECT_EQ(read.surface.vertices, lens.surface.vertices);
  EXPECT_EQ(read.surface.grid, lens.surface.grid);
  expect_equal(read.metrics.at(SurfaceModel::kSpline), lens.metrics.at(SurfaceModel::kSpline));
  EXPECT_EQ(read_json(folder / "out" / "lens.json")["spline"], "surface.spline");
  EXPECT_THAT(read_bytes(folder / "out" / "surface.ply"), HasSubstr("property double nx"));
}

TEST(Lens, AnotherModelTakesTheSplineAway) {
  const TempFolder folder;
  write_lens(spline_lens(), folder.path());
  EXPECT_TRUE(fs::exists(folder / "surface.spline"));
  write_lens(sample_lens(), folder.path());
  EXPECT_FALSE(fs::exists(folder / "surface.spline"));
}

TEST(Lens, RefusesASplineThatItsMeshDoesNotSample) {
  const TempFolder folder;
  Lens lens = spline_lens();
  write_lens(lens, folder.path());
  ControlNet other = testing::sample_spline(0.4, 0.0501);
  write_spline(other, folder / "surface.spline");
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
              HasSubstr("hold two surfaces"));
  other.points(0, 0) = 0.5;
  write_spline(other, folder / "surface.spline");
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
              AllOf(HasSubstr("surface.spline"), HasSubstr("by lens_size")));
  fs::remove(folder / "surface.spline");
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
              HasSubstr("surface.spline"));
}

TEST(Lens, TheFolderHoldsTheFilesOfTheInterfaceAndNothingElse) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  for (const char* name : {"lens.json", "surface.ply", "target.png", "target.exr", "render.png",
                           "render.exr", "error.png"}) {
    EXPECT_TRUE(fs::is_regular_file(folder / name)) << name;
  }
  EXPECT_EQ(folder.file_count(), 7U);
}

TEST(Lens, TheJsonHasTheFieldsOfTheInterface) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  const json document = read_json(folder / "lens.json");
  EXPECT_EQ(document["format"], "lensforge.lens");
  EXPECT_EQ(document["version"], 1);
  EXPECT_EQ(document["units"], "mm");
  EXPECT_EQ(document["mode"], "refract");
  EXPECT_EQ(document["source"], json({{"type", "parallel"}, {"direction", {0.0, 0.0, 1.0}}}));
  EXPECT_EQ(document["front"], json({{"type", "flat"}, {"z", 0}}));
  EXPECT_EQ(document["screen"], json({{"centre", {7.5, 5.0, 300.0}},
                                      {"right", {1.0, 0.0, 0.0}},
                                      {"up", {0.0, 1.0, 0.0}},
                                      {"size", {30.0, 20.0}}}));
  EXPECT_EQ(document["ior"], 1.4912345678901234);
  EXPECT_EQ(document["focal_length"], 300.0);
  EXPECT_EQ(document["lens_size"], json({15.0, 10.0}));
  EXPECT_EQ(document["image_size"], json({30.0, 20.0}));
  EXPECT_EQ(document["image_origin"], json({-7.5, -5.0}));
  EXPECT_EQ(document["pixels"], json({24, 16}));
  EXPECT_EQ(document["view"], "rear");
  EXPECT_EQ(document["model"], "smooth");
  EXPECT_EQ(document["surface"], "surface.ply");
  EXPECT_EQ(document["grid"], json({7, 5}));
  EXPECT_EQ(document["metrics"]["facet"]["flux_inside"], 0.999);
  EXPECT_TRUE(document["metrics"]["smooth"]["psnr"].is_null());
  EXPECT_EQ(document["provenance"]["options"]["rounds"], 6);
  EXPECT_EQ(document.size(), 19U);
}

TEST(Lens, ItsMetricsAreWrittenAsByEarlierVersions) {
  const TempFolder folder;
  Lens lens = sample_lens();
  lens.source_limit = ImageMetrics{0.25, 12.5, 0.5, 0.125, 0.75};
  write_lens(lens, folder.path());
  EXPECT_THAT(read_bytes(folder / "lens.json"), HasSubstr(R"(
  "metrics": {
    "facet": {
      "mae": 0.01,
      "psnr": 31.5,
      "ssim": 0.97,
      "flux_inside": 0.999,
      "mae_linear": 0.005
    },
    "smooth": {
      "mae": 0.0,
      "psnr": null,
      "ssim": 1.0,
      "flux_inside": 1.0,
      "mae_linear": 0.0
    },
    "source_limit": {
      "mae": 0.25,
      "psnr": 12.5,
      "ssim": 0.5,
      "flux_inside": 0.75,
      "mae_linear": 0.125
    }
  },
)"));
}

TEST(Lens, ASurfaceThatIsNoGridComesBackWithoutOne) {
  const TempFolder folder;
  Lens lens = sample_lens();
  lens.surface.grid = {};
  write_lens(lens, folder.path());
  EXPECT_FALSE(read_lens(folder.path()).surface.grid.is_grid());
}

TEST(Lens, WithoutARenderNoneIsLeftFromAnOlderLens) {
  const TempFolder folder;
  Lens lens = sample_lens();
  write_lens(lens, folder.path());
  lens.render = Image();
  write_lens(lens, folder.path());
  EXPECT_TRUE(read_lens(folder.path()).render.empty());
  EXPECT_FALSE(fs::exists(folder / "render.png"));
  EXPECT_FALSE(fs::exists(folder / "error.png"));
}

TEST(Lens, OtherFilesInTheFolderAreLeftAlone) {
  const TempFolder folder;
  write_bytes(folder / "convergence.csv", "stage\n");
  write_lens(sample_lens(), folder.path());
  EXPECT_EQ(read_bytes(folder / "convergence.csv"), "stage\n");
}

TEST(Lens, AppearsTogetherWithWhatIsAddedToIt) {
  const TempFolder folder;
  PendingFiles files(folder.path());
  files.add("convergence.csv", "stage\n");
  write_lens(sample_lens(), std::move(files));
  EXPECT_EQ(read_bytes(folder / "convergence.csv"), "stage\n");
  EXPECT_EQ(folder.file_count(), 8U);
}

TEST(Lens, WhileAFileCannotAppearThereIsNoLensJson) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  fs::create_directory(folder / "overview.png");
  PendingFiles files(folder.path());
  files.add("overview.png", "x");
  EXPECT_THROW(write_lens(sample_lens(), std::move(files)), RunError);
  EXPECT_FALSE(fs::exists(folder / "lens.json"));
}

TEST(Lens, AFullDiskLeavesTheOlderLensWhole) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  Lens other = sample_lens();
  other.setup.ior = 1.6;
  {
    const FullDisk full(1200);
    EXPECT_THAT(message_of<RunError>([&] { write_lens(other, folder.path()); }),
                HasSubstr("File too large"));
  }
  EXPECT_EQ(folder.file_count(), 7U);
  EXPECT_EQ(read_lens(folder.path()).setup, sample_lens().setup);
}

TEST(Lens, AFolderThatCannotBeMadeIsAnErrorWithItsReason) {
  const TempFolder folder;
  write_bytes(folder / "file", "x");
  EXPECT_THAT(message_of<RunError>([&] { write_lens(sample_lens(), folder / "file"); }),
              AllOf(StartsWith((folder / "file").string()), HasSubstr("Not a directory")));
}

/// A written sample lens whose lens.json was changed: what read_lens() says, less the file's name.
std::string refusal(const std::function<void(json&)>& change) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  json document = read_json(folder / "lens.json");
  change(document);
  write_bytes(folder / "lens.json", document.dump());
  const std::string message = message_of<InputError>([&] { read_lens(folder.path()); });
  const std::string start = (folder / "lens.json").string() + ": ";
  EXPECT_THAT(message, StartsWith(start));
  return message.substr(std::min(message.size(), start.size()));
}

TEST(Lens, EveryMissingFieldIsNamed) {
  for (const char* name : {"format", "version", "units", "mode", "source", "ior", "focal_length",
                           "lens_size", "image_size", "image_origin", "pixels", "view", "model",
                           "surface", "grid", "metrics", "provenance"}) {
    EXPECT_EQ(refusal([&](json& document) { document.erase(name); }),
              std::string("field '") + name + "' is missing");
  }
  for (const char* name : {"mae", "psnr", "ssim", "flux_inside"}) {
    EXPECT_EQ(refusal([&](json& document) { document["metrics"]["smooth"].erase(name); }),
              std::string("field 'metrics.smooth.") + name + "' is missing");
  }
  EXPECT_EQ(refusal([&](json& document) { document["metrics"].erase("facet"); }),
            "field 'metrics.facet' is missing");
  EXPECT_EQ(refusal([&](json& document) { document["source"].erase("type"); }),
            "field 'source.type' is missing");
}

TEST(Lens, EveryMistypedFieldIsNamedWithItsValue) {
  for (const char* name : {"format", "version", "units", "mode", "source", "ior", "focal_length",
                           "lens_size", "image_size", "image_origin", "pixels", "view", "model",
                           "surface", "grid", "metrics", "provenance"}) {
    EXPECT_THAT(refusal([&](json& document) { document[name] = true; }),
                StartsWith(std::string("field '") + name + "' is true: "));
  }
  EXPECT_EQ(refusal([](json& document) { document["metrics"]["facet"]["mae"] = "low"; }),
            "field 'metrics.facet.mae' is \"low\": it must be a number");
}

TEST(Lens, AnotherFormatVersionOrUnitIsRefusedWithItsValue) {
  EXPECT_EQ(refusal([](json& document) { document["format"] = "other.lens"; }),
            "field 'format' is \"other.lens\": only \"lensforge.lens\" can be read");
  EXPECT_EQ(refusal([](json& document) { document["version"] = 2; }),
            "field 'version' is 2: only version 1 can be read by this program");
  EXPECT_EQ(refusal([](json& document) { document["units"] = "inch"; }),
            "field 'units' is \"inch\": only \"mm\" can be read");
}

TEST(Lens, WhatThisVersionCannotDoYetIsSaid) {
  EXPECT_EQ(refusal([](json& document) { document["mode"] = "scatter"; }),
            "field 'mode' is \"scatter\": it must be \"refract\" or \"reflect\"");
  EXPECT_EQ(refusal([](json& document) { document["source"]["type"] = "sun"; }),
            "field 'source.type' is \"sun\": it must be \"parallel\" or \"point\"");
  EXPECT_EQ(refusal([](json& document) { document["front"]["type"] = "cone"; }),
            "field 'front.type' is \"cone\": it must be \"flat\", \"sphere\" or \"heights\"");
}

TEST(Lens, ValuesOutOfRangeAreRefused) {
  EXPECT_EQ(refusal([](json& document) { document["focal_length"] = 0.0; }),
            "field focal_length is 0: it must be a finite number of mm above 0");
  EXPECT_EQ(refusal([](json& document) { document["ior"] = 0.9; }),
            "field ior is 0.9: it must be a finite number above 1");
  EXPECT_THAT(refusal([](json& document) { document["view"] = "top"; }),
              HasSubstr("it must be \"front\" or \"rear\""));
  EXPECT_THAT(refusal([](json& document) {
                document["pixels"] = {100000, 1};
              }),
              HasSubstr("at most 16384 a side"));
}

TEST(Lens, AGridThatDoesNotFitTheSurfaceIsRefused) {
  EXPECT_EQ(refusal([](json& document) {
              document["grid"] = {7, 6};
            }),
            "field 'grid' is [7,6]: the surface has 35 vertices");
  EXPECT_THAT(refusal([](json& document) {
                document["grid"] = {-7, -5};
              }),
              HasSubstr("the surface has 35 vertices"));
}

TEST(Lens, ASurfaceOutsideTheFolderIsRefused) {
  for (const char* name : {"../surface.ply", "/etc/passwd", "a/b.ply", "", ".."}) {
    EXPECT_THAT(refusal([&](json& document) { document["surface"] = name; }),
                HasSubstr("must be the name of a file in the lens folder"));
  }
}

TEST(Lens, UnknownFieldsAreIgnored) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  json document = read_json(folder / "lens.json");
  document["colour"] = "clear";
  document["metrics"]["facet"]["vmaf"] = 99;
  write_bytes(folder / "lens.json", document.dump());
  EXPECT_EQ(read_lens(folder.path()).setup, sample_lens().setup);
}

TEST(Lens, AnotherToolsLensWithoutLinearErrorIsRead) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  json document = read_json(folder / "lens.json");
  document["metrics"]["facet"].erase("mae_linear");
  write_bytes(folder / "lens.json", document.dump());
  EXPECT_EQ(read_lens(folder.path()).metrics.at(SurfaceModel::kFacet).mae_linear, 0.0);
}

TEST(Lens, AMissingFolderOrFileIsNamed) {
  const TempFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder / "none"); }),
              AllOf(StartsWith((folder / "none/lens.json").string()),
                    HasSubstr("No such file or directory")));
  for (const char* name : {"lens.json", "surface.ply", "target.exr"}) {
    write_lens(sample_lens(), folder.path());
    fs::remove(folder / name);
    EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
                AllOf(StartsWith((folder / name).string()), HasSubstr("No such file")));
  }
}

TEST(Lens, ATruncatedJsonIsRefused) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  const std::string text = read_bytes(folder / "lens.json");
  for (const std::size_t length : {std::size_t{0}, std::size_t{1}, text.size() / 2}) {
    write_bytes(folder / "lens.json", std::string_view(text).substr(0, length));
    EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }), HasSubstr("is no JSON"));
  }
  write_bytes(folder / "lens.json", "[1, 2]");
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
              HasSubstr("is no JSON object"));
}

TEST(Lens, APictureOfAnotherSizeIsRefused) {
  for (const char* name : {"target.exr", "render.exr"}) {
    const TempFolder folder;
    write_lens(sample_lens(), folder.path());
    write_image(wave(23, 16, 0.0), folder / name);
    EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
                AllOf(StartsWith((folder / name).string()),
                      HasSubstr("is 23 x 16 pixels, field 'pixels' of lens.json says 24 x 16")));
  }
}

/// Error of read_lens() for a sample lens with a changed surface.
std::string surface_refusal(const std::function<void(SurfaceMesh&)>& change) {
  const TempFolder folder;
  Lens lens = sample_lens();
  write_lens(lens, folder.path());
  change(lens.surface);
  write_ply(lens.surface, folder / "surface.ply");
  return message_of<InputError>([&] { read_lens(folder.path()); });
}

TEST(Lens, AClockwiseOrFlatTriangleIsRefused) {
  EXPECT_THAT(surface_refusal([](SurfaceMesh& mesh) { mesh.triangles.col(3).reverseInPlace(); }),
              HasSubstr("surface.ply: triangle 3 must run counter-clockwise seen from +z"));
  EXPECT_THAT(surface_refusal([](SurfaceMesh& mesh) { mesh.vertices.row(1).setZero(); }),
              HasSubstr("surface.ply: triangle 0 must run counter-clockwise"));
}

TEST(Lens, ASurfaceBeyondTheWallOrUnderTheEntryFaceIsRefused) {
  for (const double z : {300.0, -0.1}) {
    EXPECT_THAT(surface_refusal([&](SurfaceMesh& mesh) { mesh.vertices(2, 4) = z; }),
                HasSubstr("must be between the entry face at 0 and the receiving plane at 300"));
  }
}

TEST(Lens, ASizeOtherThanTheSurfacesIsRefused) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  json document = read_json(folder / "lens.json");
  document["lens_size"] = {15000.0, 10000.0};
  write_bytes(folder / "lens.json", document.dump());
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
              HasSubstr("surface.ply: x runs from 0 to 15 mm: by lens_size it must run from 0 to "
                        "15000"));
  EXPECT_THAT(surface_refusal([](SurfaceMesh& mesh) { mesh.vertices.row(0).array() += 1.0; }),
              HasSubstr("x runs from 1 to 16 mm"));
}

TEST(Lens, ATransposedGridIsRefused) {
  EXPECT_EQ(refusal([](json& document) {
              document["grid"] = {5, 7};
            }),
            "field 'grid' is [5,7]: the surface's triangle 0 is no half of a cell of the grid");
}

TEST(Lens, ATriangleThatStandsThereTwiceOrIsMissingIsRefused) {
  const auto repeat = [](SurfaceMesh& mesh) { mesh.triangles.col(7) = mesh.triangles.col(20); };
  EXPECT_THAT(surface_refusal(repeat), HasSubstr("triangle 20 overlaps another one"));
  const auto triple = [](SurfaceMesh& mesh) { mesh.triangles.col(30) = mesh.triangles.col(20); };
  EXPECT_THAT(surface_refusal(triple), HasSubstr("triangle 30 overlaps another one"));
  const auto drop = [](SurfaceMesh& mesh) {
    mesh.triangles.conservativeResize(3, mesh.triangles.cols() - 1);
  };
  EXPECT_THAT(surface_refusal(drop),
              HasSubstr("the surface has 47 triangles, the grid calls for 48"));
}

TEST(Lens, WhatIsNoRegularFileIsRefusedWithoutWaiting) {
  for (const char* name : {"lens.json", "surface.ply", "target.exr", "render.exr"}) {
    const TempFolder folder;
    write_lens(sample_lens(), folder.path());
    fs::remove(folder / name);
    ASSERT_EQ(::mkfifo((folder / name).c_str(), 0600), 0);
    EXPECT_EQ(message_of<InputError>([&] { read_lens(folder.path()); }),
              (folder / name).string() + ": is a named pipe; only regular files are read");
    fs::remove(folder / name);
    fs::create_directory(folder / name);
    EXPECT_EQ(message_of<InputError>([&] { read_lens(folder.path()); }),
              (folder / name).string() + ": is a folder; only regular files are read");
  }
}

TEST(Lens, ALargeJsonAndANumberBeyondADoubleAreRefused) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  const std::string text = read_bytes(folder / "lens.json");
  write_bytes(folder / "lens.json", text + std::string(1U << 20U, ' '));
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }), HasSubstr("at most"));
  std::string large = text;
  large.replace(large.find("1.4912"), 6, "1e400, \"x\": 1.4912");
  write_bytes(folder / "lens.json", large);
  EXPECT_THAT(message_of<InputError>([&] { read_lens(folder.path()); }),
              HasSubstr("lens.json: holds a number that is too large"));
}

TEST(Lens, EveryFileSaysWhoWroteIt) {
  const TempFolder folder;
  write_lens(sample_lens(), folder.path());
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    EXPECT_TRUE(written_by_lensforge(entry.path())) << entry.path();
  }
}

TEST(Lens, ACoordinateThatIsNotFiniteIsRefused) {
  EXPECT_THAT(surface_refusal([](SurfaceMesh& mesh) { mesh.vertices(0, 4) = std::nan(""); }),
              HasSubstr("coordinates must be finite"));
}

TEST(LensFront, AFolderHoldsTheHeightsOfItsFrontAndOfNoEarlierOne) {
  const testing::TempFolder folder;
  Lens lens;
  lens.setup.lens_size = {15.0, 10.0};
  lens.setup.pixels = {24, 16};
  lens.surface = make_grid_mesh(lens.setup.lens_size, {7, 5}, 5.0);
  lens.target = Image(24, 16, 0.5F);
  lens.setup.front = testing::height_front(
      lens.setup.lens_size, {9, 7}, [](const Eigen::Vector2d& at) { return -0.01 * at.x(); });
  write_lens(lens, folder.path());
  EXPECT_EQ(read_lens(folder.path()).setup, lens.setup);
  EXPECT_TRUE(fs::exists(folder / "front.exr"));
  lens.setup.front.reset();
  write_lens(lens, folder.path());
  EXPECT_EQ(read_lens(folder.path()).setup, lens.setup);
  EXPECT_FALSE(fs::exists(folder / "front.exr"));
}

}  // namespace

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stop_token>
#include <string>
#include <vector>

#include "cam/cam_meshes.h"
#include "cam/contact/height_field.h"
#include "core/error.h"
#include "core/full_disk.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::FullDisk;
using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

Lens small_lens(double width = 3.0, double height = 2.0) {
  Lens lens;
  lens.setup.lens_size = {width, height};
  lens.surface = testing::grid_mesh(21, 17, width, height, testing::lens_relief);
  return lens;
}

CamResult run(const Lens& lens, const CamOptions& options, const TempFolder& folder,
              const RunControl& control = {}) {
  return make_finish_program(lens, options, folder.path(), Executor::cpu(2), control);
}

TEST(CamJob, WritesProgramAndReport) {
  const TempFolder folder;
  const CamResult result = run(small_lens(), {}, folder);
  EXPECT_TRUE(result.done()) << result.message;
  EXPECT_EQ(folder.file_count(), 2U);
  const auto report = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_DOUBLE_EQ(report["z_offset"].get<double>(), result.z_offset);
  EXPECT_EQ(report["operations"][0]["points"].get<std::int64_t>(), result.points);
  const std::string program = read_bytes(folder / "finish.ngc");
  EXPECT_EQ(std::count(program.begin(), program.end(), '\n'), result.lines);
  EXPECT_THAT(program, HasSubstr("(" + std::to_string(result.lines) + " lines"));
  EXPECT_NEAR(result.length_over_feed_min, result.cutting_length / 500.0, 1e-12);
  EXPECT_NEAR(result.stock_top, result.surface_top + 0.5, 1e-12);
  EXPECT_NEAR(result.deepest_cut, result.stock_top - result.tip.min().z(), 1e-12);
}

TEST(CamJob, TheProgramHoldsThePathThatWasCounted) {
  const TempFolder folder;
  const CamResult result = run(small_lens(), {}, folder);
  std::istringstream program(read_bytes(folder / "finish.ngc"));
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  double length = 0.0;
  std::int64_t cuts = 0;
  bool cutting = false;
  for (std::string line; std::getline(program, line);) {
    if (line[0] == '(' || line[0] == 'M' || line[0] == 'S' || line[0] == 'T') continue;
    if (line.starts_with("G0")) cutting = false;
    Eigen::Vector3d to = at;
    for (int k = 0; k < 3; ++k) {
      const auto place = line.find("XYZ"[k]);
      if (place != std::string::npos) to[k] = std::stod(line.substr(place + 1));
    }
    if (cutting && !(to - at).isZero()) {
      length += (to - at).norm();
      ++cuts;
    }
    if (line.starts_with("G1")) cutting = true;
    at = to;
  }
  EXPECT_EQ(cuts, result.points - 1);
  EXPECT_NEAR(length, result.cutting_length, 1e-5 * static_cast<double>(cuts));
}

TEST(CamJob, SameProgramForAnyThreads) {
  const TempFolder one;
  const TempFolder two;
  make_finish_program(small_lens(), {}, one.path(), Executor::serial(), {});
  make_finish_program(small_lens(), {}, two.path(), Executor::cpu(2), {});
  EXPECT_EQ(read_bytes(one / "finish.ngc"), read_bytes(two / "finish.ngc"));
}

TEST(CamJob, ZZeroShiftsTheProgram) {
  CamOptions options;
  options.stock = 0.25;
  const Lens lens = small_lens();
  const double top = lens.surface.vertices.row(2).maxCoeff();
  for (const auto& [name, offset] : std::vector<std::pair<const char*, double>>{
           {"stock", -top - 0.25}, {"lens", -top}, {"table", 0.0}}) {
    const TempFolder folder;
    options.z_zero = parse_z_zero(name);
    EXPECT_DOUBLE_EQ(run(lens, options, folder).z_offset, offset) << name;
    char safe[40];
    std::snprintf(safe, sizeof safe, "G0 Z%.5f\n", top + 0.25 + 5.0 + offset);
    EXPECT_THAT(read_bytes(folder / "finish.ngc"), HasSubstr(safe));
  }
  EXPECT_THROW(parse_z_zero("floor"), InputError);
}

TEST(CamJob, StoppedLeavesWhatWasThere) {
  const TempFolder folder;
  lensforge::testing::write_bytes(folder / "finish.ngc", "old");
  std::stop_source source;
  const RunControl control(source.get_token(), [&](const Progress&) { source.request_stop(); });
  const CamResult result = run(small_lens(), {}, folder, control);
  EXPECT_EQ(result.status, CamResult::Status::kInterrupted);
  EXPECT_EQ(folder.file_count(), 1U);
  EXPECT_EQ(read_bytes(folder / "finish.ngc"), "old");
}

TEST(CamJob, FullDiskLeavesNothing) {
  const TempFolder folder;
  {
    const FullDisk full(20000);
    const std::string message = message_of<RunError>([&] { run(small_lens(), {}, folder); });
    EXPECT_THAT(message, AllOf(HasSubstr("finish.ngc"), HasSubstr("File too large")));
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CamJob, UnwritableFolderIsRefused) {
  const TempFolder folder;
  lensforge::testing::write_bytes(folder / "cam", "a file");
  EXPECT_THROW(make_finish_program(small_lens(), {}, folder / "cam", Executor::serial(), {}),
               InputError);
}

TEST(CamJob, WarnsOfWhatAnOperatorShouldQuestion) {
  const TempFolder folder;
  CamOptions options;
  EXPECT_THAT(run(small_lens(), options, folder).warnings,
              ::testing::ElementsAre(HasSubstr("rough the blank")));
  Lens plate = small_lens();
  plate.surface.vertices.row(2).setConstant(6.0);
  options.stock = 0.1;
  EXPECT_THAT(run(plate, options, folder).warnings, ::testing::IsEmpty());
  options.post = Post::kGrbl;
  EXPECT_THAT(run(plate, options, folder).warnings, ::testing::Contains(HasSubstr("$30")));
  for (std::int64_t v = 0; v < plate.surface.vertex_count(); ++v) {
    plate.surface.vertices(2, v) = 6.0 + 1.2 * plate.surface.vertices(0, v);
  }
  EXPECT_THAT(run(plate, options, folder).warnings, ::testing::Contains(HasSubstr("rises by")));
  options.decimals = 4;
  EXPECT_THAT(run(small_lens(), options, folder).warnings,
              ::testing::Contains(HasSubstr("use more decimals")));
}

/// Sets one option to a bad value; the message has to name all of `words`.
struct BadOption {
  const char* words;
  double value;
  void (*set)(CamOptions&, double);
};

TEST(CamJob, BadOptionsAreNamedWithValueAndRule) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const auto diameter = [](CamOptions& o, double v) { o.tool_diameter = v; };
  const auto pitch = [](CamOptions& o, double v) { o.pitch = v; };
  const auto spindle = [](CamOptions& o, double v) { o.spindle_rpm = v; };
  const auto feed = [](CamOptions& o, double v) { o.feed = v; };
  const auto plunge = [](CamOptions& o, double v) { o.plunge = v; };
  const auto stock = [](CamOptions& o, double v) { o.stock = v; };
  const auto safe = [](CamOptions& o, double v) { o.safe_height = v; };
  const auto spin_up = [](CamOptions& o, double v) { o.spin_up = v; };
  const auto decimals = [](CamOptions& o, double v) { o.decimals = static_cast<int>(v); };
  const auto tolerance = [](CamOptions& o, double v) { o.tolerance = v; };
  const auto slope = [](CamOptions& o, double v) { o.slope_tolerance = v; };
  std::vector<BadOption> cases;
  for (const double bad : {0.0, -1.0, kNan, kInf}) {
    cases.push_back({"--tool-diameter", bad, diameter});
    cases.push_back({"--pitch", bad, pitch});
    cases.push_back({"--spindle", bad, spindle});
    cases.push_back({"--feed", bad, feed});
    cases.push_back({"--plunge", bad, plunge});
    cases.push_back({"--safe-height", bad, safe});
    cases.push_back({"--tolerance", bad, tolerance});
    cases.push_back({"--slope-tolerance", bad, slope});
  }
  for (const double bad : {-0.1, kNan, kInf}) {
    cases.push_back({"--stock", bad, stock});
    cases.push_back({"--spin-up", bad, spin_up});
  }
  cases.push_back({"--tool-diameter: 2 is not smaller than the lens", 2.0, diameter});
  cases.push_back({"--pitch: 0.5 is larger than the tool diameter, 0.4 mm", 0.5, pitch});
  cases.push_back({"--decimals: 3 is not between 4 and 6", 3, decimals});
  cases.push_back({"--decimals: 7", 7, decimals});
  cases.push_back({"--tolerance: 3e-05 is not at least 4 units", 3e-5, tolerance});
  cases.push_back({"--slope-tolerance: 1.1", 1.1, slope});
  const Lens lens = small_lens();
  const TempFolder folder;
  for (const BadOption& bad : cases) {
    CamOptions options;
    bad.set(options, bad.value);
    EXPECT_THAT(message_of<InputError>([&] { run(lens, options, folder); }), HasSubstr(bad.words));
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CamJob, SurfacesThatCannotBeCutAreRefused) {
  const TempFolder folder;
  const auto refusal = [&](const Lens& lens) {
    return message_of<InputError>([&] { run(lens, {}, folder); });
  };
  Lens lens = small_lens();
  lens.surface.triangles.resize(3, 0);
  EXPECT_THAT(refusal(lens), HasSubstr("no triangles"));

  lens = small_lens();
  lens.surface.vertices(2, 40) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(lens), HasSubstr("not finite"));

  lens = small_lens();
  lens.surface.vertices.col(45) = lens.surface.vertices.col(47) + Eigen::Vector3d(0.01, 0.0, 0.0);
  EXPECT_THAT(refusal(lens), HasSubstr("no height field"));

  lens = small_lens();
  lens.surface.triangles.row(0).swap(lens.surface.triangles.row(1));
  EXPECT_THAT(refusal(lens), HasSubstr("turned over"));

  lens = small_lens();
  lens.setup.lens_size.x() = 3.2;
  EXPECT_THAT(refusal(lens), HasSubstr("spans x 0.0000 to 3.0000 mm, not 0 to 3.2000"));

  lens = small_lens();
  lens.surface.triangles.col(100) = lens.surface.triangles.col(101);
  lens.surface.triangles.col(102) = lens.surface.triangles.col(103);
  EXPECT_NO_THROW(inspect_height_field(lens.surface, Eigen::Vector2d(3.0, 2.0)));
  lens.surface.triangles.conservativeResize(3, lens.surface.triangle_count() / 2);
  EXPECT_THROW(run(lens, {}, folder), InputError);
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(HeightField, TellsSizeAndSteepestPlace) {
  const SurfaceMesh mesh = testing::grid_mesh(
      5, 3, 2.0, 1.0, [](double x, double) { return 1.0 + std::fmax(0.0, x - 1.0) * 0.7; });
  const HeightField field = inspect_height_field(mesh, {2.0, 1.0});
  EXPECT_DOUBLE_EQ(field.box.max().z(), 1.7);
  EXPECT_NEAR(field.steepest, 0.7, 1e-12);
  EXPECT_GT(field.steepest_place.x(), 1.0);
}

}  // namespace
}  // namespace lensforge

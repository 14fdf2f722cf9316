// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/cam_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
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
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Coarse enough for a test, with everything that a cut has.
CamOptions coarse() {
  CamOptions options;
  options.sample_spacing = 0.03;
  return options;
}

CamOptions programs_only() {
  CamOptions options;
  options.render = false;
  return options;
}

CamResult run(const Lens& lens, const CamOptions& options, const TempFolder& folder,
              const RunControl& control = {}) {
  return make_cut(lens, options, folder.path(), Executor::cpu(2), control);
}

TEST(CamJob, WritesProgramsPicturesAndReport) {
  const TempFolder folder;
  const CamResult result = run(small_lens(), coarse(), folder);
  EXPECT_TRUE(result.done()) << result.message;
  std::vector<std::string> names;
  for (const auto& file : result.files) names.push_back(file.filename().string());
  EXPECT_THAT(names,
              ::testing::ElementsAre("rough.ngc", "semi.ngc", "finish.ngc", "milled.ply",
                                     "milled.png", "leakage.png", "report.html", "report.json"));
  EXPECT_EQ(folder.file_count(), names.size());
  const auto report = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_DOUBLE_EQ(report["z_offset"].get<double>(), result.report.z_offset);
  EXPECT_EQ(report["operations"].size(), 3U);
  EXPECT_GT(report["operations"][2]["minutes"].get<double>(), 0.0);
}

/// The light that leaks is what the causes add up to, and each cause counts for nothing where it is
/// not there.
TEST(CamJob, TheSplitAddsUpAndCausesThatAreNotThereCountNothing) {
  const TempFolder folder;
  CamOptions options = coarse();
  options.polish.sigma = 0.0;
  const LeakageResult leakage = run(small_lens(), options, folder).report.leakage;
  double sum = 0.0;
  for (const CausePart& part : leakage.parts) {
    sum += part.leakage;
    if (part.cause == leak_cause::kPolish) {
      EXPECT_EQ(part.leakage, 0.0);
    }
    if (part.cause == leak_cause::kScallop) {
      EXPECT_GT(part.leakage, 0.01);
    }
  }
  EXPECT_NEAR(sum, leakage.part().quality.leakage, 1e-12);
}

TEST(CamJob, SameFilesForAnyThreads) {
  const TempFolder one;
  const TempFolder two;
  const CamResult result = make_cut(small_lens(), coarse(), one.path(), Executor::serial(), {});
  make_cut(small_lens(), coarse(), two.path(), Executor::cpu(2), {});
  for (const auto& file : result.files) {
    const std::string name = file.filename().string();
    if (name.starts_with("report")) continue;  // It tells the seconds that it took.
    EXPECT_EQ(read_bytes(one / name), read_bytes(two / name)) << name;
  }
}

TEST(CamJob, ZZeroShiftsThePrograms) {
  CamOptions options = programs_only();
  options.workshop.stock.allowance = 0.25;
  const Lens lens = small_lens();
  const double top = lens.surface.vertices.row(2).maxCoeff();
  for (const auto& [zero, offset] : std::vector<std::pair<ZZero, double>>{
           {ZZero::kStock, -top - 0.25}, {ZZero::kLens, -top}, {ZZero::kTable, 0.0}}) {
    const TempFolder folder;
    options.z_zero = zero;
    EXPECT_DOUBLE_EQ(run(lens, options, folder).report.z_offset, offset) << words_for(zero);
    char safe[40];
    std::snprintf(safe, sizeof safe, "G0 Z%.6f\n", top + 0.25 + 5.0 + offset);
    EXPECT_THAT(read_bytes(folder / "finish.ngc"), HasSubstr(safe));
  }
}

TEST(CamJob, StoppedWhileProgramsAreMadeLeavesWhatWasThere) {
  const TempFolder folder;
  lensforge::testing::write_bytes(folder / "finish.ngc", "old");
  lensforge::testing::write_bytes(folder / "report.json", "old");
  std::stop_source source;
  const RunControl control(source.get_token(), [&](const Progress&) { source.request_stop(); });
  EXPECT_EQ(run(small_lens(), coarse(), folder, control).status, CamResult::Status::kInterrupted);
  EXPECT_EQ(folder.file_count(), 2U);
  EXPECT_EQ(read_bytes(folder / "finish.ngc"), "old");
}

TEST(CamJob, StoppedLaterLeavesNewProgramsWithoutAnOldReport) {
  const TempFolder folder;
  lensforge::testing::write_bytes(folder / "report.html", "old");
  std::stop_source source;
  const RunControl control(source.get_token(), [&](const Progress& progress) {
    if (progress.stage == "render surfaces") source.request_stop();
  });
  EXPECT_EQ(run(small_lens(), coarse(), folder, control).status, CamResult::Status::kInterrupted);
  EXPECT_EQ(folder.file_count(), 3U);
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html"));
}

TEST(CamJob, RemoveCutLeavesOtherFiles) {
  const TempFolder folder;
  run(small_lens(), coarse(), folder);
  lensforge::testing::write_bytes(folder / "finishing-notes.txt", "mine");
  remove_cut(folder.path());
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(CamJob, FullDiskLeavesNothing) {
  const TempFolder folder;
  {
    const FullDisk full(20000);
    const std::string message =
        message_of<RunError>([&] { run(small_lens(), programs_only(), folder); });
    EXPECT_THAT(message, AllOf(HasSubstr(".ngc"), HasSubstr("File too large")));
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CamJob, UnwritableFolderIsRefused) {
  const TempFolder folder;
  lensforge::testing::write_bytes(folder / "cam", "a file");
  EXPECT_THROW(make_cut(small_lens(), programs_only(), folder / "cam", Executor::serial(), {}),
               InputError);
}

TEST(CamJob, WarnsOfWhatAnOperatorShouldQuestion) {
  const TempFolder folder;
  CamOptions options = programs_only();
  Lens plate = small_lens();
  plate.surface.vertices.row(2).setConstant(6.0);
  EXPECT_THAT(run(plate, options, folder).report.warnings, ::testing::IsEmpty());
  options.post = find_post("grbl", "--post");
  EXPECT_THAT(run(plate, options, folder).report.warnings, ::testing::Contains(HasSubstr("$30")));
  options.workshop.machine.travel.x() = 5.0;
  EXPECT_THAT(run(plate, options, folder).report.warnings,
              ::testing::Contains(HasSubstr("travel")));
  for (std::int64_t v = 0; v < plate.surface.vertex_count(); ++v) {
    plate.surface.vertices(2, v) = 6.0 + 1.2 * plate.surface.vertices(0, v);
  }
  EXPECT_THAT(run(plate, options, folder).report.warnings,
              ::testing::Contains(HasSubstr("rises by")));
}

TEST(CamJob, WarnsWhereFlutesAreTooShortForABlankThatNobodyRoughed) {
  const TempFolder folder;
  CamOptions options = programs_only();
  options.workshop.process.rough.enabled = false;
  options.workshop.stock.allowance = 3.0;
  const std::vector<std::string> warnings = run(small_lens(), options, folder).report.warnings;
  EXPECT_THAT(warnings, ::testing::Contains(HasSubstr("nothing is roughed: 'semi' cuts")));
  options.workshop.process.rough.enabled = true;
  EXPECT_THAT(run(small_lens(), options, folder).report.warnings,
              ::testing::Not(::testing::Contains(HasSubstr("nothing is roughed"))));
}

TEST(CamJob, AClampInTheWayIsACollision) {
  const TempFolder folder;
  CamOptions options = programs_only();
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.workshop.keep_outs.push_back({"vice", {1.0, 0.5, 0.0}, {2.0, 1.5, 20.0}});
  const ReportData report = run(small_lens(), options, folder).report;
  EXPECT_FALSE(report.verdict.passes());
  EXPECT_THAT(report.warnings, ::testing::Contains(HasSubstr("vice")));
}

/// Sets one option to a bad value; the message has to name all of `words`.
struct BadOption {
  const char* words;
  double value;
  void (*set)(CamOptions&, double);
};

TEST(CamJob, BadOptionsAreNamedWithValueAndRule) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<BadOption> cases{
      {"--tool-diameter: 2 is not smaller than the lens", 2.0,
       [](CamOptions& o, double v) { o.workshop.tools.back().diameter = v; }},
      {"pitch", 0.5, [](CamOptions& o, double v) { o.workshop.process.finish.pitch = v; }},
      {"--decimals: 3", 3, [](CamOptions& o, double v) { o.decimals = static_cast<int>(v); }},
      {"--decimals: 7", 7, [](CamOptions& o, double v) { o.decimals = static_cast<int>(v); }},
      {"--spin-up", -0.1, [](CamOptions& o, double v) { o.spin_up = v; }},
      {"--spin-up", kNan, [](CamOptions& o, double v) { o.spin_up = v; }},
      {"--shrinkage", 0.3, [](CamOptions& o, double v) { o.shrinkage = v; }},
      {"--polish-sigma", kNan, [](CamOptions& o, double v) { o.polish.sigma = v; }},
      {"--sample-spacing", 0.1, [](CamOptions& o, double v) { o.sample_spacing = v; }}};
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
    return message_of<InputError>([&] { run(lens, programs_only(), folder); });
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
  EXPECT_THAT(refusal(lens), HasSubstr("hole or an overlap"));
  lens.surface.triangles.conservativeResize(3, lens.surface.triangle_count() / 2);
  EXPECT_THROW(run(lens, programs_only(), folder), InputError);
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

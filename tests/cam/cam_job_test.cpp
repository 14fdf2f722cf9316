// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <vector>

#include "cam/cam.h"
#include "cam/cam_meshes.h"
#include "cam/contact/cut_surface.h"
#include "cam/plan/cut_plan.h"
#include "cam/small_cuts.h"
#include "core/error.h"
#include "core/full_disk.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::coarse;
using lensforge::testing::FullDisk;
using lensforge::testing::message_of;
using lensforge::testing::programs_only;
using lensforge::testing::read_bytes;
using lensforge::testing::run_cut;
using lensforge::testing::small_lens;
using lensforge::testing::TempFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A built-in post as a user copies and renames it.
PostDescription post_of_a_user(const std::string& copied) {
  const TempFolder folder;
  std::string text = read_bytes(std::string(LENSFORGE_POSTS) + "/" + copied + ".toml");
  const std::string name = "name = \"" + copied + "\"";
  text.replace(text.find(name), name.size(), "name = \"router in the shed\"");
  lensforge::testing::write_bytes(folder / "mine.toml", text);
  return find_post((folder / "mine.toml").string(), "--post");
}

TEST(CamJob, WritesProgramsPicturesAndReport) {
  const TempFolder folder;
  const CamResult result = run_cut(small_lens(), coarse(), folder);
  EXPECT_TRUE(result.done()) << result.message;
  std::vector<std::string> names;
  for (const auto& file : result.files) names.push_back(file.filename().string());
  EXPECT_THAT(names,
              ::testing::ElementsAre("rough.ngc", "semi.ngc", "finish.ngc", "milled.ply",
                                     "milled.png", "wall.png", "overview.png", "leakage.png",
                                     "part.exr", "causes.exr", "report.html", "report.json"));
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
  options.workshop.polish.sigma = 0.0;
  const LeakageResult leakage = run_cut(small_lens(), options, folder).report.leakage;
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

/// By waves the part is judged by what they show, and rays are reported beside them.
TEST(CamJob, ByWavesTheVerdictIsTheirs) {
  const TempFolder folder;
  CamOptions options = coarse();
  options.light = LightModel::kAuto;
  options.surface = SurfaceModel::kSmooth;
  options.remedies = false;
  const ReportData data = run_cut(small_lens(), options, folder).report;
  ASSERT_TRUE(data.waves);
  const auto report = nlohmann::json::parse(read_bytes(folder / "report.json"));
  EXPECT_EQ(report["light"]["model"], "waves");
  const auto& waves = report["waves"]["leakage"];
  EXPECT_EQ(waves["share"], data.waves->result.part().quality.leakage);
  EXPECT_NE(waves["share"], report["leakage"]["share"]);
  const auto& checks = data.verdict.checks;
  const auto leaks = std::find_if(checks.begin(), checks.end(),
                                  [](const LimitCheck& check) { return check.key == "leakage"; });
  ASSERT_NE(leaks, checks.end());
  EXPECT_NEAR(leaks->value, 100.0 * waves["share"].get<double>(), 1e-9);
  EXPECT_NE(read_bytes(folder / "wall.png"), read_bytes(folder / "milled.png"));
  EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr("polished, by waves"));

  options.light = LightModel::kRays;
  const TempFolder rays;
  run_cut(small_lens(), options, rays);
  EXPECT_EQ(read_bytes(rays / "wall.png"), read_bytes(rays / "milled.png"));
  EXPECT_EQ(read_bytes(rays / "milled.png"), read_bytes(folder / "milled.png"));
}

/// Without a roughness nothing but a sentence; with one its haze is in picture, causes and verdict,
/// and places and programs stay those of the surface.
TEST(CamJob, RoughnessAddsHaze) {
  CamOptions options = coarse();
  options.remedies = false;
  const auto json_of_report = [](const TempFolder& folder) {
    return nlohmann::json::parse(read_bytes(folder / "report.json"));
  };
  const TempFolder clear;
  const ReportData without = run_cut(small_lens(), options, clear).report;
  EXPECT_FALSE(json_of_report(clear)["light"].contains("haze"));
  EXPECT_THAT(without.judged_words(),
              HasSubstr("Haze is not counted, because the polish's roughness is not stated: 10 nm "
                        "would scatter 0.313 % of the light."));
  options.workshop.polish.roughness = 10.0;
  const TempFolder rough;
  const ReportData with = run_cut(small_lens(), options, rough).report;
  const auto report = json_of_report(rough);
  const auto& haze = report["light"]["haze"];
  EXPECT_NEAR(haze["share"].get<double>(), 0.00313, 1e-5);
  EXPECT_GT(haze["width_pixels"].get<double>(), 0.0);
  EXPECT_EQ(haze["roughness_nm"], 10.0);
  EXPECT_EQ(haze["correlation_um"], 5.0);
  EXPECT_THAT(with.judged_words(), HasSubstr("Haze: 0.313 % of the light, spread over "));
  EXPECT_EQ(report["leakage"]["causes"].back()["cause"], "haze");
  EXPECT_EQ(report["leakage"]["causes"].size(), without.leakage.parts.size() + 1);
  double sum = 0.0;
  for (const CausePart& part : with.leakage.parts) sum += part.leakage;
  EXPECT_NEAR(sum, with.leakage.part().quality.leakage, 1e-12);
  EXPECT_NE(read_bytes(clear / "milled.png"), read_bytes(rough / "milled.png"));
  EXPECT_EQ(read_bytes(clear / "finish.ngc").substr(read_bytes(clear / "finish.ngc").find("G21")),
            read_bytes(rough / "finish.ngc").substr(read_bytes(rough / "finish.ngc").find("G21")));
  EXPECT_EQ(json_of_report(clear)["places"], report["places"]);
}

TEST(CamJob, ALensWithASpectrumHasItsOwnWavelengths) {
  const TempFolder folder;
  Lens lens = small_lens();
  lens.setup.spectrum.wavelengths = {450.0, 550.0, 650.0};
  CamOptions options = coarse();
  options.wavelength_nm = 633.0;
  EXPECT_THAT([&] { run_cut(lens, options, folder); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("--wavelength 633: the lens has")));
}

TEST(CamJob, WavesAskForASurfaceWithoutCreases) {
  const TempFolder folder;
  CamOptions options = coarse();
  options.light = LightModel::kWaves;
  options.surface = SurfaceModel::kFacet;
  EXPECT_THAT([&] { run_cut(small_lens(), options, folder); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("--light-model waves: the part has")));
  options.surface = SurfaceModel::kSmooth;
  options.workshop.polish.sigma = 0.0;
  EXPECT_THAT([&] { run_cut(small_lens(), options, folder); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("unpolished")));
}

/// A machine that goes too far makes another part of the same programs.
TEST(CamJob, APitchErrorIsInThePredictionAndNotInThePrograms) {
  const TempFolder exact;
  const TempFolder stretched;
  CamOptions options = coarse();
  const LeakageResult before = run_cut(small_lens(), options, exact).report.leakage;
  const double memory = estimate_cut(options, small_lens().setup, 1).memory_bytes;
  options.workshop.process.finish.pitch_error = 0.01;
  EXPECT_GT(estimate_cut(options, small_lens().setup, 1).memory_bytes, memory);
  const ReportData report = run_cut(small_lens(), options, stretched).report;
  const auto text_below = [](const std::string& program) {
    return program.substr(program.find("G21"));
  };
  EXPECT_EQ(text_below(read_bytes(exact / "finish.ngc")),
            text_below(read_bytes(stretched / "finish.ngc")));
  EXPECT_NE(read_bytes(exact / "milled.ply"), read_bytes(stretched / "milled.ply"));
  ASSERT_EQ(report.leakage.parts.size(), before.parts.size() + 1);
  EXPECT_EQ(report.leakage.parts.back().cause, leak_cause::kPitchError);
  // All before it is as without it.
  for (std::size_t i = 0; i < before.parts.size(); ++i) {
    EXPECT_EQ(report.leakage.parts[i].leakage, before.parts[i].leakage);
  }
  EXPECT_GT(report.leakage.part().quality.leakage, 1.02 * before.part().quality.leakage);
  EXPECT_THAT(read_bytes(stretched / "report.html"), HasSubstr("Pitch error, as assumed"));
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
  const double blank = box_to_cut(lens, options).max().z() + 0.25;
  for (const auto& [zero, offset] : std::vector<std::pair<ZZero, double>>{
           {ZZero::kStock, -blank}, {ZZero::kLens, -top}, {ZZero::kTable, 0.0}}) {
    const TempFolder folder;
    options.z_zero = zero;
    EXPECT_DOUBLE_EQ(run_cut(lens, options, folder).report.z_offset, offset) << words_for(zero);
    char safe[40];
    std::snprintf(safe, sizeof safe, "G0 Z%.6f\n", blank + 5.0 + offset);
    EXPECT_THAT(read_bytes(folder / "finish.ngc"), HasSubstr(safe));
  }
}

/// Everything in a folder, by name.
std::map<std::string, std::string> contents(const TempFolder& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    files[entry.path().filename().string()] = read_bytes(entry.path());
  }
  return files;
}

/// Stops at the first report of a stage that begins so.
RunControl stop_at(const std::string& stage, std::stop_source& source) {
  return {source.get_token(), [stage, &source](const Progress& progress) {
            if (progress.stage.starts_with(stage)) source.request_stop();
          }};
}

TEST(CamJob, WhatIsStoppedAnywhereLeavesTheOldJobAsItWas) {
  const TempFolder folder;
  CamOptions options = coarse();
  run_cut(small_lens(), options, folder);
  const auto before = contents(folder);
  options.z_zero = ZZero::kTable;
  for (const std::string stage : {"", "cam finish", "render surfaces"}) {
    std::stop_source source;
    EXPECT_EQ(run_cut(small_lens(), options, folder, stop_at(stage, source)).status,
              CamResult::Status::kInterrupted)
        << stage;
    EXPECT_EQ(contents(folder), before) << stage;
  }
}

std::vector<std::string> names_in(const TempFolder& folder) {
  std::vector<std::string> names;
  for (const auto& [name, bytes] : contents(folder)) names.push_back(name);
  return names;
}

TEST(CamJob, ProgramsOfAnEarlierRunThatThisOneDoesNotWriteAreRemoved) {
  const TempFolder folder;
  CamOptions options = programs_only();
  options.job = "A lens (1)";
  run_cut(small_lens(), options, folder);
  ASSERT_THAT(names_in(folder), ::testing::Contains("rough.ngc"));
  options.grouping = ProgramGrouping::kAll;
  run_cut(small_lens(), options, folder);
  EXPECT_THAT(names_in(folder),
              ::testing::ElementsAre("A lens (1).ngc", "report.html", "report.json"));
  options.workshop.process.rough.enabled = false;
  options.grouping = ProgramGrouping::kOperation;
  options.largest_file = 65536;
  run_cut(small_lens(), options, folder);
  EXPECT_THAT(names_in(folder), ::testing::Not(::testing::Contains("A lens (1).ngc")));
  EXPECT_THAT(names_in(folder), ::testing::Contains("finish_2.ngc"));
  options.largest_file = 0;
  options.post = find_post("fanuc", "--post");
  run_cut(small_lens(), options, folder);
  EXPECT_THAT(names_in(folder),
              ::testing::ElementsAre("finish.nc", "report.html", "report.json", "semi.nc"));
}

TEST(CamJob, ProgramsThatAreNotTheJobsAreKeptAndNamed) {
  const TempFolder folder;
  CamOptions options = programs_only();
  run_cut(small_lens(), options, folder);
  lensforge::testing::write_bytes(folder / "rough.ngc", read_bytes(folder / "rough.ngc") + "\n");
  std::filesystem::copy_file(folder / "semi.ngc", folder / "semi-old.ngc");
  lensforge::testing::write_bytes(folder / "mine.ngc", "M2\n");
  options.workshop.process.rough.enabled = false;
  const ReportData report = run_cut(small_lens(), options, folder).report;
  EXPECT_THAT(report.warnings,
              ::testing::Contains(HasSubstr("of another job, which were kept: mine.ngc, rough.ngc, "
                                            "semi-old.ngc")));
  EXPECT_THAT(read_bytes(folder / "report.html"), HasSubstr("semi-old.ngc"));
  for (const char* name : {"rough.ngc", "semi-old.ngc", "mine.ngc"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / name)) << name;
  }
}

TEST(CamJob, WhatOthersWroteIsReplacedOnlyByForce) {
  for (const std::string name : {"finish.ngc", "finish_2.ngc", "report.html", "report.json"}) {
    const TempFolder folder;
    CamOptions options = programs_only();
    lensforge::testing::write_bytes(folder / name, "mine");
    EXPECT_THAT(message_of<InputError>([&] { run_cut(small_lens(), options, folder); }),
                AllOf(HasSubstr(name), HasSubstr("--force")));
    EXPECT_EQ(names_in(folder), std::vector<std::string>{name});
    EXPECT_EQ(read_bytes(folder / name), "mine");
    options.force = true;
    EXPECT_TRUE(run_cut(small_lens(), options, folder).done());
  }
}

TEST(CamJob, AProgramThatWasEditedIsReplacedOnlyByForce) {
  const TempFolder folder;
  CamOptions options = programs_only();
  run_cut(small_lens(), options, folder);
  run_cut(small_lens(), options, folder);
  lensforge::testing::write_bytes(folder / "semi.ngc", read_bytes(folder / "semi.ngc") + "\n");
  const auto before = contents(folder);
  EXPECT_THAT(message_of<InputError>([&] { run_cut(small_lens(), options, folder); }),
              HasSubstr("semi.ngc: lensforge did not write it as it stands"));
  EXPECT_EQ(contents(folder), before);
  options.force = true;
  EXPECT_TRUE(run_cut(small_lens(), options, folder).done());
}

TEST(CamJob, AFolderInPlaceOfAFileIsRefusedWhateverForceSays) {
  const TempFolder folder;
  std::filesystem::create_directory(folder / "report.html");
  CamOptions options = programs_only();
  options.force = true;
  EXPECT_THAT(message_of<InputError>([&] { run_cut(small_lens(), options, folder); }),
              HasSubstr("report.html: is no regular file"));
}

TEST(CamJob, RemoveCutLeavesOtherFiles) {
  const TempFolder folder;
  run_cut(small_lens(), programs_only(), folder);
  lensforge::testing::write_bytes(folder / "finish.ngc", read_bytes(folder / "finish.ngc") + "\n");
  for (const char* name : {"finish-notes.txt", "finish.bak", "milled.png"}) {
    lensforge::testing::write_bytes(folder / name, "mine");
  }
  remove_cut(folder.path());
  EXPECT_THAT(names_in(folder),
              ::testing::ElementsAre("finish-notes.txt", "finish.bak", "finish.ngc", "milled.png"));
}

TEST(CamJob, SurfacesWithAHoleAreRefusedBeforeAnythingIsWritten) {
  const TempFolder folder;
  for (const bool render : {false, true}) {
    CamOptions options = coarse();
    options.render = render;
    Lens lens = small_lens();
    lens.surface.triangles.col(100) = lens.surface.triangles.col(0);
    EXPECT_THAT(message_of<InputError>([&] { run_cut(lens, options, folder); }),
                HasSubstr("hole or an overlap"));
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CamJob, FullDiskLeavesNothing) {
  const TempFolder folder;
  {
    const FullDisk full(20000);
    const std::string message =
        message_of<RunError>([&] { run_cut(small_lens(), programs_only(), folder); });
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
  EXPECT_THAT(run_cut(plate, options, folder).report.warnings, ::testing::IsEmpty());
  options.post = post_of_a_user("grbl");
  EXPECT_THAT(run_cut(plate, options, folder).report.warnings,
              ::testing::Contains(HasSubstr("$30, silently: set it to at least 23000")));
  options.workshop.machine.travel.x() = 5.0;
  EXPECT_THAT(run_cut(plate, options, folder).report.warnings,
              ::testing::Contains(HasSubstr("travel")));
  for (std::int64_t v = 0; v < plate.surface.vertex_count(); ++v) {
    plate.surface.vertices(2, v) = 6.0 + 1.2 * plate.surface.vertices(0, v);
  }
  EXPECT_THAT(run_cut(plate, options, folder).report.warnings,
              ::testing::Contains(HasSubstr("rises by")));
}

TEST(CamJob, ToolNumbersThatTheControllerCannotCallAreRefusedFirst) {
  const TempFolder folder;
  CamOptions options = programs_only();
  int& finishing = options.workshop.process.finish.tool;
  for (Tool& tool : options.workshop.tools) {
    if (tool.number == finishing) tool.number = 1000;
  }
  finishing = 1000;
  options.post = find_post("fanuc", "--post");
  EXPECT_THAT(message_of<InputError>([&] { run_cut(small_lens(), options, folder); }),
              HasSubstr("tool number 1000: is above 999, the largest that a post read as fanuc can "
                        "call; number the tool from 1 to 999"));
  // Grbl's programs call no tool, LinuxCNC's may call this one.
  for (const char* post : {"grbl", "linuxcnc"}) {
    options.post = find_post(post, "--post");
    EXPECT_NO_THROW(run_cut(small_lens(), options, folder)) << post;
  }
}

TEST(CamJob, WarnsWhereFlutesAreTooShortForABlankThatNobodyRoughed) {
  const TempFolder folder;
  CamOptions options = programs_only();
  options.workshop.process.rough.enabled = false;
  options.workshop.stock.allowance = 3.0;
  const std::vector<std::string> warnings = run_cut(small_lens(), options, folder).report.warnings;
  EXPECT_THAT(warnings, ::testing::Contains(HasSubstr("nothing is roughed: 'semi' cuts")));
  options.workshop.process.rough.enabled = true;
  EXPECT_THAT(run_cut(small_lens(), options, folder).report.warnings,
              ::testing::Not(::testing::Contains(HasSubstr("nothing is roughed"))));
}

TEST(CamJob, AClampInTheWayIsACollision) {
  const TempFolder folder;
  CamOptions options = programs_only();
  options.workshop.process.rough.enabled = false;
  options.workshop.process.semi.enabled = false;
  options.workshop.keep_outs.push_back({"vice", {1.0, 0.5, 0.0}, {2.0, 1.5, 20.0}});
  const ReportData report = run_cut(small_lens(), options, folder).report;
  EXPECT_FALSE(report.verdict.passes());
  EXPECT_THAT(report.warnings, ::testing::Contains(HasSubstr("vice")));
}

TEST(CamJob, TheReportNamesTheDesignThatWasCut) {
  const TempFolder folder;
  Lens lens = small_lens();
  EXPECT_EQ(run_cut(lens, programs_only(), folder).report.lens_id, "");
  lens.provenance = nlohmann::json{{"fingerprint", "0123456789abcdef"}};
  EXPECT_EQ(run_cut(lens, programs_only(), folder).report.lens_id, "0123456789abcdef");
  lens.provenance = nlohmann::json{{"fingerprint", "<script>"}};
  EXPECT_EQ(run_cut(lens, programs_only(), folder).report.lens_id, "");
}

TEST(CamJob, AFacetedDesignIsCutAsFacetsUnlessToldOtherwise) {
  const TempFolder folder;
  Lens lens = small_lens();
  const auto surface_of = [&](const CamOptions& options) {
    const CamResult result = run_cut(lens, options, folder);
    return result.report.parameters.front().parameters.back().value;
  };
  EXPECT_EQ(surface_of(programs_only()), "smooth, over the mesh");
  lens.model = SurfaceModel::kFacet;
  EXPECT_EQ(surface_of(programs_only()), "facets of the mesh");
  CamOptions options = programs_only();
  options.surface = SurfaceModel::kSmooth;
  EXPECT_EQ(surface_of(options), "smooth, over the mesh");
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
      {"--tool-diameter 2: must be smaller than the lens", 2.0,
       [](CamOptions& o, double v) { o.workshop.tools.back().diameter = v; }},
      {"pitch", 0.5, [](CamOptions& o, double v) { o.workshop.process.finish.pitch = v; }},
      {"--decimals 3: must be 0, or 4 to 6", 3,
       [](CamOptions& o, double v) { o.decimals = static_cast<int>(v); }},
      {"--decimals 7: must be 0, or 4 to 6", 7,
       [](CamOptions& o, double v) { o.decimals = static_cast<int>(v); }},
      {"--spin-up", -0.1, [](CamOptions& o, double v) { o.spin_up = v; }},
      {"--spin-up", kNan, [](CamOptions& o, double v) { o.spin_up = v; }},
      {"--shrinkage", 0.3, [](CamOptions& o, double v) { o.shrinkage = v; }},
      {"polish.sigma", kNan, [](CamOptions& o, double v) { o.workshop.polish.sigma = v; }},
      {"--sample-spacing", 0.1, [](CamOptions& o, double v) { o.sample_spacing = v; }}};
  const Lens lens = small_lens();
  const TempFolder folder;
  for (const BadOption& bad : cases) {
    CamOptions options;
    bad.set(options, bad.value);
    EXPECT_THAT(message_of<InputError>([&] { run_cut(lens, options, folder); }),
                HasSubstr(bad.words));
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(CamJob, SurfacesThatCannotBeCutAreRefused) {
  const TempFolder folder;
  const auto refusal = [&](const Lens& lens) {
    return message_of<InputError>([&] { run_cut(lens, programs_only(), folder); });
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
  EXPECT_THROW(run_cut(lens, programs_only(), folder), InputError);
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

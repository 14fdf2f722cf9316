// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/studio/results.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <system_error>
#include <utility>

#include "app/frame/child_command.h"
#include "app/frame/common_output.h"
#include "cam/cam.h"
#include "cam/check/check_job.h"
#include "cam/predict/part_surfaces.h"
#include "core/io/lens_folder.h"
#include "core/page/html_page.h"
#include "core/text/number_text.h"
#include "core/text/words.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json file_json(const fs::path& file, const std::string& name, const std::string& words,
               const std::string& address) {
  std::error_code none;
  const std::uintmax_t bytes = fs::file_size(file, none);
  return {{"name", name},
          {"words", words},
          {"url", address + "files/" + name + "?" + modified(file)},
          {"bytes", none ? 0 : bytes}};
}

/// A file of a folder in words.
struct NamedContent {
  const char* name;
  const char* words;
};

constexpr NamedContent kLensPictures[] = {{lens_file::kWall, "Light on the wall, as waves"},
                                          {lens_file::kRenderPng, "Light on the wall"},
                                          {lens_file::kSecondRenderPng, "Light on the second wall"},
                                          {lens_file::kError, "Error of display values"},
                                          {lens_file::kSetup, "From the side and from above"}};
constexpr NamedContent kLensFiles[] = {{lens_file::kSurface, "the surface as a mesh, PLY"},
                                       {lens_file::kFront, "heights of the front, EXR"},
                                       {"lens.step", "solid for CAD and CAM, STEP"},
                                       {"lens.iges", "solid for CAD, IGES"},
                                       {"lens.stl", "mesh, STL"},
                                       {"lens.3mf", "mesh, 3MF"},
                                       {"lens.obj", "mesh, OBJ"},
                                       {"lens.glb", "mesh, glTF"},
                                       {lens_file::kOverview, "overview, PNG"},
                                       {lens_file::kJson, "what it is, JSON"}};
constexpr NamedContent kPartPictures[] = {{cam_file::kWall, "Light on the wall from the part"},
                                          {cam_file::kLeakage, "Where light leaks"}};
constexpr NamedContent kPartFiles[] = {{cam_file::kMilledMesh, "the surface as milled, PLY"},
                                       {cam_file::kReport, "the report, JSON"}};
constexpr NamedContent kCheckPictures[] = {
    {check_file::kRectified, "The wall, seen straight on"},
    {check_file::kForecast, "The forecast of the part"},
    {check_file::kMap, "Brighter than forecast in red, darker in blue"}};

template <std::size_t N>
json files_of(const ShownLens& lens, const std::string& within, const NamedContent (&names)[N]) {
  json files = json::array();
  for (const NamedContent& one : names) {
    const fs::path file = lens.project / within / one.name;
    if (!fs::is_regular_file(file)) continue;
    files.push_back(file_json(file, within + "/" + one.name, one.words, lens.address));
  }
  return files;
}

/// "MAE 0.0012 by rays, PSNR 40.1 dB, SSIM 0.990"
std::string quality_words(const json& metrics, const std::string& by) {
  return mae_words(metrics.value("mae", 0.0)) + by + ", PSNR " +
         decimal_text(metrics.value("psnr", 0.0), 1) + " dB, SSIM " +
         decimal_text(metrics.value("ssim", 0.0), 3);
}

/// True if lens.json is of a lens whose front is a height map.
bool is_front_shaped(const json& lens) {
  const json front = lens.value("front", json());
  return front.is_object() && front.value("type", "") == "heights";
}

/// Pictures of both faces, which the studio draws when they are asked for.
void add_reliefs(const ShownLens& lens, json& pictures) {
  const std::pair<const char*, const char*> faces[] = {
      {kFrontRelief, "Relief of the front, as its cutter sees it"},
      {kRelief, "Relief of the exit face, as its cutter sees it"}};
  for (const auto& [name, words] : faces) {
    pictures.push_back({{"words", words}, {"url", lens.address + name + "?" + lens.name}});
  }
}

/// Range of the error of parts; null if the report has none.
json range_of(const json& report) {
  const json t = report.value("tolerances", json());
  if (!t.is_object() || !t.contains("mae")) return nullptr;
  return {{"p10", t["mae"]["p10"]},
          {"p90", t["mae"]["p90"]},
          {"median", t["mae"]["median"]},
          {"words", t.value("words", "")}};
}

/// Which stated limits a cut missed.
std::string verdict_of(const json& report) {
  std::string missed;
  for (const json& check : report.value("verdict", json::object()).value("checks", json::array())) {
    const bool counts = !check.value("pass", true) && !check.value("advice", false);
    if (counts) missed = with_word(std::move(missed), check.value("words", ""));
  }
  return missed.empty() ? "All limits are kept." : "Limits missed: " + missed + ".";
}

/// What a report of one of two faces says about them, in sentences.
json face_words_of(const json& report) {
  json words = json::array();
  const auto add = [&](const std::string& text) {
    if (!text.empty()) words.push_back(text);
  };
  const json& surfaces = report["surfaces"];
  const auto both = std::find_if(surfaces.begin(), surfaces.end(), [](const json& one) {
    return one.value("name", "") == surface_name::kBoth;
  });
  if (report.contains("second")) {
    const json& second = report["second"];
    add("On the second wall: " + mae_words(second["surfaces"].back().value("mae", 0.0)) +
        ", leaks " + decimal_text(100.0 * second["leakage"].value("share", 0.0), 2) + " %.");
  }
  if (both != surfaces.end()) {
    add("Both faces as made: " + mae_words(both->value("mae", 0.0)) + " by rays.");
  }
  add(report.value("face_words", ""));
  add(report.value("setup", json::object()).value("two_setups", ""));
  add(report.value("faces", json::object()).value("words", ""));
  return words;
}

/// Programs of a report, in their order; several operations may share one.
std::vector<std::pair<std::string, std::string>> programs_of(const json& report) {
  std::vector<std::pair<std::string, std::string>> programs;
  for (const json& one : report.value("operations", json::array())) {
    const std::string file = one.value("file", "");
    const bool known = std::any_of(programs.begin(), programs.end(),
                                   [&](const auto& program) { return program.first == file; });
    if (!file.empty() && !known) programs.emplace_back(file, one.value("name", ""));
  }
  return programs;
}

/// True if nothing that a cut follows from has changed since.
bool is_current(const fs::path& workshop, const fs::path& report) {
  return !fs::exists(workshop) || fs::last_write_time(workshop) <= fs::last_write_time(report);
}

}  // namespace

std::string modified(const fs::path& file) {
  std::error_code none;
  const auto time = fs::last_write_time(file, none);
  return none ? "0" : std::to_string(std::abs(time.time_since_epoch().count() % 1'000'000'007));
}

std::string mae_words(double mae) { return "MAE " + decimal_text(mae, 4); }

json own_metrics(const json& lens) {
  const json metrics = lens.value("metrics", json::object());
  return metrics.value(lens.value("model", ""), json::object());
}

const char* cut_folder(CutFace face) {
  return face == CutFace::kFront ? lens_file::kFrontCut : lens_file::kCut;
}

json lens_results(const ShownLens& lens, const json& printed) {
  const json stored = json_in(lens.folder() / lens_file::kJson);
  if (!stored.is_object()) return nullptr;
  json words = json::array();
  const json metrics = own_metrics(stored);
  const bool waves = printed.is_object() && printed.contains("waves");
  const json shown = waves ? printed["waves"] : metrics;
  words.push_back(quality_words(shown, waves ? " by waves" : " by rays"));
  if (const json all = stored.value("metrics", json::object()); all.contains("second")) {
    words.push_back("second picture: " + quality_words(all["second"], " by rays"));
  }
  if (waves) words.push_back(mae_words(metrics.value("mae", 0.0)) + " by rays");
  if (printed.is_object() && printed.contains("made")) {
    words.push_back(mae_words(printed["made"].value("mae", 0.0)) +
                    " as made in the workshop, by rays");
  }
  const bool two_faces = is_front_shaped(stored);
  if (two_faces) words.push_back("both faces are shaped: the part is cut in two setups");
  const json provenance = stored.value("provenance", json::object());
  words.push_back("designed in " + duration_text(provenance.value("seconds", 0.0) / 60.0));
  json pictures = files_of(lens, lens.name, kLensPictures);
  if (two_faces) add_reliefs(lens, pictures);
  const fs::path view = lens.folder() / project_file::kView;
  return {{"folder", lens.name},
          {"mae", shown.value("mae", 0.0)},
          {"status", provenance.value("status", "")},
          {"words", words},
          {"two_faces", two_faces},
          {"pictures", pictures},
          {"files", files_of(lens, lens.name, kLensFiles)},
          {"view", fs::exists(view) ? json(lens.address + "files/" + lens.name + "/" +
                                           project_file::kView + "?" + modified(view))
                                    : json()}};
}

json cut_results(const ShownLens& lens, CutFace face, const OpticalSetup& setup,
                 const Workshop& workshop) {
  const std::string within = lens.name + "/" + cut_folder(face);
  const fs::path file = lens.project / within / cam_file::kReport;
  const json report = json_in(file);
  if (!report.is_object() || !report.contains("surfaces")) return nullptr;
  const bool waves = report.contains("waves");
  const json& by = waves ? report["waves"] : report;
  CamOptions cut;
  cut.workshop = workshop;
  cut.face = face;
  json programs = json::array();
  json files = json::array();
  // A front's are named by their folder, too: `send` has to know which face is meant.
  const std::string before =
      face == CutFace::kFront ? std::string(lens_file::kFrontCut) + "/" : std::string();
  for (const auto& [program, name] : programs_of(report)) {
    programs.push_back(joined({before, program}));
    files.push_back(file_json(lens.project / within / program, joined({within, "/", program}),
                              "program: " + name, lens.address));
  }
  for (json& other : files_of(lens, within, kPartFiles)) files.push_back(std::move(other));
  json operations = json::array();
  for (const json& one : report.value("operations", json::array())) {
    operations.push_back({{"name", one.value("name", "")}, {"minutes", one.value("minutes", 0.0)}});
  }
  return {
      {"mae", by["surfaces"].back().value("mae", 0.0)},
      {"model", waves ? "waves" : "rays"},
      {"range", range_of(report)},
      {"range_words", "No range: cam " + tolerance_fault(cut, setup) + "."},
      {"leakage", by["leakage"].value("share", 0.0)},
      {"contrast", by["leakage"].value("contrast", json())},
      {"minutes", report.value("minutes", 0.0)},
      {"operations", operations},
      {"verdict", verdict_of(report)},
      {"faces", face_words_of(report)},
      {"pass", report.value("verdict", json::object()).value("pass", false)},
      {"current", is_current(lens.project / project_file::kWorkshop, file)},
      {"warnings", report.value("warnings", json::array())},
      {"pictures", files_of(lens, within, kPartPictures)},
      {"report", lens.address + "files/" + within + "/" + cam_file::kPage + "?" + modified(file)},
      {"files", files},
      {"programs", programs}};
}

json check_results(const ShownLens& lens) {
  const std::string within = lens.name + "/" + project_file::kCheck;
  const fs::path file = lens.project / within / check_file::kJson;
  const json check = json_in(file);
  if (!check.is_object()) return nullptr;
  json more = json::array();
  const json causes = check.value("causes", json::array());
  for (std::size_t k = 1; k < causes.size(); ++k) more.push_back(causes[k].value("words", ""));
  return {{"verdict", check.value("verdict", "")},
          {"more", more},
          {"pictures", files_of(lens, within, kCheckPictures)},
          {"report",
           lens.address + "files/" + within + "/" + check_file::kReport + "?" + modified(file)}};
}

}  // namespace lensforge::app

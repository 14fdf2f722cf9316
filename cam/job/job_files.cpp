// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/job/job_files.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string_view>
#include <system_error>

#include "cam/cam.h"
#include "cam/predict/part_surfaces.h"
#include "cam/predict/prediction.h"
#include "cam/report/report_data.h"
#include "cam/report/report_html.h"
#include "core/error.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/mesh/mesh_files.h"
#include "core/page/drawings.h"
#include "core/text/words.h"
#include "machine/gcode/program_seal.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Extensions of programs that machines read.
const std::set<std::string> kProgramExtensions{".ngc",   ".nc", ".tap", ".cnc",
                                               ".gcode", ".gc", ".g",   ".mpf"};

constexpr std::size_t kLinesToJob = 6;     ///< "job:" is the first comment below %, O and such.
constexpr std::size_t kLongestLine = 256;  ///< Of a program's header.
constexpr std::size_t kShortestCut = 30;   ///< Of a job's name shortened in a comment.
constexpr std::string_view kJobKey = "job: ";

/// Files that a cut writes beside its programs.
constexpr std::array kBesidePrograms{
    cam_file::kReport,        cam_file::kPage,          cam_file::kMilledMesh,
    cam_file::kMilledPicture, cam_file::kWall,          cam_file::kLeakage,
    cam_file::kOverview,      lens_file::kPartSurfaces, lens_file::kCausePictures};

/// check_seal(); unreadable files have none.
std::optional<bool> seal_of(const fs::path& path) {
  try {
    return check_seal(path);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// "finish" of "finish_2".
std::string without_number(const std::string& stem) {
  const std::size_t last = stem.find_last_not_of("0123456789");
  const bool numbered = last != std::string::npos && last + 1 < stem.size() && stem[last] == '_';
  return numbered ? stem.substr(0, last) : stem;
}

/// finish, finish-cross
bool names_operations(std::string_view stem) {
  while (true) {
    const std::size_t dash = stem.find('-');
    const auto word = stem.substr(0, dash);
    if (std::find(kOperationNames.begin(), kOperationNames.end(), word) == kOperationNames.end())
      return false;
    if (dash == std::string_view::npos) return true;
    stem.remove_prefix(dash + 1);
  }
}

/// The job in a program's header, in lower case; empty if it has none.
std::string stated_job(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line(kLongestLine, '\0');
  for (std::size_t i = 0; i < kLinesToJob && file.getline(line.data(), kLongestLine); ++i) {
    const std::string text = lower_case(line.substr(0, line.find('\0')));
    const std::size_t at = text.find(kJobKey);
    if (at != 1) continue;
    return text.substr(at + kJobKey.size(), text.find_last_not_of(")\r") + 1 - at - kJobKey.size());
  }
  return {};
}

/// True if the stem matches the header's job. Comments replace some letters, and both may be
/// shortened.
bool names_job(const std::string& stem, const fs::path& path) {
  const std::string job = stated_job(path);
  const std::string name = lower_case(stem);
  const std::size_t shorter = std::min(job.size(), name.size());
  if (shorter == 0 || (job.size() != name.size() && shorter < kShortestCut)) return false;
  return std::equal(job.begin(), job.begin() + static_cast<std::ptrdiff_t>(shorter), name.begin(),
                    [](char a, char b) { return a == b || a == '_' || b == '_'; });
}

bool is_program(const fs::path& path) {
  std::error_code error;
  const std::string name = path.filename().string();
  if (!fs::is_regular_file(path, error) || !name_of_partial(name).empty()) return false;
  return kProgramExtensions.contains(lower_case(path.extension().string())) ||
         (names_operations(without_number(path.stem().string())) && seal_of(path).has_value());
}

ColorImage leakage_picture(const LeakageResult& leakage) {
  const FluxPicture& part = leakage.part().picture;
  return false_color_image(surplus(part, leakage.designed.picture), part.columns, part.rows);
}

std::string listed(const std::vector<fs::path>& paths) {
  std::string text;
  for (const fs::path& path : paths) text = with_word(text, path.string());
  return text;
}

}  // namespace

bool is_own_program(const fs::path& path) {
  if (!is_program(path)) return false;
  const std::string stem = without_number(path.stem().string());
  if (!names_operations(stem) && !names_job(stem, path)) return false;
  return seal_of(path) == true;
}

bool is_name_of_cut(const std::string& name) {
  const fs::path path(name);
  const auto among = [&name](const auto& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  return kProgramExtensions.contains(lower_case(path.extension().string())) ||
         names_operations(without_number(path.stem().string())) || among(lens_file::kCutFiles) ||
         among(lens_file::kCutLayers);
}

OtherPrograms other_programs(const fs::path& folder, std::span<const fs::path> written) {
  OtherPrograms others;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const fs::path& path = entry.path();
    if (!is_program(path)) continue;
    if (std::find(written.begin(), written.end(), path) != written.end()) continue;
    (is_own_program(path) ? others.earlier : others.kept).push_back(path);
  }
  std::sort(others.earlier.begin(), others.earlier.end());
  std::sort(others.kept.begin(), others.kept.end());
  return others;
}

void require_replaceable_cut(const fs::path& folder, std::span<const fs::path> programs,
                             std::span<const char* const> others, bool force) {
  std::vector<fs::path> odd;
  std::vector<fs::path> foreign;
  const auto judge = [&](const fs::path& path, const auto& own) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) return;
    if (!fs::is_regular_file(status)) {
      odd.push_back(path);
    } else if (fs::file_size(path, error) > 0 && !own(path)) {
      foreign.push_back(path);
    }
  };
  for (const fs::path& path : programs) {
    judge(path, [](const fs::path& p) { return seal_of(p) == true; });
  }
  for (const char* const name : others) judge(folder / name, written_by_lensforge);
  if (!odd.empty()) throw InputError(listed(odd) + ": is no regular file and is not replaced");
  if (foreign.empty() || force) return;
  throw InputError(listed(foreign) + ": lensforge did not write " +
                   (foreign.size() == 1 ? "it" : "them") +
                   " as it stands; move it away or replace it with --force");
}

std::vector<const char*> cut_file_names(const CamOptions& options) {
  if (options.render) return {kBesidePrograms.begin(), kBesidePrograms.end()};
  return {cam_file::kReport, cam_file::kPage};
}

void add_prediction_files(const Prediction& prediction, const Lens& lens, PendingFiles& files) {
  const double total = lens.target.total();
  const auto add_picture = [&](const char* name, const LeakageResult& result) {
    files.add(name, [&result, total](const fs::path& beside) {
      write_image(result.part().picture.image(total), beside);
    });
  };
  files.add(cam_file::kMilledMesh,
            [&](const fs::path& beside) { write_ply(prediction.milled, beside); });
  add_picture(cam_file::kMilledPicture, prediction.leakage);
  add_picture(cam_file::kWall, prediction.judged());
  files.add(cam_file::kOverview, [&prediction, &lens, total](const fs::path& beside) {
    const LeakageResult& judged = prediction.judged();
    write_image(draw_overview(lens, {judged.designed.picture.image(total),
                                     judged.part().picture.image(total)}),
                beside);
  });
  files.add(cam_file::kLeakage, [&](const fs::path& beside) {
    write_image(leakage_picture(prediction.leakage), beside);
  });
  files.add(lens_file::kPartSurfaces,
            [&](const fs::path& beside) { write_layers(prediction.surfaces, beside); });
  files.add(lens_file::kCausePictures, [&](const fs::path& beside) {
    write_layers(cause_layers(prediction.leakage, total), beside);
  });
}

void add_report_files(const ReportData& report, PendingFiles& files) {
  files.add(cam_file::kPage, report_html(report));
  // The job is named after its folder, whose name need not be UTF-8.
  constexpr auto kReplace = nlohmann::json::error_handler_t::replace;
  files.add(cam_file::kReport, report_json(report).dump(1, ' ', false, kReplace) + "\n");
}

void remove_prediction(const fs::path& folder) {
  for (const char* name : kBesidePrograms) {
    std::error_code ignored;
    if (written_by_lensforge(folder / name)) fs::remove(folder / name, ignored);
  }
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/earlier_design.h"

#include <string_view>
#include <system_error>

#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/io/output_guard.h"
#include "core/surface/spline_file.h"
#include "core/text/json_text.h"
#include "design/design_lens.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;

/// A lens.json is a few kilobytes.
constexpr std::uintmax_t kMaxJson = 1 << 20;

/// Whether lensforge wrote this file of a lens folder, by what it says of itself.
bool is_own(const fs::path& path) {
  std::error_code ignored;
  if (fs::file_size(path, ignored) == 0) return true;
  if (path.filename() == lens_file::kConvergence) {
    return file_starts_with(path, convergence_csv({}));
  }
  if (path.filename() == lens_file::kSpline) return is_spline_file(path);
  return written_by_lensforge(path);
}

/// Null where the file cannot be understood: whoever needs it says so.
nlohmann::json provenance_of(const fs::path& json) {
  const std::string text = read_whole_file(json, kMaxJson);
  try {
    const nlohmann::json document = parse_json(text, json.string());
    return document.is_object() ? document.value("provenance", nlohmann::json()) : nlohmann::json();
  } catch (const InputError&) {
    return nullptr;
  }
}

[[noreturn]] void refuse(const fs::path& folder, const std::string& holds) {
  throw InputError("--out " + folder.string() + ": holds " + holds);
}

/// What no option lets a design replace.
void require_files(const fs::path& folder) {
  for (const char* name : lens_file::kAll) {
    std::error_code ignored;
    const fs::file_status status = fs::status(folder / name, ignored);
    if (!fs::exists(status) || fs::is_regular_file(status)) continue;
    refuse(folder, std::string(name) + ", which is no regular file; choose another folder");
  }
}

}  // namespace

EarlierDesign EarlierDesign::in(const fs::path& folder) {
  std::error_code ignored;
  EarlierDesign earlier;
  for (const char* name : lens_file::kAll) {
    const fs::path path = folder / name;
    if (!fs::is_regular_file(path, ignored)) continue;
    if (name == std::string_view(lens_file::kJson)) {
      earlier.lens = true;
      earlier.provenance = provenance_of(path);
    } else if (name == std::string_view(lens_file::kCheckpoint)) {
      earlier.checkpoint = true;
    } else if (!is_own(path)) {
      earlier.foreign.emplace_back(name);
    }
  }
  return earlier;
}

bool EarlierDesign::is_of(const std::string& fingerprint) const {
  return provenance.is_object() && provenance.value("fingerprint", nlohmann::json()) == fingerprint;
}

void refuse_to_overwrite(const fs::path& folder, const EarlierDesign& earlier, bool resume,
                         bool force) {
  require_files(folder);
  if (force || (resume && earlier.lens)) return;
  if (!resume && (earlier.lens || earlier.checkpoint)) {
    refuse(folder, std::string(earlier.lens ? "a lens" : "an unfinished design") +
                       " already; choose another folder, go on with --resume or replace it with "
                       "--force");
  }
  if (earlier.foreign.empty()) return;
  refuse(folder, earlier.foreign.front() +
                     " already, which lensforge did not write; choose another folder or replace "
                     "it with --force");
}

void require_finished(const fs::path& folder, const EarlierDesign& earlier,
                      const std::string& fingerprint) {
  if (!earlier.provenance.is_object()) refuse(folder, "a lens.json that cannot be understood");
  if (earlier.provenance.value("status", nlohmann::json()) == "interrupted") {
    refuse(folder, std::string("an unfinished design whose ") + lens_file::kCheckpoint +
                       " is missing: nothing to resume; start again with --force");
  }
  if (earlier.provenance.contains("fingerprint") && !earlier.is_of(fingerprint)) {
    refuse(folder,
           "the finished lens of another picture or other options: there is nothing to resume; "
           "choose another folder or replace it with --force");
  }
}

}  // namespace lensforge::app

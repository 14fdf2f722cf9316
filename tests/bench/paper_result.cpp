// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/paper_result.h"

#include <cstdint>
#include <fstream>
#include <sstream>

#include "bench/child_process.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"

namespace lensforge::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kStarted = "started.json";  ///< What the folder's design was started with.
constexpr const char* kRow = "row.json";          ///< The same and the figures, once it is done.
constexpr int kBadInput = 2;

std::string content(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The JSON in a file; null if there is none.
json read_json(const fs::path& file) {
  const json value = json::parse(content(file), nullptr, false);
  return value.is_discarded() ? json() : value;
}

/// FNV-1a of a file's bytes, to notice that it has changed.
std::string fingerprint(const fs::path& file) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : content(file)) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  }
  std::ostringstream text;
  text << std::hex << hash;
  return text.str();
}

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n');
  if (end == std::string::npos) return "";
  const std::size_t before = text.find_last_of('\n', end);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  return text.substr(begin, end + 1 - begin);
}

/// One row's folder and what is done in it.
class RowRun {
 public:
  RowRun(const PaperRow& row, const PaperPrograms& programs)
      : programs_(programs), folder_(programs.out / row.name) {
    result_.row = row;
    asked_ = {{"options", row.options},
              {"pixels", row.pixels},
              {"picture", fingerprint(row.picture)},
              {"build", fingerprint(programs.design)}};
  }

  PaperResult run() {
    if (!fs::exists(result_.row.picture)) {
      end(PaperResult::Status::kNoPicture,
          fs::path(result_.row.picture).filename().string() + " is not there");
    } else if (!reuse() && design()) {
      store();
    }
    if (result_.row.is_traced() && result_.done() && result_.trace.is_null() &&
        fs::exists(programs_.ray_trace)) {
      trace();
      store();
    }
    return std::move(result_);
  }

 private:
  void end(PaperResult::Status status, const std::string& message) {
    result_.status = status;
    result_.message = message;
  }

  /// True if `made` has the options and the picture of this row.
  [[nodiscard]] bool same_work(const json& made) const {
    if (!made.is_object()) return false;
    const auto same = [&](const char* key) { return made.value(key, json()) == asked_[key]; };
    return same("options") && same("pixels") && same("picture");
  }

  bool reuse() {
    const json row = read_json(folder_ / kRow);
    result_.lens = read_json(folder_ / lens_file::kJson);
    if (!same_work(row) || result_.lens.is_null()) return false;
    result_.wall_seconds = row["wall_seconds"];
    result_.cpu_seconds = row["cpu_seconds"];
    result_.peak_mib = row["peak_mib"];
    result_.resumed = row["resumed"];
    if (row["asked_rays"] == programs_.rays) result_.trace = row["trace"];
    result_.reused = true;
    result_.other_build = row["build"] != asked_["build"];
    // The build that made the design stays on record when a ray trace is added to it.
    asked_["build"] = row["build"];
    return true;
  }

  [[nodiscard]] fs::path log(const std::string& name) const {
    return programs_.out / (result_.row.name + "." + name + ".log");
  }

  [[nodiscard]] std::vector<std::string> design_words() const {
    const PaperRow& row = result_.row;
    std::vector<std::string> words = {
        programs_.design.string(),  "design", row.picture, "--out", folder_.string(), "--pixels",
        std::to_string(row.pixels), "--json"};
    words.insert(words.end(), row.options.begin(), row.options.end());
    words.emplace_back(result_.resumed ? "--resume" : "--force");
    return words;
  }

  bool design() {
    const json started = read_json(folder_ / kStarted);
    result_.resumed = same_work(started) && started["build"] == asked_["build"];
    if (!result_.resumed) fs::remove_all(folder_);
    require_writable_folder(folder_);
    write_whole_file(folder_ / kStarted, asked_.dump(2));
    const ChildResult child = run_child(design_words(), log("design-out"), log("design"));
    if (child.exit_code != 0) {
      const bool refused = child.exit_code == kBadInput;
      end(refused ? PaperResult::Status::kRefused : PaperResult::Status::kFailed,
          last_line(content(log("design"))));
      if (refused) fs::remove_all(folder_);
      return false;
    }
    result_.lens = read_json(folder_ / lens_file::kJson);
    // The program's own clock continues from where a resumed design was interrupted.
    result_.wall_seconds =
        std::max(child.wall_seconds, result_.lens["provenance"]["seconds"].get<double>());
    result_.cpu_seconds = child.cpu_seconds;
    result_.peak_mib = child.peak_mib;
    return true;
  }

  void trace() {
    std::vector<std::string> words = {programs_.ray_trace.string(), folder_.string(), "--json",
                                      "--out", (folder_ / "ray_trace.exr").string()};
    if (programs_.rays > 0) {
      words.insert(words.end(), {"--rays", std::to_string(programs_.rays)});
    }
    const ChildResult child = run_child(words, log("trace-out"), log("trace"));
    if (child.exit_code == 0) result_.trace = read_json(log("trace-out"));
  }

  void store() const {
    json row = asked_;
    row["wall_seconds"] = result_.wall_seconds;
    row["cpu_seconds"] = result_.cpu_seconds;
    row["peak_mib"] = result_.peak_mib;
    row["resumed"] = result_.resumed;
    row["asked_rays"] = programs_.rays;
    row["trace"] = result_.trace;
    write_whole_file(folder_ / kRow, row.dump(2));
  }

  const PaperPrograms& programs_;
  fs::path folder_;
  json asked_;
  PaperResult result_;
};

}  // namespace

PaperResult run_row(const PaperRow& row, const PaperPrograms& programs) {
  return RowRun(row, programs).run();
}

}  // namespace lensforge::bench

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/studio/project.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <system_error>
#include <utility>

#include "app/batch/batch_job.h"
#include "app/commands/design_command.h"
#include "app/frame/child_command.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "app/studio/studio_forms.h"
#include "app/view/lens_view.h"
#include "cam/cam.h"
#include "cam/check/check_job.h"
#include "cam/proposal/proposal.h"
#include "cam/report/report_html.h"
#include "core/error.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/io/checkpoint_file.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/lens/lens.h"
#include "core/lens/setup_json.h"
#include "core/optics/picture_blur.h"
#include "core/page/html_page.h"
#include "core/schema/json.h"
#include "core/text/number_text.h"
#include "core/text/words.h"
#include "design/schedule/levels.h"
#include "machine/send.h"
#include "machine/stream/journal.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kRecord = "studio.json";
constexpr const char* kFormat = "lensforge.studio";
/// What the studio keeps for itself; hidden, and served to nobody.
constexpr const char* kKept = ".studio";
constexpr const char* kPicture = "picture.png";
constexpr const char* kPreview = "preview.png";
constexpr const char* kPhoto = "photo";
constexpr const char* kWorkshop = "workshop.toml";
constexpr const char* kLensPrefix = "lens-";
constexpr const char* kCam = "cam";
constexpr const char* kCheck = "check";
constexpr const char* kView = "view.html";
constexpr const char* kEvents = "events.jsonl";

/// Longest side of the picture that a page shows and crops, pixels.
constexpr int kPreviewSide = 1024;
constexpr std::size_t kLongestName = 40;
/// End of the events file that is read for what was said last, bytes.
constexpr std::streamoff kEventsTail = 65536;
constexpr std::size_t kMessages = 6;

/// True for a few letters and digits: an extension.
bool is_word(const std::string& text) {
  constexpr std::size_t kLongest = 5;
  return !text.empty() && text.size() <= kLongest &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789") == std::string::npos;
}

/// Letters, digits and '-' of a title: a folder's name.
std::string name_of(const std::string& title) {
  std::string name;
  for (const char c : title) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80 && std::isalnum(byte) != 0) {
      name += static_cast<char>(std::tolower(byte));
    } else if (!name.empty() && name.back() != '-') {
      name += '-';
    }
  }
  name = name.substr(0, kLongestName);
  while (name.ends_with('-')) name.pop_back();
  return name.empty() ? "picture" : name;
}

/// A folder of that name which does not exist yet.
fs::path free_folder(const fs::path& parent, const std::string& name) {
  fs::path folder = parent / name;
  for (int i = 2; fs::exists(folder); ++i) folder = parent / (name + "-" + std::to_string(i));
  return folder;
}

/// At most `side` pixels on the longer side.
Image fitted(const Image& image, int side) {
  const int longer = std::max(image.columns(), image.rows());
  if (longer <= side) return image;
  const Eigen::Vector2i size = working_size(image.columns(), image.rows(), side);
  return resample(image, size.x(), size.y());
}

std::string modified(const fs::path& file) {
  std::error_code none;
  const auto time = fs::last_write_time(file, none);
  return none ? "0" : std::to_string(std::abs(time.time_since_epoch().count() % 1'000'000'007));
}

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
                                          {lens_file::kError, "Error of display values"},
                                          {lens_file::kSetup, "From the side and from above"}};
constexpr NamedContent kLensFiles[] = {{lens_file::kSurface, "the surface as a mesh, PLY"},
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
json files_of(const fs::path& folder, const std::string& within, const NamedContent (&names)[N],
              const std::string& address) {
  json files = json::array();
  for (const NamedContent& one : names) {
    const fs::path file = folder / within / one.name;
    if (!fs::is_regular_file(file)) continue;
    files.push_back(file_json(file, within + "/" + one.name, one.words, address));
  }
  return files;
}

/// Metrics by their model's name, as in lens.json; those of the lens's own model.
json own_metrics(const json& lens) {
  const json metrics = lens.value("metrics", json::object());
  return metrics.value(lens.value("model", ""), json::object());
}

std::string mae_words(double mae) { return "MAE " + decimal_text(mae, 4); }

}  // namespace

bool Project::is_project(const fs::path& folder) {
  const json record = json_in(folder / kRecord);
  return record.is_object() && record.value("format", "") == kFormat;
}

fs::path Project::create(const fs::path& parent, const std::string& title, std::string_view bytes) {
  const std::string stem = fs::path(title).stem().string();
  fs::path folder = free_folder(parent, name_of(stem));
  const std::string extension = lower_case(fs::path(title).extension().string());
  const bool plain = extension.size() > 1 && is_word(extension.substr(1));
  const std::string original = "original" + (plain ? extension : std::string());
  fs::create_directories(folder / kKept);
  try {
    write_whole_file(folder / original, bytes);
    const LoadedImage loaded = read_image(folder / original);
    write_image(grey_picture(fitted(loaded.image, kPreviewSide)), folder / kPreview);
    const json record{{"format", kFormat},
                      {"version", 1},
                      {"title", stem},
                      {"original", original},
                      {"changes", loaded.changes},
                      {"width", loaded.image.columns()},
                      {"height", loaded.image.rows()},
                      {"settings", json::object()},
                      {"workshop", json::object()},
                      {"current", 0}};
    write_whole_file(folder / kRecord, record.dump(2) + "\n");
  } catch (const InputError& e) {
    fs::remove_all(folder);
    // The name of the file is the studio's own.
    std::string words = e.what();
    const std::string path = (folder / original).string();
    const std::size_t at = words.find(path);
    if (at != std::string::npos) words.replace(at, path.size(), printable_line(title));
    throw InputError(words);
  }
  return folder;
}

Project::Project(fs::path folder, ComputeTurn& turn)
    : folder_(std::move(folder)), turn_(&turn), record_(json_in(folder_ / kRecord)) {
  if (!record_.is_object() || record_.value("format", "") != kFormat) {
    throw InputError((folder_ / kRecord).string() + ": is no project of the studio");
  }
}

void Project::save() const { write_whole_file(folder_ / kRecord, record_.dump(2) + "\n"); }

std::vector<int> Project::versions() const {
  std::vector<int> found;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const std::string name = entry.path().filename().string();
    const std::string prefix = kLensPrefix;
    const std::string digits = name.starts_with(prefix) ? name.substr(prefix.size()) : "";
    const bool number = !digits.empty() && digits.size() < 7 &&
                        std::all_of(digits.begin(), digits.end(),
                                    [](unsigned char c) { return std::isdigit(c) != 0; });
    if (number && fs::is_regular_file(entry.path() / lens_file::kJson)) {
      found.push_back(std::stoi(digits));
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string Project::lens_name() const {
  return kLensPrefix + std::to_string(record_.value("current", 0));
}

int Project::next_version() const {
  int next = record_.value("current", 0) + 1;
  while (fs::exists(folder_ / (kLensPrefix + std::to_string(next)))) ++next;
  return next;
}

void Project::step_version(int by) {
  require_idle();
  const int current = record_.value("current", 0);
  int next = 0;
  for (const int version : versions()) {
    if (by < 0 && version < current) next = version;
    if (by > 0 && version > current && next == 0) next = version;
  }
  if (next == 0) throw InputError(by < 0 ? "there is no earlier lens" : "there is no later lens");
  record_["current"] = next;
  const json kept = record_.value("versions", json::object());
  const json settings = kept.value(std::to_string(next), json());
  if (settings.is_object()) record_["settings"] = settings;
  save();
}

void Project::leave_failed_design() {
  if (!job_ || job_->running() || job_->task().checkpoint.empty()) return;
  const fs::path lens = lens_folder();
  if (fs::exists(lens / lens_file::kJson) || fs::exists(lens / lens_file::kCheckpoint)) return;
  if (job_->state()["status"] != "failed") return;
  // The settings stay: they are to be mended.
  const std::vector<int> all = versions();
  record_["current"] = all.empty() ? 0 : all.back();
  save();
}

void Project::require_idle() const {
  if (computing()) {
    throw InputError(job_->task().step + " is running; wait for its end, or pause it");
  }
}

fs::path Project::move_to(const fs::path& bin) {
  require_idle();
  if (sending()) throw InputError("a program is being sent; end the job first");
  fs::create_directories(bin);
  fs::path place = free_folder(bin, folder_.filename().string());
  fs::rename(folder_, place);
  return place;
}

void Project::require_picture() const {
  if (!fs::is_regular_file(folder_ / kPicture)) {
    throw InputError("there is no picture yet; crop and tone it, or take it as it is");
  }
}

void Project::take_picture(std::string_view bytes) {
  require_idle();
  const fs::path place = folder_ / kPicture;
  if (bytes.empty()) {
    // The whole precision of the original, as the program reads it.
    const LoadedImage loaded = read_image(folder_ / record_.value("original", ""));
    write_image(loaded.image, place);
    record_["size"] = {loaded.image.columns(), loaded.image.rows()};
  } else {
    const fs::path trial = folder_ / kKept / kPicture;
    write_whole_file(trial, bytes);
    const LoadedImage loaded = read_image(trial);
    fs::rename(trial, place);
    record_["size"] = {loaded.image.columns(), loaded.image.rows()};
  }
  save();
}

void Project::take_photo(std::string_view bytes) {
  require_idle();
  const fs::path trial = folder_ / kKept / kPhoto;
  write_whole_file(trial, bytes);
  try {
    read_image(trial);
  } catch (const InputError&) {
    fs::remove(trial);
    throw InputError("the photograph: no picture can be read from it");
  }
  fs::rename(trial, folder_ / kPhoto);
}

void Project::take_settings(const json& changes) {
  json record = record_;
  if (changes.contains("settings")) {
    record["settings"] = changed_settings(record["settings"], changes["settings"]);
  }
  if (changes.contains("workshop")) {
    record["workshop"] = changed_workshop(record["workshop"], changes["workshop"]);
    const fs::path file = folder_ / kWorkshop;
    if (record["workshop"].empty()) {
      fs::remove(file);
    } else {
      write_whole_file(file, workshop_toml(workshop_with(record["workshop"])));
    }
  }
  record_ = std::move(record);
  save();
}

Arguments Project::setting_words(bool of_plan) const {
  BatchStep step{"design", json::object()};
  Arguments words;
  for (const auto& [name, value] : record_["settings"].items()) {
    if (name == "--made-by") continue;
    if (of_plan && !is_plan_option(name)) continue;
    step.set(name.substr(2), value);
  }
  words = step.words();
  const bool shop = fs::is_regular_file(folder_ / kWorkshop);
  if (of_plan ? shop : record_["settings"].value("--made-by", false)) {
    words.insert(words.end(), {"--made-by", shop ? kWorkshop : "default"});
  }
  return words;
}

std::string Project::range_fault() const {
  const fs::path file = lens_folder() / lens_file::kJson;
  const json lens = json_in(file);
  if (!lens.is_object()) return "there is no lens";
  CamOptions cut;
  cut.workshop = workshop_with(record_["workshop"]);
  return tolerance_fault(cut, read_setup(JsonFields(lens, file.string()), lens_folder()));
}

Arguments Project::words_of(const std::string& step, const std::string& format) const {
  Arguments words{step};
  const auto add = [&](const Arguments& more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  if (step == "plan") {
    words.emplace_back(kPicture);
    add(setting_words(true));
  } else if (step == "design") {
    words.emplace_back(kPicture);
    add(setting_words(false));
    add({"--out", kLensPrefix + std::to_string(next_version())});
  } else if (step == "cam") {
    words.push_back(lens_name());
    if (fs::is_regular_file(folder_ / kWorkshop)) add({"--workshop", kWorkshop});
    // The programs that send takes, unless the workshop states its own.
    if (!record_["workshop"].contains("machine.post")) add({"--post", "grbl"});
  } else if (step == kCheck) {
    words.push_back(lens_name());
    add({kPhoto, "--out", lens_name() + "/" + kCheck});
    if (fs::is_regular_file(folder_ / kWorkshop)) add({"--workshop", kWorkshop});
  } else if (step == "view") {
    words.push_back(lens_name());
    add({"--out", lens_name() + "/" + kView});
  } else {
    words.push_back(lens_name());
    add({"--out", lens_name() + "/lens." + format});
  }
  return words;
}

void Project::start(StudioTask task) {
  job_.reset();
  record_["job"] = task.files;
  save();
  job_ = std::make_unique<StudioJob>(folder_, std::move(task), turn_);
}

void Project::run(const json& request) {
  const std::string step = request.value("step", "");
  static const std::vector<std::string> kSteps{"plan", "design", "cam", "view", "export", kCheck};
  if (std::find(kSteps.begin(), kSteps.end(), step) == kSteps.end()) {
    throw InputError("step " + json(step).dump() +
                     ": must be plan, design, cam, view, export or check");
  }
  const std::string format = request.value("format", "step");
  if (!is_word(format)) {
    throw InputError("format " + json(format).dump() + ": must be a file's extension; step works");
  }
  require_idle();
  if (step == "plan" || step == "design") {
    require_picture();
  } else if (record_.value("current", 0) == 0) {
    throw InputError(step + ": there is no lens yet; design one first");
  } else if (step == kCheck && !fs::is_regular_file(folder_ / kPhoto)) {
    throw InputError("there is no photograph yet; choose one");
  }
  const std::string kept = std::string(kKept) + "/";
  StudioTask task{step, words_of(step, format), kept + step};
  if (step == "design") {
    const int version = next_version();
    record_["versions"][std::to_string(version)] = record_["settings"];
    record_["current"] = version;
    task.files = kept + lens_name();
    task.checkpoint = lens_folder() / lens_file::kCheckpoint;
  }
  start(std::move(task));
}

void Project::pause() {
  if (!computing()) throw InputError("nothing is running");
  job_->stop();
}

void Project::resume() {
  require_idle();
  const std::string files = record_.value("job", "");
  const json record = files.empty() ? json() : json_in(folder_ / (files + ".json"));
  if (!record.is_object()) throw InputError("there is nothing to go on with");
  StudioTask task{record.value("step", ""), record.value("words", Arguments()), files};
  if (task.step == "design") {
    const auto out = std::find(task.words.begin(), task.words.end(), "--out");
    const std::string prefix = kLensPrefix;
    record_["current"] = std::stoi((out + 1)->substr(prefix.size()));
    task.checkpoint = lens_folder() / lens_file::kCheckpoint;
    const bool begun = fs::exists(task.checkpoint) || fs::exists(lens_folder() / lens_file::kJson);
    const bool said =
        std::find(task.words.begin(), task.words.end(), "--resume") != task.words.end();
    if (begun && !said) task.words.emplace_back("--resume");
  }
  start(std::move(task));
}

Arguments Project::send_words(const json& request) const {
  const std::string program = request.value("program", "");
  const std::string port = request.value("port", "");
  const std::string file = lens_name() + "/" + kCam + "/" + program;
  const bool plain = program.ends_with(".ngc") && program.find('/') == std::string::npos &&
                     !program.starts_with('.');
  if (!plain || !fs::is_regular_file(folder_ / file)) {
    throw InputError("program " + json(program).dump() + ": is none of this lens");
  }
  Arguments words{"send",     file,
                  "--port",   port.empty() ? "sim:grbl@1x" : port,
                  "--events", std::string(kKept) + "/" + kEvents,
                  "--keys"};
  const std::string how = request.value("how", "");
  if (how == "resume") words.insert(words.end(), {"--resume", "--yes"});
  // A simulated mill holds nothing that an earlier run has cut.
  if (how == "restart" || (how.empty() && port.starts_with("sim:")))
    words.emplace_back("--restart");
  return words;
}

void Project::send(const json& request) {
  if (sending()) throw InputError("a program is being sent; end it first");
  StudioTask task{"send", send_words(request), std::string(kKept) + "/send"};
  cut_.reset();
  fs::remove(folder_ / kKept / kEvents);
  cut_ = std::make_unique<StudioJob>(folder_, std::move(task), nullptr);
}

void Project::press(const json& request) {
  if (!sending()) throw InputError("no program is being sent");
  const std::string key = request.value("key", "");
  if (key.size() != 1) throw InputError("key " + json(key).dump() + ": must be one character");
  cut_->press(key[0]);
}

fs::path Project::file(std::string_view path) const {
  fs::path inside;
  for (const std::string_view part : split(path, '/')) {
    if (part.empty() || part.starts_with('.') || part.find('\\') != std::string_view::npos) {
      throw NotFound{"no such file"};
    }
    inside /= part;
  }
  std::error_code none;
  fs::path whole = fs::canonical(folder_ / inside, none);
  if (none || !fs::is_regular_file(whole)) throw NotFound{"no such file"};
  const fs::path relative = whole.lexically_relative(fs::canonical(folder_));
  // A link may lead out of the folder.
  if (relative.empty() || *relative.begin() == "..") throw NotFound{"no such file"};
  return whole;
}

std::string Project::live_picture(bool error) const {
  return job_ ? job_->live_picture(error) : std::string();
}

fs::path Project::relief() const {
  fs::path file = folder_ / kKept / (lens_name() + "-relief.png");
  if (!fs::is_regular_file(lens_folder() / lens_file::kJson)) throw NotFound{"no lens yet"};
  if (!fs::exists(file)) {
    const Lens lens = read_lens(lens_folder());
    write_image(relief_picture(relief_of(lens), lens.setup.lens_size), file);
  }
  return file;
}

json Project::picture_json(const std::string& address) const {
  const fs::path picture = folder_ / kPicture;
  const bool ready = fs::is_regular_file(picture);
  const json size = record_.value("size", json{0, 0});
  return {{"original", record_.value("original", "")},
          {"title", record_.value("title", "")},
          {"preview", address + "files/" + kPreview},
          {"ready", ready},
          {"url", ready ? json(address + "files/" + kPicture + "?" + modified(picture)) : json()},
          {"width", ready ? size[0] : record_["width"]},
          {"height", ready ? size[1] : record_["height"]},
          {"changes", record_.value("changes", json::array())}};
}

json Project::light_json() {
  json asked{record_["settings"], record_["workshop"], record_.value("size", json())};
  if (asked != asked_) {
    light_ = computed_light();
    asked_ = std::move(asked);
  }
  return light_;
}

json Project::computed_light() const {
  if (!fs::is_regular_file(folder_ / kPicture)) return nullptr;
  try {
    DesignSettings settings;
    OptionSet options("design", "");
    options.fields(settings);
    Arguments words{kPicture, "--out", "lens"};
    const Arguments more = setting_words(false);
    words.insert(words.end(), more.begin(), more.end());
    // The workshop's file is read below, from its values.
    const auto made = std::find(words.begin(), words.end(), "--made-by");
    if (made != words.end()) words.erase(made, made + 2);
    options.parse(words);
    ProposalWish wish;
    wish.design = settings.design;
    wish.cut.workshop = workshop_with(record_["workshop"]);
    const Eigen::Vector2i picture(record_["size"][0].get<int>(), record_["size"][1].get<int>());
    return wish_json(wish, picture);
  } catch (const InputError& e) {
    return {{"error", e.what()}};
  }
}

json Project::commands_json() const {
  json commands = json::object();
  const bool lens = record_.value("current", 0) > 0;
  try {
    for (const char* step : {"plan", "design"}) commands[step] = command_text(words_of(step, ""));
    for (const char* step : {"cam", "view", "export", kCheck}) {
      if (lens) commands[step] = command_text(words_of(step, "step"));
    }
  } catch (const InputError&) {
    // Settings that contradict each other are named by light_json().
  }
  if (lens) {
    commands["send"] =
        "lensforge send " + lens_name() + "/" + kCam + "/finish.ngc --port " + "sim:grbl@1x";
  }
  return commands;
}

json Project::plan_json() const {
  const json plan = json_in(folder_ / kKept / "plan.out");
  if (!plan.is_object() || !plan.contains("proposals")) return nullptr;
  json proposals = plan["proposals"];
  for (json& one : proposals) {
    one["settings"] = json::object();
    for (const auto& [name, value] : one["options"].items()) {
      if (is_form_option(name)) one["settings"][name] = value;
    }
  }
  return {{"proposals", proposals}};
}

json Project::lens_json(const std::string& address) const {
  const std::string name = lens_name();
  const json lens = json_in(lens_folder() / lens_file::kJson);
  if (!lens.is_object()) return nullptr;
  const json result = json_in(folder_ / kKept / (name + ".out"));
  json words = json::array();
  const json metrics = own_metrics(lens);
  const bool waves = result.is_object() && result.contains("waves");
  const json shown = waves ? result["waves"] : metrics;
  const double mae = shown.value("mae", 0.0);
  words.push_back(mae_words(mae) + (waves ? " by waves" : " by rays") + ", PSNR " +
                  decimal_text(shown.value("psnr", 0.0), 1) + " dB, SSIM " +
                  decimal_text(shown.value("ssim", 0.0), 3));
  if (waves) words.push_back(mae_words(metrics.value("mae", 0.0)) + " by rays");
  if (result.is_object() && result.contains("made")) {
    words.push_back(mae_words(result["made"].value("mae", 0.0)) +
                    " as made in the workshop, by rays");
  }
  const json provenance = lens.value("provenance", json::object());
  words.push_back("designed in " + duration_text(provenance.value("seconds", 0.0) / 60.0));
  const fs::path view = lens_folder() / kView;
  return {{"version", record_["current"]},
          {"folder", name},
          {"mae", mae},
          {"status", provenance.value("status", "")},
          {"words", words},
          {"pictures", files_of(folder_, name, kLensPictures, address)},
          {"files", files_of(folder_, name, kLensFiles, address)},
          {"view", fs::exists(view)
                       ? json(address + "files/" + name + "/" + kView + "?" + modified(view))
                       : json()}};
}

json Project::part_json(const std::string& address) const {
  const std::string within = lens_name() + "/" + kCam;
  const fs::path file = folder_ / within / cam_file::kReport;
  const json report = json_in(file);
  if (!report.is_object() || !report.contains("surfaces")) return nullptr;
  const bool waves = report.contains("waves");
  const json& by = waves ? report["waves"] : report;
  json range = nullptr;
  if (const json t = report.value("tolerances", json()); t.is_object() && t.contains("mae")) {
    range = {{"p10", t["mae"]["p10"]},
             {"p90", t["mae"]["p90"]},
             {"median", t["mae"]["median"]},
             {"words", t.value("words", "")}};
  }
  json programs = json::array();
  json files = json::array();
  json operations = json::array();
  for (const json& one : report.value("operations", json::array())) {
    const std::string program = one.value("file", "");
    const std::string name = one.value("name", "");
    operations.push_back({{"name", name}, {"minutes", one.value("minutes", 0.0)}});
    // Several operations may share a program.
    if (program.empty() || std::find(programs.begin(), programs.end(), program) != programs.end()) {
      continue;
    }
    programs.push_back(program);
    files.push_back(file_json(folder_ / within / program, (fs::path(within) / program).string(),
                              "program: " + name, address));
  }
  for (json& other : files_of(folder_, within, kPartFiles, address)) {
    files.push_back(std::move(other));
  }
  const fs::path workshop = folder_ / kWorkshop;
  const bool current =
      !fs::exists(workshop) || fs::last_write_time(workshop) <= fs::last_write_time(file);
  const json verdict = report.value("verdict", json::object());
  std::string missed;
  for (const json& check : verdict.value("checks", json::array())) {
    const bool counts = !check.value("pass", true) && !check.value("advice", false);
    if (counts) missed = with_word(std::move(missed), check.value("words", ""));
  }
  const json& last = by["surfaces"].back();
  return {{"mae", last.value("mae", 0.0)},
          {"model", waves ? "waves" : "rays"},
          {"range", range},
          {"range_words", "No range: cam " + range_fault() + "."},
          {"leakage", by["leakage"].value("share", 0.0)},
          {"contrast", by["leakage"].value("contrast", json())},
          {"minutes", report.value("minutes", 0.0)},
          {"operations", operations},
          {"verdict", missed.empty() ? "All limits are kept." : "Limits missed: " + missed + "."},
          {"pass", verdict.value("pass", false)},
          {"current", current},
          {"warnings", report.value("warnings", json::array())},
          {"pictures", files_of(folder_, within, kPartPictures, address)},
          {"report", address + "files/" + within + "/" + cam_file::kPage + "?" + modified(file)},
          {"files", files},
          {"programs", programs}};
}

json Project::check_json(const std::string& address) const {
  const std::string within = lens_name() + "/" + kCheck;
  const fs::path file = folder_ / within / check_file::kJson;
  const json check = json_in(file);
  if (!check.is_object()) return nullptr;
  json more = json::array();
  const json causes = check.value("causes", json::array());
  for (std::size_t k = 1; k < causes.size(); ++k) more.push_back(causes[k].value("words", ""));
  return {
      {"verdict", check.value("verdict", "")},
      {"more", more},
      {"pictures", files_of(folder_, within, kCheckPictures, address)},
      {"report", address + "files/" + within + "/" + check_file::kReport + "?" + modified(file)}};
}

json Project::job_json(const std::string& address) const {
  const std::string files = record_.value("job", "");
  json job = job_ ? job_->state() : files.empty() ? json() : earlier_job(folder_, files);
  if (job.is_object() && job["live"].is_object()) {
    const std::string number = std::to_string(job["live"].value("number", 0));
    job["live"]["picture"] = address + "live.png?" + number;
    job["live"]["error"] = address + "live-error.png?" + number;
  }
  return job;
}

/// Where the tool is over the lens, shares from its upper left corner as seen by the cutter; null
/// if that is not known. @param position  in the machine's coordinates.
json Project::tool_json(const json& position, const fs::path& program) const {
  std::ifstream stream(folder_ / kKept / kEvents);
  std::string first;
  std::getline(stream, first);
  const json begin = json::parse(first, nullptr, false);
  const json lens = json_in(folder_ / program.parent_path().parent_path() / lens_file::kJson);
  if (!position.is_array() || !begin.is_object() || !begin.contains("origin") ||
      !lens.is_object()) {
    return nullptr;
  }
  const auto share = [&](std::size_t k) {
    return (position[k].get<double>() - begin["origin"][k].get<double>()) /
           lens["lens_size"][k].get<double>();
  };
  return {share(0), 1.0 - share(1)};
}

namespace {

/// True if a job of this program was begun and not ended: `send` wants to be told how to go on.
bool is_unfinished(const fs::path& program) {
  try {
    return !read_journal(SendOptions().journal_of(program)).finished;
  } catch (const InputError&) {
    return false;  // There is none.
  }
}

}  // namespace

json Project::cut_json(const std::string& address) const {
  if (!cut_) return nullptr;
  json cut = cut_->state();
  const Arguments& words = cut_->task().words;  // send PROGRAM --port PORT
  cut["program"] = fs::path(words[1]).filename().string();
  cut["port"] = words[3];
  cut["under"] = address + "relief.png?" + lens_name();
  if (cut["status"] == "paused") cut["status"] = "interrupted";
  std::ifstream stream(folder_ / kKept / kEvents, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream ? static_cast<std::streamoff>(stream.tellg()) : 0;
  stream.seekg(std::max<std::streamoff>(0, size - kEventsTail));
  std::vector<std::string> messages;
  json last = json::object();
  for (std::string line; std::getline(stream, line);) {
    json event = json::parse(line, nullptr, false);
    if (!event.is_object()) continue;  // The first may be a part of one.
    if (event.contains("message")) messages.push_back(event["message"]);
    last = std::move(event);
  }
  for (const char* key :
       {"percent", "left", "state", "position", "feed", "rpm", "overrides", "line"}) {
    cut[key] = last.value(key, json());
  }
  cut["tool"] = tool_json(cut["position"], words[1]);
  const bool simulated = words[3].starts_with("sim:");
  cut["unfinished"] = !simulated && !sending() && is_unfinished(folder_ / words[1]);
  const std::size_t from = messages.size() - std::min(messages.size(), kMessages);
  cut["messages"] = std::vector<std::string>(messages.begin() + static_cast<std::ptrdiff_t>(from),
                                             messages.end());
  return cut;
}

json Project::state(const std::string& address) {
  leave_failed_design();
  const std::vector<int> all = versions();
  json list = json::array();
  for (const int version : all) {
    const json lens = json_in(folder_ / (kLensPrefix + std::to_string(version)) / lens_file::kJson);
    const json size = lens.value("lens_size", json{0.0, 0.0});
    list.push_back({{"version", version},
                    {"words", mae_words(own_metrics(lens).value("mae", 0.0)) + " by rays, " +
                                  number_text(size[0].get<double>()) + " mm wide"}});
  }
  const int current = record_.value("current", 0);
  const bool idle = !computing();
  json state{{"name", folder_.filename().string()},
             {"picture", picture_json(address)},
             {"settings", record_["settings"]},
             {"workshop", record_["workshop"]},
             {"light", light_json()},
             {"commands", commands_json()},
             {"plan", plan_json()},
             {"lens", lens_json(address)},
             {"versions", list},
             {"can_undo", idle && !all.empty() && current > all.front()},
             {"can_redo", idle && !all.empty() && current < all.back()},
             {"part", part_json(address)},
             {"photo", fs::is_regular_file(folder_ / kPhoto)},
             {"check", check_json(address)},
             {"job", job_json(address)},
             {"cut", cut_json(address)}};
  constexpr std::size_t kExact = std::size_t{1} << 53U;  // Of JavaScript's numbers.
  state["number"] = std::hash<std::string>()(state.dump()) % kExact;
  return state;
}

std::string Project::standing() const {
  if (sending()) return "is being cut";
  if (computing()) return job_->task().step + " is running";
  const json part = part_json("");
  if (part.is_object()) {
    return "part: " + mae_words(part["mae"]) + ", " + duration_text(part["minutes"]);
  }
  const json lens = lens_json("");
  if (lens.is_object()) return "lens: " + mae_words(lens["mae"]);
  return fs::is_regular_file(folder_ / kPicture) ? "picture chosen" : "a picture to crop";
}

json Project::summary(const std::string& address) const {
  const bool ready = fs::is_regular_file(folder_ / kPicture);
  const char* const shown = ready ? kPicture : kPreview;
  return {{"name", folder_.filename().string()},
          {"picture", address + "files/" + shown + "?" + modified(folder_ / shown)},
          {"words", standing()},
          {"running", computing() || sending()}};
}

}  // namespace lensforge::app

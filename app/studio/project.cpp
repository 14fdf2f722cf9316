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
#include <variant>

#include "app/batch/batch_job.h"
#include "app/commands/design_command.h"
#include "app/frame/child_command.h"
#include "app/frame/common_output.h"
#include "app/frame/option_set.h"
#include "app/studio/studio_forms.h"
#include "app/view/lens_view.h"
#include "cam/cam.h"
#include "cam/milled/mould.h"
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
#include "core/optics/front.h"
#include "core/optics/picture_blur.h"
#include "core/page/drawings.h"
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
using project_file::kCheck;
using project_file::kView;
using project_file::kWorkshop;

constexpr const char* kRecord = "studio.json";
constexpr const char* kFormat = "lensforge.studio";
/// What the studio keeps for itself; hidden, and served to nobody.
constexpr const char* kKept = ".studio";
constexpr const char* kPicture = "picture.png";
constexpr const char* kPreview = "preview.png";
/// The second picture's key in the record, and what stands before the names of its files.
constexpr const char* kSecond = "second";
constexpr const char* kSecondPrefix = "second-";
constexpr const char* kNoSecond = "--second: there is no second picture yet; choose one";
constexpr const char* kPhoto = "photo";
constexpr const char* kLensPrefix = "lens-";
/// Steps that are commands of these names, and that of a front's setup.
constexpr const char* kCam = "cam";
constexpr const char* kFrontCam = "cam-front";
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

}  // namespace

bool Project::is_project(const fs::path& folder) {
  const json record = json_in(folder / kRecord);
  return record.is_object() && record.value("format", "") == kFormat;
}

namespace {

/// Keeps a picture as it came, and what a page shows of it. @param prefix  before the files' names.
/// @param title  of the file that it was. @return what a record has of it. @throw InputError that
/// names the title if no picture can be read; then nothing is kept.
json keep_original(const fs::path& folder, const std::string& prefix, const std::string& title,
                   std::string_view bytes) {
  const std::string extension = lower_case(fs::path(title).extension().string());
  const bool plain = extension.size() > 1 && is_word(extension.substr(1));
  const std::string original = prefix + "original" + (plain ? extension : std::string());
  const fs::path trial = folder / kKept / original;
  write_whole_file(trial, bytes);
  try {
    const LoadedImage loaded = read_image(trial);
    write_image(grey_picture(fitted(loaded.image, kPreviewSide)), folder / (prefix + kPreview));
    fs::rename(trial, folder / original);
    return {{"title", fs::path(title).stem().string()},
            {"original", original},
            {"changes", loaded.changes},
            {"width", loaded.image.columns()},
            {"height", loaded.image.rows()}};
  } catch (const InputError& e) {
    fs::remove(trial);
    // The name of the file is the studio's own.
    std::string words = e.what();
    const std::size_t at = words.find(trial.string());
    if (at != std::string::npos) words.replace(at, trial.string().size(), printable_line(title));
    throw InputError(words);
  }
}

/// Takes a PNG, or the original if it is empty, as the picture that designs get.
void take_as_picture(const fs::path& folder, const std::string& prefix, std::string_view bytes,
                     json& record) {
  const fs::path place = folder / (prefix + kPicture);
  const fs::path trial = folder / kKept / kPicture;
  if (!bytes.empty()) write_whole_file(trial, bytes);
  const LoadedImage loaded =
      read_image(bytes.empty() ? folder / record.value("original", "") : trial);
  if (bytes.empty()) {
    write_image(loaded.image, place);  // The whole precision of the original.
  } else {
    fs::rename(trial, place);
  }
  record["size"] = {loaded.image.columns(), loaded.image.rows()};
}

}  // namespace

fs::path Project::create(const fs::path& parent, const std::string& title, std::string_view bytes) {
  fs::path folder = free_folder(parent, name_of(fs::path(title).stem().string()));
  fs::create_directories(folder / kKept);
  try {
    json record = keep_original(folder, "", title, bytes);
    record.update({{"format", kFormat},
                   {"version", 1},
                   {"settings", json::object()},
                   {"workshop", json::object()},
                   {"current", 0}});
    write_whole_file(folder / kRecord, record.dump(2) + "\n");
  } catch (const InputError&) {
    fs::remove_all(folder);
    throw;
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
  take_as_picture(folder_, "", bytes, record_);
  save();
}

void Project::take_second(const std::string& title, std::string_view bytes) {
  require_idle();
  json second = keep_original(folder_, kSecondPrefix, title, bytes);
  take_as_picture(folder_, kSecondPrefix, "", second);
  const std::string earlier = has_second() ? record_[kSecond].value("original", "") : "";
  if (!earlier.empty() && earlier != second["original"]) fs::remove(folder_ / earlier);
  record_[kSecond] = std::move(second);
  record_["settings"]["--second"] = true;
  save();
}

void Project::take_second_picture(std::string_view bytes) {
  require_idle();
  if (!has_second()) throw InputError(kNoSecond);
  take_as_picture(folder_, kSecondPrefix, bytes, record_[kSecond]);
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
    if (record["settings"].value("--second", false) && !has_second()) throw InputError(kNoSecond);
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
    if (is_flag_for_file(name)) continue;
    if (of_plan && !is_plan_option(name)) continue;
    step.set(name.substr(2), value);
  }
  words = step.words();
  const bool shop = fs::is_regular_file(folder_ / kWorkshop);
  if (of_plan ? shop : record_["settings"].value("--made-by", false)) {
    words.insert(words.end(), {"--made-by", shop ? kWorkshop : "default"});
  }
  if (!of_plan && record_["settings"].value("--second", false)) {
    words.insert(words.end(), {"--second", std::string(kSecondPrefix) + kPicture});
  }
  return words;
}

const OpticalSetup* Project::lens_setup() {
  const fs::path file = lens_folder() / lens_file::kJson;
  const std::string read = lens_name() + " " + modified(file);
  if (read != setup_read_) {
    setup_.reset();
    const json lens = json_in(file);
    setup_read_ = read;
    try {
      if (lens.is_object()) setup_ = read_setup(JsonFields(lens, file.string()), lens_folder());
    } catch (const InputError&) {
      // The commands that read the lens say what is wrong with it.
    }
  }
  return setup_ ? &*setup_ : nullptr;
}

namespace {

bool is_front_cut(const OpticalSetup& setup) {
  return setup.front && std::holds_alternative<HeightFront>(*setup.front);
}

}  // namespace

double Project::frame_margin(const OpticalSetup& setup) {
  json asked{setup_read_, record_["workshop"]};
  if (asked != margin_asked_) {
    CamOptions cut;
    cut.workshop = workshop_with(record_["workshop"]);
    frame_margin_ = std::max(cut.workshop.stock.margin, margin_for_frame(cut, setup));
    margin_asked_ = std::move(asked);
  }
  return frame_margin_;
}

Arguments Project::setup_words(CutFace face, const OpticalSetup& setup) {
  Arguments words{"--z-zero", "table"};
  if (face == CutFace::kFront) words = {"--face", "front"};
  if (!record_["workshop"].contains("stock.margin")) {
    words.insert(words.end(), {"--margin", number_text(frame_margin(setup)) + "mm"});
  }
  // Tabs would hang in the air: the lens is sawn out of its frame.
  if (face == CutFace::kBack && setup.outline) {
    words.insert(words.end(), {"--cut-outline", "never"});
  }
  return words;
}

Arguments Project::cut_words(CutFace face) {
  Arguments words{kCam, lens_name()};
  const auto add = [&](const Arguments& more) {
    words.insert(words.end(), more.begin(), more.end());
  };
  if (fs::is_regular_file(folder_ / kWorkshop)) add({"--workshop", kWorkshop});
  // The programs that send takes, unless the workshop states its own.
  const json& shop = record_["workshop"];
  if (!shop.contains("machine.post")) add({"--post", "grbl"});
  const OpticalSetup* const setup = lens_setup();
  if (setup != nullptr && is_front_cut(*setup)) {
    add(setup_words(face, *setup));
  } else if (face == CutFace::kFront) {
    throw InputError("the front of this lens is flat, as the blank's: there is one setup");
  }
  return words;
}

Arguments Project::words_of(const std::string& step, const std::string& format) {
  if (step == kCam) return cut_words(CutFace::kBack);
  if (step == kFrontCam) return cut_words(CutFace::kFront);
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
  static const std::vector<std::string> kSteps{"plan", "design", kFrontCam, kCam,
                                               "view", "export", kCheck};
  if (std::find(kSteps.begin(), kSteps.end(), step) == kSteps.end()) {
    throw InputError("step " + json(step).dump() +
                     ": must be plan, design, cam-front, cam, view, export or check");
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
  const std::string of_front = std::string(lens_file::kFrontCut) + "/";
  const bool front = program.starts_with(of_front);
  const std::string name = front ? program.substr(of_front.size()) : program;
  const std::string file =
      lens_name() + "/" + cut_folder(front ? CutFace::kFront : CutFace::kBack) + "/" + name;
  const bool plain =
      name.ends_with(".ngc") && name.find('/') == std::string::npos && !name.starts_with('.');
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

std::string Project::live_picture(std::string LiveState::*picture) const {
  return job_ ? job_->live_picture(picture) : std::string();
}

fs::path Project::relief(CutFace face) const {
  const bool front = face == CutFace::kFront;
  fs::path file = folder_ / kKept / (lens_name() + "-" + (front ? kFrontRelief : kRelief));
  if (!fs::is_regular_file(lens_folder() / lens_file::kJson)) throw NotFound{"no lens yet"};
  if (!fs::exists(file)) {
    Lens lens = read_lens(lens_folder());
    if (front && !is_front_cut(lens.setup)) throw NotFound{"no shaped front"};
    if (front) lens = front_lens(lens, 0.0);
    write_image(relief_picture(relief_of(lens), lens.setup.lens_size), file);
  }
  return file;
}

json Project::picture_json(const std::string& prefix, const json& record,
                           const std::string& address) const {
  const std::string name = prefix + kPicture;
  const fs::path picture = folder_ / name;
  const std::string preview = prefix + kPreview;
  const bool ready = fs::is_regular_file(picture);
  const json size = record.value("size", json{0, 0});
  return {{"original", record.value("original", "")},
          {"title", record.value("title", "")},
          {"preview", address + "files/" + preview + "?" + modified(folder_ / preview)},
          {"ready", ready},
          {"url", ready ? json(address + "files/" + name + "?" + modified(picture)) : json()},
          {"width", ready ? size[0] : record["width"]},
          {"height", ready ? size[1] : record["height"]},
          {"changes", record.value("changes", json::array())}};
}

json Project::light_json() {
  json asked{record_["settings"], record_["workshop"], record_.value("size", json()),
             record_.value(kSecond, json())};
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
    if (record_["settings"].value("--made-by", false)) {
      wish.design.made_by = made_by(wish.cut, settings.robust);
    }
    if (!settings.design.second.file.empty()) {
      // Only its size counts here.
      const json& size = record_[kSecond]["size"];
      wish.design.second.picture =
          std::make_shared<const Image>(size[0].get<int>(), size[1].get<int>(), 1.0F);
    }
    const Eigen::Vector2i picture(record_["size"][0].get<int>(), record_["size"][1].get<int>());
    return wish_json(wish, picture);
  } catch (const InputError& e) {
    return {{"error", e.what()}};
  }
}

json Project::commands_json() {
  json commands = json::object();
  const bool lens = record_.value("current", 0) > 0;
  try {
    for (const char* step : {"plan", "design"}) commands[step] = command_text(words_of(step, ""));
    for (const char* step : {kCam, "view", "export", kCheck}) {
      if (lens) commands[step] = command_text(words_of(step, "step"));
    }
    if (const OpticalSetup* const setup = lens_setup(); setup != nullptr && is_front_cut(*setup)) {
      commands[kFrontCam] = command_text(words_of(kFrontCam, ""));
    }
  } catch (const InputError&) {
    // Settings that contradict each other are named by light_json().
  }
  if (lens) {
    commands["send"] =
        "lensforge send " + lens_name() + "/" + lens_file::kCut + "/finish.ngc --port sim:grbl@1x";
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
  json lens = lens_results({folder_, lens_name(), address},
                           json_in(folder_ / kKept / (lens_name() + ".out")));
  if (lens.is_object()) lens["version"] = record_["current"];
  return lens;
}

json Project::part_json(CutFace face, const std::string& address) {
  const OpticalSetup* const setup = lens_setup();
  if (setup == nullptr) return nullptr;
  return cut_results({folder_, lens_name(), address}, face, *setup,
                     workshop_with(record_["workshop"]));
}

json Project::job_json(const std::string& address) const {
  const std::string files = record_.value("job", "");
  json job = job_ ? job_->state() : files.empty() ? json() : earlier_job(folder_, files);
  if (job.is_object() && job["live"].is_object()) {
    const std::string number = std::to_string(job["live"].value("number", 0));
    job["live"]["picture"] = address + "live.png?" + number;
    job["live"]["error"] = address + "live-error.png?" + number;
    if (job["live"].value("two_screens", false)) {
      job["live"]["second"] = address + "live-second.png?" + number;
    }
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
  const fs::path program = words[1];
  const bool front = program.parent_path().filename() == lens_file::kFrontCut;
  const std::string name = program.filename().string();
  cut["program"] = front ? std::string(lens_file::kFrontCut) + "/" + name : name;
  cut["port"] = words[3];
  cut["under"] = address + (front ? kFrontRelief : kRelief) + "?" + lens_name();
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
  cut["tool"] = tool_json(cut["position"], program);
  const bool simulated = words[3].starts_with("sim:");
  cut["unfinished"] = !simulated && !sending() && is_unfinished(folder_ / program);
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
  json state{
      {"name", folder_.filename().string()},
      {"picture", picture_json("", record_, address)},
      {"second", has_second() ? picture_json(kSecondPrefix, record_[kSecond], address) : json()},
      {"settings", record_["settings"]},
      {"workshop", record_["workshop"]},
      {"light", light_json()},
      {"commands", commands_json()},
      {"plan", plan_json()},
      {"lens", lens_json(address)},
      {"front", part_json(CutFace::kFront, address)},
      {"versions", list},
      {"can_undo", idle && !all.empty() && current > all.front()},
      {"can_redo", idle && !all.empty() && current < all.back()},
      {"part", part_json(CutFace::kBack, address)},
      {"photo", fs::is_regular_file(folder_ / kPhoto)},
      {"check", check_results({folder_, lens_name(), address})},
      {"job", job_json(address)},
      {"cut", cut_json(address)}};
  constexpr std::size_t kExact = std::size_t{1} << 53U;  // Of JavaScript's numbers.
  state["number"] = std::hash<std::string>()(state.dump()) % kExact;
  return state;
}

std::string Project::standing() {
  if (sending()) return "is being cut";
  if (computing()) return job_->task().step + " is running";
  const json part = part_json(CutFace::kBack, "");
  if (part.is_object()) {
    return "part: " + mae_words(part["mae"]) + ", " + duration_text(part["minutes"]);
  }
  const json lens = lens_json("");
  if (lens.is_object()) return "lens: " + mae_words(lens["mae"]);
  return fs::is_regular_file(folder_ / kPicture) ? "picture chosen" : "a picture to crop";
}

json Project::summary(const std::string& address) {
  const bool ready = fs::is_regular_file(folder_ / kPicture);
  const char* const shown = ready ? kPicture : kPreview;
  return {{"name", folder_.filename().string()},
          {"picture", address + "files/" + shown + "?" + modified(folder_ / shown)},
          {"words", standing()},
          {"running", computing() || sending()}};
}

}  // namespace lensforge::app

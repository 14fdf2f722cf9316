// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/option_set.h"
#include "app/studio/project.h"
#include "app/studio/results.h"
#include "app/studio/studio_forms.h"
#include "app/studio/studio_job.h"
#include "app/view/loopback_server.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/io/lens_folder.h"
#include "core/page/html_page.h"
#include "core/schema/json.h"
#include "core/text/version.h"
#include "core/text/words.h"
#include "studio_files.h"

namespace lensforge::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* kKeyFile = ".key";
/// Folder of removed projects.
constexpr const char* kRemoved = ".removed";
/// A photograph of 100 megapixels, and a TIFF of 50.
constexpr std::size_t kMaxBody = 200'000'000;
/// A program of some million lines.
constexpr std::uintmax_t kMaxFile = 2'000'000'000;
constexpr unsigned kOk = 200;
constexpr unsigned kRefused = 400;
constexpr unsigned kForbidden = 403;
constexpr unsigned kMissing = 404;
constexpr unsigned kBroken = 500;

/// The key of a folder's studio: 128 bits, for its owner alone.
std::string key_of(const fs::path& folder) {
  const fs::path file = folder / kKeyFile;
  std::ifstream stream(file);
  std::string key(std::istreambuf_iterator<char>(stream), {});
  constexpr std::size_t kDigits = 32;
  if (key.size() == kDigits) return key;
  std::random_device random;  // The system's, not a sequence.
  constexpr std::string_view kHex = "0123456789abcdef";
  key.clear();
  for (std::size_t i = 0; i < kDigits; ++i) key += kHex[random() % kHex.size()];
  write_whole_file(file, "");
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  std::ofstream(file) << key;
  return key;
}

/// Compares in a time that does not depend on where the texts differ.
bool same_key(std::string_view a, std::string_view b) {
  unsigned difference = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  }
  return difference == 0U;
}

/// Value of "name=value" in a list; empty if there is none.
std::string_view value_in(std::string_view list, char separator, std::string_view name) {
  for (std::string_view part : split(list, separator)) {
    while (part.starts_with(' ')) part.remove_prefix(1);
    if (part.size() > name.size() && part.starts_with(name) && part[name.size()] == '=') {
      return part.substr(name.size() + 1);
    }
  }
  return {};
}

/// Text with its %XX escapes resolved (RFC 3986); '+' stays.
std::string unescaped(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    int byte = 0;
    const bool escape = text[i] == '%' && i + 2 < text.size();
    const char* const end = text.data() + i + 3;
    if (escape && std::from_chars(text.data() + i + 1, end, byte, 16).ptr == end) {
      plain += static_cast<char>(byte);
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

const char* type_of(const fs::path& file) {
  static constexpr std::array<std::pair<std::string_view, const char*>, 4> kShown{
      {{".html", "text/html; charset=utf-8"},
       {".png", "image/png"},
       {".svg", "image/svg+xml"},
       {".json", "application/json"}}};
  const std::string extension = file.extension().string();
  for (const auto& [end, type] : kShown) {
    if (extension == end) return type;
  }
  return nullptr;
}

LoopbackAnswer answer_with(std::string type, std::string bytes, unsigned status = kOk) {
  LoopbackAnswer answer{std::move(type)};
  answer.bytes = std::make_shared<const std::string>(std::move(bytes));
  answer.status = status;
  return answer;
}

LoopbackAnswer json_answer(const json& value, unsigned status = kOk) {
  const auto replace = json::error_handler_t::replace;
  return answer_with("application/json", value.dump(-1, ' ', false, replace), status);
}

std::string studio_page() {
  PageContent content;
  content.title = "lensforge studio";
  content.head =
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src 'self' "
      "blob: data:; connect-src 'self'; style-src 'unsafe-inline'; script-src "
      "'unsafe-inline'\">\n"
      "<link rel=\"icon\" href=\"data:,\">\n" +
      element("style", "", "\n" + std::string(studio_files::kStyle));
  content.header = element("h1", "", "lensforge studio") + element("p", "data-folder", "");
  content.body = std::string(studio_files::kBody);
  content.footer = escape_html(program_mark());
  content.script = "(function () {\n\"use strict\";\n";
  for (const std::string_view script : studio_files::kScripts) content.script += script;
  content.script += "})();\n";
  return html_page(content);
}

/// Pictures of a running design by their names in a project.
const std::map<std::string_view, std::string LiveState::*>& live_pictures() {
  static const std::map<std::string_view, std::string LiveState::*> all{
      {"live.png", &LiveState::picture},
      {"live-error.png", &LiveState::error},
      {"live-second.png", &LiveState::second}};
  return all;
}

json parsed(std::string_view body) {
  return body.empty() ? json::object() : parse_json(body, "the request");
}

/// Makes the folder of the projects if there is none. @throw InputError naming it.
fs::path projects_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (!is_folder(folder)) {
    throw InputError("FOLDER " + folder.string() + ": is no folder and cannot be made one");
  }
  require_writable_folder(folder);
  return fs::canonical(folder);
}

/// Serves the page that leads from a picture to a part, to browsers on this machine, and runs the
/// commands that the page asks for. Projects are folders in one folder; nothing outside of it can
/// be reached. Only a browser that opened address() is answered, since a page can move a machine.
/// Requests are answered by the server's thread; at the end all jobs are interrupted, and can be
/// resumed.
class Studio {
 public:
  /// @param folder  of the projects; made if it does not exist. @param port  0 takes a free one.
  /// @param common  words that every computing command gets: --threads, --device.
  /// @throw InputError naming folder or --port.
  Studio(const fs::path& folder, int port, Arguments common)
      : folder_(projects_folder(folder)),
        key_(key_of(folder_)),
        page_(studio_page()),
        turn_(std::move(common)),
        server_({port, "--port", kMaxBody},
                [this](const LoopbackRequest& request) { return guarded(request); }) {}

  /// "http://127.0.0.1:8420/?key=…": with the key, which is kept in the folder.
  [[nodiscard]] std::string address() const { return server_.address() + "?key=" + key_; }

 private:
  using Path = std::vector<std::string_view>;

  [[nodiscard]] std::string cookie_name() const {
    return "lensforge-" + std::to_string(server_.port());
  }

  LoopbackAnswer guarded(const LoopbackRequest& request) {
    if (same_key(value_in(request.query, '&', "key"), key_)) return entered();
    if (!same_key(value_in(request.cookie, ';', cookie_name()), key_)) {
      return answer_with("text/plain; charset=utf-8",
                         "Open the address that lensforge studio prints; it has the key.\n",
                         kForbidden);
    }
    try {
      return request.post ? posted(request) : got(request);
    } catch (const NotFound& e) {
      return json_answer({{"error", e.what}}, kMissing);
    } catch (const InputError& e) {
      return json_answer({{"error", e.what()}}, kRefused);
    } catch (const std::exception& e) {
      return json_answer({{"error", e.what()}}, kBroken);
    }
  }

  /// The page, and the key as a cookie that no script and no other site gets.
  LoopbackAnswer entered() const {
    LoopbackAnswer answer = answer_with("text/html; charset=utf-8", page_);
    answer.cookie = cookie_name() + "=" + key_ + "; HttpOnly; SameSite=Strict; Path=/";
    return answer;
  }

  LoopbackAnswer got(const LoopbackRequest& request) {
    if (request.path == "/") return entered();
    if (request.path == "/forms.json") return json_answer(studio_forms());
    if (request.path == "/studio.json") return json_answer(overview());
    const Path path = split(request.path.substr(1), '/');
    if (path.size() < 3 || path[0] != "projects") throw NotFound{"no such page"};
    const std::string address = address_of(path[1]);
    Project& project = project_of(path[1]);
    if (path[2] == "files") {
      return file_answer(project.file(unescaped(request.path.substr(address.size() + 6))));
    }
    if (path.size() > 3) throw NotFound{"no such page"};
    if (path[2] == "state.json") return json_answer(project.state(address));
    if (path[2] == kRelief) return file_answer(project.relief(CutFace::kBack));
    if (path[2] == kFrontRelief) return file_answer(project.relief(CutFace::kFront));
    if (const auto live = live_pictures().find(path[2]); live != live_pictures().end()) {
      std::string picture = project.live_picture(live->second);
      if (picture.empty()) throw NotFound{"no picture yet"};
      return answer_with("image/png", std::move(picture));
    }
    throw NotFound{"no such page"};
  }

  LoopbackAnswer posted(const LoopbackRequest& request) {
    const Path path = split(request.path.substr(1), '/');
    if (path[0] != "projects") throw NotFound{"no such page"};
    if (path.size() == 1) return created(request);
    if (path.size() != 3) throw NotFound{"no such page"};
    Project& project = project_of(path[1]);
    if (path[2] == "remove") {
      const fs::path place = project.move_to(folder_ / kRemoved);
      projects_.erase(std::string(path[1]));
      return json_answer({{"moved_to", place.string()}});
    }
    if (path[2] == "second") {
      project.take_second(title_of(request), request.body);
    } else {
      act(project, path[2], request.body);
    }
    return json_answer(project.state(address_of(path[1])));
  }

  LoopbackAnswer created(const LoopbackRequest& request) {
    const fs::path made = Project::create(folder_, title_of(request), request.body);
    return json_answer({{"name", made.filename().string()}});
  }

  /// Name of the file that a picture was.
  static std::string title_of(const LoopbackRequest& request) {
    return unescaped(value_in(request.query, '&', "title"));
  }

  static void act(Project& project, std::string_view action, std::string_view body) {
    if (action == "picture") return project.take_picture(body);
    if (action == "second-picture") return project.take_second_picture(body);
    if (action == "photo") return project.take_photo(body);
    if (action == "settings") return project.take_settings(parsed(body));
    if (action == "run") return project.run(parsed(body));
    if (action == "pause") return project.pause();
    if (action == "continue") return project.resume();
    if (action == "undo") return project.undo();
    if (action == "redo") return project.redo();
    if (action == "send") return project.send(parsed(body));
    if (action == "key") return project.press(parsed(body));
    throw NotFound{"no such action"};
  }

  static std::string address_of(std::string_view name) {
    return "/projects/" + std::string(name) + "/";
  }

  /// @throw NotFound
  Project& project_of(std::string_view name) {
    const std::string plain(name);
    const bool allowed =
        !plain.empty() && plain[0] != '.' && plain.find_first_of("/\\%") == std::string::npos;
    if (!allowed || !Project::is_project(folder_ / plain)) throw NotFound{"no such project"};
    const auto found = projects_.find(plain);
    if (found != projects_.end()) return found->second;
    return projects_.try_emplace(plain, folder_ / plain, turn_).first->second;
  }

  json overview() {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      if (name[0] != '.' && Project::is_project(entry.path())) names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    json projects = json::array();
    for (const std::string& name : names) {
      projects.push_back(project_of(name).summary(address_of(name)));
    }
    return {{"program", program_mark()}, {"folder", folder_.string()}, {"projects", projects}};
  }

  static LoopbackAnswer file_answer(const fs::path& file) {
    const char* const type = type_of(file);
    LoopbackAnswer answer = answer_with(type != nullptr ? type : "application/octet-stream",
                                        read_whole_file(file, kMaxFile));
    if (type == nullptr) answer.file_name = file.filename().string();
    return answer;
  }

  fs::path folder_;
  std::string key_;
  std::string page_;
  ComputeTurn turn_;
  std::map<std::string, Project> projects_;
  LoopbackServer server_;  ///< Last, so that it ends first.
};

/// Options of `lensforge studio`.
struct StudioSettings {
  std::string folder = "studio";
  int port = 8420;
};

constexpr int kLargestPort = 65535;

void describe(Description& d, StudioSettings& settings) {
  d.text("FOLDER", settings.folder, "", "folder of the projects; made if there is none");
  d.whole("--port", settings.port, Limits::between(0, kLargestPort),
          "port of the page at 127.0.0.1; 0 takes a free one")
      .essential = true;
}

/// The common options that were given, for the commands of the studio.
Arguments common_words(const CommonOptions& common) {
  Arguments words;
  if (common.threads > 0) words.insert(words.end(), {"--threads", std::to_string(common.threads)});
  if (common.device != "auto") words.insert(words.end(), {"--device", common.device});
  return words;
}

CommandResult run(CommandFrame& frame, StudioSettings& settings) {
  frame.begin();
  {
    const Studio studio(settings.folder, settings.port, common_words(frame.options().common()));
    const Console& console = frame.console();
    if (frame.options().common().quiet) {
      console.result({{"address", studio.address()}}, studio.address() + "\n");
    } else {
      console.note("the studio is at " + studio.address());
      console.begin();
    }
    std::mutex mutex;
    std::condition_variable_any never;
    std::unique_lock lock(mutex);
    never.wait(lock, frame.stop_token(), [] { return false; });
  }
  return {.exit_code = kDone, .notes = {"everything is kept in " + settings.folder}};
}

}  // namespace

int studio_command(const Arguments& arguments) {
  return run_command<StudioSettings>({"studio",
                                      "Serves a page on this machine that leads from a picture to "
                                      "a part: light and sizes, design, "
                                      "cut, programs.",
                                      run, "lensforge studio ~/lenses"},
                                     arguments);
}

}  // namespace lensforge::app

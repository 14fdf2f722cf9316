// SPDX-License-Identifier: GPL-3.0-or-later
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>

#include "app/frame/command_line.h"
#include "app/frame/command_run.h"
#include "app/frame/option_set.h"
#include "app/studio/studio.h"

namespace lensforge::app {
namespace {

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

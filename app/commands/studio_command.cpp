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
          "port of the page at 127.0.0.1; 0 takes a free one");
}

CommandResult run(CommandFrame& frame, StudioSettings& settings) {
  frame.begin();
  {
    const Studio studio(settings.folder, settings.port);
    frame.console().note("the studio is at " + studio.address());
    frame.console().begin();
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

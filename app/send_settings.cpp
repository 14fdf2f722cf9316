// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/send_settings.h"

#include "core/error.h"

namespace lensforge::app {

void add_send_options(OptionSet& options, SendSettings& settings) {
  options.positional("FILE", settings.file, "G-code program");
  options.fields(send_fields(), settings.job);
  options.flag("--yes", settings.yes, "do not ask before resuming");
  options.text("--log", settings.log, "FILE",
               "log file, appended to an earlier one; default FILE.ngc.log");
  options.text("--events", settings.events, "FILE",
               "append what happens as JSON, one object a line: to an earlier events file, a new "
               "one or a pipe; - is standard output");
}

void require_consistent(const SendSettings& settings, bool json) {
  if (json && settings.events == "-") {
    throw InputError("--events -: standard output belongs to the result with --json");
  }
  if (settings.log == "-") throw InputError("--log -: has to be a file");
  validate(settings.job);
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/sender.h"

#include "machine/stream/send_run.h"

namespace lensforge {

SendResult Sender::run(ProgramFeed& feed, const SendControl& control) {
  const SendRules rules{info_, options_, parts_.guard != nullptr};
  return SendRun(parts_, rules, first_line_, feed, control).run();
}

}  // namespace lensforge

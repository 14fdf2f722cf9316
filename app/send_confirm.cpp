// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/send_confirm.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>

#include "core/error.h"
#include "machine/link/port.h"

namespace lensforge::app {
namespace {

constexpr double kStopCheck = 0.1;  ///< Longest time without a look at the stop token, s.

/// What is typed up to Enter; empty at the end of the input.
std::string read_answer(const std::stop_token& stop) {
  while (wait_for(STDIN_FILENO, POLLIN, kStopCheck) == 0) {
    if (stop.stop_requested()) throw Interrupted();
  }
  std::array<char, 256> bytes{};
  const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  std::string answer(bytes.data(), count > 0 ? static_cast<std::size_t>(count) : 0);
  return answer.substr(0, answer.find('\n'));
}

}  // namespace

void require_consent(const std::stop_token& stop) {
  if (::isatty(STDIN_FILENO) == 0) {
    throw InputError(
        "--resume: cannot ask for confirmation, standard input is no terminal; use --yes");
  }
  std::fputs("Go on? [y/N] ", stderr);
  const std::string answer = read_answer(stop);
  if (answer != "y" && answer != "Y" && answer != "yes") {
    throw InputError("--resume: not confirmed; nothing was sent");
  }
}

}  // namespace lensforge::app

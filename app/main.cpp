// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <string>
#include <vector>

#include "app/command_line.h"

int main(int argc, char** argv) {
  // A full disk, a file-size limit and a closed pipe are then errors of the write that meets them.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  return lensforge::app::run_command_line(std::vector<std::string>(argv + 1, argv + argc));
}

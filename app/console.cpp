// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/error.h"
#include "core/printable.h"

namespace lensforge::app {
namespace {

/// File names need not be UTF-8, which JSON has to be: other bytes become U+FFFD.
std::string dump(const nlohmann::json& object) {
  return object.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

std::size_t terminal_width() {
  constexpr std::size_t kUsual = 80;
  winsize size{};
  const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : kUsual;
}

void print_to_stdout(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0) {
    throw RunError(std::string("standard output: ") + std::strerror(errno));
  }
}

int report_error(const std::string& message, int exit_code, bool json) noexcept {
  try {
    const std::string line = printable_line(message);
    std::fprintf(stderr, "lensforge: %s\n", line.c_str());
    if (json) print_to_stdout(dump({{"error", line}, {"exit_code", exit_code}}));
  } catch (const std::exception&) {
    // The reason was printed; a stdout that is gone as well changes nothing.
  }
  return exit_code;
}

void Console::note(const std::string& message) const {
  if (!quiet_) std::fprintf(stderr, "lensforge: %s\n", printable_line(message).c_str());
}

void Console::result(const nlohmann::json& object, const std::string& text) const {
  print_to_stdout(json_ ? dump(object) : printable_lines(text));
}

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "machine/link/link.h"

namespace lensforge::testing {

/// Looks at what goes through a link: whether lines leave after the first feed hold, and how many
/// bytes went.
class SpyLink : public Link {
 public:
  explicit SpyLink(Link& link) : link_(link) {}

  std::string read(double wait) override { return link_.read(wait); }
  std::size_t write(std::string_view bytes) override {
    const std::size_t count = link_.write(bytes);
    for (const char byte : bytes.substr(0, count)) note(byte);
    return count;
  }

  bool held = false;             ///< A feed hold went.
  bool line_after_hold = false;  ///< Then a byte that is no realtime command.
  std::size_t written = 0;
  std::function<void(std::size_t)> each_byte;

 private:
  void note(char byte) {
    ++written;
    if (each_byte) each_byte(written);
    const auto code = static_cast<unsigned char>(byte);
    const bool urgent = byte == '!' || byte == '?' || byte == '~' || code == 0x18 || code >= 0x80;
    if (held && !urgent) line_after_hold = true;
    if (byte == '!') held = true;
    if (code == 0x18) held = false;  // What comes after a reset is another job.
  }

  Link& link_;
};

}  // namespace lensforge::testing

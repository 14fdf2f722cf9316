// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/wire.h"

namespace lensforge {

void Wire::line(std::string_view text) {
  lines_ += text;
  lines_ += '\n';
}

void Wire::urgent(char byte) {
  urgent_ += byte;
  flush();
}

void Wire::flush() {
  while (!urgent_.empty()) {
    const std::size_t count = link_.write(urgent_);
    if (count == 0) return;
    urgent_.erase(0, count);
  }
  while (written_ < lines_.size()) {
    const std::size_t count = link_.write(std::string_view(lines_).substr(written_));
    if (count == 0) return;
    written_ += count;
  }
  lines_.clear();
  written_ = 0;
}

void Wire::discard() {
  lines_.clear();
  written_ = 0;
}

void Wire::receive(double wait, const std::function<void(const Reply&)>& take) {
  reader_.feed(link_.read(wait), take);
}

}  // namespace lensforge

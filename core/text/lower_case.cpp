// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/lower_case.h"

namespace lensforge {

std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

}  // namespace lensforge

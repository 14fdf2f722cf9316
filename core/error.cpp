// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/error.h"

#include <cstdio>
#include <cstdlib>

namespace lensforge {

void check_failed(const char* condition, const char* file, int line, const std::string& values) {
  std::fprintf(stderr, "lensforge: a bug: %s:%d: %s is false (%s)\n", file, line, condition,
               values.c_str());
  std::abort();
}

}  // namespace lensforge

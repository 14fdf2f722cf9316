// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/sandbox/module.h"

/// A module of an older version.
extern "C" const lensforge::ModuleHead* lensforge_stale() {
  static const lensforge::ModuleHead head{"lensforge 0.0.0", sizeof(lensforge::ModuleHead)};
  return &head;
}

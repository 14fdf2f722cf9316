// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/frame/option_set.h"
#include "design/reflect.h"

namespace lensforge::app {

/// Options of `lensforge reflect`.
struct ReflectSettings {
  std::string mesh;  ///< File to read.
  std::string out;   ///< Folder; empty with `evaluate`.
  bool evaluate = false;
  bool resume = false;
  reflect::ReflectOptions reflect;
};

/// Describes every option of the command.
void describe(Description& d, ReflectSettings& settings);

}  // namespace lensforge::app

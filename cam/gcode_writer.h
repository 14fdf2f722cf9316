// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace lensforge {

/// Dialect of the controller that a program is written for.
enum class Post {
  kLinuxcnc,  ///< RS-274/NGC as LinuxCNC reads it: tool word, exact program end, % not needed.
  kGrbl,      ///< Grbl 1.1: no T and M6, at most 80 characters a line.
};

/// "linuxcnc" or "grbl" → Post. @throw InputError naming the option and the value.
Post parse_post(std::string_view name);

/// The name that parse_post() takes.
std::string_view post_name(Post post);

}  // namespace lensforge

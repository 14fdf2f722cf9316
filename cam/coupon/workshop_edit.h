// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "cam/workshop/workshop.h"

namespace lensforge {

/// A workshop's file with polish.sigma, the finishing ball's diameter and finish.pitch_error
/// changed, and every other byte, comments among them, as it was.
/// @param text  TOML that parse_workshop() takes.
/// @param to    the same workshop with other values of these three.
/// @return nothing where the file cannot be changed so: it states no tools and the ball changes, or
///         it is written in a way that this does not follow.
std::optional<std::string> edited_workshop(const std::string& text, const Workshop& to);

}  // namespace lensforge

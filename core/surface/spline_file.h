// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/optics/optical_setup.h"
#include "core/surface/control_net.h"

namespace lensforge {

/// Returns why a spline cannot be the optical surface of a lens with this setup: its rim is not the
/// lens's rectangle to the last bit, or surface_fault() of its nodes. One clause; nothing if it can
/// be.
std::optional<std::string> spline_fault(const ControlNet& net, const OpticalSetup& setup);

/// Writes surface.spline (docs/interface.md), whole or not at all, exact to the bit.
/// @throw RunError if it cannot be written.
void write_spline(const ControlNet& net, const std::filesystem::path& path);

/// Reads surface.spline back. @throw InputError naming the file and what is wrong if it is missing,
///        of another version, truncated, or holds a number that is not finite.
ControlNet read_spline(const std::filesystem::path& path);

/// True if this file begins with the magic of write_spline().
bool is_spline_file(const std::filesystem::path& path);

}  // namespace lensforge

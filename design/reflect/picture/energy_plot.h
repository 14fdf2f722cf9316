// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge::reflect {

struct ReflectUpdate;

/// The energy of every update over the time in which it was reached, a line for each stage;
/// energies on a logarithmic scale of whole decades. SVG; empty for fewer than two updates.
std::string energy_plot(const std::vector<ReflectUpdate>& updates);

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "app/send_settings.h"

namespace lensforge::app {

/// The program, journal, log, events, ports and register maps of a job have to be different files
/// and devices, by whatever names they go, and none that is written may be where standard output or
/// standard error lead to.
/// @param maps  as register_maps() gave them. @throw InputError naming the two.
void require_apart(const SendSettings& settings, const std::vector<RegisterMap>& maps);

}  // namespace lensforge::app

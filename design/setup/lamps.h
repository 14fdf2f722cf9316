// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "design/setup/design_options.h"

namespace lensforge {

/// What `--lamp` may be, for help.
inline constexpr const char* kLampWords = "sun|led:3mm@600mm|torch|laser:532nm|projector|FILE:...";

/// Sets source, its size or angle and, for a laser, the wavelength, to those of a lamp:
/// - "sun": parallel light of 9.3 mrad;
/// - "led", "led:3mm@600mm": a flat disc of that diameter, that far in front of the lens's middle;
/// - "torch": that of a telephone, 2 mm at 1 m; "projector": its lens, 12 mm at 2 m;
/// - "laser", "laser:532nm": a widened beam, parallel light of one wavelength;
/// - "FILE:3mm@600mm", "FILE:9.3mrad": a picture of the lamp, as wide as that.
/// @throw InputError naming option, text and rule.
void set_lamp(LightOptions& light, const std::string& text);

/// Puts the lamp of the options before a finished lens; a parallel one shines straight on a lens,
/// and from where light came so far on a mirror.
/// @throw InputError naming `--lamp` if a mirror was made for a point source and the lamp is none,
///        or the other way round.
void put_lamp(const LightOptions& light, OpticalSetup& setup);

/// Sets index and Abbe number to those of a material (material_named()): the index at 587.56 nm, or
/// at a laser's wavelength. @throw InputError naming option, text and rule.
void set_material(DesignOptions& options, const std::string& text);

}  // namespace lensforge

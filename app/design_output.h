// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/console.h"
#include "app/option_set.h"
#include "design/design_lens.h"

namespace lensforge::app {

/// Where a lens comes from: program, options, time, outcome.
nlohmann::json design_provenance(const OptionSet& options, const ChosenDevice& device,
                                 const DesignOptions& design, const DesignResult& result);

/// How nearly the picture under an extended source is known.
nlohmann::json source_json(const SourceCheck& source);

/// How far the colours of the light land apart, mm.
nlohmann::json fringe_json(const Fringe& fringe);

/// Writes all that a design leaves in its folder, and puts it in the place of what was there. The
/// cut of an earlier lens goes with it: milled, it would not be this one.
/// @throw RunError if something cannot be written.
void write_design(const std::filesystem::path& folder, const DesignResult& result,
                  const Console& console);

}  // namespace lensforge::app

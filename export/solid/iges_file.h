// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "export/solid/step_file.h"
#include "export/spline/spline_net.h"

namespace lensforge {

/// Checks the structure of an IGES file in its fixed form (IGES 5.3, chapter 2) before OpenCASCADE
/// trusts it: lines of 80 columns, sections S G D P T in this order and numbered from 1, two lines
/// for each directory entry, valid pointers into the directory and the parameters, and a last line
/// with the right counts. Returns the number of entities.
/// @throw InputError "NAME: line 12: its parameters begin in line 40 of section P, which has 39"
///        and the like.
std::int64_t check_iges(std::string_view content, const std::string& name);

/// write_step() as IGES 5.3, a manifold solid (entity 186) in millimetres. The format has no face
/// names, and its header no description.
/// @pre the net lies above z = 0. @throw RunError if it cannot be written or does not read back;
///      Interrupted, and then nothing was written.
SolidContent write_iges(const SplineNet& net, const StepHeader& header,
                        const std::filesystem::path& path, const RunControl& control = {});

/// Reads an IGES file. OpenCASCADE runs in a child process; its crash is an InputError too.
/// @throw InputError if the file cannot be read or holds no shape; Interrupted.
SolidContent inspect_iges(const std::filesystem::path& path, const RunControl& control = {});

}  // namespace lensforge

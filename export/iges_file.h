// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "export/spline_net.h"
#include "export/step_file.h"

namespace lensforge {

/// write_step() as IGES 5.3, a manifold solid (entity 186) in millimetres. The format has no place
/// for the names of faces, and of the header for no description.
/// @pre the net lies above z = 0. @throw RunError if it cannot be written or does not read back;
///      Interrupted, and then nothing was written.
SolidContent write_iges(const SplineNet& net, const StepHeader& header,
                        const std::filesystem::path& path, const RunControl& control = {});

/// OpenCASCADE works in a child process: what makes it crash is an InputError as well.
/// @throw InputError if the file cannot be read or holds no shape; Interrupted.
SolidContent inspect_iges(const std::filesystem::path& path, const RunControl& control = {});

}  // namespace lensforge

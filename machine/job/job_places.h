// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "machine/job/send_options.h"

namespace lensforge {

/// A file that is written beside a job.
struct NamedFile {
  std::string option;  ///< That names it.
  std::filesystem::path path;
};

/// The program, journal, other files, ports and register maps of a job have to be different files
/// and devices, by whatever names they go, and none that is written may be where standard output or
/// standard error lead to.
/// @param maps  as register_maps() gave them. @throw InputError naming the two.
void require_apart(const std::filesystem::path& program, const SendOptions& options,
                   const std::vector<RegisterMap>& maps, const std::vector<NamedFile>& beside);

}  // namespace lensforge

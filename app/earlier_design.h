// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace lensforge::app {

/// What an output folder holds of an earlier design.
struct EarlierDesign {
  bool lens = false;        ///< A lens.json: of a finished or an interrupted design.
  bool checkpoint = false;  ///< Something to go on from.

  static EarlierDesign in(const std::filesystem::path& folder);
};

/// @throw InputError if `folder` holds an earlier design and neither `resume` nor `force` says what
///        to do with it.
void refuse_to_overwrite(const std::filesystem::path& folder, bool resume, bool force);

/// Removes every file that lensforge writes into a lens folder, the G-code made from it included,
/// and only those. The checkpoint stays: the new design has replaced it by its own.
void remove_earlier_design(const std::filesystem::path& folder);

}  // namespace lensforge::app

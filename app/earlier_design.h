// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace lensforge::app {

/// What an output folder holds of an earlier design.
struct EarlierDesign {
  bool lens = false;        ///< A lens.json: of a finished or an interrupted design.
  bool checkpoint = false;  ///< Something to go on from.
  /// Files with names that `design` writes, which lensforge did not write.
  std::vector<std::string> foreign;
  nlohmann::json provenance;  ///< Of the lens; null where there is none.

  static EarlierDesign in(const std::filesystem::path& folder);

  /// Whether the lens is of the design with this fingerprint, finished or not.
  [[nodiscard]] bool is_of(const std::string& fingerprint) const;

  friend bool operator==(const EarlierDesign&, const EarlierDesign&) = default;
};

/// @throw InputError if `folder` holds something that the design would replace and neither `resume`
///        nor `force` says that it may; or, whatever they say, a folder or device in the place of a
///        file.
void refuse_to_overwrite(const std::filesystem::path& folder, const EarlierDesign& earlier,
                         bool resume, bool force);

/// @throw InputError if the finished lens that --resume meets is not what the same picture and
///        options give, or its design was never finished and its checkpoint is gone.
/// @pre earlier.lens && !earlier.checkpoint
void require_finished(const std::filesystem::path& folder, const EarlierDesign& earlier,
                      const std::string& fingerprint);

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <string>
#include <vector>

/// Designs to compare with the figures of Sun, Deng and Zhang, "End-to-end Surface Optimization for
/// Light Control" (Tables 1 and 2, Fig. 10).
namespace lensforge::bench {

inline constexpr double kNotGiven = std::numeric_limits<double>::quiet_NaN();

/// The paper's figures for a picture of the same kind; NaN if it has none.
struct PaperFigures {
  std::string picture;             ///< Its name there.
  double mae = kNotGiven;          ///< Table 1: the paper's own rendering.
  double traced_mae = kNotGiven;   ///< Table 2, column "Ours".
  double traced_ssim = kNotGiven;  ///< Same.
};

enum class RowGroup { kPaper, kOtherLight, kSmooth, kPhotograph, kAblation };

/// One design.
struct PaperRow {
  std::string name;  ///< Of its folder.
  RowGroup group = RowGroup::kPaper;
  std::string title;                 ///< Of the picture, as printed.
  std::string picture;               ///< File.
  int pixels = 256;                  ///< Longer side.
  std::vector<std::string> options;  ///< Of `lensforge design`, besides --pixels and --out.
  PaperFigures paper;
  std::string variant;  ///< Ablation only: what is left out.

  /// The ray trace knows parallel light through a lens only; the ablation does without.
  [[nodiscard]] bool is_traced() const {
    return group != RowGroup::kAblation && group != RowGroup::kOtherLight;
  }
};

/// The pictures' folder and the factor by which to shrink the work.
struct RowChoice {
  std::string fixtures;                   ///< Folder of the generated pictures.
  int most_pixels = 0;                    ///< Longer sides are cut to this; 0 leaves them.
  int ablation_pixels = 256;              ///< Longer side of the ablation's pictures.
  std::vector<std::string> only;          ///< Keep rows whose name contains one of these; or all.
  std::vector<std::string> more_options;  ///< Added to every design.
};

/// All rows of `choice`, in the order of the runs: the paper's kinds first, the ablation last. Does
/// not check that the pictures exist.
std::vector<PaperRow> choose_rows(const RowChoice& choice);

/// The ablation's variants in the order of Fig. 10, "full" last.
const std::vector<std::string>& ablation_variants();

}  // namespace lensforge::bench

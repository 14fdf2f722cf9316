// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cam/plan/cam_options.h"
#include "cam/predict/printed_part.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "design/design.h"

/// Proposes sizes for a lens from what a person knows (lamp, wall, workshop), and forecasts what
/// comes of each.
namespace lensforge {

/// What is known of a lens. Lamp, material and distance of the wall are those of `design`.
struct ProposalWish {
  DesignOptions design;
  bool sized = false;     ///< design.width is stated.
  bool pixelled = false;  ///< design.pixels is stated.
  CamOptions cut;         ///< Workshop and part: a milled lens, or a print.
  double hours = 8.0;     ///< On the machine at most, > 0.
  std::vector<double> sheets{kSheetsOnSale.begin(), kSheetsOnSale.end()};  ///< Thicknesses, mm.

  [[nodiscard]] bool printed() const { return cut.part == PartKind::kPrint; }
};

/// Duration of one operation of a cut, or of a print.
struct OperationMinutes {
  std::string name;  ///< "rough", "semi", "finish"; "print"
  double minutes = 0.0;
};

/// What a print adds to a forecast.
struct PrintForecast {
  PrintRun run;
  Terraces terraces;
  double steps_mae = 0.0;  ///< Of ProposalForecast::mae, what the steps add to the film's.
};

/// What comes of a design that is cut and polished, or printed and levelled. Its numbers follow
/// from a trial of at most 64 pixels with pixels of the same size, and are good to those stated in
/// docs/accuracy.md, "Plans".
struct ProposalForecast {
  std::vector<PictureBlur> blurs;  ///< part_blurs() or print_blurs()
  int sharp_pixels = 0;  ///< On the picture's longer side, each as wide as the widest blur.
  bool waves = false;    ///< The picture is by waves; else by rays.
  double mae = 0.0;      ///< Of the part.
  /// PictureQuality::leakage of the part against the designed surface; of a print, whose surface is
  /// designed sharper than the picture, against the picture.
  double leakage = 0.0;
  double contrast = 0.0;  ///< PictureQuality::contrast() of the part; 0 for a picture without dark.
  double relief = 0.0;    ///< Highest − lowest point of the surface, mm.
  /// Thinnest of ProposalWish::sheets that fits; 0 if none does, or for a print.
  double sheet = 0.0;
  std::optional<PrintForecast> print;
  std::vector<OperationMinutes> operations;
  double design_seconds = 0.0;  ///< estimate_design()

  [[nodiscard]] double minutes() const;
};

/// A proposal: sizes and what comes of them.
struct Proposal {
  std::string title;  ///< "as asked", "sharper", "quicker"
  std::string words;  ///< What it does, in a sentence.
  DesignOptions design;
  ProposalForecast forecast;
};

/// Pixels on the picture's longer side that light, polish and passes show: each as wide as the
/// widest blur. @param picture  size of the picture, pixels.
int sharp_pixels(const ProposalWish& wish, const Eigen::Vector2i& picture);

/// part_blurs() or print_blurs() of a wish. @param setup  of its design.
std::vector<PictureBlur> blurs_of(const ProposalWish& wish, const OpticalSetup& setup);

/// Durations of a cut's operations: length of their passes over feed, and kOperationMinutes.
/// @param size  of the lens, mm. @param relief, mean  highest and mean height of the surface above
///                 its lowest point, mm.
std::vector<OperationMinutes> operation_times(const CamOptions& options,
                                              const Eigen::Vector2d& size, double relief,
                                              double mean);

/// Start and end of an operation: spindle, first approach, retreat.
inline constexpr double kOperationMinutes = 0.6;

/// The proposal that keeps to what is stated, then up to two others: sharper and quicker.
/// @throw InputError naming option, value and rule if the options contradict each other;
///        Interrupted.
std::vector<Proposal> propose(const Image& picture, const ProposalWish& known,
                              const Executor& executor, const RunControl& control);

}  // namespace lensforge

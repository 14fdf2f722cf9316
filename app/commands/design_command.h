// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/frame/command_run.h"
#include "app/frame/console.h"
#include "app/frame/option_set.h"
#include "cam/plan/cam_options.h"
#include "core/compute/executor.h"
#include "core/image/color.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/lens/lens.h"
#include "design/design.h"
#include "design/setup/design_options.h"

namespace lensforge::app {

/// How a coloured picture is projected: as grey, or by three lenses with a lamp each.
enum class ColorWay { kGrey, kThreeLamps };

/// Options of a picture in colour.
struct ColorOptions {
  ColorWay way = ColorWay::kGrey;
  std::array<double, 3> lamps{625.0, 525.0, 465.0};  ///< Wavelengths, nm: red, green, blue.
  double gap = 10.0;                                 ///< Between the lenses, mm.
};

/// Options of `lensforge design`.
struct DesignSettings {
  std::string target;
  std::string out;
  std::string outline;    ///< Edge of the lens; empty: its rectangle.
  Background background;  ///< Behind target, source's shape and outline.
  std::string made_by;    ///< Workshop file, or "default"; empty: not designed for a process.
  bool robust = false;    ///< Design for parts polished less or more than made_by states.
  CamOptions cut;  ///< For made_by: whether the part or a mould is milled, and the shrinkage.
  ColorOptions color;
  DesignOptions design;
  std::vector<std::string> changes;  ///< Changes made to the pictures above, in words.
  std::string live;  ///< Port of a page that shows the design while it runs; empty: none.
  bool resume = false;
  bool force = false;
};

/// Describes every option of the command.
void describe(Description& d, DesignSettings& settings);

/// Reads the picture to project. @throw InputError; Interrupted.
LoadedImage read_target(const DesignSettings& settings, const RunControl& control);

/// Fills options that were not given with the library's values for this picture, and reads the
/// pictures that options name. @throw InputError naming option or picture, value and rule;
/// Interrupted.
void settle(OptionSet& options, DesignSettings& settings, const Image& picture,
            const RunControl& control);

/// Files of an earlier design in an output folder.
struct EarlierDesign {
  bool lens = false;        ///< There is a lens.json, of a finished or an interrupted design.
  bool checkpoint = false;  ///< There is a checkpoint to resume from.
  /// Files with names that `design` writes, which lensforge did not write.
  std::vector<std::string> foreign;
  nlohmann::json provenance;  ///< The lens's; null without a lens.

  static EarlierDesign in(const std::filesystem::path& folder);

  /// True if the lens belongs to the design with this fingerprint, finished or not.
  [[nodiscard]] bool is_of(const std::string& fingerprint) const;

  friend bool operator==(const EarlierDesign&, const EarlierDesign&) = default;
};

/// @throw InputError if the design would replace something in `folder` and neither `resume` nor
///        `force` is set, or, in any case, if a folder or device has the name of one of its files.
void refuse_to_overwrite(const std::filesystem::path& folder, const EarlierDesign& earlier,
                         bool resume, bool force);

/// Returns the origin of a lens: program, options, time, result.
nlohmann::json design_provenance(const OptionSet& options, const ChosenDevice& device,
                                 const DesignOptions& design, const DesignResult& result);

/// Writes all files of a design and replaces those of an earlier one. The programs of an earlier
/// lens are deleted: they would mill another surface.
/// @throw RunError if something cannot be written.
void write_design(const std::filesystem::path& folder, const DesignResult& result,
                  const Console& console);

/// Designs the lens for a picture that was read, and writes it to settings.out.
/// @param earlier  what that folder held before the picture was read.
/// @pre settle() @throw InputError, RunError, Interrupted.
CommandResult design_for(CommandFrame& frame, DesignSettings& settings, const LoadedImage& loaded,
                         const EarlierDesign& earlier);

// A picture in colour, by three lenses with a lamp each.

/// Of the lamps, in the order of ColorOptions::lamps; the names of their lenses' folders.
inline constexpr std::array kLampNames{"red", "green", "blue"};

/// A coloured picture, and the light of the three lamps that makes it.
struct ColorTarget {
  LampSplit split;
  std::vector<std::string> changes;
  std::array<Image, 3> rgb;  ///< In the lenses' pixels.
};

/// Splits a picture by the lamps of settings.color. @throw InputError if they mix no colours, an
/// option does not go with them, or the picture has nothing for one of them; Interrupted.
ColorTarget color_target(const OptionSet& options, const DesignSettings& settings,
                         const LoadedColors& loaded, const RunControl& control);

/// Does settle() for the lens of one lamp, whose picture is target.split.lamps.pictures[lamp], and
/// sets its light and the place of its picture.
void settle_lamp(OptionSet& options, DesignSettings& settings, const ColorTarget& target,
                 std::size_t lamp, const RunControl& control);

/// What the three lenses project together.
struct ColorResult {
  nlohmann::json figures;  ///< The `color` of color.json (docs/interface.md).
  std::string text;        ///< For people.
  ColorImage wanted;       ///< sRGB.
  ColorImage reached;
};
ColorResult color_result(const DesignSettings& settings, const ColorTarget& target,
                         const std::array<Lens, 3>& lenses);

/// Designs the three lenses of --color three-lamps into folders of settings.out, and writes the
/// picture that they project together beside them.
CommandResult run_three_lamps(CommandFrame& frame, DesignSettings& settings);

}  // namespace lensforge::app

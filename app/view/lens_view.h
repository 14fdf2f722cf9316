// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/view/stored_surface.h"
#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/optics/optical_setup.h"
#include "design/setup/design_options.h"

namespace lensforge {

/// A surface whose projected picture a page draws.
struct ViewedSurface {
  std::string id;     ///< "designed"
  std::string words;  ///< Short description.
  StoredSurface surface;
  Image picture;  ///< The picture it projects, computed by the program; linear light.
  /// MAE between that picture and the one of the stored surface, both computed by the program; of a
  /// designed surface for two pictures, the larger one.
  double storage_error = 0.0;

  /// True if a page draws it; else it shows `picture` until a control is moved.
  [[nodiscard]] bool exact() const;
};

/// Maximum error of a stored surface that a page draws: one sees a quarter of a grey level of 256.
inline constexpr double kMaxStorageError = 1e-3;

/// A picture that a wave makes, as the program has stored it.
struct WavePicture {
  std::string words;  ///< "as designed"
  std::string png;    ///< Bytes of the file.
};

/// The picture after one cause of error.
struct ViewedCause {
  std::string cause;
  std::string surface;  ///< ViewedSurface::id, or empty if no page draws it.
  Image picture;        ///< Linear light.
};

/// A lens's second picture, of the designed surface.
struct ViewedSecond {
  Image target;   ///< Linear light.
  Image picture;  ///< As ViewedSurface::picture.
};

/// Content of a lens's page.
struct LensView {
  std::string name;
  OpticalSetup setup;
  std::string model;                    ///< model_name()
  Image target;                         ///< Linear light.
  std::optional<ViewedSecond> second;   ///< Of a lens for two pictures.
  std::vector<ViewedSurface> surfaces;  ///< The designed one comes first.
  std::vector<WavePicture> waves;       ///< Of the folder, if design or cam followed waves.
  /// The causes of error between target and part, step by step, and the surface for each.
  std::vector<ViewedCause> causes;
  LensRaster relief;             ///< Heights of the designed surface, mm.
  std::vector<ReportPath> path;  ///< Tool paths; empty without programs.
  std::string leakage_map;       ///< Bytes of a PNG; empty if there is none.
  std::string other_light;  ///< The lamp and material that were asked for, or empty: its own light.
  std::vector<std::string> notes;  ///< For the user who requested the page.
};

/// Number of nodes along the longer side of a page's relief.
inline constexpr int kReliefNodes = 240;

/// Heights of a lens's surface for pictures of its relief.
LensRaster relief_of(const Lens& lens);

/// Content of a page for a lens without predictions. @pre the lens has a picture.
LensView view_of_lens(const Lens& lens, const std::string& name, const Executor& executor);

/// Reads a lens folder, with `cam`'s predictions for the part, if present. In another light the
/// pictures of the surfaces are computed anew, briefly (Look); of those in the folder, which are in
/// the lens's own light, none is taken.
/// @throw InputError if it is no lens folder or has no rendered picture, or if the light does not
///        fit it; Interrupted.
LensView read_view(const std::filesystem::path& folder, const OtherLight& light,
                   const Executor& executor, const RunControl& control);

/// Returns the page that shows a lens: one self-contained HTML file that computes the projected
/// picture itself.
std::string view_page(const LensView& view);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/work_estimate.h"
#include "core/image/image.h"
#include "core/image/image_io.h"
#include "core/lens/lens.h"
#include "design/energy/objective_options.h"
#include "design/render.h"
#include "design/setup/design_options.h"

/// Designs a lens or a mirror that projects a picture.
///
///     const lensforge::Image picture = lensforge::read_image("portrait.png").image;
///     lensforge::DesignOptions options =
///         lensforge::default_design_options(lensforge::SurfaceModel::kSpline, picture);
///     options.width = 50.0;          // mm
///     options.focal_length = 200.0;  // mm
///     const lensforge::DesignResult result =
///         lensforge::design_lens(picture, options, lensforge::Executor::cpu(), {});
///     lensforge::write_lens(result.lens, "lens");
///
/// A RunControl reports progress and stops a design, which then returns its best surface so far.
/// With DesignOptions::checkpoint a file takes the state after every round; the same picture and
/// options with DesignOptions::resume go on from there to the same result, bit for bit. A
/// checkpoint of another picture or other options is refused (design_identity()).

namespace lensforge {

/// A designed lens and the record of its design.
struct DesignResult {
  enum class Status { kDone, kInterrupted };
  Status status = Status::kInterrupted;
  std::string message;            ///< Reason for the end, in one line.
  std::uint64_t fingerprint = 0;  ///< design_identity() of picture and options.
  /// Predicted picture of the part that DesignOptions::made_by makes of the lens.
  struct Made {
    ImageMetrics metrics;
    Image picture;
  };
  std::optional<Made> made;
  /// The picture as a wave makes it, of the part where there is one; where the last steps followed
  /// it.
  struct Wall {
    ImageMetrics metrics;
    Image picture;
    double wavelength = 0.0;  ///< mm; the middle one of a spectrum.
  };
  std::optional<Wall> wall;
  std::optional<SourceCheck> source;  ///< Extended sources only.
  /// Result for a spectrum.
  struct Colors {
    ColorImage picture;  ///< Projected picture; white where all wavelengths match the target.
    Fringe fringe;
  };
  std::optional<Colors> colors;
  Lens lens;  ///< Best surface so far, at the resolution reached.
  std::vector<ConvergenceRow> convergence;

  /// As designed, then the wall's or, without that, the part's as made.
  [[nodiscard]] std::vector<Image> pictures() const {
    std::vector<Image> all{lens.render};
    if (wall) {
      all.push_back(wall->picture);
    } else if (made) {
      all.push_back(made->picture);
    }
    return all;
  }
};

/// Designs a lens that projects `target` (linear light, any size, not all black), coarse to fine
/// over picture and mesh (Sun et al., section 3.4 and Appendix E).
/// @throw InputError if an option breaks its rule, the picture is all black, or a checkpoint to
///        resume from is missing, corrupt, or belongs to another picture or other options; RunError
///        if a checkpoint cannot be written or a GPU's memory does not suffice; Interrupted if it
///        is stopped before its first surface; a later stop returns the best surface so far.
DesignResult design_lens(const Image& target, const DesignOptions& options,
                         const Executor& executor, const RunControl& control);

/// Predicts the part that a process makes of a spline lens, by rays. @pre lens.spline
DesignResult::Made made_part(const Lens& lens, const MadeBy& process, const Executor& executor);

/// The picture by waves of a spline lens, or of the part that a process makes of it. @pre
/// lens.spline @throw Interrupted
DesignResult::Wall wall_of(const Lens& lens, const std::optional<MadeBy>& process,
                           const WaveOptions& waves, const Executor& executor,
                           const RunControl& control);

/// Number that differs for pictures or options that give another result.
/// @pre validate(options, target) passes.
std::uint64_t design_identity(const Image& target, const DesignOptions& options);

/// Estimates what a design for a picture of `columns` × `rows` pixels takes on `threads` threads of
/// the CPU, if every round uses all its iterations.
/// @param share  of the optimisation's memory that is on this machine; 1 except with MPI on
///        several.
/// @pre the options are in their ranges.
WorkEstimate estimate_design(int columns, int rows, const DesignOptions& options, int threads,
                             double share = 1.0);

/// The same estimate. @throw InputError if the disk of `folder` or the memory is too small, naming
///        the --pixels that fit, if any do.
WorkEstimate require_room_for_design(int columns, int rows, const DesignOptions& options,
                                     int threads, const std::filesystem::path& folder,
                                     double share = 1.0);

}  // namespace lensforge

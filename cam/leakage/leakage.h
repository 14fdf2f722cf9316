// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cam/leakage/picture_judge.h"
#include "cam/leakage/render_field.h"
#include "core/image/image.h"

namespace lensforge {

/// A surface with what it is called.
struct NamedSurface {
  std::string name;
  const SurfaceField* field = nullptr;
  std::optional<GridWindow> grid = {};  ///< It is rendered on, if not on FieldRenderSetup::grid.
};

/// Names of the causes in the chain that cam measures.
namespace leak_cause {
inline constexpr const char* kSource = "source";  ///< That is no point: in front of the chain.
inline constexpr const char* kPolish = "polish";
inline constexpr const char* kCrease = "crease rounding";
inline constexpr const char* kScallop = "scallop";
inline constexpr const char* kChord = "chord";
inline constexpr const char* kDecimals = "decimals";
inline constexpr const char* kPitchError = "pitch error";  ///< Where the workshop states one.
}  // namespace leak_cause

/// Surfaces from the designed one to the part, each with one cause of wrong light more than the one
/// before.
struct LeakageChain {
  NamedSurface designed;
  std::vector<NamedSurface> steps;   ///< Named after the cause each adds; the last is the part.
  std::vector<NamedSurface> others;  ///< Only rendered and compared.

  [[nodiscard]] const NamedSurface& part() const { return steps.back(); }
};

/// A surface's picture.
struct RenderedSurface {
  std::string name;
  FluxPicture picture;
  PictureQuality quality;
};

/// What one cause adds to the picture's faults: the difference of two neighbours in the chain. The
/// parts of a chain sum to the difference of its ends. Contrast is split by its inverse, which
/// stays finite where the design leaves the dark pixels without any light.
struct CausePart {
  std::string cause;
  double leakage = 0.0;
  double dark_flux = 0.0;
  double dark_ratio = 0.0;
};

/// The designed surface in the light of a point, beside the picture in that of an extended source.
struct PointLight {
  RenderedSurface designed;
  /// Share of the light that the source's extent moves to where the light of a point puts less.
  double moved = 0.0;
};

/// The pictures of a chain and what is wrong with them. Leakage is that against the designed
/// surface in the same light: of an extended source it is what the part adds to the blur.
struct LeakageResult {
  RenderedSurface designed;
  std::optional<PointLight> point;     ///< Where the source is extended.
  std::vector<RenderedSurface> steps;  ///< As LeakageChain::steps; the last is the part.
  std::vector<RenderedSurface> others;
  std::vector<CausePart> parts;  ///< The source's, where it is extended; then one per step.
  std::vector<double> dark;      ///< 1 for dark pixels, 0 for others, row by row from the top.
  std::int64_t dark_pixels = 0;  ///< Of the target; without any the dark figures are 0.
  std::int64_t bright_pixels = 0;

  [[nodiscard]] const RenderedSurface& part() const { return steps.back(); }
};

/// Renders every surface of a chain and splits the leakage by cause. A surface that stands in the
/// chain more than once (the same object) is rendered once. Under an extended source the designed
/// surface is also rendered in the light of a point: what the dark pixels get more is the source's
/// part.
/// @pre the chain has a designed surface and at least one step; target has the setup's pixels.
/// @throw InputError if dark_below and bright_from break their rules; Interrupted.
LeakageResult measure_leakage(const LeakageChain& chain, const Image& target,
                              const FieldRenderSetup& setup, const LeakageOptions& options,
                              const Executor& executor, const RunControl& control,
                              const TileObserver& observe = {});

/// 1 where `part` has more flux than `designed`, 0 elsewhere. @pre equal sizes.
std::vector<double> pixels_with_surplus(const FluxPicture& part, const FluxPicture& designed);

/// max(0, part − designed) of every pixel in units of a uniformly lit picture's pixel: its mean is
/// the leakage times the designed picture's flux. @pre equal sizes.
std::vector<double> surplus(const FluxPicture& part, const FluxPicture& designed);

}  // namespace lensforge

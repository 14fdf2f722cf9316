// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/surface_field.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

struct FieldRenderSetup;
struct Haze;

/// Limits of a target's dark and bright pixels, as shares of its mean.
struct LeakageOptions {
  double dark_below = 0.1;   ///< Dark: linear target below it, ≥ 0.
  double bright_from = 1.0;  ///< Bright: linear target from it on, > dark_below.
};

/// @throw InputError if dark_below and bright_from break their rules.
void validate(const LeakageOptions& options);

/// Mean of the bright pixels ÷ mean of the dark ones, from its inverse; infinite for dark pixels
/// without light.
double contrast_of(double dark_ratio);

/// Picture that a surface projects: share of the lens's flux per pixel, row by row from the top.
struct FluxPicture {
  int columns = 0;
  int rows = 0;
  std::vector<double> flux;

  /// Share of the flux that lands on the picture.
  [[nodiscard]] double inside() const;
  /// The picture scaled so that all of the lens's flux sums to `total`.
  [[nodiscard]] Image image(double total) const;
};

/// Quality of a picture against the target and against the designed picture.
struct PictureQuality {
  ImageMetrics metrics;     ///< Against the target, with all of the lens's flux as its total.
  double leakage = 0.0;     ///< Σ max(0, g − g_designed) / Σ g_designed over all pixels.
  double dark_flux = 0.0;   ///< Share of the lens's flux in the target's dark pixels.
  double dark_ratio = 0.0;  ///< Mean of the dark pixels ÷ mean of the bright ones.

  [[nodiscard]] double contrast() const { return contrast_of(dark_ratio); }
};

/// Σ max(0, picture − designed) over all pixels, as a share of the designed picture's flux; 0 if it
/// has none. @pre equal sizes.
double leakage_share(const FluxPicture& picture, const FluxPicture& designed);

/// Judges pictures of a lens against its target and its designed picture.
class PictureJudge {
 public:
  /// @param target, designed  of equal sizes; both must outlive the judge.
  /// @throw InputError if dark_below and bright_from break their rules.
  PictureJudge(const Image& target, const FluxPicture& designed, const LeakageOptions& options);

  [[nodiscard]] PictureQuality judge(const FluxPicture& picture) const;

  [[nodiscard]] const Image& target() const { return target_; }
  /// 1 for dark pixels, 0 for others, row by row from the top.
  [[nodiscard]] const std::vector<double>& dark() const { return dark_; }
  [[nodiscard]] std::int64_t dark_pixels() const;
  [[nodiscard]] std::int64_t bright_pixels() const;

 private:
  [[nodiscard]] double dark_ratio(const FluxPicture& picture) const;

  const Image& target_;
  const FluxPicture& designed_;
  std::vector<double> dark_;
  std::vector<double> bright_;
};

/// A surface and its name.
struct NamedSurface {
  std::string name;
  const SurfaceField* field = nullptr;
  std::optional<GridWindow> grid = {};  ///< Its own grid; else FieldRenderSetup::grid.
};

/// Names of the causes in the chain that cam measures.
namespace leak_cause {
inline constexpr const char* kSource = "source";  ///< An extended one: in front of the chain.
inline constexpr const char* kDiffraction = "diffraction";  ///< By waves: in front of the chain.
inline constexpr const char* kPolish = "polish";
inline constexpr const char* kCrease = "crease rounding";
inline constexpr const char* kScallop = "scallop";
inline constexpr const char* kChord = "chord";
inline constexpr const char* kDecimals = "decimals";
inline constexpr const char* kPitchError = "pitch error";  ///< If the workshop states one.
inline constexpr const char* kPath = "path";  ///< By waves: chords, decimals and pitch error.
inline constexpr const char* kHaze = "haze";  ///< Behind the chain, if the workshop states it.
}  // namespace leak_cause

/// Called for every sampled tile of a surface; the patch includes one more node around it where
/// there is one.
using TileObserver =
    std::function<void(const SurfaceField&, const CellRange&, const SurfacePatch&)>;

struct RenderedSurface;

/// What a chain's pictures by waves need besides its setup.
struct ChainWaves {
  double wavelength = 0.0;                ///< mm; of a setup without a spectrum; 0: by rays.
  Eigen::Vector2d scatter{0.0, 0.0};      ///< WaveOptions::scatter
  const RenderedSurface* rays = nullptr;  ///< The designed surface by rays.

  /// Nothing if the light goes as rays.
  [[nodiscard]] std::optional<WaveOptions> options() const {
    if (wavelength == 0.0) return std::nullopt;
    WaveOptions waves;
    waves.wavelength = wavelength;
    waves.scatter = scatter;
    return waves;
  }
};

/// Surfaces from the designed one to the part; each adds one cause of wrong light to the one
/// before.
struct LeakageChain {
  NamedSurface designed;
  std::vector<NamedSurface> steps;   ///< Named after the added cause; the last is the part.
  std::vector<NamedSurface> others;  ///< Only rendered and compared.
  TileObserver observe = {};         ///< Sees the tiles of those without a grid of their own.
  const Haze* haze = nullptr;        ///< Of the part's picture: the last cause, if there is any.
  ChainWaves waves = {};             ///< Of measure_waves() and worst_places().

  [[nodiscard]] const NamedSurface& part() const { return steps.back(); }
};

/// A surface's picture.
struct RenderedSurface {
  std::string name;
  FluxPicture picture;
  PictureQuality quality;
};

/// Contribution of one cause to the picture's faults: the difference of two neighbours in the
/// chain. The parts of a chain sum to the difference of its ends. Contrast is split by its inverse,
/// which stays finite where the design leaves the dark pixels without light.
struct CausePart {
  std::string cause;
  double leakage = 0.0;
  double dark_flux = 0.0;
  double dark_ratio = 0.0;
};

/// The designed surface in the light of a point source, for comparison with an extended one.
struct PointLight {
  RenderedSurface designed;
  /// Share of the light that the source's extent moves to where a point source puts less.
  double moved = 0.0;
};

/// The pictures of a chain and their faults. Leakage is measured against the designed surface in
/// the same light: with an extended source it is what the part adds to the blur.
struct LeakageResult {
  RenderedSurface designed;
  std::optional<PointLight> point;      ///< By rays, where the source is extended.
  std::optional<RenderedSurface> rays;  ///< By waves: the designed surface by rays.
  /// As LeakageChain::steps, and the part with its haze where there is any; the last is the part.
  std::vector<RenderedSurface> steps;
  std::vector<RenderedSurface> others;
  bool hazed = false;  ///< True if the last step is that of the haze.
  /// The source's, where it is extended, or by waves that of diffraction; then one per step.
  std::vector<CausePart> parts;
  std::vector<double> dark;      ///< 1 for dark pixels, 0 for others, row by row from the top.
  std::int64_t dark_pixels = 0;  ///< Of the target; without any the dark figures are 0.
  std::int64_t bright_pixels = 0;

  [[nodiscard]] const RenderedSurface& part() const { return steps.back(); }
  /// The part without its haze: what the surface's places send where.
  [[nodiscard]] const RenderedSurface& clear_part() const {
    return hazed ? steps[steps.size() - 2] : steps.back();
  }
};

/// Renders every surface of a chain and splits the leakage by cause. A surface that occurs in the
/// chain more than once (the same object) is rendered once. With an extended source the designed
/// surface is also rendered in the light of a point: the additional light in the dark pixels is the
/// source's part. Haze is added to the part's picture, also among the other surfaces.
/// @pre the chain has a designed surface and at least one step; target has the setup's pixels.
/// @throw InputError if dark_below and bright_from break their rules; Interrupted.
LeakageResult measure_leakage(const LeakageChain& chain, const Image& target,
                              const FieldRenderSetup& setup, const LeakageOptions& options,
                              const Executor& executor, const RunControl& control);

/// A choice of the model, and the reason for it in a sentence.
struct LightChoice {
  bool waves = false;
  std::string words;
};

/// Rays if the surface has creases, which a wave does not show as rays do, or unless waves_show().
/// @param asked       kAuto leaves the choice.
/// @param wavelength  mm; of a setup without a spectrum.
LightChoice light_choice(const FieldRenderSetup& setup, LightModel asked, bool creases,
                         double wavelength);

/// A chain's pictures by scalar waves.
struct WaveLeakage {
  LeakageResult result;
  double wavelength = 0.0;  ///< mm; the middle one of a spectrum.
  double width = 0.0;       ///< diffraction_width(), mm.
};

/// measure_leakage() by wave_flux(); other surfaces than those of the chain's steps are left out.
/// Leakage is measured against the designed surface by waves: it is what the part adds.
/// @pre chain.waves says which.
WaveLeakage measure_waves(const LeakageChain& chain, const Image& target,
                          const FieldRenderSetup& setup, const LeakageOptions& options,
                          const Executor& executor, const RunControl& control);

/// 1 where `part` has more flux than `designed`, 0 elsewhere. @pre equal sizes.
std::vector<double> pixels_with_surplus(const FluxPicture& part, const FluxPicture& designed);

/// max(0, part − designed) of every pixel in units of a uniformly lit picture's pixel: its mean is
/// the leakage times the designed picture's flux. @pre equal sizes.
std::vector<double> surplus(const FluxPicture& part, const FluxPicture& designed);

/// Estimated change of a part's figures at half the sample spacing: about their error.
struct SamplingCheck {
  double spacing = 0.0;  ///< Of the samples, mm.
  double leakage = 0.0;  ///< Of the part at half the spacing − as measured; estimated.
  double mae = 0.0;      ///< The same for its display-encoded mean absolute error.
};

/// Renders kSamplingWindows² windows, evenly spaced over the lens, at half the spacing and
/// extrapolates the change to the whole lens; of fronts (FieldRenderSetup::back) all of it. Costs
/// about a fifth of the two surfaces' pictures for 128² pixels and less for more.
/// @param chain  behind `result`.
/// @param target  with the setup's pixels.
/// @throw Interrupted.
SamplingCheck check_sampling(const LeakageChain& chain, const LeakageResult& result,
                             const Image& target, const FieldRenderSetup& setup,
                             const Executor& executor, const RunControl& control);

/// Number of windows along a side of the lens.
inline constexpr int kSamplingWindows = 6;

/// Side of a window, in pixels as if lens and picture had the same size: only pixels whose light
/// comes entirely from the window show the leakage.
inline constexpr double kWindowPixels = 4.0;

/// A difference of heights and its place.
struct HeightDifference {
  double value = 0.0;  ///< mm, part − designed: above 0 where material is left.
  Eigen::Vector2d place{0.0, 0.0};
};

/// Places on the lens whose light lands in chosen pixels, contrary to the design.
struct LeakMap {
  std::int64_t columns = 0;     ///< Cells along x.
  std::int64_t rows = 0;        ///< Cells along y, from the least.
  CellCounts grid_cells{1, 1};  ///< Cells of the rendered grid in a (square) map cell.
  /// Share of the lens's flux, signed: negative for a cell that takes light away from those pixels.
  std::vector<double> leakage;
  std::vector<HeightDifference> height;  ///< Largest by absolute value in every cell.

  [[nodiscard]] double total() const;
};

/// Traces the light of both surfaces cell by cell: a cell's leakage is Σ weight · (flux of the
/// part's cell − flux of the designed cell) over all pixels, exact as the pictures are. With
/// pixels_with_surplus() as weights the map sums to Σ max(0, g − g_designed), and a cell left as
/// designed counts 0, wherever its light lands. All light of a spectrum is traced in its middle
/// colour. Same bits for any number of threads.
/// @param weights  one per pixel, row by row from the top.
/// @param cell  requested side of a map cell, mm, > 0.
/// @throw Interrupted as the executor does.
LeakMap map_leakage(const NamedSurface& designed, const NamedSurface& part,
                    const FieldRenderSetup& setup, std::span<const double> weights, double cell,
                    const Executor& executor);

/// Selection of places from a map.
struct LeakPlaceOptions {
  int span = 5;   ///< A place is a square of span × span cells, ≥ 1.
  int count = 3;  ///< Maximum number of places, ≥ 0.
};

/// Predicted leakage of a place if one thing were changed.
struct LeakTrial {
  std::string change;      ///< "a 0.3 mm ball"
  double leakage = 0.0;    ///< As LeakPlace::leakage, all else unchanged.
  double dark_flux = 0.0;  ///< As LeakPlace::dark_flux.
  double moves = 1.0;      ///< Moves of the whole lens's finishing with the change ÷ without it.
  double minutes = 1.0;    ///< The same for its minutes at the finishing feed.
};

/// A part of the lens from which light leaks.
struct LeakPlace {
  CellRange cells;                  ///< Of the rendered grid.
  Eigen::Vector2d place{0.0, 0.0};  ///< Source of most of it, mm on the lens.
  double side = 0.0;                ///< Of the square, mm.
  double leakage = 0.0;    ///< Share of the lens's flux that leaves here and lands where the design
                           ///< puts less, minus the designed share.
  double dark_flux = 0.0;  ///< The same for the dark pixels.
  HeightDifference height;          ///< Largest difference of height in the worst cell.
  Eigen::Vector2d lands{0.0, 0.0};  ///< Centre of that light, pixel coordinates.
  std::vector<CausePart> parts;     ///< `leakage` and `dark_flux` by cause; dark_ratio stays 0.
  std::vector<LeakTrial> trials;    ///< Of remedies, if any were tried.
};

/// The places that leak most, worst first, at least a square's side apart. `map` gives the places,
/// the chain the causes, by waves if it has them, haze not among them: it scatters light of every
/// place alike. @throw Interrupted as the executor does.
std::vector<LeakPlace> worst_places(const LeakMap& map, const LeakageChain& chain,
                                    const LeakageResult& result, const FieldRenderSetup& setup,
                                    const LeakPlaceOptions& options, const Executor& executor);

}  // namespace lensforge

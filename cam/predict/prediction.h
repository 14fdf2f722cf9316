// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/leakage/leakage.h"
#include "cam/milled/creases.h"
#include "cam/path/operation.h"
#include "cam/plan/cam_options.h"
#include "cam/plan/cut_plan.h"
#include "cam/predict/part_surfaces.h"
#include "cam/report/report_data.h"
#include "cam/tolerance/tolerance_forecast.h"
#include "core/compute/executor.h"
#include "core/image/rasters.h"
#include "core/lens/lens.h"
#include "core/lens/surface_field.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"
#include "core/optics/polish_transfer.h"

namespace lensforge {

/// Prediction of a part before it is cut.
struct Prediction {
  LeakageResult leakage;             ///< By rays.
  std::optional<WaveLeakage> waves;  ///< Where the light model asks for them.
  /// Of a lens for two pictures: designed and part on its second screen, by rays, without haze.
  std::optional<LeakageResult> second;
  ChainWaves light = {};           ///< Of `waves`.
  std::string light_words;         ///< By what the part is judged, and why.
  std::vector<PictureBlur> blurs;  ///< Of light and part.
  Haze haze;                       ///< Of the part; none where its roughness is not stated.
  std::string haze_words;          ///< What it scatters, or that it is not counted.
  SamplingCheck sampling;          ///< Of the part.
  std::vector<LeakPlace> places;   ///< Places that leak most, worst first.
  CreaseMap creases;
  ReportMap height;              ///< Part − designed, µm.
  LensRaster surface;            ///< Heights of the part, mm.
  SurfaceMesh milled;            ///< The surface as milled, at kMeshSpacing.
  LayeredImage surfaces;         ///< Designed but polished, and the part: PartLayers.
  ToleranceForecast tolerances;  ///< Empty unless requested.
  std::vector<FaceError> faces;  ///< Of a lens whose two faces are cut; else empty.

  /// By what the part is judged.
  [[nodiscard]] const LeakageResult& judged() const { return waves ? waves->result : leakage; }
};

/// Spacing of the nodes of milled.ply, mm: 100 mm take 1 million.
inline constexpr double kMeshSpacing = 0.1;

/// Renders every surface from the design to the polished part and finds where light leaks, by rays
/// and, where the light model asks for it, by waves. Memory does not grow with the number of
/// samples. @throw Interrupted
Prediction predict_part(const PartSurfaces& surfaces, const CutSetup& cut, const Executor& executor,
                        const RunControl& control);

/// The parts with errors that CamOptions::tolerances asks for, or a few for their range; none where
/// they cannot be drawn.
PartDraws part_draws(const CamOptions& options, const OpticalSetup& setup);

/// A predicted cut, for trying its places again.
struct TrialSite {
  const CutSetup& setup;
  const CutPasses& passes;
  const SurfaceField& part;      ///< As predicted.
  const LeakageResult& leakage;  ///< By rays or waves.
  ChainWaves waves = {};         ///< Of the light, if it goes as waves.
};

/// Cuts places of a predicted cut again, with other options: the finishing rows and valleys around
/// a place are planned, fitted and rounded as in make_cut(), and the light of the place is traced
/// from the resulting surface, cast and polished. It replaces the place's light in the predicted
/// picture; the change of the whole leakage, wherever the light lands, is added to the place's own.
/// Unlike in a new cut, the rest of the lens stays as predicted, and rows begin at the place, so
/// their moves join elsewhere.
class TrialCut {
 public:
  /// @param changed  may differ from the setup's options in finishing tool and process, decimals,
  ///                 tolerances and polishing.
  /// All references must outlive this. @pre `changed` is valid for the lens.
  TrialCut(const TrialSite& site, const CamOptions& changed, const Executor& executor);

  /// Work of the finishing rasters over the whole lens.
  struct Work {
    double moves = 0.0;
    double minutes = 0.0;  ///< Length ÷ feed.
  };
  /// Estimated from kWorkRows rows of every raster, evenly spread. @throw Interrupted
  [[nodiscard]] Work work(const RunControl& control) const;
  static constexpr std::int64_t kWorkRows = 6;

  /// Predicts the leakage of a place with the changed options. @throw Interrupted
  [[nodiscard]] LeakTrial at(const LeakPlace& place, const RunControl& control) const;

 private:
  [[nodiscard]] std::vector<BallPath> paths_around(const Eigen::AlignedBox2d& box,
                                                   const RunControl& control) const;
  void add_pencil(const Eigen::AlignedBox2d& box, const MoveSink& sink,
                  const RunControl& control) const;

  TrialSite site_;
  const CamOptions& options_;
  const Executor& executor_;
  std::unique_ptr<const FinishBalls> own_;  ///< If balls or rows differ.
  const FinishBalls* balls_;
  std::vector<FinishPass> passes_;
};

/// Tries remedies at every place against its main cause, and against the next one if that does not
/// halve the leak, and records the predicted leakage in LeakPlace::trials. Against creases: smaller
/// balls, one after the other until the leak is halved, at most three; against scallops half the
/// pitch; against chords half the tolerances; against decimals one more; against polishing half of
/// it, then half of it and half the pitch. Everything else stays unchanged.
/// @throw Interrupted
void try_remedies(const TrialSite& site, std::vector<LeakPlace>& places, const Executor& executor,
                  const RunControl& control);

/// Angles along x and y within which a part's rows scatter beside their rays, rad:
/// WaveOptions::scatter. @param wavelength  mm
Eigen::Vector2d order_angles(double wavelength, const Passes& passes);

/// Blur by a film or polish of σ, mm, in pixels: it moves the picture's detail like the lens's.
double smoothing_blur(const OpticalSetup& setup, double sigma);

/// Blurs of the light, of the polish, which moves the picture's detail like the lens's, and of the
/// ripple that polish leaves of the rows, by rays.
/// @param height  of the surface, about, mm. @param wavelength  mm
std::vector<PictureBlur> part_blurs(const OpticalSetup& setup, const CamOptions& options,
                                    const Passes& passes, double height, double wavelength);

/// Predicts the picture of a lens from the surfaces of its cut, with the remedies and tolerances
/// that its options request. @throw Interrupted
Prediction predict_cut(const CutSetup& setup, const CutPasses& passes, const CutSurfaces& cut,
                       const Executor& executor, const RunControl& control);

}  // namespace lensforge

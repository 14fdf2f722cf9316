// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cam/path/finish_raster.h"
#include "cam/plan/cam_options.h"
#include "cam/plan/cut_plan.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/lens/surface_field.h"

namespace lensforge {

/// What may differ between a lens's forecast and its picture on a wall.
enum class Deviation {
  kDistance,   ///< Of the wall, a share of the lens's distance from it.
  kTiltX,      ///< Of the wall about its horizontal axis, rad.
  kTiltY,      ///< About its vertical axis, rad.
  kPartTiltX,  ///< Of the part about the lens's x axis, rad; lamp and wall stay.
  kPartTiltY,  ///< About its y axis, rad.
  kLampSize,  ///< Square of the lamp's full angle as seen from the lens, minus the design's, rad².
  kLampDistance,  ///< 1 / distance of the lamp, minus the design's, as a share of 1 / focal length.
  kIndex,         ///< Of (n − 1), a share.
  kPolish,        ///< ln(σ / σ of the workshop).
  kBall,          ///< Of the finishing ball's radius, a share.
  kPitch,         ///< FinishProcess::pitch_error beyond the workshop's, a share.
  kBacklash,      ///< Of the axis along the rows, mm; < 0: compensated by too much.
  kHaze,          ///< Haze::share beyond the workshop's.
};
inline constexpr std::size_t kDeviations = 13;

/// One value of each Deviation, all 0 for the forecast.
using Deviations = Eigen::Matrix<double, static_cast<int>(kDeviations), 1>;

inline Eigen::Index index_of(Deviation deviation) { return static_cast<Eigen::Index>(deviation); }

/// Step of each for derivatives by differences: its picture changes well above rounding, and
/// linearly.
Deviations deviation_steps(const OpticalSetup& setup);

/// Limits within which pictures are computed.
struct DeviationLimits {
  Deviations least, most;
};
DeviationLimits deviation_limits(const OpticalSetup& setup);

/// Distance of the picture's middle from the lens's, mm.
double wall_distance(const OpticalSetup& setup);
/// Full angle of the lamp as seen from the lens, rad.
double lamp_angle(const OpticalSetup& setup);
/// Distance of the lamp from the lens, mm; none for parallel light.
std::optional<double> lamp_distance(const OpticalSetup& setup);

/// Predicts pictures on the wall, with light around the picture's rectangle, by cam's chain: the
/// finishing rows are planned and fitted once; the balls that they move, with deviations, leave a
/// surface (MilledField), which is polished (PolishedField) and rendered (render_field(), a lamp
/// with a width by a convolution). Where light_choice() asks for waves, the picture by rays of the
/// lamp's middle is blurred by the Gaussian that brings the planned part's nearest to that by
/// waves, what then is missing is added, and all convolved with the lamp. Where parts cannot be
/// drawn (tolerance_fault(), creases) it is the lens as designed. Every step is kept and done anew
/// only for the deviations that it depends on: a cut by ball, pitch error and backlash, a part by
/// these and its polish, its light by these, the lamp and the wall. Not for several threads at
/// once.
class WallModel {
 public:
  /// @param lens  must outlive this. @param options  with the workshop.
  /// @param fine  pixels of the predicted pictures per pixel of the lens's picture, ≥ 1.
  /// @throw InputError for waves of a lens without a part; Interrupted
  WallModel(const Lens& lens, const CamOptions& options, int fine, const Executor& executor,
            const RunControl& control);
  WallModel(const WallModel&) = delete;
  WallModel& operator=(const WallModel&) = delete;
  ~WallModel();

  /// Irradiance relative to all light spread evenly over the picture. Deviations beyond
  /// deviation_limits() count as these. @throw Interrupted once the constructor's control stops
  /// @param near  deviations close by: from theirs the diffraction is taken to first order, with
  ///              its changes around the forecast, since waves are most of a picture's time.
  [[nodiscard]] Image picture(const Deviations& deviations, const Deviations& near) const;
  [[nodiscard]] Image picture(const Deviations& deviations) const {
    return picture(deviations, deviations);
  }
  /// ln of the size of that picture's pixels, in planned ones: those of another lamp's distance
  /// grow with the shadow of the lens, in which details keep their places.
  [[nodiscard]] double log_size(const Deviations& deviations) const;

  [[nodiscard]] const Lens& lens() const { return lens_; }
  [[nodiscard]] const CamOptions& options() const { return options_; }
  /// False if the part's own deviations have no effect here.
  [[nodiscard]] bool has_part() const { return !rows_.empty(); }
  /// Why there is no part; empty if there is one.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  /// True if diffraction is in the pictures.
  [[nodiscard]] bool by_waves() const { return waves_.has_value(); }
  /// True if the deviation can show at all.
  [[nodiscard]] bool shows(Deviation deviation) const;
  /// Pixels of a picture beyond each side of the picture's rectangle.
  [[nodiscard]] int margin() const { return margin_; }
  [[nodiscard]] int fine() const { return fine_; }

 private:
  /// Rows that a ball of this radius cuts.
  struct BallRows {
    double radius = 0.0;  ///< mm
    std::vector<RasterRow> rows;
  };
  /// A surface as cut, and one as polished.
  struct Cut;
  struct Part;

  /// Values by key, of which the one used longest ago is dropped first.
  template <class Key, class Value>
  struct Kept {
    std::size_t most = 1;
    std::vector<std::pair<Key, Value>> values;  ///< The last one was used last.

    /// The value of a key, made where it is not kept.
    template <class Make>
    const Value& of(const Key& key, const Make& make) {
      const auto found = std::find_if(values.begin(), values.end(),
                                      [&](const auto& one) { return one.first == key; });
      if (found != values.end()) {
        std::rotate(found, found + 1, values.end());
      } else {
        Value value = make();
        if (values.size() == most) values.erase(values.begin());
        values.emplace_back(key, std::move(value));
      }
      return values.back().second;
    }
  };

  void plan_rows(const CutSetup& setup, const RunControl& control);
  void choose_light();
  /// What a cut depends on: the ball's radius, a share; the pitch error; the backlash, mm.
  using CutKey = std::array<double, 3>;
  [[nodiscard]] std::shared_ptr<const Cut> cut(const CutKey& made) const;
  [[nodiscard]] std::shared_ptr<const Part> part(const Deviations& deviations) const;
  /// Shares of the light of a part.
  [[nodiscard]] std::vector<double> light_of(const Part& part, const OpticalSetup& optics) const;
  /// The same by waves.
  [[nodiscard]] std::vector<double> waves_of(const Part& part, const OpticalSetup& optics,
                                             const WaveOptions& waves) const;
  /// What waves add to blurred rays in the light of the lamp's middle.
  /// @param for_tilts  as finely as tilts ask for, at three times the cost; always if there is one.
  [[nodiscard]] const std::vector<double>& diffraction(Deviations at, bool for_tilts) const;
  /// Its change by one of deviation_steps() from the forecast.
  [[nodiscard]] const std::vector<double>& diffraction_change(Deviation deviation) const;
  /// The same to first order, from that of deviations close by.
  [[nodiscard]] std::vector<double> diffraction(const Deviations& at, const Deviations& near) const;
  [[nodiscard]] Deviations within_limits(const Deviations& deviations) const;
  [[nodiscard]] OpticalSetup optics_of(const Deviations& deviations) const;
  [[nodiscard]] Haze haze_at(const OpticalSetup& optics, double more) const;
  /// Shares of the light, of the lens as designed where there is no part, and without haze.
  [[nodiscard]] std::vector<double> clear_flux(const Deviations& deviations,
                                               const Deviations& near) const;
  [[nodiscard]] bool is_kept_whole() const;

  const Lens& lens_;
  CamOptions options_;
  int fine_;
  int margin_;
  OpticalSetup wide_;  ///< The lens's, with margin and fine pixels.
  double height_;      ///< Of the surface, mm.
  double blank_top_ = 0.0;
  Passes passes_;
  std::string fault_;
  std::vector<BallRows> rows_;            ///< Empty if there is no part.
  GridWindow grid_;                       ///< On which parts are sampled, if there is one.
  std::optional<WaveOptions> waves_;      ///< If the light goes as waves.
  std::vector<double> diffraction_blur_;  ///< As blurred() takes it; of waves.
  Executor executor_;
  RunControl silent_;  ///< Stops what is computed later.
  mutable Kept<CutKey, std::shared_ptr<const Cut>> cuts_;
  mutable Kept<std::pair<double, CutKey>, std::shared_ptr<const Part>> parts_;
  /// By deviations, and by those whose diffraction it is.
  using PictureKey = std::pair<Deviations, Deviations>;
  mutable Kept<PictureKey, std::vector<double>> lights_;
  mutable Kept<PictureKey, Image> pictures_;
  mutable Kept<std::pair<Deviations, bool>, std::vector<double>> diffractions_;
  mutable std::array<std::vector<double>, kDeviations> diffraction_changes_;  ///< Once asked for.
};

}  // namespace lensforge

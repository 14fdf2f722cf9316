// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "cam/finish_paths.h"
#include "cam/leakage/leakage.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/mould.h"
#include "cam/milled/polished_field.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled/surface_field.h"

namespace lensforge {

/// Every surface between the design and the polished part, each with one cause of wrong light more
/// than the one before (LeakageChain). Tiles are held (HeldField): not for several threads at once.
class PartSurfaces {
 public:
  /// What is designed and what mills it. All must outlive the surfaces.
  struct Design {
    const SurfaceField& surface;     ///< Of the lens; held, if tiles are to be shared.
    const RoundedField& rounded;     ///< Of what is cut, lens or mould.
    Eigen::AlignedBox2d rectangle;   ///< Of the lens, mm.
    double blank_top = 0.0;          ///< mm
    std::optional<CastFrame> mould;  ///< If the lens is cast.
  };

  PartSurfaces(const Design& design, FinishPaths paths, const PolishModel& polish);

  [[nodiscard]] LeakageChain chain() const;
  [[nodiscard]] const SurfaceField& designed() const { return design_.surface; }
  [[nodiscard]] const SurfaceField& rounded() const { return *raw_[1]; }
  [[nodiscard]] const SurfaceField& milled() const { return *raw_.back(); }
  [[nodiscard]] const SurfaceField& part() const { return *polished_.back(); }

 private:
  /// As the lens has it: cast if it is cut in a mould.
  const SurfaceField* on_lens(const SurfaceField& cut);

  /// For surfaces that are rendered themselves and polished.
  const SurfaceField* held(const SurfaceField* field);

  Design design_;
  MilledField ideal_;
  MilledField fitted_;
  MilledField written_;
  std::optional<MilledField> stretched_;  ///< If the machine makes other ways than are written.
  std::vector<std::unique_ptr<CastField>> cast_;
  std::vector<std::unique_ptr<HeldField>> held_;
  std::vector<const SurfaceField*> raw_;                  ///< In the order of the chain.
  std::vector<std::unique_ptr<PolishedField>> polished_;  ///< Likewise.
};

/// Names of the surfaces that are rendered beside the chain's.
namespace surface_name {
inline constexpr const char* kDesigned = "designed";
inline constexpr const char* kRounded = "tool-rounded";
inline constexpr const char* kMilled = "as milled";
inline constexpr const char* kPolished = "polished";
}  // namespace surface_name

}  // namespace lensforge

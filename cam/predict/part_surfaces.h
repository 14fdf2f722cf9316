// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/leakage/leakage.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/mould.h"
#include "cam/milled/polished_field.h"
#include "cam/milled/rounded_field.h"
#include "cam/milled/surface_field.h"
#include "cam/plan/finishing.h"
#include "core/compute/executor.h"
#include "core/image/layered_image.h"
#include "core/surface/optical_surface.h"

namespace lensforge {

/// An optical surface as the prediction asks for it. Its tiles are held (HeldField): not for
/// several threads at once.
class MeantSurface {
 public:
  MeantSurface() = default;
  MeantSurface(const MeantSurface&) = delete;
  MeantSurface& operator=(const MeantSurface&) = delete;
  virtual ~MeantSurface() = default;

  [[nodiscard]] virtual const SurfaceField& field() const = 0;

  /// What the ball can reach of it. `cut` is the same surface; both must outlive the result.
  [[nodiscard]] virtual std::unique_ptr<RoundedField> rounded(const CutSurface& cut,
                                                              const Eigen::AlignedBox2d& rectangle,
                                                              const Executor& executor) = 0;
};

std::unique_ptr<MeantSurface> meant_surface(std::shared_ptr<const OpticalSurface> surface);

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

/// Surfaces in part.exr.
namespace part_layer {
inline constexpr const char* kPolished = "polished";  ///< As designed, but polished.
inline constexpr const char* kPart = "part";          ///< Cut and polished.
}  // namespace part_layer

/// Nodes of a surface in part.exr, about: what a page of 25 MB can hold.
inline constexpr double kPartNodes = 4e5;

/// The nodes of a surface's layers: columns and rows, evenly over the lens, and how many cells of
/// the grid that is sampled lie between two of them.
struct PartGrid {
  Eigen::Vector2i nodes;
  Eigen::Vector2i every;
};

/// @param spacings  of the grid that is sampled, along x and y, at most, mm. @param most  nodes,
/// about.
PartGrid part_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings, double most);

/// The grid over the lens that is sampled, at most `spacings` apart: nodes of part_grid() with
/// kPartNodes are nodes of it.
GridWindow sampled_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings);

/// Heights, mm, and slopes of surfaces as layers "NAME.z", "NAME.slope_x" and "NAME.slope_y", at
/// nodes evenly over the lens, the upper left one first, kept from the tiles that are sampled for
/// the surfaces' pictures.
class PartLayers {
 public:
  /// @param spacings  as of sampled_grid(), whose tiles are taken.
  PartLayers(std::vector<NamedSurface> surfaces, const Eigen::Vector2d& lens_size,
             const Eigen::Vector2d& spacings);

  /// Keeps what layers need of a surface's tile; of other surfaces that is nothing.
  void take(const SurfaceField& field, const SurfacePatch& tile, const Executor& executor);

  /// @pre every tile was taken.
  [[nodiscard]] const LayeredImage& layers() const { return layers_; }

 private:
  std::vector<NamedSurface> surfaces_;
  PartGrid nodes_;
  LayeredImage layers_;
};

/// The pictures of the designed surface and of a chain's steps, under the names that they have
/// there, linear light.
/// @param total  of a picture with all of the lens's light.
LayeredImage cause_layers(const LeakageResult& leakage, double total);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cam/contact/cut_surface.h"
#include "cam/leakage/leakage.h"
#include "cam/milled/milled_field.h"
#include "cam/milled/mould.h"
#include "cam/milled/polished_field.h"
#include "cam/milled/rounded_field.h"
#include "cam/plan/cut_plan.h"
#include "cam/plan/finishing.h"
#include "core/compute/executor.h"
#include "core/image/rasters.h"
#include "core/lens/optical_surface.h"
#include "core/lens/surface_field.h"
#include "core/optics/front.h"

namespace lensforge {

/// An optical surface for the prediction. Its tiles are held (HeldField): not for several threads
/// at once.
class MeantSurface {
 public:
  MeantSurface() = default;
  MeantSurface(const MeantSurface&) = delete;
  MeantSurface& operator=(const MeantSurface&) = delete;
  virtual ~MeantSurface() = default;

  [[nodiscard]] virtual const SurfaceField& field() const = 0;

  /// The surface that the ball can reach. `cut` is the same surface; both must outlive the result.
  [[nodiscard]] virtual std::unique_ptr<RoundedField> rounded(const CutSurface& cut,
                                                              const Eigen::AlignedBox2d& rectangle,
                                                              const Executor& executor) = 0;
};

std::unique_ptr<MeantSurface> meant_surface(std::shared_ptr<const OpticalSurface> surface);

/// Every surface between the design and the polished part; each adds one cause of wrong light to
/// the one before (LeakageChain). Tiles are held (HeldField): not for several threads at once.
class PartSurfaces {
 public:
  /// The designed surfaces and their frame. All must outlive the surfaces.
  struct Design {
    const SurfaceField& surface;      ///< Of the lens; held, if tiles are to be shared.
    const RoundedField& rounded;      ///< Of the surface to cut, lens or mould.
    Eigen::AlignedBox2d rectangle;    ///< Of the lens, mm.
    double blank_top = 0.0;           ///< mm
    std::optional<CastFrame> turned;  ///< If the lens is cast, or lies turned over.
  };

  PartSurfaces(const Design& design, FinishPaths paths, const PolishModel& polish);

  [[nodiscard]] LeakageChain chain() const;
  /// The same with the path's causes in one, for waves, whose pictures take longer.
  /// @param even  grid of the surfaces that have no rows.
  [[nodiscard]] LeakageChain short_chain(const GridWindow& even) const;
  [[nodiscard]] const SurfaceField& designed() const { return design_.surface; }
  [[nodiscard]] const SurfaceField& rounded() const { return *raw_[1]; }
  [[nodiscard]] const SurfaceField& milled() const { return *raw_.back(); }
  /// As milled, in the frame of the cut.
  [[nodiscard]] const SurfaceField& cut() const { return stretched_ ? *stretched_ : written_; }
  [[nodiscard]] const SurfaceField& part() const { return *polished_.back(); }

 private:
  /// The surface on the lens: a cast one if it is cut in a mould.
  const SurfaceField* on_lens(const SurfaceField& cut);

  /// Holds tiles of a surface that is both rendered itself and polished.
  const SurfaceField* held(const SurfaceField* field);

  Design design_;
  MilledField ideal_;
  MilledField fitted_;
  MilledField written_;
  std::optional<MilledField> stretched_;  ///< If the machine's paths differ from the written ones.
  std::vector<std::unique_ptr<CastField>> cast_;
  std::vector<std::unique_ptr<HeldField>> held_;
  std::vector<const SurfaceField*> raw_;                  ///< In the order of the chain.
  std::vector<std::unique_ptr<PolishedField>> polished_;  ///< In the same order.
};

/// The surfaces of one cut with all that they are made from. Not for several threads at once.
class CutSurfaces {
 public:
  /// @param setup, passes  must outlive this. @param paths  finish_paths().
  CutSurfaces(const CutSetup& setup, const CutPasses& passes, FinishPaths paths,
              const Executor& executor);
  CutSurfaces(const CutSurfaces&) = delete;
  CutSurfaces& operator=(const CutSurfaces&) = delete;

  [[nodiscard]] const PartSurfaces& surfaces() const { return *surfaces_; }

 private:
  std::unique_ptr<MeantSurface> cut_;
  std::unique_ptr<MeantSurface> lens_;  ///< Null if it is the surface that is cut, or a front.
  std::unique_ptr<CastField> front_;    ///< In the lens's frame, if that is cut.
  std::unique_ptr<RoundedField> rounded_;
  std::optional<PartSurfaces> surfaces_;
};

/// Names of the surfaces rendered in addition to the chain's.
namespace surface_name {
inline constexpr const char* kDesigned = "designed";
inline constexpr const char* kRounded = "tool-rounded";
inline constexpr const char* kMilled = "as milled";
inline constexpr const char* kPolished = "polished";
inline constexpr const char* kBoth = "both faces";  ///< The part, and the other face as made.
}  // namespace surface_name

/// Surfaces in part.exr.
namespace part_layer {
inline constexpr const char* kPolished = "polished";  ///< As designed, but polished.
inline constexpr const char* kPart = "part";          ///< Cut and polished.
}  // namespace part_layer

/// Name of the layer with a surface's heights.
std::string layer_of(const std::string& surface);

/// Fingerprint of the design from lens.json; empty if it has none.
std::string fingerprint_of(const Lens& lens);

/// The other face of a lens with a shaped front as its own cut predicted it, from
/// CamOptions::other_cut; nothing if there is no such cut of this design.
std::optional<HeightFront> made_face(const CutSetup& cut);

/// A face by its heights.
class HeightMapField final : public SurfaceField {
 public:
  explicit HeightMapField(HeightFront map) : map_(std::move(map)), surface_(map_) {}

  void sample(const GridWindow& window, const Executor& executor,
              SurfacePatch& patch) const override;

 private:
  HeightFront map_;
  FrontSurface surface_;
};

/// Approximate maximum number of nodes of a surface in part.exr: more would not fit a page of 15
/// MB.
inline constexpr double kPartNodes = 6.3e6;
/// Minimum spacing of these nodes, mm. A 64² portrait's part, polished with σ = 30 µm, has an error
/// of MAE 0.0005 with nodes every 0.01 × 0.03 mm and 0.0022 with 0.03 × 0.03 mm.
inline constexpr double kPartSpacing = 0.01;

/// The nodes of a surface's layers: columns and rows, evenly over the lens, and the cells of the
/// sampled grid between two of them.
struct PartGrid {
  Eigen::Vector2i nodes;
  Eigen::Vector2i every;
};

/// @param spacings  maximum of the sampled grid's, along x and y, mm. @param most  approximate
///                  number of nodes.
PartGrid part_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings, double most);

/// The sampled grid over the lens, with nodes at most `spacings` apart; it contains the nodes of
/// part_grid() with kPartNodes.
GridWindow sampled_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings);

/// Heights of surfaces, mm, as layers "NAME.z" at nodes evenly over the lens, the upper left one
/// first, taken from the tiles sampled for the surfaces' pictures.
class PartLayers {
 public:
  /// @param spacings  as of sampled_grid(), whose tiles are taken.
  PartLayers(std::vector<NamedSurface> surfaces, const Eigen::Vector2d& lens_size,
             const Eigen::Vector2d& spacings);

  /// Keeps the layers' nodes of a surface's tile; ignores other surfaces.
  void take(const SurfaceField& field, const SurfacePatch& tile, const Executor& executor);

  /// @pre every tile was taken.
  [[nodiscard]] const LayeredImage& layers() const { return layers_; }

 private:
  std::vector<NamedSurface> surfaces_;
  PartGrid nodes_;
  LayeredImage layers_;
};

/// The pictures of the designed surface and of a chain's steps, under their names in the chain,
/// linear light.
/// @param total  of a picture with all of the lens's light.
LayeredImage cause_layers(const LeakageResult& leakage, double total);

}  // namespace lensforge

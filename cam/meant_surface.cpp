// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/meant_surface.h"

#include <limits>
#include <optional>
#include <utility>

#include "cam/contact/drop_cutter.h"
#include "cam/milled/designed_field.h"
#include "cam/milled/surface_field.h"

namespace lensforge {
namespace {

/// How finely a surface without creases is cut into facets, which are followed only in grooves that
/// bend as sharply as the ball (RowCurves), and by the pencil.
constexpr SmoothCutOptions kSmoothCut{1e-4, 2e-2};

/// The same where the ball's reach is judged: only heights count, since a fillet's slopes are the
/// ball's.
constexpr SmoothCutOptions kReachCut{1e-4, std::numeric_limits<double>::infinity()};

/// Facets are cut and rendered as they are.
class MeantFacets final : public MeantSurface {
 public:
  explicit MeantFacets(std::shared_ptr<const OpticalSurface> surface)
      : surface_(std::move(surface)), facets_(surface_->mesh()), held_(facets_) {}

  [[nodiscard]] const SurfaceField& field() const override { return held_; }

  [[nodiscard]] std::unique_ptr<RoundedField> rounded(const CutSurface& cut,
                                                      const Eigen::AlignedBox2d& rectangle,
                                                      const Executor& executor) override {
    cutter_ = cut.cutter(rectangle, executor);
    return std::make_unique<RoundedField>(held_, facets_.grid(), *cutter_, executor);
  }

 private:
  std::shared_ptr<const OpticalSurface> surface_;
  FacetField facets_;
  HeldField held_;
  std::shared_ptr<const DropCutter> cutter_;
};

/// A surface without creases is cut through finer facets of its own.
class MeantSmooth final : public MeantSurface {
 public:
  explicit MeantSmooth(std::shared_ptr<const OpticalSurface> surface)
      : surface_(std::move(surface)), field_(*surface_), held_(field_) {}

  [[nodiscard]] const SurfaceField& field() const override { return held_; }

  [[nodiscard]] std::unique_ptr<RoundedField> rounded(const CutSurface& cut,
                                                      const Eigen::AlignedBox2d& /*rectangle*/,
                                                      const Executor& executor) override {
    if (const auto* const same = dynamic_cast<const SmoothCutSurface*>(&cut)) {
      reach_.emplace(*same, kReachCut, executor);
    } else {
      reach_.emplace(surface_, cut.radius(), kReachCut, executor);
    }
    return std::make_unique<RoundedField>(held_, *reach_, reach_->deviation().height, executor);
  }

 private:
  std::shared_ptr<const OpticalSurface> surface_;
  SmoothField field_;
  HeldField held_;
  std::optional<SmoothCutSurface> reach_;
};

}  // namespace

std::unique_ptr<MeantSurface> meant_surface(std::shared_ptr<const OpticalSurface> surface) {
  if (surface->has_creases()) return std::make_unique<MeantFacets>(std::move(surface));
  return std::make_unique<MeantSmooth>(std::move(surface));
}

std::unique_ptr<CutSurface> surface_to_cut(std::shared_ptr<const OpticalSurface> surface,
                                           double radius, const Executor& executor) {
  if (surface->has_creases()) {
    return std::make_unique<FacetCutSurface>(surface->mesh(), radius, executor);
  }
  return std::make_unique<SmoothCutSurface>(std::move(surface), radius, kSmoothCut, executor);
}

}  // namespace lensforge

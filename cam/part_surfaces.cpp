// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/part_surfaces.h"

#include <utility>

namespace lensforge {

PartSurfaces::PartSurfaces(const Design& design, FinishPaths paths, const PolishModel& polish)
    : design_(design),
      ideal_(std::move(paths.ideal), design.blank_top),
      fitted_(std::move(paths.fitted), design.blank_top),
      written_(std::move(paths.written), design.blank_top) {
  raw_ = {&design.surface, held(on_lens(design.rounded)), on_lens(ideal_), on_lens(fitted_),
          held(on_lens(written_))};
  if (!paths.stretched.empty()) {
    stretched_.emplace(std::move(paths.stretched), design.blank_top);
    raw_.push_back(held(on_lens(*stretched_)));
  }
  for (const SurfaceField* field : raw_) {
    polished_.push_back(
        std::make_unique<PolishedField>(*field, design.surface, design.rectangle, polish));
  }
}

const SurfaceField* PartSurfaces::on_lens(const SurfaceField& cut) {
  if (!design_.mould) return &cut;
  cast_.push_back(std::make_unique<CastField>(cut, *design_.mould));
  return cast_.back().get();
}

const SurfaceField* PartSurfaces::held(const SurfaceField* field) {
  held_.push_back(std::make_unique<HeldField>(*field));
  return held_.back().get();
}

LeakageChain PartSurfaces::chain() const {
  LeakageChain chain;
  chain.designed = {surface_name::kDesigned, &design_.surface};
  const char* const causes[] = {leak_cause::kPolish,   leak_cause::kCrease,
                                leak_cause::kScallop,  leak_cause::kChord,
                                leak_cause::kDecimals, leak_cause::kPitchError};
  for (std::size_t i = 0; i < polished_.size(); ++i) {
    chain.steps.push_back({causes[i], polished_[i].get()});
  }
  chain.others = {{surface_name::kRounded, raw_[1]},
                  {surface_name::kMilled, raw_.back()},
                  {surface_name::kPolished, &part()}};
  return chain;
}

}  // namespace lensforge

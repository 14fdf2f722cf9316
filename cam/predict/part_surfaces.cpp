// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/predict/part_surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

#include "cam/cam.h"
#include "cam/contact/drop_cutter.h"
#include "cam/milled/rounded_field.h"
#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/lens/continued_surface.h"
#include "core/lens/surface_field.h"

namespace lensforge {
namespace {

/// Facets of a surface without creases for checking the ball's reach: only heights count, since a
/// fillet's slopes are the ball's.
constexpr SmoothCutOptions kReachCut{1e-4, std::numeric_limits<double>::infinity()};

/// Facets, cut and rendered without smoothing.
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
    polished_.push_back(std::make_unique<PolishedField>(*field, design.rectangle, polish));
  }
}

const SurfaceField* PartSurfaces::on_lens(const SurfaceField& cut) {
  if (!design_.turned) return &cut;
  cast_.push_back(std::make_unique<CastField>(cut, *design_.turned));
  return cast_.back().get();
}

const SurfaceField* PartSurfaces::held(const SurfaceField* field) {
  held_.push_back(std::make_unique<HeldField>(*field));
  return held_.back().get();
}

CutSurfaces::CutSurfaces(const CutSetup& setup, const CutPasses& passes, FinishPaths paths,
                         const Executor& executor)
    : cut_(meant_surface(setup.optical)),
      rounded_(cut_->rounded(passes.balls->surface(), setup.cut_rectangle(), executor)) {
  const Lens& lens = *setup.lens;
  const std::optional<CastFrame> turned = setup.turned();
  if (setup.is_front()) {
    front_ = std::make_unique<CastField>(cut_->field(), *turned);
  } else if (turned) {
    // The mould's surface differs from the surface of the lens cast in it.
    lens_ = meant_surface(
        continued_surface(optical_surface(lens, setup.model), setup.apron_on_lens(), RunOut{}));
  }
  const SurfaceField& on_lens = lens_ ? lens_->field() : cut_->field();
  const SurfaceField& meant = front_ ? *front_ : on_lens;
  const Eigen::AlignedBox2d rectangle(Eigen::Vector2d(0.0, 0.0), lens.setup.lens_size);
  surfaces_.emplace(
      PartSurfaces::Design{meant, *rounded_, rectangle, setup.blank.max().z(), turned},
      std::move(paths), setup.options.workshop.polish);
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

LeakageChain PartSurfaces::short_chain(const GridWindow& even) const {
  LeakageChain chain = this->chain();
  chain.designed.grid = even;
  const auto chord =
      std::find_if(chain.steps.begin(), chain.steps.end(),
                   [](const NamedSurface& step) { return step.name == leak_cause::kChord; });
  chain.steps.erase(chord, chain.steps.end());
  for (NamedSurface& step : chain.steps) {
    if (step.name != leak_cause::kScallop) step.grid = even;
  }
  chain.steps.push_back({leak_cause::kPath, &part()});
  return chain;
}

namespace {

/// Rounding allowed in quotients, so that whole ones do not cost a cell.
constexpr double kRounding = 1e-9;

/// Keeps the nodes of one tile.
void keep_nodes(const SurfacePatch& patch, const PartGrid& grid, const std::string& name,
                const Executor& executor, LayeredImage& layers) {
  const GridWindow& window = patch.window;
  const auto layer = layers.layer(layer_of(name));
  const auto keep_row = [&](std::int64_t j) {
    const std::int64_t row = window.first_row + j;
    if (row % grid.every.y() != 0) return;
    const std::int64_t from_top = grid.nodes.y() - 1 - row / grid.every.y();
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const std::int64_t column = window.first_column + i;
      if (column % grid.every.x() != 0) continue;
      const std::int64_t at = from_top * grid.nodes.x() + column / grid.every.x();
      layer[static_cast<std::size_t>(at)] =
          static_cast<float>(patch.z[static_cast<std::size_t>(j * window.columns + i)]);
    }
  };
  parallel_for(executor, "keep surface", window.rows, keep_row, 16);
}

std::vector<std::string> layer_names(const std::vector<NamedSurface>& surfaces) {
  std::vector<std::string> names;
  names.reserve(surfaces.size());
  for (const NamedSurface& surface : surfaces) names.push_back(layer_of(surface.name));
  return names;
}

}  // namespace

std::string layer_of(const std::string& surface) { return surface + ".z"; }

std::string fingerprint_of(const Lens& lens) {
  const nlohmann::json& provenance = lens.provenance.json();
  if (!provenance.is_object()) return "";
  const auto stated = provenance.find("fingerprint");
  if (stated == provenance.end() || !stated->is_string()) return "";
  constexpr std::size_t kDigits = 16;
  const auto& text = stated->get_ref<const std::string&>();
  const bool hexadecimal = text.find_first_not_of("0123456789abcdef") == std::string::npos;
  return text.size() == kDigits && hexadecimal ? text : "";
}

namespace {

/// True if the report of a cut says that it is of this design and of this face.
bool is_cut_of(const std::filesystem::path& folder, const std::string& lens_id, bool front) {
  std::ifstream file(folder / cam_file::kReport);
  const nlohmann::json report = nlohmann::json::parse(file, nullptr, false);
  if (!report.is_object() || lens_id.empty()) return false;
  return report.value("lens_id", "") == lens_id &&
         report.value("face", "back") == (front ? "front" : "back") &&
         report.value("part", "") == "lens";
}

}  // namespace

std::optional<HeightFront> made_face(const CutSetup& cut) {
  const Lens& lens = *cut.lens;
  const std::filesystem::path& folder = cut.options.other_cut;
  const bool shaped = lens.setup.front && std::holds_alternative<HeightFront>(*lens.setup.front);
  if (folder.empty() || !shaped || !is_cut_of(folder, fingerprint_of(lens), !cut.is_front())) {
    return std::nullopt;
  }
  std::error_code none;
  const std::filesystem::path path = folder / lens_file::kPartSurfaces;
  if (!std::filesystem::is_regular_file(path, none)) return std::nullopt;
  const LayeredImage layers = read_layers(path);
  const std::string name = layer_of(part_layer::kPart);
  const bool fits =
      layers.has(name) && std::min(layers.columns(), layers.rows()) >= kMinHeightSamples;
  if (!fits) throw InputError(path.string() + ": has no heights of a part; remove it");
  const std::span<const float> heights = layers.layer(name);
  HeightGrid grid{layers.columns(), layers.rows(), {heights.begin(), heights.end()}};
  return HeightFront{std::make_shared<const HeightSpline>(std::move(grid)), lens.setup.lens_size};
}

void HeightMapField::sample(const GridWindow& window, const Executor& executor,
                            SurfacePatch& patch) const {
  resize_patch(window, false, patch);
  const auto sample_row = [&](std::int64_t j) {
    for (std::int64_t i = 0; i < window.columns; ++i) {
      const FrontPoint point = surface_.at(window.node(i, j));
      const auto k = static_cast<std::size_t>(j * window.columns + i);
      patch.z[k] = point.z;
      patch.slope_x[k] = point.gradient.x();
      patch.slope_y[k] = point.gradient.y();
    }
  };
  parallel_for(executor, "sample height map", window.rows, sample_row, 16);
}

PartGrid part_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings, double most) {
  const double coarse = std::max(kPartSpacing, std::sqrt(lens_size.prod() / most));
  PartGrid grid;
  for (int axis = 0; axis < 2; ++axis) {
    // A spacing that divides the pitch should stay so: use as many cells as it requires if their
    // number allows that.
    const double cells = std::ceil(lens_size[axis] / spacings[axis] - kRounding);
    const double every = std::max(1.0, std::ceil(coarse / spacings[axis] - kRounding));
    grid.every[axis] = static_cast<int>(every);
    grid.nodes[axis] = static_cast<int>(std::max(1.0, std::ceil(cells / every))) + 1;
  }
  return grid;
}

GridWindow sampled_grid(const Eigen::Vector2d& lens_size, const Eigen::Vector2d& spacings) {
  const PartGrid nodes = part_grid(lens_size, spacings, kPartNodes);
  const Eigen::Array2i cells = (nodes.nodes.array() - 1) * nodes.every.array();
  GridWindow grid;
  grid.spacing = lens_size.cwiseQuotient(cells.cast<double>().matrix());
  grid.columns = cells.x() + 1;
  grid.rows = cells.y() + 1;
  return grid;
}

PartLayers::PartLayers(std::vector<NamedSurface> surfaces, const Eigen::Vector2d& lens_size,
                       const Eigen::Vector2d& spacings)
    : surfaces_(std::move(surfaces)),
      nodes_(part_grid(lens_size, spacings, kPartNodes)),
      layers_(nodes_.nodes.x(), nodes_.nodes.y(), layer_names(surfaces_)) {}

void PartLayers::take(const SurfaceField& field, const SurfacePatch& tile,
                      const Executor& executor) {
  for (const NamedSurface& surface : surfaces_) {
    if (surface.field == &field) keep_nodes(tile, nodes_, surface.name, executor, layers_);
  }
}

LayeredImage cause_layers(const LeakageResult& leakage, double total) {
  std::vector<const RenderedSurface*> surfaces{&leakage.designed};
  for (const RenderedSurface& step : leakage.steps) surfaces.push_back(&step);
  std::vector<std::string> names;
  names.reserve(surfaces.size());
  for (const RenderedSurface* surface : surfaces) names.push_back(surface->name);
  const FluxPicture& part = leakage.part().picture;
  LayeredImage layers(part.columns, part.rows, names);
  for (const RenderedSurface* surface : surfaces) {
    const Image image = surface->picture.image(total);
    std::copy(image.values().begin(), image.values().end(), layers.layer(surface->name).begin());
  }
  return layers;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/mpi/stage_problem.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "design/mpi/row_slabs.h"

namespace lensforge {
namespace {

template <int Size, class T>
void put_vector(const Eigen::Matrix<T, Size, 1>& vector, Parcel& parcel) {
  for (const T entry : vector) parcel.put(entry);
}
template <class Vector>
void take_vector(Vector& vector, Parcel& parcel) {
  for (auto& entry : vector) parcel.take(entry);
}

void put_front(const Front& front, Parcel& parcel) {
  const auto* const map = std::get_if<HeightFront>(&front);
  parcel.put(map != nullptr);
  if (map == nullptr) {
    const auto& sphere = std::get<SphericalFront>(front);
    parcel.put(sphere.radius);
    put_vector(sphere.apex, parcel);
    return;
  }
  const HeightGrid& grid = map->spline->grid();
  parcel.put(grid.columns);
  parcel.put(grid.rows);
  parcel.put_all(grid.heights);
  put_vector(map->size, parcel);
  put_vector(map->corner, parcel);
}

Front take_front(Parcel& parcel) {
  if (!parcel.take<bool>()) {
    SphericalFront sphere;
    parcel.take(sphere.radius);
    take_vector(sphere.apex, parcel);
    return sphere;
  }
  HeightGrid grid;
  parcel.take(grid.columns);
  parcel.take(grid.rows);
  grid.heights = parcel.take_all<float>();
  HeightFront map;
  map.spline = std::make_shared<HeightSpline>(std::move(grid));
  take_vector(map.size, parcel);
  take_vector(map.corner, parcel);
  return map;
}

void put_outline(const Outline& outline, Parcel& parcel) {
  parcel.put(outline.kind);
  parcel.put(outline.radius);
  parcel.put(outline.points.size());
  for (const Eigen::Vector2d& point : outline.points) put_vector(point, parcel);
}

Outline take_outline(Parcel& parcel) {
  Outline outline;
  parcel.take(outline.kind);
  parcel.take(outline.radius);
  outline.points.resize(parcel.take<std::size_t>());
  for (Eigen::Vector2d& point : outline.points) take_vector(point, parcel);
  return outline;
}

void put_image(const Image& image, Parcel& parcel) {
  parcel.put(image.columns());
  parcel.put(image.rows());
  parcel.put_all(std::vector<float>(image.values().begin(), image.values().end()));
}

Image take_image(Parcel& parcel) {
  const int columns = parcel.take<int>();
  Image image(columns, parcel.take<int>());
  const std::vector<float> values = parcel.take_all<float>();
  std::copy(values.begin(), values.end(), image.values().begin());
  return image;
}

void put_options(const ObjectiveOptions& options, Parcel& parcel) {
  LF_CHECK(!options.made_by, "");
  parcel.put(options.weights);
  parcel.put(options.model);
  parcel.put(options.nu);
  parcel.put(options.area);
  parcel.put(options.surface_height);
}

ObjectiveOptions take_options(Parcel& parcel) {
  ObjectiveOptions options;
  parcel.take(options.weights);
  parcel.take(options.model);
  parcel.take(options.nu);
  parcel.take(options.area);
  parcel.take(options.surface_height);
  return options;
}

/// All that every rank has of a problem.
Parcel common_part(const StageProblem& problem) {
  Parcel parcel;
  parcel.put(problem.mesh.grid);
  put_setup(problem.setup, parcel);
  parcel.put(problem.aspect);
  put_options(problem.options, parcel);
  const auto* const picture = std::get_if<Image>(&problem.goal);
  parcel.put(picture != nullptr);
  if (picture != nullptr) put_image(*picture, parcel);
  return parcel;
}

/// From rank 0 to all.
Parcel shared(const Parcel& own, const Ranks& ranks) {
  std::vector<std::byte> bytes = own.bytes();
  std::size_t size = bytes.size();
  ranks.broadcast(size);
  bytes.resize(size);
  ranks.broadcast_bytes(bytes.data(), size);
  return Parcel(std::move(bytes));
}

/// Columns `held` of rank 0's matrix, which is null on the others.
template <class Matrix>
Matrix held_columns(const Matrix* whole, const Ranks& ranks, Eigen::Index rows,
                    const std::function<ItemRange(int)>& held) {
  using Scalar = typename Matrix::Scalar;
  const ItemRange own = held(ranks.rank());
  if (!ranks.is_first()) {
    Matrix part(rows, own.count());
    ranks.receive(0, std::span<Scalar>(part.data(), static_cast<std::size_t>(part.size())));
    return part;
  }
  for (int r = 1; r < ranks.count(); ++r) {
    const ItemRange range = held(r);
    ranks.send(r, std::span<const Scalar>(whole->data() + range.begin * rows,
                                          static_cast<std::size_t>(range.count() * rows)));
  }
  return whole->middleCols(own.begin, own.count());
}

}  // namespace

void put_setup(const OpticalSetup& setup, Parcel& parcel) {
  parcel.put(setup.mode);
  put_vector(setup.light, parcel);
  parcel.put(setup.point.has_value());
  if (setup.point) {
    put_vector(setup.point->position, parcel);
    parcel.put(setup.point->emission);
  }
  parcel.put(setup.front.has_value());
  if (setup.front) put_front(*setup.front, parcel);
  parcel.put(setup.extent.width);
  parcel.put(setup.extent.shape.columns);
  parcel.put(setup.extent.shape.rows);
  parcel.put_all(setup.extent.shape.weights);
  parcel.put_all(setup.spectrum.wavelengths);
  parcel.put_all(setup.spectrum.powers);
  parcel.put(setup.spectrum.abbe);
  parcel.put(setup.fresnel);
  parcel.put(setup.ior);
  parcel.put(setup.focal_length);
  put_vector(setup.lens_size, parcel);
  parcel.put(setup.outline.has_value());
  if (setup.outline) put_outline(*setup.outline, parcel);
  put_vector(setup.image_size, parcel);
  put_vector(setup.image_origin, parcel);
  put_vector(setup.screen_x, parcel);
  put_vector(setup.screen_y, parcel);
  put_vector(setup.pixels, parcel);
  parcel.put(setup.view);
}

OpticalSetup take_setup(Parcel& parcel) {
  OpticalSetup setup;
  parcel.take(setup.mode);
  take_vector(setup.light, parcel);
  if (parcel.take<bool>()) {
    setup.point.emplace();
    take_vector(setup.point->position, parcel);
    parcel.take(setup.point->emission);
  }
  if (parcel.take<bool>()) setup.front = take_front(parcel);
  parcel.take(setup.extent.width);
  parcel.take(setup.extent.shape.columns);
  parcel.take(setup.extent.shape.rows);
  setup.extent.shape.weights = parcel.take_all<double>();
  setup.spectrum.wavelengths = parcel.take_all<double>();
  setup.spectrum.powers = parcel.take_all<double>();
  parcel.take(setup.spectrum.abbe);
  parcel.take(setup.fresnel);
  parcel.take(setup.ior);
  parcel.take(setup.focal_length);
  take_vector(setup.lens_size, parcel);
  if (parcel.take<bool>()) setup.outline = take_outline(parcel);
  take_vector(setup.image_size, parcel);
  take_vector(setup.image_origin, parcel);
  take_vector(setup.screen_x, parcel);
  take_vector(setup.screen_y, parcel);
  take_vector(setup.pixels, parcel);
  parcel.take(setup.view);
  return setup;
}

StageProblem share_problem(const StageProblem* whole, const Ranks& ranks, GridShape& grid) {
  Parcel parcel = shared(whole != nullptr ? common_part(*whole) : Parcel(), ranks);
  parcel.take(grid);
  StageProblem part;
  part.setup = take_setup(parcel);
  parcel.take(part.aspect);
  part.options = take_options(parcel);
  const auto faces = [&](int r) { return RowSlab(grid, ranks.count(), r).held_faces(); };
  const auto vertices = [&](int r) { return RowSlab(grid, ranks.count(), r).held_vertices(); };
  if (parcel.take<bool>()) {
    part.goal = take_image(parcel);
  } else {
    const auto* const wanted = whole != nullptr ? &std::get<Correspondence>(whole->goal) : nullptr;
    Correspondence held;
    held.centroids =
        held_columns<Eigen::Matrix2Xd>(wanted ? &wanted->centroids : nullptr, ranks, 2, faces);
    Eigen::RowVectorXd flux;
    if (wanted != nullptr) flux = wanted->flux.transpose();
    held.flux = held_columns<Eigen::RowVectorXd>(&flux, ranks, 1, faces).transpose();
    part.goal = std::move(held);
  }
  const SurfaceMesh* const mesh = whole != nullptr ? &whole->mesh : nullptr;
  part.mesh.vertices =
      held_columns<Eigen::Matrix3Xd>(mesh ? &mesh->vertices : nullptr, ranks, 3, vertices);
  part.mesh.triangles =
      held_columns<Eigen::Matrix3Xi>(mesh ? &mesh->triangles : nullptr, ranks, 3, faces);
  const RowSlab slab(grid, ranks.count(), ranks.rank());
  part.mesh.triangles.array() -= static_cast<int>(slab.held_vertices().begin);
  part.mesh.grid = slab.held_grid();
  return part;
}

}  // namespace lensforge

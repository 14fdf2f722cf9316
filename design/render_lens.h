// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "core/surface/lens.h"
#include "core/surface/surface_mesh.h"
#include "core/surface/surface_model.h"

namespace lensforge {

/// A projected picture.
struct RenderResult {
  Image image;  ///< Linear flux relative to a uniformly lit picture; mean = flux_inside.
  double flux_inside = 0.0;  ///< Share of the lens's flux that lands on the image rectangle.
};

/// Renders what a surface projects onto the image rectangle of `setup`, exactly (no sampling but of
/// a source that has an extent, see picture_under()).
RenderResult render_surface(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                            const Executor& executor);

/// Renders a surface and compares it with `target` (linear light). The picture is scaled so that
/// the lens's whole flux would equal the target's total; `rendered` takes it unless null.
/// @pre target has setup.pixels columns and rows.
ImageMetrics evaluate(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                      const Image& target, Image* rendered, const Executor& executor);

/// Flux per pixel, as shares of the lens's, of its surface under its model in another setup.
std::vector<double> flux_of_lens(const Lens& lens, const OpticalSetup& setup,
                                 const Executor& executor);

/// How long a lens is looked at.
enum class Look {
  kThorough,  ///< A spline at the nodes of picture_nodes(), an extended source at all its points.
  kBrief,  ///< At most 4 nodes per knot cell each way and as many points of the source as fit into
           ///< 4 million nodes, at least 4. A 64² photograph under a source of 2 mrad has MAE
           ///< 0.0022 instead of 0.0020.
};

/// evaluate() of a lens under one of its models.
ImageMetrics evaluate(const Lens& lens, SurfaceModel model, Image* rendered,
                      const Executor& executor, Look look = Look::kThorough);

/// The same for a smooth surface that is known by its own normals at the vertices, 3 × V with
/// z > 0: what the triangles between them hide does not matter. Computed on the CPU.
RenderResult render_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const OpticalSetup& setup, const Executor& executor);

/// evaluate() by the normals given.
ImageMetrics evaluate(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                      const OpticalSetup& setup, const Image& target, Image* rendered,
                      const Executor& executor);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "core/compute/executor.h"
#include "core/compute/work_estimate.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/lens/optical_surface.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

/// Renders what a lens or a surface projects, and compares it with the picture that it was made
/// for.
///
///     const lensforge::Lens lens = lensforge::read_lens("lens");
///     lensforge::Image picture;
///     const lensforge::ImageMetrics metrics =
///         lensforge::evaluate(lens, lens.model, &picture, lensforge::Executor::cpu());
///     std::cout << "MAE " << metrics.mae << '\n';
///
/// A mesh that comes alone has no setup of its own: setup_for_mesh() gives one to render_surface().

namespace lensforge {

/// A projected picture.
struct RenderResult {
  Image image;  ///< Linear flux relative to a uniformly lit picture; mean = flux_inside.
  double flux_inside = 0.0;  ///< Share of the lens's flux that lands on the image rectangle.
};

/// Renders what a surface projects onto the image rectangle of `setup`, exactly: only an extended
/// source is sampled (see picture_under()).
RenderResult render_surface(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                            const Executor& executor);

/// Renders a surface and compares it with `target` (linear light). The picture is scaled so that
/// the lens's whole flux would equal the target's total; `rendered` takes it unless null.
/// @pre target has setup.pixels columns and rows.
ImageMetrics evaluate(const SurfaceMesh& mesh, const OpticalSetup& setup, SurfaceModel model,
                      const Image& target, Image* rendered, const Executor& executor);

/// Effort of a rendering.
enum class Look {
  kThorough,  ///< A spline at picture_nodes(), an extended source at all its points.
  kBrief,  ///< At most 4 nodes per knot cell each way and as many points of the source as fit into
           ///< 4 million nodes, at least 4. A 64² photograph under a source of 2 mrad has MAE
           ///< 0.0022 instead of 0.0020.
};

/// evaluate() of a lens under one of its models.
/// @param control  takes a report of every picture that a thorough look sums.
ImageMetrics evaluate(const Lens& lens, SurfaceModel model, Image* rendered,
                      const Executor& executor, Look look = Look::kThorough,
                      const RunControl& control = {});

/// The same for a smooth surface given by its own normals at the vertices, 3 × V with z > 0, which
/// do not depend on the triangles between them. Computed on the CPU.
RenderResult render_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const OpticalSetup& setup, const Executor& executor);

/// evaluate() with given normals.
ImageMetrics evaluate(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                      const OpticalSetup& setup, const Image& target, Image* rendered,
                      const Executor& executor);

/// Flux that a mesh sends to every pixel of `setup`, as shares of the lens's total (Sun et al.,
/// section 3.2), row by row from the top; setup.pixels values. An extended source is the sum of its
/// points.
/// @param model  facet or smooth.
/// @pre vertex numbers are in range, coordinates finite, the setup valid.
/// @throw Interrupted, see Executor::with_stop().
std::vector<double> flux_of_surface(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                    SurfaceModel model, const Executor& executor);

/// The same for a smooth surface given by its own normals at the vertices, 3 × V with z > 0.
/// Computed on the CPU.
std::vector<double> flux_of_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                                    const OpticalSetup& setup, const Executor& executor);

/// Adjoint of flux_of_surface(): Σ ∂(flux of pixel i)/∂(vertices) × cotangent[i], 3 × V, per mm.
/// Triangles whose light does not leave, and needles of light (deposit_adjoint()), have a
/// derivative only by the light that they take in. Same bits for any number of threads.
/// @param cotangent  setup.pixels values, row by row from the top.
/// @throw InputError if the setup has an outline: the cut of a face has no derivative here.
///        Interrupted, see Executor::with_stop(). Error: 1e-6 of the product against central
///        differences (FluxOfSurface.* in tests/design/render/render_flux_test.cpp).
Eigen::Matrix3Xd flux_of_surface_adjoint(const SurfaceMesh& mesh, const OpticalSetup& setup,
                                         SurfaceModel model, std::span<const double> cotangent,
                                         const Executor& executor);

/// Flux per pixel of a lens in another setup, as shares of the lens's total, under its own model.
/// @param control  takes a report of every picture that is summed.
std::vector<double> flux_of_lens(const Lens& lens, const OpticalSetup& setup,
                                 const Executor& executor, const RunControl& control = {});

/// Distance on the screen between the landing points of the spectrum's first and last wavelength,
/// mm.
struct Fringe {
  double mean = 0.0;  ///< Over the vertices of the surface.
  double max = 0.0;
};

/// @param normals 3 × V of the surface at its vertices, of any length, z > 0. Rays that do not
///                 leave the surface are ignored. @pre the setup has a spectrum.
Fringe fringe_of(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                 const OpticalSetup& setup);

/// The same for a lens under its own model.
Fringe fringe_of(const Lens& lens);

/// Accuracy of the picture of a lens under its extended source.
struct SourceCheck {
  double blur = 0.0;  ///< Width of the source's image on the screen, pixels.
  int points = 0;     ///< Source points whose pictures are summed.
  /// Mean absolute differences of display-encoded pixels between that picture and the picture with
  /// half as many points, and the picture by the optimiser's convolution.
  double halving = 0.0;
  double convolution = 0.0;
};

/// Setup for a mesh without one: the image rectangle is straight above the lens and as large, the
/// working picture has 256 pixels on its longer side.
OpticalSetup setup_for_mesh(const SurfaceMesh& mesh);

/// The same setup with `pixels` on the longer side of the picture.
OpticalSetup with_longer_side(OpticalSetup setup, int pixels);

/// The same setup with an image rectangle of this width, proportions and centre kept.
OpticalSetup with_image_width(OpticalSetup setup, double width);

/// @param option  names the wall's distance in the message.
/// @throw InputError unless the wall lies above the whole surface and the setup is valid.
void require_wall_above(const SurfaceMesh& mesh, const OpticalSetup& setup,
                        const std::string& option = "--focal");

/// Estimates a rendering of `pixels` pixels, its comparison with a target, and its file.
WorkEstimate rendering_work(double pixels);

}  // namespace lensforge

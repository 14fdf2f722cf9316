// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/image/image.h"
#include "core/lens/lens.h"
#include "core/mesh/surface_mesh.h"
#include "core/optics/optical_setup.h"

namespace lensforge {

/// One number per vertex, stored as PackedNumbers.
struct StoredChannel {
  std::string name;  ///< "x", "y", "z", "slope_x", "slope_y"
  int bytes = 0;     ///< Bytes per number; 0 if all are `low`.
  double low = 0.0;
  double high = 0.0;
  std::string text;  ///< Base 64.

  /// Resolution of the stored numbers, in the channel's unit.
  [[nodiscard]] double step() const;
};

/// A surface as stored in a page: numbers of a few bytes.
///
/// On a grid, x and y are offsets from the vertices of an even grid over the lens; 16 bits then
/// resolve far less than a micrometre.
struct StoredSurface {
  GridShape grid;  ///< {0, 0} if the mesh is no grid.
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  std::vector<StoredChannel> channels;
  /// Vertex numbers of the triangles, 32 bits each, base 64; empty if they follow from the grid.
  std::string corners;
  bool zigzag = false;       ///< The diagonals alternate from row to row (make_grid_mesh()).
  SampledSurface read_back;  ///< As a page decodes it; without normals if there are no slopes.

  [[nodiscard]] const StoredChannel* channel(const std::string& name) const;
};

/// @param normals  3 × V with z > 0, of any length; without columns the triangles' own normals are
///        used.
StoredSurface store_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const Eigen::Vector2d& lens_size);

/// A surface whose projected picture a page draws.
struct ViewedSurface {
  std::string id;     ///< "designed"
  std::string words;  ///< Short description.
  StoredSurface surface;
  Image picture;  ///< The picture it projects, computed by the program; linear light.
  /// MAE between that picture and the one of the stored surface, both computed by the program.
  double storage_error = 0.0;
};

/// The picture after one cause of error.
struct ViewedCause {
  std::string cause;
  std::string surface;  ///< ViewedSurface::id, or empty if no page draws it.
  Image picture;        ///< Linear light.
};

/// Content of a lens's page.
struct LensView {
  std::string name;
  OpticalSetup setup;
  std::string model;                    ///< model_name()
  Image target;                         ///< Linear light.
  std::vector<ViewedSurface> surfaces;  ///< The designed one comes first.
  /// The causes of error between target and part, step by step, and the surface for each.
  std::vector<ViewedCause> causes;
  LensRaster relief;               ///< Heights of the designed surface, mm.
  std::vector<ReportPath> path;    ///< Tool paths; empty without programs.
  std::string leakage_map;         ///< Bytes of a PNG; empty if there is none.
  std::vector<std::string> notes;  ///< For the user who requested the page.
};

/// Number of nodes along the longer side of a page's relief.
inline constexpr int kReliefNodes = 240;

/// Content of a page for a lens without predictions. @pre the lens has a picture.
LensView view_of_lens(const Lens& lens, const std::string& name, const Executor& executor);

/// Reads a lens folder, with `cam`'s predictions for the part, if present.
/// @throw InputError if it is no lens folder or has no rendered picture; Interrupted.
LensView read_view(const std::filesystem::path& folder, const Executor& executor,
                   const RunControl& control);

/// Returns the page that shows a lens: one self-contained HTML file that computes the projected
/// picture itself.
std::string view_page(const LensView& view);

}  // namespace lensforge

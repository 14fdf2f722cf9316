// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cam/report/report_data.h"
#include "core/compute/executor.h"
#include "core/compute/run_control.h"
#include "core/image/image.h"
#include "core/optics/optical_setup.h"
#include "core/surface/lens.h"
#include "core/surface/sampled_surface.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// One number of every vertex, as PackedNumbers.
struct StoredChannel {
  std::string name;  ///< "x", "y", "z", "slope_x", "slope_y"
  int bytes = 0;     ///< Of each number; 0 if all are `low`.
  double low = 0.0;
  double high = 0.0;
  std::string text;  ///< Base 64.

  /// Between two neighbouring numbers, in the channel's unit.
  [[nodiscard]] double step() const;
};

/// A surface as a page has it: in numbers of a few bytes.
///
/// On a grid x and y are counted from where an even grid over the lens has the vertex, so that 16
/// bits reach far below a micrometre.
struct StoredSurface {
  GridShape grid;  ///< {0, 0} if it is none.
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  std::vector<StoredChannel> channels;
  /// Vertex numbers of the triangles, 32 bits each, base 64; empty if they follow from the grid.
  std::string corners;
  bool zigzag = false;       ///< Their diagonals turn from row to row (make_grid_mesh()).
  SampledSurface read_back;  ///< What a page reads of it; without normals if it has no slopes.

  [[nodiscard]] const StoredChannel* channel(const std::string& name) const;
};

/// @param normals  3 × V with z > 0, of any length; without columns the triangles' own count.
StoredSurface store_surface(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                            const Eigen::Vector2d& lens_size);

/// A surface whose light a page draws.
struct ViewedSurface {
  std::string id;     ///< "designed"
  std::string words;  ///< What it is, in a few words.
  StoredSurface surface;
  Image picture;  ///< What the program says that it projects; linear light.
  /// Between that picture and the one of the surface as stored, both by the program: MAE.
  double storage_error = 0.0;
};

/// What one cause makes of the picture.
struct ViewedCause {
  std::string cause;
  std::string surface;  ///< ViewedSurface::id, or empty if no page draws it.
  Image picture;        ///< Linear light.
};

/// What a page shows of a lens.
struct LensView {
  std::string name;
  OpticalSetup setup;
  std::string model;                    ///< model_name()
  Image target;                         ///< Linear light.
  std::vector<ViewedSurface> surfaces;  ///< The designed one comes first.
  /// What lies between target and part, step by step, and which surface projects it.
  std::vector<ViewedCause> causes;
  LensRaster relief;               ///< Heights of the designed surface, mm.
  std::vector<ReportPath> path;    ///< Of the tools, where there are programs.
  std::string leakage_map;         ///< Bytes of a PNG; empty where there is none.
  std::vector<std::string> notes;  ///< For whoever asked for the page.
};

/// Nodes along the longer side of a page's relief.
inline constexpr int kReliefNodes = 240;

/// What a page shows of a lens alone. @pre the lens has a picture.
LensView view_of_lens(const Lens& lens, const std::string& name, const Executor& executor);

/// Reads a lens folder, with what `cam` predicts of the part where that is there.
/// @throw InputError if it is none, or holds no rendered picture; Interrupted.
LensView read_view(const std::filesystem::path& folder, const Executor& executor,
                   const RunControl& control);

}  // namespace lensforge

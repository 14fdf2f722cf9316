// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "design/reflect/light/goal.h"

namespace lensforge {
class Description;
}

namespace lensforge::reflect {

/// How target normals are found.
enum class Method {
  kExact,  ///< Cached paths, gradients without noise, steps that every face chooses.
  kPaper,  ///< Monte-Carlo gradients and fixed steps: the published algorithm.
};

/// Across which axis, through the middle of the bounding box, a shape stays symmetric.
enum class Symmetry { kNone = -1, kX = 0, kY = 1, kZ = 2 };

/// What shapes a reflection. Lengths and places are in the units of the mesh, z is up.
struct ReflectOptions {
  GoalKind goal = GoalKind::kStealth;
  std::string place;  ///< Of a goal: "X,Y,Z" a point, "X,Y,Z,X,Y,Z" the ends of a line.
  std::string light;  ///< "X,Y,Z;X,Y,Z;…" towards the light; empty: the band or the sun.
  Method method = Method::kExact;
  int seed = 1;                 ///< Of the paper's random paths.
  double elevation_deg = 20.0;  ///< Half height of the band of directions.
  int direction_rows = 8;       ///< Heights in the band, each with six times as many azimuths.
  int sun_positions = 24;       ///< On the sun's half circle.
  double anchor = 0.1;          ///< β: how strongly normals are held.
  double denoise = 0.0;         ///< α for a mesh whose diagonal is 3; 0: none.
  double normal_weight = 1000;  ///< λ of Eq. 3.
  int rim_updates = 30;         ///< Vertex updates with rim-spoke elements.
  int face_updates = 30;        ///< Vertex updates with face elements.
  int normal_steps = 8;         ///< Steps of the normals before each vertex update.
  bool split = true;            ///< Split edges that hamper creases, then update again.
  int faces = 0;                ///< Remesh to about so many first; 0: the mesh as it is.
  std::string fix_box;          ///< "X,Y,Z,X,Y,Z": what is inside does not move.
  std::string fix_plane;        ///< "NX,NY,NZ,D": what has n·x ≤ d does not move.
  std::string fix_vertices;     ///< File of the numbers of vertices that do not move.
  std::string planar_faces;     ///< File of groups of faces that stay planar, one a line.
  Symmetry symmetry = Symmetry::kNone;
  bool keep_volume = false;
  bool keep_box = false;          ///< Nothing leaves the bounding box.
  double max_displacement = 0.0;  ///< Of a vertex; 0: no limit.
  double min_thickness = 0.0;     ///< Of the material behind a vertex; 0: no limit.
  double radar_ghz = 0.0;         ///< Frequency of radar cross-sections; 0: none.
  bool force = false;             ///< Replace files that lensforge did not write.
  /// File that takes a checkpoint every second; none is written if empty.
  std::filesystem::path checkpoint;
  /// Go on from `checkpoint`. Same mesh and options → same shape as without interruption.
  bool resume = false;
};

/// The options as the command has them.
void describe(Description& d, ReflectOptions& o);

/// @throw InputError naming option, value and rule.
void validate(const ReflectOptions& options);

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/mesh/surface_mesh.h"

namespace lensforge {
class Description;
}

namespace lensforge::reflect {

/// Goal for the reflected light (Tojo et al., 4.1 and Fig. 12).
enum class GoalKind {
  kStealth,  ///< As little as possible goes back to where the light comes from.
  kPoint,    ///< As much as possible goes to a point.
  kLine,     ///< As much as possible goes to the nearest point of a line.
  kDeflect,  ///< As little as possible goes to a point.
  kRadar,    ///< As little as possible of a radar's wave goes back to it.
};

/// Reflected energy 5·½ Σ a_k ⟨L² V⟩ of a shape, by one reflection alone and by one and two.
struct Energies {
  double direct = 0.0;
  double total = 0.0;
};

/// Method to find target normals.
enum class Method {
  kExact,  ///< Cached paths, gradients without noise, a step length per face.
  kPaper,  ///< Monte-Carlo gradients and fixed steps: the published algorithm.
};

/// Axis across which a shape stays symmetric, about the middle of the bounding box.
enum class Symmetry { kNone = -1, kX = 0, kY = 1, kZ = 2 };

/// Direction of the electric field that a radar sends and receives.
enum class Polarization {
  kVertical,    ///< In the plane of sight and z.
  kHorizontal,  ///< Along the horizon.
};

/// Options of a run. Lengths and places are in the units of the mesh, z is up.
struct ReflectOptions {
  GoalKind goal = GoalKind::kStealth;
  /// Goal's "X,Y,Z" of a point or "X,Y,Z,X,Y,Z" of a line's ends; with `glare` a file of points,
  /// too.
  std::string place;
  std::string light;  ///< "X,Y,Z;X,Y,Z;…" towards the light; empty: the band or the sun.
  Method method = Method::kExact;
  int seed = 1;                 ///< For the paper's random paths.
  double elevation_deg = 20.0;  ///< Half height of the band of directions.
  int direction_rows = 8;       ///< Heights in the band; each has six times as many azimuths.
  int sun_positions = 24;       ///< Directions on the sun's half circle.
  double anchor = 0.1;          ///< β, the strength with which normals are held.
  double denoise = 0.0;         ///< α for a mesh whose diagonal is 3; 0: none.
  double normal_weight = 1000;  ///< λ of Eq. 3.
  int rim_updates = 30;         ///< Vertex updates with rim-spoke elements.
  int face_updates = 30;        ///< Vertex updates with face elements.
  int normal_steps = 8;         ///< Steps of the normals before each vertex update.
  bool split = true;            ///< Split edges that hamper creases, then update again.
  int faces = 0;                ///< Remesh to about this many first; 0: no remeshing.
  std::string fix_box;          ///< "X,Y,Z,X,Y,Z": vertices inside do not move.
  std::string fix_plane;        ///< "NX,NY,NZ,D": vertices with n·x ≤ d do not move.
  std::string fix_vertices;     ///< File with the numbers of vertices that do not move.
  std::string planar_faces;     ///< File with groups of faces that stay planar, one per line.
  Symmetry symmetry = Symmetry::kNone;
  bool keep_volume = false;
  bool keep_box = false;          ///< Nothing leaves the bounding box.
  double max_displacement = 0.0;  ///< Limit for a vertex; 0: none.
  double min_thickness = 0.0;     ///< Minimum of the material behind a vertex; 0: none.
  double radar_ghz = 0.0;         ///< Frequency of radar cross-sections; 0: none.
  Polarization polarization = Polarization::kVertical;  ///< Of the radar.
  std::string frequency;                                ///< "GHZ,GHZ,…" of --goal radar.
  std::string sector;        ///< "FROM,TO,STEP" of --goal radar, degrees; empty: all around.
  int radar_updates = 30;    ///< Vertex updates of --goal radar.
  std::string glare;         ///< "LAT,LON[,ZONE]": reflected sunlight at the place; empty: none.
  double glare_limit = 0.0;  ///< W/m² whose hours are counted; 0: none.
  double glare_north_deg = 0.0;  ///< Bearing of +y, clockwise from north.
  std::string glare_material = "glass-bk7";
  double turbidity = 3.0;  ///< Linke's.
  bool force = false;      ///< Replace files that lensforge did not write.
  /// File that takes a checkpoint every second; none is written if empty.
  std::filesystem::path checkpoint;
  /// Continue from `checkpoint`. The same mesh and options give the same shape as without
  /// interruption.
  bool resume = false;
};

/// All options, as the command has them.
void describe(Description& d, ReflectOptions& o);

/// @throw InputError naming option, value and rule.
void validate(const ReflectOptions& options);

/// A mesh that the reflector stage can use, and the changes made to it.
struct RepairedMesh {
  SurfaceMesh mesh;
  std::vector<std::string> changes;  ///< For example "12 duplicate vertices merged".
  /// New number of every vertex; −1 if it was dropped. Not of a mesh that was separated.
  std::vector<int> vertex;
  std::vector<int> face;  ///< Original face of every face. Not of a mesh that was separated.
  bool closed = false;
};

/// Merges vertices in the same place, removes faces without area and vertices without a face, and
/// turns faces that disagree with their neighbours; the faces of a closed piece then look outwards.
/// @param name  of the file, for messages.
/// @param separate  separate surfaces at edges with more than two faces; faces are then cut in
/// four.
/// @throw InputError naming the face or edge: no face with an area, an edge with more than two
///        faces unless `separate`, a piece with one side only (a Möbius strip), coordinates so
///        large or small that areas vanish.
RepairedMesh repair_mesh(const SurfaceMesh& mesh, const std::string& name, bool separate = false);

/// A mesh that is ready to be deformed, with the parts that stay as they are.
struct ReflectInput {
  SurfaceMesh mesh;
  bool closed = false;
  std::vector<std::string> changes;      ///< Repairs, in words.
  std::vector<std::uint8_t> fixed;       ///< One flag per vertex; empty: all move.
  std::vector<std::vector<int>> planar;  ///< Groups of faces that each stay in one plane.
  std::vector<int> partner;              ///< Mirror image of every vertex; empty: no symmetry.
};

/// Repairs a mesh, remeshes it for --faces, and finds the parts that the options fix.
/// @param name  of its file, for messages.
/// @throw InputError naming file or option: a mesh that cannot be repaired, an open mesh where a
///        volume or a thickness is to be kept, numbers of vertices or faces that it does not have,
///        no vertex left that may move, options that contradict each other.
ReflectInput prepared_input(const SurfaceMesh& mesh, const std::string& name,
                            const ReflectOptions& options);

}  // namespace lensforge::reflect

// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_options.h"

#include "core/error.h"
#include "core/schema/description.h"
#include "design/reflect/light/light_field.h"

namespace lensforge::reflect {
namespace {

constexpr int kMaxUpdates = 10000;
constexpr int kMaxDirectionRows = 64;
constexpr int kMaxSunPositions = 1000;
constexpr int kMaxSeeds = 1000000000;
constexpr int kMaxFaces = 1000000;

}  // namespace

void describe(Description& d, ReflectOptions& o) {
  d.word("--goal", o.goal,
         {{"stealth", GoalKind::kStealth},
          {"point", GoalKind::kPoint},
          {"line", GoalKind::kLine},
          {"deflect", GoalKind::kDeflect}},
         "send little light back to where it comes from, much of it to a point or "
         "to a line, or little of it to a point");
  d.text("--place", o.place, "X,Y,Z[,X,Y,Z]",
         "the point of --goal point and deflect, or the two ends of the line");
  d.text("--light", o.light, "X,Y,Z[;X,Y,Z...]",
         "directions towards the light, instead of the band (stealth) or the sun's half "
         "circle from east (+x) over noon (0,-1,1) to west");
  d.word("--method", o.method, {{"exact", Method::kExact}, {"paper", Method::kPaper}},
         "exact: cached light paths without noise, until a stage no longer gains; "
         "paper: random paths, steps of fixed length and all updates");
  d.whole("--seed", o.seed, Limits::between(0, kMaxSeeds), "of --method paper");
  d.number("--elevation", o.elevation_deg, Limits::above(0, 90), "degrees",
           "the band of directions reaches from minus this to this above the horizon");
  d.whole("--direction-rows", o.direction_rows, Limits::between(1, kMaxDirectionRows),
          "heights in the band, each with six times as many azimuths");
  d.whole("--sun-positions", o.sun_positions, Limits::between(1, kMaxSunPositions),
          "directions on the sun's half circle");
  d.number("--anchor", o.anchor, Limits::between(0, 1e6), "",
           "beta: how strongly faces are held at their first directions; larger keeps the "
           "shape, smaller lowers the energy");
  d.number("--denoise", o.denoise, Limits::zero_or(1, 1e9), "",
           "alpha: smooth the normals between creases, for a mesh with a diagonal of 3; 250 "
           "smooths, 1000 hardly does, 0 leaves them as they are");
  d.number("--normal-weight", o.normal_weight, Limits::above(0, 1e9), "",
           "lambda: how strongly elements follow their normals instead of their shape");
  d.whole("--rim-updates", o.rim_updates, Limits::between(0, kMaxUpdates),
          "updates of the vertices that keep whole neighbourhoods rigid");
  d.whole("--face-updates", o.face_updates, Limits::between(0, kMaxUpdates),
          "updates of the vertices that keep faces rigid and let creases form");
  d.whole("--normal-steps", o.normal_steps, Limits::between(1, 1000),
          "steps of the normals before each update of the vertices");
  d.without("--no-split", o.split,
            "do not split the edges that hamper creases, nor update the faces once more");
  d.whole("--faces", o.faces, Limits::zero_or(20, kMaxFaces),
          "remesh to about so many even triangles first; 0 takes the mesh as it is");
  d.text("--fix-box", o.fix_box, "X,Y,Z,X,Y,Z",
         "vertices inside this box do not move; its lowest and highest corner");
  d.text("--fix-plane", o.fix_plane, "NX,NY,NZ,D",
         "vertices with nx*x + ny*y + nz*z <= d do not move");
  d.text("--fix-vertices", o.fix_vertices, "FILE",
         "numbers, from 0, of the vertices of the file that do not move");
  d.text("--planar-faces", o.planar_faces, "FILE",
         "numbers, from 0, of faces that stay in one plane; a line for every plane");
  d.word("--symmetry", o.symmetry,
         {{"none", Symmetry::kNone}, {"x", Symmetry::kX}, {"y", Symmetry::kY}, {"z", Symmetry::kZ}},
         "keep both halves mirror images across this axis at the box's middle");
  d.flag("--keep-volume", o.keep_volume, "keep the volume of a closed mesh");
  d.flag("--keep-box", o.keep_box, "let nothing leave the bounding box");
  d.number("--max-displacement", o.max_displacement, Limits::zero_or(1e-9, 1e9),
           "units of the mesh", "move no vertex farther; 0 sets no limit");
  d.number("--min-thickness", o.min_thickness, Limits::zero_or(1e-9, 1e9), "units of the mesh",
           "keep this much material behind every vertex that has it; 0 sets no limit");
  d.number("--radar", o.radar_ghz, Limits::zero_or(0.01, 1000), "GHz",
           "compute radar cross-sections around the horizon too, for a mesh in millimetres; "
           "0 computes none");
  d.flag("--force", o.force, "replace files that lensforge did not write").left_out =
      "it does not change the shape";
}

void validate(const ReflectOptions& options) {
  require_limits(options);
  make_light_field(options);
}

}  // namespace lensforge::reflect

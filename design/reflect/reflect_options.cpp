// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_options.h"

#include "core/error.h"
#include "design/reflect/light/light_field.h"

namespace lensforge::reflect {
namespace {

using O = ReflectOptions;
using R = Row<O>;

constexpr int kMaxUpdates = 10000;
constexpr int kMaxDirectionRows = 64;
constexpr int kMaxSunPositions = 1000;
constexpr int kMaxSeeds = 1000000000;
constexpr int kMaxFaces = 1000000;

OptionField<O> force_row() {
  OptionField<O> row = R::flag("--force", &O::force, "replace files that lensforge did not write");
  row.left_out = "it does not change the shape";
  return row;
}

}  // namespace

const OptionTable<ReflectOptions>& reflect_fields() {
  static const OptionTable<O> table{
      R::word<GoalKind>("--goal", &O::goal,
                        {{"stealth", GoalKind::kStealth},
                         {"point", GoalKind::kPoint},
                         {"line", GoalKind::kLine},
                         {"deflect", GoalKind::kDeflect}},
                        "send little light back to where it comes from, much of it to a point or "
                        "to a line, or little of it to a point"),
      R::text("--place", &O::place, "X,Y,Z[,X,Y,Z]",
              "the point of --goal point and deflect, or the two ends of the line"),
      R::text("--light", &O::light, "X,Y,Z[;X,Y,Z...]",
              "directions towards the light, instead of the band (stealth) or the sun's half "
              "circle from east (+x) over noon (0,-1,1) to west"),
      R::word<Method>("--method", &O::method,
                      {{"exact", Method::kExact}, {"paper", Method::kPaper}},
                      "exact: cached light paths without noise, until a stage no longer gains; "
                      "paper: random paths, steps of fixed length and all updates"),
      R::whole("--seed", &O::seed, Limits::between(0, kMaxSeeds), "of --method paper"),
      R::number("--elevation", &O::elevation_deg, Limits::above(0, 90), "degrees",
                "the band of directions reaches from minus this to this above the horizon"),
      R::whole("--direction-rows", &O::direction_rows, Limits::between(1, kMaxDirectionRows),
               "heights in the band, each with six times as many azimuths"),
      R::whole("--sun-positions", &O::sun_positions, Limits::between(1, kMaxSunPositions),
               "directions on the sun's half circle"),
      R::number("--anchor", &O::anchor, Limits::between(0, 1e6), "",
                "beta: how strongly faces are held at their first directions; larger keeps the "
                "shape, smaller lowers the energy"),
      R::number("--denoise", &O::denoise, Limits::zero_or(1, 1e9), "",
                "alpha: smooth the normals between creases, for a mesh with a diagonal of 3; 250 "
                "smooths, 1000 hardly does, 0 leaves them as they are"),
      R::number("--normal-weight", &O::normal_weight, Limits::above(0, 1e9), "",
                "lambda: how strongly elements follow their normals instead of their shape"),
      R::whole("--rim-updates", &O::rim_updates, Limits::between(0, kMaxUpdates),
               "updates of the vertices that keep whole neighbourhoods rigid"),
      R::whole("--face-updates", &O::face_updates, Limits::between(0, kMaxUpdates),
               "updates of the vertices that keep faces rigid and let creases form"),
      R::whole("--normal-steps", &O::normal_steps, Limits::between(1, 1000),
               "steps of the normals before each update of the vertices"),
      R::without("--no-split", &O::split,
                 "do not split the edges that hamper creases, nor update the faces once more"),
      R::whole("--faces", &O::faces, Limits::zero_or(20, kMaxFaces),
               "remesh to about so many even triangles first; 0 takes the mesh as it is"),
      R::text("--fix-box", &O::fix_box, "X,Y,Z,X,Y,Z",
              "vertices inside this box do not move; its lowest and highest corner"),
      R::text("--fix-plane", &O::fix_plane, "NX,NY,NZ,D",
              "vertices with nx*x + ny*y + nz*z <= d do not move"),
      R::text("--fix-vertices", &O::fix_vertices, "FILE",
              "numbers, from 0, of the vertices of the file that do not move"),
      R::text("--planar-faces", &O::planar_faces, "FILE",
              "numbers, from 0, of faces that stay in one plane; a line for every plane"),
      R::word<Symmetry>("--symmetry", &O::symmetry,
                        {{"none", Symmetry::kNone},
                         {"x", Symmetry::kX},
                         {"y", Symmetry::kY},
                         {"z", Symmetry::kZ}},
                        "keep both halves mirror images across this axis at the box's middle"),
      R::flag("--keep-volume", &O::keep_volume, "keep the volume of a closed mesh"),
      R::flag("--keep-box", &O::keep_box, "let nothing leave the bounding box"),
      R::number("--max-displacement", &O::max_displacement, Limits::zero_or(1e-9, 1e9),
                "units of the mesh", "move no vertex farther; 0 sets no limit"),
      R::number("--min-thickness", &O::min_thickness, Limits::zero_or(1e-9, 1e9),
                "units of the mesh",
                "keep this much material behind every vertex that has it; 0 sets no limit"),
      R::number("--radar", &O::radar_ghz, Limits::zero_or(0.01, 1000), "GHz",
                "compute radar cross-sections around the horizon too, for a mesh in millimetres; "
                "0 computes none"),
      force_row()};
  return table;
}

void validate(const ReflectOptions& options) {
  require_limits(reflect_fields(), options);
  make_light_field(options);
}

}  // namespace lensforge::reflect

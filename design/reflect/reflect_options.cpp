// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_options.h"

#include "core/error.h"
#include "design/reflect/light/light_field.h"

namespace lensforge::reflect {
namespace {

using O = ReflectOptions;
using R = Row<O>;

constexpr int kMostUpdates = 10000;
constexpr int kMostDirectionRows = 64;
constexpr int kMostSunPositions = 1000;

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
      R::number("--elevation", &O::elevation_deg, Limits::above(0, 90), "degrees",
                "the band of directions reaches from minus this to this above the horizon"),
      R::whole("--direction-rows", &O::direction_rows, Limits::between(1, kMostDirectionRows),
               "heights in the band, each with six times as many azimuths"),
      R::whole("--sun-positions", &O::sun_positions, Limits::between(1, kMostSunPositions),
               "directions on the sun's half circle"),
      R::number("--anchor", &O::anchor, Limits::between(0, 1e6), "",
                "beta: how strongly faces are held at their first directions; larger keeps the "
                "shape, smaller lowers the energy"),
      R::number("--denoise", &O::denoise, Limits::zero_or(1, 1e9), "",
                "alpha: smooth the normals between creases, for a mesh with a diagonal of 3; 250 "
                "smooths, 1000 hardly does, 0 leaves them as they are"),
      R::number("--normal-weight", &O::normal_weight, Limits::above(0, 1e9), "",
                "lambda: how strongly elements follow their normals instead of their shape"),
      R::whole("--rim-updates", &O::rim_updates, Limits::between(0, kMostUpdates),
               "updates of the vertices that keep whole neighbourhoods rigid"),
      R::whole("--face-updates", &O::face_updates, Limits::between(0, kMostUpdates),
               "updates of the vertices that keep faces rigid and let creases form"),
      R::whole("--normal-steps", &O::normal_steps, Limits::between(1, 1000),
               "steps of the normals before each update of the vertices"),
      R::flag("--force", &O::force, "replace files that lensforge did not write")};
  return table;
}

void validate(const ReflectOptions& options) {
  require_limits(reflect_fields(), options);
  make_light_field(options);
}

}  // namespace lensforge::reflect

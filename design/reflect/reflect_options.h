// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "core/text/option_field.h"
#include "design/reflect/light/goal.h"

namespace lensforge::reflect {

/// What shapes a reflection. Lengths and places are in the units of the mesh, z is up.
struct ReflectOptions {
  GoalKind goal = GoalKind::kStealth;
  std::string place;  ///< Of a goal: "X,Y,Z" a point, "X,Y,Z,X,Y,Z" the ends of a line.
  std::string light;  ///< "X,Y,Z;X,Y,Z;…" towards the light; empty: the band or the sun.
  double elevation_deg = 20.0;  ///< Half height of the band of directions.
  int direction_rows = 8;       ///< Heights in the band, each with six times as many azimuths.
  int sun_positions = 24;       ///< On the sun's half circle.
  double anchor = 0.1;          ///< β: how strongly normals are held.
  double denoise = 0.0;         ///< α for a mesh whose diagonal is 3; 0: none.
  double normal_weight = 1000;  ///< λ of Eq. 3.
  int rim_updates = 30;         ///< Vertex updates with rim-spoke elements.
  int face_updates = 30;        ///< Vertex updates with face elements.
  int normal_steps = 8;         ///< Steps of the normals before each vertex update.
  bool force = false;           ///< Replace files that lensforge did not write.
};

/// The options as the command has them.
const OptionTable<ReflectOptions>& reflect_fields();

/// @throw InputError naming option, value and rule.
void validate(const ReflectOptions& options);

}  // namespace lensforge::reflect

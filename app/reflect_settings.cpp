// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/reflect_settings.h"

namespace lensforge::app {

void add_reflect_options(OptionSet& options, ReflectSettings& settings) {
  options.positional("MESH", settings.mesh,
                     "shape: .stl, .obj, .ply, .off; solid: .step, .stp; z is up");
  options.text("--out", settings.out, "DIR", "folder for the new shape, its pictures and figures");
  options.flag("--evaluate", settings.evaluate,
               "print the reflected energies of the mesh as it is and write nothing");
  options.flag("--resume", settings.resume,
               "continue the interrupted run in --out, with the same mesh and options");
  options.fields(reflect::reflect_fields(), settings.reflect);
}

}  // namespace lensforge::app

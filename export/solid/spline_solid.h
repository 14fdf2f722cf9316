// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <TopoDS_Face.hxx>
#include <TopoDS_Solid.hxx>
#include <string>
#include <utility>
#include <vector>

#include "export/spline/spline_net.h"

namespace lensforge {

/// An OpenCASCADE solid and the names of its faces.
struct NamedSolid {
  TopoDS_Solid solid;
  std::vector<std::pair<TopoDS_Face, std::string>> names;
};

/// Returns the solid between a net and the face below it; neighbouring faces share their edges.
NamedSolid make_spline_solid(const SplineNet& net);

}  // namespace lensforge

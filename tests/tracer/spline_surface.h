// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "tracer/lens_files.h"

namespace tracer {

/// surface.spline as fine triangles, with the spline's own points and unit normals at their
/// corners.
/// @throw std::runtime_error naming the file.
Mesh read_spline(const std::string& file);

}  // namespace tracer

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "core/optics/dispersion.h"
#include "core/optics/optical_setup.h"
#include "core/surface/surface_mesh.h"

namespace lensforge {

/// Fewest and most wavelengths of a picture.
inline constexpr int kMinWavelengths = 2;
inline constexpr int kMaxWavelengths = 5;

/// Wavelengths, nm, from "450,550,650". @param name  of the option, for the message.
/// @throw InputError unless there are 2 to 5 that rise, from 380 to 780.
std::vector<double> parse_wavelengths(const std::string& text, const std::string& name);

/// The setup for light of one wavelength; its index is that of the line d.
OpticalSetup in_color(OpticalSetup setup, double abbe, double wavelength);

/// How far apart on the screen the first and last wavelength land, mm.
struct Fringe {
  double mean = 0.0;  ///< Over the vertices of the surface.
  double max = 0.0;
};

/// @param normals  3 × V of the surface at its vertices, of any length, z > 0. Rays that do not
///                 leave the surface are left out.
Fringe fringe_of(const SurfaceMesh& mesh, const Eigen::Matrix3Xd& normals,
                 const OpticalSetup& setup, double abbe, const std::vector<double>& wavelengths);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "core/image/image_io.h"
#include "design/reflect/reflect_shape.h"

namespace lensforge::reflect {

/// The pictures of a result.
struct ReflectPictures {
  ColorImage views;         ///< retroreflection_views()
  ColorImage displacement;  ///< displacement_views()
};

/// A page that needs nothing from outside: energies before and after, pictures, how the energy
/// fell, radar cross-sections, what is broken, options.
std::string reflect_report(const ReflectResult& result, const ReflectOptions& options,
                           const ReflectPictures& pictures);

}  // namespace lensforge::reflect

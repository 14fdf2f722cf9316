// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "core/optics/outline.h"
#include "core/schema/json.h"

namespace lensforge {

/// The outline in lens.json: its type, a circle's centre and radius, a rounded rectangle's radius,
/// a polygon's corners; mm.
nlohmann::ordered_json outline_json(const Outline& outline, const Eigen::Vector2d& lens_size);

/// outline_json() read back for a lens of this size. @throw InputError naming the field.
Outline read_outline(const JsonFields& outline, const Eigen::Vector2d& lens_size);

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "design/reflect/input.h"
#include "design/reflect/reflect_shape.h"
#include "design/reflect/result_files.h"

/// Deforms a mesh so that its reflection meets a goal: no light back to its source, light to a
/// point or a line, or no light to a point (Tojo et al.); or so that little of a radar's wave goes
/// back. Meshes are read by core (read_mesh()),
/// solids by export (read_solid_mesh()).
///
///     reflect::ReflectOptions options;
///     options.goal = reflect::GoalKind::kStealth;
///     options.max_displacement = 2.0;
///     const Executor executor = Executor::cpu(8);
///     const reflect::ReflectInput input =
///         reflect::prepared_input(read_mesh("car.stl"), "car.stl", options);
///     const reflect::ReflectResult result =
///         reflect::reflect_shape(input, options, executor, RunControl());
///     if (result.done()) reflect::write_result(result, options, "stealthy", executor);
namespace lensforge::reflect {}

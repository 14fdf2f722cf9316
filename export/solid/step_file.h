// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/compute/run_control.h"
#include "export/spline/spline_net.h"

namespace lensforge {

/// Checks what holds for every STEP file (ISO 10303-21) before OpenCASCADE trusts it: it begins as
/// one, has a whole DATA section, texts, comments and parentheses end, no entity is defined twice,
/// and each one that is named is defined. Returns the number of entities.
/// @throw InputError "NAME: line 12: #34 is used but nowhere defined" and the like.
std::int64_t check_part21(std::string_view content, const std::string& name);

/// Application protocol of a STEP file.
enum class StepSchema { kAp214, kAp242 };

/// What the header of a solid's file says; ASCII.
struct StepHeader {
  std::string name;         ///< Of the part.
  std::string description;  ///< One line: what it was made from.
  std::string author;
  std::string program;
  std::string time_stamp;  ///< ISO 8601; the same input then gives the same bytes.
};

/// What a file of solids holds, as OpenCASCADE sees it.
struct SolidContent {
  int solids = 0;
  int faces = 0;
  std::int64_t entities = 0;    ///< Of a file that was read by inspect_step() or inspect_iges().
  bool valid = false;           ///< BRepCheck_Analyzer finds nothing.
  bool closed = false;          ///< Every edge has a face on both sides.
  double volume = 0.0;          ///< mm³
  std::array<double, 3> low{};  ///< Corners of the box around it, mm
  std::array<double, 3> high{};

  [[nodiscard]] bool is_one_solid() const { return solids == 1 && valid && closed; }
};

/// Writes the solid between a spline net and the face below it as STEP in millimetres: the patches
/// are faces named "optical surface", the walls "side wall", the plane or sphere below "back".
/// The file is read back before it appears under its name: one solid, valid, closed, the net's
/// volume to 1e-6. @pre the net lies above that face. @throw RunError if it cannot be written or
/// does not read back so;
///      Interrupted, and then nothing was written.
SolidContent write_step(const SplineNet& net, const StepHeader& header, StepSchema schema,
                        const std::filesystem::path& path, const RunControl& control = {});

/// OpenCASCADE works in a child process: what makes it crash is an InputError as well.
/// @throw InputError if the file cannot be read or holds no shape; Interrupted.
SolidContent inspect_step(const std::filesystem::path& path, const RunControl& control = {});

}  // namespace lensforge

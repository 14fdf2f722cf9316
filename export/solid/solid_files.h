// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/compute/executor.h"
#include "core/mesh/surface_mesh.h"
#include "export/spline/spline_net.h"

namespace lensforge {

// STEP

/// Checks the structure of a STEP file (ISO 10303-21) before OpenCASCADE reads it: a STEP header, a
/// complete DATA section, closed strings, comments and parentheses, no entity defined twice, and no
/// undefined entity used. Returns the number of entities.
/// @throw InputError "NAME: line 12: #34 is used but nowhere defined" and the like.
std::int64_t check_part21(std::string_view content, const std::string& name);

/// Application protocol of a STEP file.
enum class StepSchema { kAp214, kAp242 };

/// Header of a solid's file; ASCII.
struct StepHeader {
  std::string name;         ///< The part's name.
  std::string description;  ///< One line: the part's source.
  std::string author;
  std::string program;
  std::string time_stamp;  ///< ISO 8601. Given by the caller: the same input gives the same bytes.
};

/// When a file was written, as StepHeader::time_stamp; empty if that is not known.
std::string file_time(const std::filesystem::path& file);

/// Content of a file of solids, according to OpenCASCADE.
struct SolidContent {
  int solids = 0;
  int faces = 0;
  std::int64_t entities = 0;    ///< Set by inspect_step() and inspect_iges() only.
  bool valid = false;           ///< BRepCheck_Analyzer finds no fault.
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

/// Writes a mesh as STEP (AP214) in millimetres: every triangle is a flat face that shares its
/// edges with its neighbours; every closed piece of the mesh is a solid, every open one a shell.
/// The file is read back before it appears under its name: as many faces, valid, and of closed
/// pieces the mesh's volume to 1e-6.
/// @pre an edge has at most two triangles, which run along it in opposite directions.
/// @throw RunError if it cannot be written, as with sides below 1e-7 mm, or does not read back so;
///        Interrupted, and then nothing was written.
SolidContent write_mesh_step(const SurfaceMesh& mesh, const StepHeader& header,
                             const std::filesystem::path& path, const RunControl& control = {});

/// Reads a STEP file. OpenCASCADE runs in a child process; its crash is an InputError too.
/// @throw InputError if the file cannot be read or holds no shape; Interrupted.
SolidContent inspect_step(const std::filesystem::path& path, const RunControl& control = {});

// IGES

/// Checks the structure of an IGES file in its fixed form (IGES 5.3, chapter 2) before OpenCASCADE
/// trusts it: lines of 80 columns, sections S G D P T in this order and numbered from 1, two lines
/// for each directory entry, valid pointers into the directory and the parameters, and a last line
/// with the right counts. Returns the number of entities.
/// @throw InputError "NAME: line 12: its parameters begin in line 40 of section P, which has 39"
///        and the like.
std::int64_t check_iges(std::string_view content, const std::string& name);

/// write_step() as IGES 5.3, a manifold solid (entity 186) in millimetres. The format has no face
/// names, and its header no description.
/// @pre the net lies above z = 0. @throw RunError if it cannot be written or does not read back;
///      Interrupted, and then nothing was written.
SolidContent write_iges(const SplineNet& net, const StepHeader& header,
                        const std::filesystem::path& path, const RunControl& control = {});

/// Reads an IGES file. OpenCASCADE runs in a child process; its crash is an InputError too.
/// @throw InputError if the file cannot be read or holds no shape; Interrupted.
SolidContent inspect_iges(const std::filesystem::path& path, const RunControl& control = {});

}  // namespace lensforge

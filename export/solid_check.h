// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <TopoDS_Shape.hxx>
#include <optional>
#include <string>

#include "export/step_file.h"

/// What the files of all solid formats share; OpenCASCADE's types stay inside of this room.
namespace lensforge {

/// OpenCASCADE reports on stdout, which belongs to the command.
void silence_opencascade();

int count_shapes(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind);

/// @throw InputError if the file cannot be read or holds no shape. Lengths become millimetres.
TopoDS_Shape read_step_shape(const std::filesystem::path& path);

/// @param expected  the volume in mm³, if known: coarse integration that finds it is enough.
SolidContent inspect_shape(const TopoDS_Shape& shape, std::optional<double> expected = {});

/// @throw RunError naming `path` unless `content` is one closed solid of `volume` mm³.
void require_read_back(const SolidContent& content, double volume,
                       const std::filesystem::path& path);

/// @throw RunError "cannot be written".
[[noreturn]] void fail_to_write(const std::filesystem::path& path, const std::string& why);

/// Why the system refused the last write.
std::string last_system_error();

}  // namespace lensforge

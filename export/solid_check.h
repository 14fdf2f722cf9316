// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <TopoDS_Shape.hxx>
#include <functional>
#include <optional>
#include <string>

#include "core/compute/run_control.h"
#include "export/step_file.h"

/// What the files of all solid formats share; OpenCASCADE's types stay inside of this room.
namespace lensforge {

/// OpenCASCADE reports on stdout, which belongs to the command.
void silence_opencascade();

int count_shapes(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind);

/// @param expected  the volume in mm³, if known: coarse integration that finds it is enough.
SolidContent inspect_shape(const TopoDS_Shape& shape, std::optional<double> expected = {});

/// SolidContent as bytes, for a child process's result, and back.
std::string bytes_of(const SolidContent& content);
SolidContent content_of(const std::string& bytes);

/// Runs `write`, which writes `path` with OpenCASCADE and reads it back, in a child process, so
/// that a stop request ends it at once. @throw RunError if it cannot be written or read;
/// Interrupted.
SolidContent write_guarded(const std::filesystem::path& path, const RunControl& control,
                           const std::function<SolidContent(const RunControl&)>& write);

/// @throw RunError naming `path` unless `content` is one closed solid of `volume` mm³.
void require_read_back(const SolidContent& content, double volume,
                       const std::filesystem::path& path);

/// @throw RunError "cannot be written".
[[noreturn]] void fail_to_write(const std::filesystem::path& path, const std::string& why);

/// Why the system refused the last write.
std::string last_system_error();

}  // namespace lensforge

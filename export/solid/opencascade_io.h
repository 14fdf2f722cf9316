// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <STEPControl_Reader.hxx>
#include <TopoDS_Shape.hxx>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/compute/run_control.h"
#include "export/solid/step_file.h"

/// How files of solids are read and written, whatever their format. OpenCASCADE crashes at some
/// broken files, and takes for ever over others, so that all of its work on a file that is not our
/// own happens in a child process. Its types stay inside of this room.
namespace lensforge {

/// Bytes of a file at most; export's largest has 0.7 GB, and OpenCASCADE takes 15 bytes for one.
inline constexpr std::uintmax_t kMaxSolidBytes = 2'000'000'000;

/// Runs OpenCASCADE's `work` on a file in a child process (run_in_child()) and returns its result.
/// @throw InputError naming the file: it is missing or no regular file, or the child crashes, fails
///        or needs more memory or time than a file of this size is given; Interrupted.
std::string read_guarded(const std::filesystem::path& path,
                         const std::function<std::string(const RunControl&)>& work,
                         const RunControl& control);

/// Reads a STEP file and turns it into shapes; lengths become millimetres.
/// @pre in a child process, or the file is our own.
/// @throw InputError if OpenCASCADE takes it for no STEP file.
void load_step(STEPControl_Reader& reader, const std::filesystem::path& path,
               const RunControl& control);

/// The shape of a STEP or an IGES file. @pre as for load_step().
/// @throw InputError if the file cannot be read or holds no shape.
TopoDS_Shape read_step_shape(const std::filesystem::path& path, const RunControl& control);
TopoDS_Shape read_iges_shape(const std::filesystem::path& path, const RunControl& control);

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

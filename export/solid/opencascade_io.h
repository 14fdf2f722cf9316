// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <STEPControl_Reader.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <TopoDS_Solid.hxx>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/compute/executor.h"
#include "export/solid/solid_files.h"
#include "export/spline/spline_net.h"

/// Reading and writing of solids in any format. OpenCASCADE crashes on some broken files and never
/// ends on others; it therefore reads files that are not our own in a child process. Its types are
/// used only in this folder.
namespace lensforge {

/// Maximum file size in bytes. The largest file that export writes has 0.7 GB; OpenCASCADE needs 15
/// bytes of memory per byte.
inline constexpr std::uintmax_t kMaxSolidBytes = 2'000'000'000;

/// Runs OpenCASCADE's `work` on a file in a child process (run_in_child()) and returns its result.
/// @throw InputError naming the file: it is missing or no regular file, or the child crashes, fails
///        or needs more memory or time than a file of this size may use; Interrupted.
std::string read_guarded(const std::filesystem::path& path,
                         const std::function<std::string(const RunControl&)>& work,
                         const RunControl& control);

/// Reports a step of writing a solid, such as "reading back", and returns a control whose reports
/// have it as detail. `control` must outlive it.
RunControl solid_step(const std::string& what, const RunControl& control);

/// Reads a STEP file and turns it into shapes; lengths become millimetres.
/// @pre in a child process, or the file is our own.
/// @throw InputError if OpenCASCADE does not accept it as a STEP file.
void load_step(STEPControl_Reader& reader, const std::filesystem::path& path,
               const RunControl& control);

/// Reads the shape of a STEP or an IGES file. @pre as for load_step().
/// @throw InputError if the file cannot be read or holds no shape.
TopoDS_Shape read_step_shape(const std::filesystem::path& path, const RunControl& control);
TopoDS_Shape read_iges_shape(const std::filesystem::path& path, const RunControl& control);

/// A text as OpenCASCADE takes it.
Handle(TCollection_HAsciiString) occ_text(const std::string& value);

/// Silences OpenCASCADE's messages: it prints them to stdout, which is the command's.
void silence_opencascade();

int count_shapes(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind);

/// @param expected  the volume in mm³, if known; a coarse integration that matches it is accepted.
SolidContent inspect_shape(const TopoDS_Shape& shape, std::optional<double> expected = {});

/// Converts SolidContent to bytes, for the result of a child process, and back.
std::string bytes_of(const SolidContent& content);
SolidContent content_of(const std::string& bytes);

/// Runs `write`, which writes `path` with OpenCASCADE and reads it back, in a child process, which
/// a stop request ends at once. @throw RunError if it cannot be written or read; Interrupted.
SolidContent write_guarded(const std::filesystem::path& path, const RunControl& control,
                           const std::function<SolidContent(const RunControl&)>& write);

/// @throw RunError naming `path` unless `content` is one closed solid of `volume` mm³.
void require_read_back(const SolidContent& content, double volume,
                       const std::filesystem::path& path);

/// @throw RunError naming `path` unless `content` has a volume, mm³.
void require_same_volume(const SolidContent& content, double volume,
                         const std::filesystem::path& path);

/// @throw RunError "cannot be written".
[[noreturn]] void fail_to_write(const std::filesystem::path& path, const std::string& why);

/// Reason for which the system refused the last write.
std::string last_system_error();

/// An OpenCASCADE solid and the names of its faces.
struct NamedSolid {
  TopoDS_Solid solid;
  std::vector<std::pair<TopoDS_Face, std::string>> names;
};

/// Returns the solid between a net and the face below it; neighbouring faces share their edges.
/// Defined in spline_solid.cpp.
NamedSolid make_spline_solid(const SplineNet& net);

}  // namespace lensforge

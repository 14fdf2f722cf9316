// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/iges_file.h"

#include <IGESControl_Controller.hxx>
#include <IGESControl_Writer.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <string>

#include "core/io/files.h"
#include "export/iges_check.h"
#include "export/solid_check.h"
#include "export/solid_reading.h"
#include "export/spline_solid.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

Handle(TCollection_HAsciiString) text(const std::string& value) {
  return new TCollection_HAsciiString(value.c_str());
}

/// ISO 8601 as IGES has it: YYYYMMDD.HHNNSS.
std::string iges_date(const std::string& time_stamp) {
  std::string date;
  for (const char c : time_stamp) {
    if (c == 'T') date += '.';
    if (std::isdigit(static_cast<unsigned char>(c)) != 0) date += c;
  }
  return date;
}

void fill_header(const StepHeader& header, const fs::path& path, IGESControl_Writer& writer) {
  IGESData_GlobalSection section = writer.Model()->GlobalSection();
  section.SetSendName(text(header.name));
  section.SetFileName(text(path.filename().string()));
  section.SetSystemId(text(header.program));
  section.SetInterfaceVersion(text(header.program));
  section.SetAuthorName(text(header.author));
  section.SetDate(text(iges_date(header.time_stamp)));
  section.SetLastChangeDate(text(iges_date(header.time_stamp)));
  writer.Model()->SetGlobalSection(section);
  // There it stands whole; lines of the global section break anywhere.
  writer.Model()->AddStartLine(header.program.c_str());
}

/// What happens in the child process.
SolidContent write_beside(const SplineNet& net, const StepHeader& header, const fs::path& beside,
                          const fs::path& path) {
  silence_opencascade();
  IGESControl_Controller::Init();
  constexpr int kSolids = 1;
  IGESControl_Writer writer("MM", kSolids);
  if (!writer.AddShape(make_spline_solid(net).solid)) {
    fail_to_write(path, "OpenCASCADE cannot put the solid into IGES");
  }
  writer.ComputeModel();
  fill_header(header, path, writer);
  errno = 0;
  if (!writer.Write(beside.c_str())) fail_to_write(path, last_system_error());
  return inspect_shape(read_iges_shape(beside, {}), net.volume());
}

}  // namespace

SolidContent write_iges(const SplineNet& net, const StepHeader& header, const fs::path& path,
                        const RunControl& control) {
  SolidContent content;
  write_whole_file(path, [&](const fs::path& beside) {
    content = write_guarded(
        path, control, [&](const RunControl&) { return write_beside(net, header, beside, path); });
    require_read_back(content, net.volume(), path);
  });
  return content;
}

SolidContent inspect_iges(const fs::path& path, const RunControl& control) {
  const auto inspect = [&](const RunControl& inner) {
    const std::int64_t entities = check_iges(read_whole_file(path, kMaxSolidBytes), path.string());
    SolidContent content = inspect_shape(read_iges_shape(path, inner));
    content.entities = entities;
    return bytes_of(content);
  };
  return content_of(read_guarded(path, inspect, control));
}

}  // namespace lensforge

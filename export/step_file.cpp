// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/step_file.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <Interface_Static.hxx>
#include <STEPConstruct.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <Transfer_FinderProcess.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferWriter.hxx>
#include <XSControl_WorkSession.hxx>
#include <cerrno>

#include "core/io/files.h"
#include "export/part21_check.h"
#include "export/solid_check.h"
#include "export/solid_reading.h"
#include "export/spline_solid.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

Handle(TCollection_HAsciiString) text(const std::string& value) {
  return new TCollection_HAsciiString(value.c_str());
}

/// OpenCASCADE keeps what a file is to look like in process-wide settings.
void set_up_writing(const StepHeader& header, StepSchema schema, bool outlined) {
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.schema",
                            schema == StepSchema::kAp214 ? "AP214IS" : "AP242DIS");
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetCVal("write.step.product.name", header.name.c_str());
  // Curves in parameter space follow from the ones in space; without them files are smaller. Those
  // of an outline are no lines of the parameters, and would be found less exactly.
  Interface_Static::SetIVal("write.surfacecurve.mode", outlined ? 1 : 0);
}

void name_faces(const NamedSolid& solid, STEPControl_Writer& writer) {
  const Handle(Transfer_FinderProcess) finder = writer.WS()->TransferWriter()->FinderProcess();
  for (const auto& [face, name] : solid.names) {
    const Handle(StepRepr_RepresentationItem) item = STEPConstruct::FindEntity(finder, face);
    if (!item.IsNull()) item->SetName(text(name));
  }
}

void fill_header(const StepHeader& header, STEPControl_Writer& writer) {
  APIHeaderSection_MakeHeader section(writer.Model());
  section.SetName(text(header.name));
  section.SetDescriptionValue(1, text(header.description));
  section.SetAuthorValue(1, text(header.author));
  section.SetOriginatingSystem(text(header.program));
  section.SetPreprocessorVersion(text(header.program));
  section.SetTimeStamp(text(header.time_stamp));
}

/// What happens in the child process.
SolidContent write_beside(const SplineNet& net, const StepHeader& header, StepSchema schema,
                          const fs::path& beside, const fs::path& path) {
  silence_opencascade();
  const NamedSolid solid = make_spline_solid(net);
  set_up_writing(header, schema, net.outline.has_value());
  STEPControl_Writer writer;
  if (writer.Transfer(solid.solid, STEPControl_ManifoldSolidBrep) != IFSelect_RetDone) {
    fail_to_write(path, "OpenCASCADE cannot put the solid into STEP");
  }
  name_faces(solid, writer);
  fill_header(header, writer);
  errno = 0;
  if (writer.Write(beside.c_str()) != IFSelect_RetDone) fail_to_write(path, last_system_error());
  return inspect_shape(read_step_shape(beside, {}), net.volume());
}

}  // namespace

SolidContent write_step(const SplineNet& net, const StepHeader& header, StepSchema schema,
                        const fs::path& path, const RunControl& control) {
  SolidContent content;
  write_whole_file(path, [&](const fs::path& beside) {
    content = write_guarded(path, control, [&](const RunControl&) {
      return write_beside(net, header, schema, beside, path);
    });
    require_read_back(content, net.volume(), path);
  });
  return content;
}

SolidContent inspect_step(const fs::path& path, const RunControl& control) {
  const std::int64_t entities = check_part21(read_whole_file(path, kMaxSolidBytes), path.string());
  SolidContent content = content_of(read_guarded(
      path, [&](const RunControl& c) { return bytes_of(inspect_shape(read_step_shape(path, c))); },
      control));
  content.entities = entities;
  return content;
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/step_file.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRep_Tool.hxx>
#include <GProp_GProps.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <STEPConstruct.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Reader.hxx>
#include <STEPControl_Writer.hxx>
#include <Standard_Failure.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <Transfer_FinderProcess.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferWriter.hxx>
#include <XSControl_WorkSession.hxx>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "core/error.h"
#include "core/files.h"
#include "export/spline_solid.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Share by which OpenCASCADE's volume of the file may differ from the splines' own integral.
constexpr double kVolumeShare = 1e-6;

[[noreturn]] void fail_to_write(const fs::path& path, const std::string& why) {
  throw RunError(path.string() + ": cannot be written: " + why);
}

/// OpenCASCADE reports on stdout, which belongs to the command.
void silence_opencascade() {
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));
}

Handle(TCollection_HAsciiString) text(const std::string& value) {
  return new TCollection_HAsciiString(value.c_str());
}

/// OpenCASCADE keeps what a file is to look like in process-wide settings.
void set_up_writing(const StepHeader& header, StepSchema schema) {
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.schema",
                            schema == StepSchema::kAp214 ? "AP214IS" : "AP242DIS");
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetCVal("write.step.product.name", header.name.c_str());
  // Curves in parameter space follow from the ones in space; without them files are smaller.
  Interface_Static::SetIVal("write.surfacecurve.mode", 0);
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

int count(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind) {
  int number = 0;
  for (TopExp_Explorer at(shape, kind); at.More(); at.Next()) ++number;
  return number;
}

bool shells_are_closed(const TopoDS_Shape& shape) {
  for (TopExp_Explorer at(shape, TopAbs_SHELL); at.More(); at.Next()) {
    if (!BRep_Tool::IsClosed(at.Current())) return false;
  }
  return true;
}

TopoDS_Shape read_shape(const fs::path& path) {
  STEPControl_Reader reader;
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone) {
    throw InputError(path.string() + ": is missing or no STEP file");
  }
  reader.TransferRoots();
  if (reader.NbShapes() == 0) throw InputError(path.string() + ": holds no shape");
  return reader.OneShape();
}

void require_read_back(const StepContent& content, double volume, const fs::path& path) {
  if (!content.is_one_solid()) fail_to_write(path, "it does not read back as one closed solid");
  if (std::abs(content.volume - volume) <= kVolumeShare * volume) return;
  fail_to_write(path, "it reads back with a volume of " + std::to_string(content.volume) +
                          " mm^3 instead of " + std::to_string(volume));
}

}  // namespace

StepContent write_step(const SplineNet& net, const StepHeader& header, StepSchema schema,
                       const fs::path& path) {
  silence_opencascade();
  const NamedSolid solid = make_spline_solid(net);
  set_up_writing(header, schema);
  STEPControl_Writer writer;
  if (writer.Transfer(solid.solid, STEPControl_ManifoldSolidBrep) != IFSelect_RetDone) {
    fail_to_write(path, "OpenCASCADE cannot put the solid into STEP");
  }
  name_faces(solid, writer);
  fill_header(header, writer);
  StepContent content;
  write_whole_file(path, [&](const fs::path& beside) {
    errno = 0;
    if (writer.Write(beside.c_str()) != IFSelect_RetDone) {
      fail_to_write(path, errno != 0 ? std::generic_category().message(errno) : "unknown reason");
    }
    content = inspect_step(beside);
    require_read_back(content, net.volume(), path);
  });
  return content;
}

StepContent inspect_step(const fs::path& path) {
  silence_opencascade();
  const TopoDS_Shape shape = read_shape(path);
  StepContent content;
  content.solids = count(shape, TopAbs_SOLID);
  content.faces = count(shape, TopAbs_FACE);
  content.valid = BRepCheck_Analyzer(shape).IsValid();
  content.closed = shells_are_closed(shape);
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties, kVolumeShare / 10.0);
  content.volume = properties.Mass();
  return content;
}

}  // namespace lensforge

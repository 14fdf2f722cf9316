// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid/opencascade_io.h"

#include <BRepBndLib.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepGProp.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <IGESControl_Controller.hxx>
#include <IGESControl_Reader.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Message_PrinterOStream.hxx>
#include <Message_ProgressIndicator.hxx>
#include <Message_ProgressScope.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <TopExp_Explorer.hxx>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <new>
#include <stdexcept>
#include <system_error>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/sandbox/child_work.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;

/// Memory that a reader may need whatever the file's size, for the samples above all, and for each
/// byte of it. A file of 35 MB takes 0.6 GB.
constexpr double kMemory = 3e9;
constexpr double kMemoryPerByte = 100.0;

/// Computing time that a reader is given: a file of 35 MB takes 12 s, most of it the check.
constexpr double kSeconds = 120.0;
constexpr double kSecondsPerByte = 3e-5;

/// OpenCASCADE's progress, passed on.
class ReadProgress : public Message_ProgressIndicator {
 public:
  explicit ReadProgress(const RunControl& control) : control_(control) {}

 protected:
  void Show(const Message_ProgressScope& /*scope*/, Standard_Boolean /*force*/) override {
    control_.report({"", GetPosition(), 1.0, ""});
  }

 private:
  const RunControl& control_;
};

ChildLimits limits_for(const fs::path& path) {
  const auto bytes = static_cast<double>(fs::file_size(path));
  return {.memory_bytes = std::min(kMemory + kMemoryPerByte * bytes, free_memory_bytes()),
          .cpu_seconds = kSeconds + kSecondsPerByte * bytes};
}

/// Reads either format. @param name  of the format.
template <class Reader>
void load(Reader& reader, const char* name, const fs::path& path, const RunControl& control) {
  silence_opencascade();
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone) {
    throw InputError(path.string() + ": is no " + name + " file that can be read");
  }
  const Handle(ReadProgress) progress = new ReadProgress(control);
  reader.TransferRoots(progress->Start());
}

template <class Reader>
TopoDS_Shape only_shape(const Reader& reader, const fs::path& path) {
  const TopoDS_Shape shape = reader.NbShapes() > 0 ? reader.OneShape() : TopoDS_Shape();
  if (shape.IsNull()) throw InputError(path.string() + ": holds no shape");
  return shape;
}

/// `work` with OpenCASCADE's exceptions turned into standard ones.
std::string with_standard_errors(const std::function<std::string()>& work) {
  try {
    return work();
  } catch (const Standard_OutOfMemory&) {
    throw std::bad_alloc();
  } catch (const Standard_Failure& failure) {
    throw std::runtime_error(std::string("OpenCASCADE: ") + failure.GetMessageString());
  }
}

}  // namespace

std::string read_guarded(const fs::path& path,
                         const std::function<std::string(const RunControl&)>& work,
                         const RunControl& control) {
  require_regular_file(path);
  const auto guarded = [&](const RunControl& inner) {
    return with_standard_errors([&] { return work(inner); });
  };
  try {
    return run_in_child("reading " + path.filename().string(), limits_for(path), guarded, control);
  } catch (const ChildFailure& failure) {
    throw InputError(path.string() + ": is no solid that can be read: the reader " +
                     failure.what() +
                     "; a program that writes solids can check it and write it anew");
  }
}

void load_step(STEPControl_Reader& reader, const fs::path& path, const RunControl& control) {
  load(reader, "STEP", path, control);
}

TopoDS_Shape read_step_shape(const fs::path& path, const RunControl& control) {
  STEPControl_Reader reader;
  load_step(reader, path, control);
  return only_shape(reader, path);
}

TopoDS_Shape read_iges_shape(const fs::path& path, const RunControl& control) {
  IGESControl_Controller::Init();
  IGESControl_Reader reader;
  load(reader, "IGES", path, control);
  return only_shape(reader, path);
}

namespace {

/// Share by which OpenCASCADE's volume of the file may differ from the splines' own integral.
constexpr double kVolumeShare = 1e-6;

/// Relative errors that OpenCASCADE's integration is asked for, one after the other until the
/// volume is the expected one. It comes out far better than asked for (1e-4: a portrait's 119,025
/// control points to 1.4e-8 in 1.3 s; 1e-7: to 2e-9 in 11 s).
constexpr std::array kIntegrationErrors{1e-4, 1e-7};

double volume_of(const TopoDS_Shape& shape, double error) {
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties, error);
  return properties.Mass();
}

bool is_same_volume(double found, double expected) {
  return std::abs(found - expected) <= kVolumeShare * expected;
}

bool shells_are_closed(const TopoDS_Shape& shape) {
  for (TopExp_Explorer at(shape, TopAbs_SHELL); at.More(); at.Next()) {
    if (!BRep_Tool::IsClosed(at.Current())) return false;
  }
  return true;
}

/// Around the shape itself, not around its control points.
void measure_extent(const TopoDS_Shape& shape, SolidContent& content) {
  Bnd_Box box;
  BRepBndLib::AddOptimal(shape, box, false, false);
  if (box.IsVoid()) return;
  auto& [x0, y0, z0] = content.low;
  auto& [x1, y1, z1] = content.high;
  box.Get(x0, y0, z0, x1, y1, z1);
}

}  // namespace

Handle(TCollection_HAsciiString) occ_text(const std::string& value) {
  return new TCollection_HAsciiString(value.c_str());
}

void silence_opencascade() {
  Message::DefaultMessenger()->RemovePrinters(STANDARD_TYPE(Message_PrinterOStream));
}

int count_shapes(const TopoDS_Shape& shape, TopAbs_ShapeEnum kind) {
  int number = 0;
  for (TopExp_Explorer at(shape, kind); at.More(); at.Next()) ++number;
  return number;
}

SolidContent inspect_shape(const TopoDS_Shape& shape, std::optional<double> expected) {
  SolidContent content;
  content.solids = count_shapes(shape, TopAbs_SOLID);
  content.faces = count_shapes(shape, TopAbs_FACE);
  content.valid = BRepCheck_Analyzer(shape).IsValid();
  content.closed = shells_are_closed(shape);
  for (const double error : kIntegrationErrors) {
    content.volume = volume_of(shape, error);
    if (expected && is_same_volume(content.volume, *expected)) break;
  }
  measure_extent(shape, content);
  return content;
}

std::string bytes_of(const SolidContent& content) {
  ByteWriter bytes;
  bytes.put(content);
  return bytes.take();
}

SolidContent content_of(const std::string& bytes) { return ByteReader(bytes).get<SolidContent>(); }

RunControl solid_step(const std::string& what, const RunControl& control) {
  control.report({"", 0.0, 0.0, what});
  return {control.stop_token(), [&control, what](const Progress& progress) {
            control.report({progress.stage, progress.done, progress.total, what});
          }};
}

SolidContent write_guarded(const std::filesystem::path& path, const RunControl& control,
                           const std::function<SolidContent(const RunControl&)>& write) {
  const auto guarded = [&](const RunControl& inner) {
    return with_standard_errors([&] { return bytes_of(write(inner)); });
  };
  try {
    return content_of(
        run_in_child("writing " + path.filename().string(), ChildLimits{}, guarded, control));
  } catch (const ChildFailure& failure) {
    fail_to_write(path, std::string("OpenCASCADE ") + failure.what());
  } catch (const InputError&) {
    fail_to_write(path, "it does not read back");
  }
}

void require_read_back(const SolidContent& content, double volume,
                       const std::filesystem::path& path) {
  if (!content.is_one_solid()) fail_to_write(path, "it does not read back as one closed solid");
  require_same_volume(content, volume, path);
}

void require_same_volume(const SolidContent& content, double volume,
                         const std::filesystem::path& path) {
  if (is_same_volume(content.volume, volume)) return;
  fail_to_write(path, "it reads back with a volume of " + std::to_string(content.volume) +
                          " mm^3 instead of " + std::to_string(volume));
}

void fail_to_write(const std::filesystem::path& path, const std::string& why) {
  throw RunError(path.string() + ": cannot be written: " + why);
}

std::string last_system_error() { return errno != 0 ? system_reason(errno) : "unknown reason"; }

}  // namespace lensforge

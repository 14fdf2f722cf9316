// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/solid_reading.h"

#include <IGESControl_Controller.hxx>
#include <IGESControl_Reader.hxx>
#include <Message_ProgressIndicator.hxx>
#include <Message_ProgressScope.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <algorithm>
#include <new>
#include <stdexcept>

#include "core/compute/work_estimate.h"
#include "core/error.h"
#include "core/io/files.h"
#include "core/sandbox/child_work.h"
#include "export/solid_check.h"

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

/// What a reader of either format does. @param name  of the format.
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

}  // namespace

std::string with_standard_errors(const std::function<std::string()>& work) {
  try {
    return work();
  } catch (const Standard_OutOfMemory&) {
    throw std::bad_alloc();
  } catch (const Standard_Failure& failure) {
    throw std::runtime_error(std::string("OpenCASCADE: ") + failure.GetMessageString());
  }
}

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

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Interface_Static.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <TopoDS_Shape.hxx>
#include <filesystem>

#include "export/solid/opencascade_io.h"

namespace lensforge::testing {

/// A STEP file as other programs write them: not by export's own writer.
inline void write_foreign_step(const TopoDS_Shape& shape, const std::filesystem::path& path,
                               const char* unit) {
  silence_opencascade();
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.unit", unit);
  STEPControl_Writer writer;
  writer.Transfer(shape, STEPControl_AsIs);
  writer.Write(path.c_str());
}

}  // namespace lensforge::testing

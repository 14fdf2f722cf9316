// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <BRepBuilderAPI_Transform.hxx>
#include <Interface_Static.hxx>
#include <STEPControl_Controller.hxx>
#include <STEPControl_Writer.hxx>
#include <TopoDS_Shape.hxx>
#include <filesystem>
#include <gp_Trsf.hxx>
#include <string>

#include "core/temp_folder.h"
#include "export/solid/opencascade_io.h"

namespace lensforge::testing {

/// A STEP file as other programs write them: not by export's own writer.
inline void write_foreign_step(const TopoDS_Shape& shape, const std::filesystem::path& path) {
  silence_opencascade();
  STEPControl_Controller::Init();
  Interface_Static::SetCVal("write.step.unit", "MM");
  STEPControl_Writer writer;
  writer.Transfer(shape, STEPControl_AsIs);
  writer.Write(path.c_str());
}

/// The same in inches. The unit is written here: OpenCASCADE 7.8 writes "inch" and leaves the
/// numbers.
inline void write_foreign_step_in_inches(const TopoDS_Shape& shape,
                                         const std::filesystem::path& path) {
  gp_Trsf scaling;
  scaling.SetScaleFactor(1.0 / 25.4);
  write_foreign_step(BRepBuilderAPI_Transform(shape, scaling).Shape(), path);
  std::string text = read_bytes(path);
  const std::string millimetre = "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );";
  const std::size_t at = text.find(millimetre);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, millimetre.size(),
               "( CONVERSION_BASED_UNIT('INCH',#900001) LENGTH_UNIT() NAMED_UNIT(#900002) );\n"
               "#900001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#900003);\n"
               "#900002 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
               "#900003 = " +
                   millimetre);
  write_bytes(path, text);
}

}  // namespace lensforge::testing

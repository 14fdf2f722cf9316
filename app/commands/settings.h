// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "app/frame/command_run.h"
#include "app/frame/option_set.h"
#include "cam/coupon/coupon.h"
#include "core/optics/optical_setup.h"
#include "design/reflect.h"
#include "export/export.h"

/// Options of the short commands: coupon, export and reflect, and those that `render` has
/// everywhere.
namespace lensforge::app {

/// Options of `lensforge coupon`.
struct CouponSettings {
  std::string out;            ///< Folder of the coupon, or the fitted workshop's file.
  std::string fit;            ///< Readings to fit; empty: make a coupon.
  std::string workshop;       ///< TOML file; empty for the defaults.
  std::string workshop_text;  ///< Content of that file.
  CouponOptions coupon;
};

/// Describes every option of the command.
void describe(Description& d, CouponSettings& settings);

/// Reads the workshop. @throw InputError naming file or option, value and rule, also if an option
/// of the cut is given with --fit.
void settle(OptionSet& options, CouponSettings& settings);

/// Options of `lensforge export`.
struct ExportSettings {
  std::string source;
  std::string out;
  ExportSurface surface = ExportSurface::kDesigned;
  ExportOptions options;
};

/// Describes every option of the command.
void describe(Description& d, ExportSettings& settings);

/// @throw InputError naming an option that was given but does not apply to the format.
void require_fitting_options(const OptionSet& options, const ExportFormat& format);

/// What was written, without the file itself.
CommandResult export_report(const ExportResult& result);

/// Options of `lensforge reflect`.
struct ReflectSettings {
  std::string mesh;  ///< File to read.
  std::string out;   ///< Folder; empty with `evaluate`.
  bool evaluate = false;
  bool resume = false;
  bool step = false;  ///< Write the shape as STEP, too.
  reflect::ReflectOptions reflect;
};

/// Describes every option of the command.
void describe(Description& d, ReflectSettings& settings);

/// Describes --at of `render`, the z of another screen, mm; 0: the lens's own.
void describe_at(Description& d, double& z);

/// The setup with its screen at z = `z`: between a lens's two screens size and place of the picture
/// lie between theirs. @param height  of the surface, mean. @throw InputError naming --at if it
/// does not fit the other options or the lens.
OpticalSetup setup_at(const OptionSet& options, double z, double height, const OpticalSetup& setup);

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/export_options.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/files.h"
#include "core/io/output_guard.h"
#include "core/text/lower_case.h"

namespace lensforge {
namespace {

using Words = Row<ExportOptions>::Choices<ExportFormat>;

const Words& formats() {
  using F = ExportFormat;
  static const Words words{{"extension", F::kByExtension},
                           {"step", F::kStep},
                           {"iges", F::kIges},
                           {"stl", F::kStl},
                           {"obj", F::kObj},
                           {"ply", F::kPly},
                           {"3mf", F::k3mf},
                           {"glb", F::kGlb},
                           {"exr", F::kExr},
                           {"png", F::kPng}};
  return words;
}

/// It stands in one field of the file's header.
void require_author(const std::string& author) {
  constexpr std::size_t kMaxBytes = 200;
  if (author.size() > kMaxBytes) {
    throw InputError("--author: has " + std::to_string(author.size()) + " bytes; at most " +
                     std::to_string(kMaxBytes) + " are possible");
  }
  // OpenCASCADE writes other bytes as they are, which neither format allows.
  const auto is_printable = [](char c) { return c >= ' ' && c <= '~'; };
  if (!std::all_of(author.begin(), author.end(), is_printable)) {
    throw InputError("--author: holds a character that is not printable ASCII; write it without");
  }
}

}  // namespace

const OptionTable<ExportOptions>& export_fields() {
  using O = ExportOptions;
  using R = Row<O>;
  static const OptionTable<O> table{
      R::flag("--force", &O::force, "replace a file that lensforge did not write"),
      R::word<ExportFormat>(
          "--format", &O::format, formats(),
          "solid as step or iges; closed mesh as stl (binary), obj, ply or 3mf; clear part for "
          "scenes as glb; height map as exr (32-bit, mm) or png (16-bit grey)"),
      R::whole("--pixels", &O::pixels, Limits::between(2, kMaxImageSide),
               "longer side of a height map"),
      R::length("--tolerance", &O::tolerance, Limits::between(1e-6, 1.0),
                "step, iges: largest distance of the splines from the smooth surface"),
      R::number("--normal-tolerance", &O::normal_tolerance, Limits::between(1e-6, 0.1), "rad",
                "step, iges: largest angle to the normals of the vertex-normal model"),
      R::whole(
          "--max-points", &O::max_points, Limits::between(0, 1e7),
          "step, iges: maximum number of control points, about 72 bytes each; 0: four a vertex, "
          "575000 at most"),
      R::word<StepSchema>("--schema", &O::schema,
                          {{"ap214", StepSchema::kAp214}, {"ap242", StepSchema::kAp242}},
                          "step: application protocol"),
      R::text("--author", &O::author, "NAME", "step, iges: author in the header; printable ASCII")};
  return table;
}

std::string word_of(ExportFormat format) {
  for (const auto& [word, meaning] : formats()) {
    if (meaning == format) return word;
  }
  return {};
}

bool is_height_map(ExportFormat format) {
  return format == ExportFormat::kExr || format == ExportFormat::kPng;
}

bool is_spline_solid(ExportFormat format) {
  return format == ExportFormat::kStep || format == ExportFormat::kIges;
}

ExportFormat export_format(const ExportOptions& options, const std::filesystem::path& out) {
  if (options.format != ExportFormat::kByExtension) return options.format;
  const std::string extension = lower_case(out.extension().string());
  if (extension == ".stp") return ExportFormat::kStep;
  if (extension == ".igs") return ExportFormat::kIges;
  std::string known;
  for (const auto& [word, meaning] : formats()) {
    if (meaning == ExportFormat::kByExtension) continue;
    if (extension == "." + word) return meaning;
    known += (known.empty() ? "." : ", .") + word;
  }
  throw InputError("--out " + out.string() + ": must end in one of " + known +
                   ", or --format must say what to write");
}

void validate(const ExportOptions& options, const std::filesystem::path& out) {
  require_limits(export_fields(), options);
  require_author(options.author);
  export_format(options, out);
  if (is_folder(out)) throw InputError("--out " + out.string() + ": is a folder, not a file");
  require_replaceable("--out", out, options.force);
}

}  // namespace lensforge

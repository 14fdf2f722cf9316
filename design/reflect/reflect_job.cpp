// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_job.h"

#include "core/image/image_io.h"
#include "core/io/checkpoint_file.h"
#include "core/io/files.h"
#include "core/io/output_guard.h"
#include "core/io/pending_files.h"
#include "core/schema/json.h"
#include "core/surface/mesh_io.h"
#include "core/text/number_text.h"
#include "core/text/version.h"
#include "design/reflect/light/light_field.h"
#include "design/reflect/mesh/unit_frame.h"
#include "design/reflect/picture/reflect_report.h"
#include "design/reflect/picture/views.h"

namespace lensforge::reflect {
namespace {

namespace fs = std::filesystem;

/// A reflect.json is a few kilobytes.
constexpr std::uintmax_t kMaxJsonBytes = 1 << 20;

nlohmann::json energies_json(const Energies& energies) {
  return {{"energy_direct", energies.direct}, {"energy", energies.total}};
}

std::string convergence_text(const ReflectResult& result) {
  std::string text =
      "# " + program_mark() + "\nupdate,stage,energy,mean_displacement,max_displacement,seconds\n";
  for (const ReflectUpdate& row : result.updates) {
    text += std::to_string(row.number) + "," + row.stage;
    for (const double value : {row.energy, row.mean_displacement, row.max_displacement}) {
      text.append(",").append(number_text(value, 9));
    }
    text.append(",").append(decimal_text(row.seconds, 2)).append("\n");
  }
  return text;
}

nlohmann::json options_json(const ReflectOptions& options) {
  nlohmann::json json;
  for (const Field& field : description_of(options)) {
    json[field.name.substr(2)] = json_of(field.get());
  }
  return json;
}

}  // namespace

void require_replaceable_result(const fs::path& folder, bool force) {
  for (const char* name : reflect_file::kAll) require_replaceable("--out", folder / name, force);
}

bool holds_result(const fs::path& folder, std::uint64_t fingerprint) {
  const fs::path path = folder / reflect_file::kJson;
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return false;
  const nlohmann::json json =
      nlohmann::json::parse(read_whole_file(path, kMaxJsonBytes), nullptr, false);
  return json.is_object() && json.value("status", nlohmann::json()) == "done" &&
         json.value("fingerprint", nlohmann::json()) == fingerprint_text(fingerprint);
}

nlohmann::json result_json(const ReflectResult& result, const ReflectOptions& options) {
  nlohmann::json json = {{"format", "lensforge.reflect"},
                         {"version", 1},
                         {"program", program_mark()},
                         {"status", result.done() ? "done" : "interrupted"},
                         {"fingerprint", fingerprint_text(result.fingerprint)},
                         {"goal", options_json(options).at("goal")},
                         {"before", energies_json(result.before)},
                         {"after", result.done() ? energies_json(result.after) : nlohmann::json()},
                         {"faces", result.mesh.triangle_count()},
                         {"vertices", result.mesh.vertex_count()},
                         {"updates", result.updates.size()},
                         {"mean_displacement", result.mean_displacement},
                         {"max_displacement", result.max_displacement},
                         {"seconds", result.seconds},
                         {"warnings", result.unmet},
                         {"options", options_json(options)}};
  if (result.radar) json["radar"] = radar_json(*result.radar);
  return json;
}

std::vector<fs::path> write_result(const ReflectResult& result, const ReflectOptions& options,
                                   const fs::path& folder, const Executor& executor) {
  const UnitFrame frame(result.reference);
  const LightField field = frame.to_unit(make_light_field(options));
  const SurfaceMesh before = frame.to_unit(result.reference);
  const SurfaceMesh after = frame.to_unit(result.mesh);
  PendingFiles files(folder);
  files.add(reflect_file::kSurface, [&](const fs::path& to) { write_ply(result.mesh, to); });
  files.add(reflect_file::kPrint,
            [&](const fs::path& to) { write_stl(result.mesh, program_mark(), to); });
  files.add(reflect_file::kReference, [&](const fs::path& to) { write_ply(result.reference, to); });
  const ReflectPictures pictures{retroreflection_views({before, after}, field, executor),
                                 displacement_views({before, after}, executor)};
  files.add(reflect_file::kViews, [&](const fs::path& to) { write_image(pictures.views, to); });
  files.add(reflect_file::kDisplacement,
            [&](const fs::path& to) { write_image(pictures.displacement, to); });
  files.add(reflect_file::kReport, reflect_report(result, options, pictures));
  if (result.radar) {
    files.add(reflect_file::kRadarTable, radar_csv(*result.radar));
    files.add(reflect_file::kRadarPlot, radar_svg(*result.radar));
  }
  files.add(reflect_file::kConvergence, convergence_text(result));
  files.add(reflect_file::kJson, result_json(result, options).dump(2) + "\n");
  return files.publish();
}

}  // namespace lensforge::reflect

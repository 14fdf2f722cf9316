// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_checkpoint.h"

#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "core/io/checkpoint_file.h"
#include "core/schema/json.h"

// The numbers are the vertices and the unmet turns, as doubles.
namespace lensforge::reflect {
namespace {

using nlohmann::json;

constexpr std::string_view kMagic = "lensforge reflect checkpoint 1\n";

/// Stages of a run: rim-spoke, face, split.
constexpr int kStages = 3;

template <class Matrix>
auto entries(const Matrix& matrix) {
  using Scalar = typename Matrix::Scalar;
  return std::span<const Scalar>(matrix.data(), static_cast<std::size_t>(matrix.size()));
}

json to_json(const ReflectUpdate& row) {
  return {row.number,           row.stage,  row.energy, row.mean_displacement,
          row.max_displacement, row.seconds};
}

ReflectUpdate update_from_json(const json& j) {
  return {j.at(0), j.at(1), j.at(2), j.at(3), j.at(4), j.at(5)};
}

void require(bool holds, const JsonFields& fields, const char* name, const char* rule) {
  if (!holds) fields.refuse(name, rule);
}

ReflectCheckpoint from_header(const json& header, const JsonFields& fields) {
  ReflectCheckpoint checkpoint;
  checkpoint.fingerprint = header.at("fingerprint");
  checkpoint.stage = fields.integer("stage");
  checkpoint.first = fields.integer("first");
  checkpoint.split = header.at("split").get<std::vector<int>>();
  checkpoint.before = {fields.number("direct"), fields.number("total")};
  checkpoint.seconds = fields.number("seconds");
  for (const json& row : header.at("updates")) {
    checkpoint.updates.push_back(update_from_json(row));
  }
  require(checkpoint.stage >= 0 && checkpoint.stage < kStages, fields, "stage",
          "it must be 0 to 2");
  require(checkpoint.first >= 0 && checkpoint.first <= static_cast<int>(checkpoint.updates.size()),
          fields, "first", "it must be 0 to the number of updates");
  return checkpoint;
}

/// Takes a matrix of three rows off the front of the numbers.
Eigen::Matrix3Xd taken(std::string_view& numbers, int columns, const std::filesystem::path& path) {
  constexpr std::size_t kBytes = 3 * sizeof(double);
  if (columns < 0 || static_cast<std::size_t>(columns) > numbers.size() / kBytes) {
    refuse_checkpoint(path, "holds fewer numbers than its header says");
  }
  Eigen::Matrix3Xd matrix(3, columns);
  const std::size_t bytes = kBytes * static_cast<std::size_t>(columns);
  if (bytes > 0) std::memcpy(matrix.data(), numbers.data(), bytes);
  numbers.remove_prefix(bytes);
  if (!matrix.allFinite()) refuse_checkpoint(path, "holds a number that is not finite");
  return matrix;
}

}  // namespace

std::uint64_t reflect_fingerprint(const ReflectInput& input, const ReflectOptions& options) {
  json description = {input.fixed, input.planar, input.partner};
  append_fingerprint(description_of(options), description);
  Fnv1a hash;
  hash.add(description.dump());
  hash.add(bytes_of(entries(input.mesh.vertices)));
  hash.add(bytes_of(entries(input.mesh.triangles)));
  return hash.value();
}

void write_checkpoint(const ReflectCheckpoint& checkpoint, const std::filesystem::path& path) {
  json rows = json::array();
  for (const ReflectUpdate& row : checkpoint.updates) rows.push_back(to_json(row));
  const json header = {{"fingerprint", checkpoint.fingerprint},
                       {"stage", checkpoint.stage},
                       {"first", checkpoint.first},
                       {"split", checkpoint.split},
                       {"direct", checkpoint.before.direct},
                       {"total", checkpoint.before.total},
                       {"updates", rows},
                       {"seconds", checkpoint.seconds},
                       {"vertices", checkpoint.vertices.cols()},
                       {"faces", checkpoint.unmet.cols()}};
  std::string numbers(bytes_of(entries(checkpoint.vertices)));
  numbers += bytes_of(entries(checkpoint.unmet));
  write_checkpoint_file(path, kMagic, {header, numbers});
}

ReflectCheckpoint read_checkpoint(const std::filesystem::path& path,
                                  std::optional<std::uint64_t> fingerprint) {
  const CheckpointContent content = read_checkpoint_file(path, kMagic);
  try {
    const JsonFields fields(content.header, checkpoint_header_name(path));
    ReflectCheckpoint checkpoint = from_header(content.header, fields);
    if (fingerprint && checkpoint.fingerprint != *fingerprint) {
      refuse_checkpoint(path,
                        "is of another mesh or other options: run the command that began it, or "
                        "start anew with --force");
    }
    std::string_view numbers = content.numbers;
    checkpoint.vertices = taken(numbers, fields.integer("vertices"), path);
    checkpoint.unmet = taken(numbers, fields.integer("faces"), path);
    if (!numbers.empty()) refuse_checkpoint(path, "holds more numbers than its header says");
    return checkpoint;
  } catch (const json::exception&) {
    refuse_checkpoint(path, "has a bad header: a field is missing or of another type");
  }
}

}  // namespace lensforge::reflect

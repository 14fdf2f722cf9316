// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/schedule/checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdint>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "core/compute/scalar.h"
#include "core/error.h"
#include "core/member_count.h"
#include "core/mesh/surface_mesh.h"
#include "core/schema/description.h"
#include "core/temp_folder.h"
#include "design/setup/design_options.h"
#include "design/test_setups.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using testing::message_of;
using testing::TempFolder;

Checkpoint sample() {
  Checkpoint checkpoint;
  checkpoint.fingerprint = 0xfedcba9876543210ULL;
  checkpoint.level = 2;
  checkpoint.round = 3;
  checkpoint.value = 1e3 / 7.0;
  checkpoint.transporting = false;
  checkpoint.seconds = 0.1 + 0.2;
  checkpoint.mesh = make_grid_mesh({10.0, 8.0}, {7, 6}, 5.0);
  testing::Random random(1);
  for (double& x : checkpoint.mesh.vertices.reshaped()) x += random.magnitude(1e-17, 1.0);
  checkpoint.scales = {1e-3 * checkpoint.mesh.vertices, 1.0 / 3.0, 1e-9 / 7.0};
  for (int i = 1; i <= 3; ++i) {
    ConvergenceRow row;
    row.stage = "render";
    row.level = 1;
    row.round = 2;
    row.iteration = i;
    row.energy = {0.1 * i, 0.7, 1e-17,     1e17,       1.0 / 3.0, 0.2,
                  0.3,     0.4, 1.0 / 9.0, 1e-9 / 3.0, 1e-300};
    row.mass_error = 1.0 / 11.0;
    row.mae = 1.0 / 7.0;
    row.seconds = 0.7 * i;
    checkpoint.convergence.push_back(row);
  }
  return checkpoint;
}

std::string sample_bytes(const TempFolder& folder) {
  write_checkpoint(sample(), folder / "good");
  return testing::read_bytes(folder / "good");
}

/// Message of the error for a checkpoint of these bytes.
std::string refusal_of(const TempFolder& folder, const std::string& bytes) {
  testing::write_bytes(folder / "bad", bytes);
  return message_of<InputError>([&] { read_checkpoint(folder / "bad"); });
}

/// Replaces a text in `bytes` and corrects the check sum (FNV-1a over all but the last 8).
std::string forged(std::string bytes, const std::string& from, const std::string& to) {
  bytes.resize(bytes.size() - 8);
  bytes.replace(bytes.find(from), from.size(), to);
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  char tail[8];
  std::memcpy(tail, &hash, 8);
  return bytes.append(tail, 8);
}

TEST(Checkpoint, ComesBackToTheBit) {
  const TempFolder folder;
  const Checkpoint before = sample();
  write_checkpoint(before, folder / "checkpoint");
  const Checkpoint after = read_checkpoint(folder / "checkpoint");
  EXPECT_EQ(after.fingerprint, before.fingerprint);
  EXPECT_EQ(after.level, before.level);
  EXPECT_EQ(after.round, before.round);
  EXPECT_EQ(after.value, before.value);
  EXPECT_EQ(after.transporting, before.transporting);
  EXPECT_EQ(after.seconds, before.seconds);
  EXPECT_EQ(after.mesh.vertices, before.mesh.vertices);
  EXPECT_EQ(after.mesh.triangles, before.mesh.triangles);
  EXPECT_EQ(after.mesh.grid, before.mesh.grid);
  EXPECT_EQ(after.scales.reach, before.scales.reach);
  EXPECT_EQ(after.scales.xy, before.scales.xy);
  EXPECT_EQ(after.scales.z, before.scales.z);
  EXPECT_EQ(convergence_csv(after.convergence), convergence_csv(before.convergence));
  ASSERT_EQ(after.convergence.size(), 3U);
  EXPECT_EQ(after.convergence[2].energy.barrier, 1.0 / 3.0);
  EXPECT_EQ(after.convergence[2].energy.align, 1.0 / 9.0);
  EXPECT_EQ(after.convergence[2].energy.flux, 1e-9 / 3.0);
  EXPECT_EQ(after.convergence[2].energy.total, 1e-300);
  EXPECT_EQ(after.convergence[2].mass_error, 1.0 / 11.0);
  EXPECT_EQ(after.convergence[2].mae, 1.0 / 7.0);
}

TEST(Checkpoint, BothFacesComeBackToTheBit) {
  const TempFolder folder;
  for (const bool from_planes : {true, false}) {
    Checkpoint before = sample();
    before.from_planes = from_planes;
    before.front = Eigen::MatrixXd::Random(5, 4) / 3.0;  // One sample at each knot of 7 × 6 points.
    write_checkpoint(before, folder / "checkpoint");
    const Checkpoint after = read_checkpoint(folder / "checkpoint");
    EXPECT_EQ(after.front, before.front);
    EXPECT_EQ(after.from_planes, from_planes);
    EXPECT_EQ(after.mesh.vertices, before.mesh.vertices);
    EXPECT_EQ(after.scales.reach, before.scales.reach);
  }
  const std::string bytes = testing::read_bytes(folder / "checkpoint");
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"rows\":6", "\"rows\":5")), HasSubstr("vertices"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"from_planes\"", "\"from_plants\"")),
              HasSubstr("vertices"));
}

TEST(Checkpoint, ASharedFrontComesBackToTheBit) {
  const TempFolder folder;
  Checkpoint before = sample();
  before.shared_front = {4, 5, std::vector<float>(20)};
  for (std::size_t i = 0; i < 20; ++i) {
    before.shared_front->heights[i] = -0.3F / static_cast<float>(i + 1);
  }
  write_checkpoint(before, folder / "checkpoint");
  const Checkpoint after = read_checkpoint(folder / "checkpoint");
  EXPECT_EQ(after.shared_front, before.shared_front);
  EXPECT_EQ(after.mesh.vertices, before.mesh.vertices);
  const std::string bytes = testing::read_bytes(folder / "checkpoint");
  const std::string size = "\"shared_front\":[4,5]";
  EXPECT_THAT(refusal_of(folder, forged(bytes, size, "\"shared_front\":[4,6]")),
              HasSubstr("vertices"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, size, "\"shared_front\":[1,20]")),
              HasSubstr("a front of an impossible size"));
}

TEST(Checkpoint, AFileIsThatOfEarlierVersions) {
  const TempFolder folder;
  Checkpoint checkpoint = sample();
  checkpoint.convergence.resize(1);
  write_checkpoint(checkpoint, folder / "checkpoint");
  const std::string head =
      "lensforge checkpoint 4\n"
      R"({"columns":7,"convergence":[["render",1,2,1,0.1,0.7,1e-17,1e+17,0.3333333333333333,)"
      R"(0.2,0.3,0.4,0.1111111111111111,3.3333333333333337e-10,1e-300,0.09090909090909091,)"
      R"(0.14285714285714285,0.7]],"fingerprint":18364758544493064720,"level":2,"round":3,)"
      R"("rows":6,"scales":[0.3333333333333333,1.4285714285714285e-10],)"
      R"("seconds":0.30000000000000004,"transporting":false,"value":142.85714285714286})"
      "\n";
  const std::string bytes = testing::read_bytes(folder / "checkpoint");
  EXPECT_EQ(bytes.substr(0, head.size()), head);
  EXPECT_EQ(bytes.size(), head.size() + (2 * 3 * 7 * 6 + 1) * sizeof(double));
  EXPECT_EQ(convergence_csv(checkpoint.convergence),
            "stage,level,round,iteration,image,unlit,gradient,boundary,barrier,face,edge,laplacian,"
            "align,flux,total,mass_error,mae,seconds\n"
            "render,1,2,1,0.1,0.7,1e-17,1e+17,0.333333333,0.2,0.3,0.4,0.111111111,3.33333333e-10,"
            "1e-300,0.0909090909,0.142857143,0.7\n");
}

TEST(Checkpoint, ARowWithoutAllOfItsValuesIsRefused) {
  const TempFolder folder;
  const std::string bytes = sample_bytes(folder);
  EXPECT_THAT(refusal_of(folder, forged(bytes, ",0.7],", "],")), HasSubstr("bad header"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, ",0.7],", ",\"0.7\"],")), HasSubstr("bad header"));
}

TEST(Checkpoint, AValueThatIsNotKnownYetStaysInfinite) {
  const TempFolder folder;
  for (const bool transporting : {true, false}) {
    Checkpoint before = sample();
    before.value = kInfinity;
    before.transporting = transporting;
    write_checkpoint(before, folder / "checkpoint");
    const Checkpoint after = read_checkpoint(folder / "checkpoint");
    EXPECT_EQ(after.value, kInfinity);
    EXPECT_EQ(after.transporting, transporting);
  }
}

TEST(Checkpoint, ScalesThatAreNotKnownYetStayUnknown) {
  const TempFolder folder;
  Checkpoint before = sample();
  before.scales = {};
  write_checkpoint(before, folder / "checkpoint");
  EXPECT_FALSE(read_checkpoint(folder / "checkpoint").scales.known());
}

TEST(Checkpoint, LeavesNothingBesideIt) {
  const TempFolder folder;
  write_checkpoint(sample(), folder / "checkpoint");
  write_checkpoint(sample(), folder / "checkpoint");
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(Checkpoint, EveryTruncationIsRefused) {
  const TempFolder folder;
  const std::string bytes = sample_bytes(folder);
  for (std::size_t length = 0; length < bytes.size(); length += 1 + length / 40) {
    EXPECT_THAT(refusal_of(folder, bytes.substr(0, length)), HasSubstr("bad")) << length;
  }
  refusal_of(folder, bytes.substr(0, bytes.size() - 1));
}

TEST(Checkpoint, EveryFlippedByteIsRefused) {
  const TempFolder folder;
  const std::string bytes = sample_bytes(folder);
  for (std::size_t i = 0; i < bytes.size(); i += 7) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ 0x10);
    EXPECT_THAT(refusal_of(folder, flipped), HasSubstr("bad")) << i;
  }
}

TEST(Checkpoint, ExtraBytesAreRefused) {
  const TempFolder folder;
  refusal_of(folder, sample_bytes(folder) + "x");
}

TEST(Checkpoint, AnotherVersionIsRefused) {
  const TempFolder folder;
  const std::string other = forged(sample_bytes(folder), "checkpoint 4", "checkpoint 3");
  EXPECT_THAT(refusal_of(folder, other), HasSubstr("version"));
}

TEST(Checkpoint, AMissingFileIsRefused) {
  const TempFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { read_checkpoint(folder / "absent"); }),
              HasSubstr("absent"));
}

TEST(Checkpoint, ANamedPipeIsRefusedWithoutWaiting) {
  const TempFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THAT(message_of<InputError>([&] { read_checkpoint(folder / "pipe"); }),
              HasSubstr("only regular files are read"));
}

TEST(Checkpoint, AHeaderThatContradictsItselfIsRefused) {
  const TempFolder folder;
  const std::string bytes = sample_bytes(folder);
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"columns\":7", "\"columns\":8")),
              HasSubstr("vertices"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"columns\":7", "\"columns\":\"7\"")),
              HasSubstr("header"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"round\"", "\"rnd\"")), HasSubstr("header"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"level\":2", "\"level\":-2")),
              HasSubstr("field 'level' is -2: it must be 0 or more"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"seconds\":0", "\"seconds\":1e999")),
              HasSubstr("header"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"transporting\":false", "\"transporting\":0")),
              HasSubstr("header"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "\"value\":", "\"worth\":")), HasSubstr("header"));
  EXPECT_THAT(refusal_of(folder, forged(bytes, "{\"", "[\"")), HasSubstr("header"));
}

TEST(Checkpoint, AFolderThatDoesNotExistIsARunError) {
  const TempFolder folder;
  message_of<RunError>([&] { write_checkpoint(sample(), folder / "no" / "such" / "place"); });
}

/// Another value than the one that a field has, within its limits.
FieldValue other_value(const Field& field) {
  const FieldValue value = field.get();
  if (field.kind == FieldKind::kFlag) return !std::get<bool>(value);
  if (field.kind == FieldKind::kWord) {
    return FieldValue(field.words.front()) == value ? field.words.back() : field.words.front();
  }
  if (field.name == "--front") return "sphere:3000";
  if (field.name == "--lamp") return "sun";
  if (field.name == "--material") return "pc";
  if (field.name == "--wavelengths") return "450,650";
  if (field.kind == FieldKind::kText) return field.unit == "X,Y,Z" ? "1,2,-3" : "1,2";
  const double now = number_of(value);
  const double next = field.kind == FieldKind::kWhole ? now + 1.0 : 1.01 * now + 0.001;
  EXPECT_TRUE(field.limits.hold(next)) << field.name;
  return field.kind == FieldKind::kWhole ? FieldValue(static_cast<int>(next)) : FieldValue(next);
}

TEST(DesignFingerprint, ChangesWithEveryOption) {
  const Image picture = testing::spot_picture(12, 9);
  std::set<std::uint64_t> seen{design_fingerprint(picture, {})};
  DesignOptions changed;
  Description all = description_of(changed);
  all.add(description_of(changed.light));
  all.add(description_of(changed.weights));
  for (const Field& field : all) {
    if (field.name == "--source-picture") continue;  // The shape that it shows is stored.
    const DesignOptions before = changed;
    field.set(other_value(field));
    EXPECT_TRUE(seen.insert(design_fingerprint(picture, changed)).second) << field.name;
    changed = before;
  }
  DesignOptions options;
  options.iterations = 61;  // That no word of --quality stands for.
  EXPECT_TRUE(seen.insert(design_fingerprint(picture, options)).second);
}

TEST(DesignFingerprint, ChangesWithEveryNumberOfTheProcess) {
  const Image picture = testing::spot_picture(12, 9);
  std::set<std::uint64_t> seen{design_fingerprint(picture, {})};
  const MadeBy made[] = {{},
                         {.pitch = 0.05},
                         {.rows_along_x = false},
                         {.polish_sigma = 0.02},
                         {.rim_depth = 0.01},
                         {.rim_length = 2.0},
                         {.polish_spread = 0.1},
                         {.polish_order = 4},
                         {.polish_floor = 0.1},
                         {.roughness = 10.0},
                         {.roughness = 10.0, .correlation = 4.0}};
  EXPECT_EQ(std::size(made), testing::member_count<MadeBy>() + 1);
  for (const MadeBy& process : made) {
    DesignOptions options;
    options.made_by = process;
    EXPECT_TRUE(seen.insert(design_fingerprint(picture, options)).second);
  }
}

TEST(DesignFingerprint, EveryMemberOfTheOptionsHasARow) {
  // Weights, light and the second picture have tables of their own, the process comes from a
  // workshop, the outline may come from a file; checkpoint and resume do not change the result. The
  // light's lamp has a row.
  constexpr std::size_t kWithoutRow = 6;
  EXPECT_EQ(description_of(DesignOptions()).size() + kWithoutRow,
            testing::member_count<DesignOptions>());
  EXPECT_EQ(description_of(ObjectiveWeights()).size(), testing::member_count<ObjectiveWeights>());
}

TEST(DesignFingerprint, IsThatOfEarlierVersions) {
  DesignOptions options;
  options.model = SurfaceModel::kSmooth;  // Their default.
  EXPECT_EQ(design_fingerprint(Image(4, 3, 0.5F), options), 0xb4b596475400188aULL);
}

TEST(DesignFingerprint, ChangesWithThePicture) {
  Image picture = testing::spot_picture(12, 9);
  const std::uint64_t base = design_fingerprint(picture, {});
  picture.at(5, 5) += 1e-6F;
  EXPECT_NE(design_fingerprint(picture, {}), base);
  EXPECT_NE(design_fingerprint(Image(9, 12, 0.5F), {}), design_fingerprint(Image(12, 9, 0.5F), {}));
}

TEST(DesignFingerprint, DoesNotDependOnWhereCheckpointsGo) {
  const Image picture = testing::spot_picture(12, 9);
  DesignOptions options;
  options.checkpoint = "elsewhere";
  options.resume = true;
  EXPECT_EQ(design_fingerprint(picture, options), design_fingerprint(picture, {}));
}

}  // namespace
}  // namespace lensforge

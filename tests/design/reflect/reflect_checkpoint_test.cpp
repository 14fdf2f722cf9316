// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_checkpoint.h"

#include <gmock/gmock.h>

#include <limits>
#include <set>
#include <stop_token>
#include <string>

#include "core/error.h"
#include "core/temp_folder.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::TempFolder;
using ::testing::HasSubstr;

ReflectCheckpoint sample() {
  ReflectCheckpoint checkpoint;
  checkpoint.fingerprint = 0xfedcba9876543210ULL;
  checkpoint.stage = 2;
  checkpoint.first = 1;
  checkpoint.split = {3, 7};
  checkpoint.before = {1.0 / 3.0, 1.0 / 7.0};
  checkpoint.updates = {{1, "face", 0.1, 1e-17, 1.0 / 9.0, 0.7}, {2, "split", 0.2, 0.3, 0.4, 0.5}};
  checkpoint.seconds = 0.1 + 0.2;
  checkpoint.vertices = Eigen::Matrix3Xd::Constant(3, 5, 1.0 / 11.0);
  checkpoint.unmet = Eigen::Matrix3Xd::Constant(3, 2, -1e-300);
  return checkpoint;
}

TEST(ReflectCheckpoint, ComesBackToTheBit) {
  const TempFolder folder;
  const ReflectCheckpoint before = sample();
  write_checkpoint(before, folder / "checkpoint");
  const ReflectCheckpoint after = read_checkpoint(folder / "checkpoint", before.fingerprint);
  EXPECT_EQ(after.stage, before.stage);
  EXPECT_EQ(after.first, before.first);
  EXPECT_EQ(after.split, before.split);
  EXPECT_EQ(after.before.direct, before.before.direct);
  EXPECT_EQ(after.before.total, before.before.total);
  EXPECT_EQ(after.seconds, before.seconds);
  EXPECT_EQ(after.vertices, before.vertices);
  EXPECT_EQ(after.unmet, before.unmet);
  ASSERT_EQ(after.updates.size(), 2U);
  EXPECT_EQ(after.updates[0].stage, "face");
  EXPECT_EQ(after.updates[0].mean_displacement, 1e-17);
  EXPECT_EQ(after.updates[1].seconds, 0.5);
}

TEST(ReflectCheckpoint, OneOfAnotherRunOrWithOtherNumbersIsRefused) {
  const TempFolder folder;
  const auto refusal = [&](const ReflectCheckpoint& checkpoint, std::uint64_t fingerprint) {
    write_checkpoint(checkpoint, folder / "bad");
    return message_of<InputError>([&] { read_checkpoint(folder / "bad", fingerprint); });
  };
  EXPECT_THAT(refusal(sample(), 1), HasSubstr("other options"));
  ReflectCheckpoint late = sample();
  late.first = 3;
  EXPECT_THAT(refusal(late, late.fingerprint), HasSubstr("field 'first' is 3"));
  ReflectCheckpoint far = sample();
  far.stage = 3;
  EXPECT_THAT(refusal(far, far.fingerprint), HasSubstr("field 'stage' is 3"));
  ReflectCheckpoint lost = sample();
  lost.vertices(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(lost, lost.fingerprint), HasSubstr("not finite"));
}

TEST(ReflectCheckpoint, FingerprintChangesWithMeshAndOptions) {
  const ReflectOptions usual;
  const ReflectInput input = prepared_input(shapes::icosphere(1), "mesh", usual);
  std::set<std::uint64_t> seen{reflect_fingerprint(input, usual)};
  ReflectOptions options;
  for (const Field& row : description_of(options)) {
    const FieldValue now = row.get();
    if (row.kind == FieldKind::kFlag) row.set(!std::get<bool>(now));
    if (row.kind == FieldKind::kText) row.set("x");
    if (row.kind == FieldKind::kWord) row.set(row.words.back());
    if (row.kind == FieldKind::kWhole) row.set(std::get<int>(now) + 1);
    if (row.kind == FieldKind::kNumber) row.set(std::get<double>(now) + 1.0);
    const bool is_new = seen.insert(reflect_fingerprint(input, options)).second;
    EXPECT_EQ(is_new, row.left_out.empty()) << row.name;
    row.set(now);
  }
  ReflectInput fixed = input;
  fixed.fixed.assign(static_cast<std::size_t>(input.mesh.vertex_count()), 1);
  EXPECT_TRUE(seen.insert(reflect_fingerprint(fixed, usual)).second);
  ReflectInput moved = input;
  moved.mesh.vertices(0, 0) += 1e-9;
  EXPECT_TRUE(seen.insert(reflect_fingerprint(moved, usual)).second);
}

/// Stopped after every update and resumed until it is done.
ReflectResult in_pieces(const ReflectInput& input, ReflectOptions options) {
  options.resume = false;
  for (;;) {
    std::stop_source stop;
    const RunControl control(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
    ReflectResult result = reflect_shape(input, options, Executor::serial(), control);
    if (result.done()) return result;
    options.resume = true;
  }
}

TEST(ReflectCheckpoint, AVertexOutOfAllBoundsIsRefused) {
  const TempFolder folder;
  ReflectOptions options;
  options.rim_updates = 2;
  options.direction_rows = 2;
  options.checkpoint = folder / "checkpoint";
  const ReflectInput input = prepared_input(shapes::icosphere(1), "mesh", options);
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress&) { stop.request_stop(); });
  ASSERT_FALSE(reflect_shape(input, options, Executor::serial(), control).done());
  ReflectCheckpoint checkpoint = read_checkpoint(options.checkpoint);
  checkpoint.vertices(1, 2) = 1e30;
  write_checkpoint(checkpoint, options.checkpoint);
  options.resume = true;
  const auto resume = [&] { reflect_shape(input, options, Executor::serial(), RunControl()); };
  EXPECT_THAT(message_of<InputError>(resume), HasSubstr("has a vertex out of all bounds"));
}

TEST(ReflectCheckpoint, ARunInPiecesEndsWithTheSameBits) {
  const TempFolder folder;
  ReflectOptions options;
  options.rim_updates = 2;
  options.face_updates = 2;
  options.direction_rows = 3;
  options.symmetry = Symmetry::kX;
  options.fix_plane = "0,0,1,-0.9";
  for (const Method method : {Method::kExact, Method::kPaper}) {
    options.method = method;
    options.denoise = method == Method::kPaper ? 250.0 : 0.0;
    const ReflectInput input = prepared_input(shapes::icosphere(2), "mesh", options);
    options.checkpoint.clear();
    const ReflectResult whole = reflect_shape(input, options, Executor::cpu(2), RunControl());
    options.checkpoint = folder / "checkpoint";
    const ReflectResult pieces = in_pieces(input, options);
    EXPECT_EQ(whole.mesh.vertices, pieces.mesh.vertices);
    EXPECT_EQ(whole.mesh.triangles, pieces.mesh.triangles);
    EXPECT_EQ(whole.reference.vertices, pieces.reference.vertices);
    EXPECT_EQ(whole.before.total, pieces.before.total);
    EXPECT_EQ(whole.after.total, pieces.after.total);
    ASSERT_EQ(whole.updates.size(), pieces.updates.size());
    EXPECT_EQ(whole.updates.back().energy, pieces.updates.back().energy);
    EXPECT_EQ(whole.updates.back().stage, "split");
  }
}

}  // namespace
}  // namespace lensforge::reflect

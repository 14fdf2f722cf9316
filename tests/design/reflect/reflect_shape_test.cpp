// SPDX-License-Identifier: GPL-3.0-or-later
#include "design/reflect/reflect_shape.h"

#include <gmock/gmock.h>

#include <limits>
#include <set>
#include <stop_token>
#include <string>

#include "core/error.h"
#include "core/schema/description.h"
#include "core/temp_folder.h"
#include "fixtures/shapes/shapes.h"

namespace lensforge::reflect {
namespace {

ReflectOptions quick() {
  ReflectOptions options;
  options.rim_updates = 2;
  options.face_updates = 3;
  options.split = false;
  return options;
}

ReflectResult shaped(const SurfaceMesh& mesh, const ReflectOptions& options,
                     const Executor& executor = Executor::cpu(2),
                     const RunControl& control = RunControl()) {
  return reflect_shape(prepared_input(mesh, "mesh", options), options, executor, control);
}

TEST(ReflectShape, StealthLowersTheEnergyAndKeepsTheShape) {
  const SurfaceMesh mesh = shapes::ellipsoid({1.3, 0.8, 0.5}, 3);
  const ReflectResult result = shaped(mesh, quick());
  EXPECT_TRUE(result.done());
  EXPECT_LT(result.after.total, 0.5 * result.before.total);
  EXPECT_LT(result.mean_displacement, 0.02);
  EXPECT_EQ(result.updates.size(), 5U);
}

TEST(ReflectShape, SameBitsForAnyNumberOfThreads) {
  const SurfaceMesh mesh = shapes::torus(24, 14);
  const ReflectResult one = shaped(mesh, quick(), Executor::serial());
  const ReflectResult two = shaped(mesh, quick());
  EXPECT_EQ(one.mesh.vertices, two.mesh.vertices);
}

TEST(ReflectShape, UnitsOfTheMeshDoNotMatter) {
  const SurfaceMesh mesh = shapes::icosphere(2);
  SurfaceMesh large = mesh;
  large.vertices = 1024.0 * mesh.vertices;
  const ReflectResult a = shaped(mesh, quick());
  const ReflectResult b = shaped(large, quick());
  EXPECT_LT((1024.0 * a.mesh.vertices - b.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(ReflectShape, StopsWhenAsked) {
  std::stop_source stop;
  const RunControl control(stop.get_token(), [&](const Progress& progress) {
    if (progress.done >= 2.0) stop.request_stop();
  });
  const ReflectResult result = shaped(shapes::icosphere(2), quick(), Executor::cpu(2), control);
  EXPECT_FALSE(result.done());
  EXPECT_EQ(result.updates.size(), 2U);
  EXPECT_NE(result.mesh.vertices, result.reference.vertices);
}

TEST(ReflectShape, ThePapersMethodFollowsItsSeedAlone) {
  ReflectOptions options = quick();
  options.method = Method::kPaper;
  options.denoise = 250.0;
  const SurfaceMesh mesh = shapes::icosphere(3);
  const ReflectResult one = shaped(mesh, options, Executor::serial());
  EXPECT_EQ(one.mesh.vertices, shaped(mesh, options).mesh.vertices);
  EXPECT_LT(one.after.total, one.before.total);
  options.seed = 2;
  EXPECT_NE(one.mesh.vertices, shaped(mesh, options).mesh.vertices);
}

TEST(ReflectShape, FixedPartsAndConstraintsHoldToTheEnd) {
  const SurfaceMesh mesh = shapes::ellipsoid({1.0, 0.8, 0.7}, 3);
  ReflectOptions options = quick();
  options.split = true;
  options.fix_plane = "0,0,1,-0.6";
  options.keep_volume = true;
  options.keep_box = true;
  options.max_displacement = 0.1;
  const ReflectResult result = shaped(mesh, options);
  EXPECT_THAT(result.unmet, ::testing::IsEmpty());
  EXPECT_GT(result.mesh.triangle_count(), mesh.triangle_count());
  const Eigen::Matrix3Xd moved = result.mesh.vertices - result.reference.vertices;
  EXPECT_LE(moved.colwise().norm().maxCoeff(), 0.1 + 1e-9);
  for (Eigen::Index v = 0; v < mesh.vertex_count(); ++v) {
    if (mesh.vertices(2, v) <= -0.6) {
      EXPECT_LT(moved.col(v).norm(), 1e-12);
    }
  }
  EXPECT_LT(result.after.total, result.before.total);
}

TEST(ReflectShape, FacadesSendSunlightToPlacesAsThePaperDoes) {
  ReflectOptions options;
  options.split = false;
  options.place = "0,-3,0";
  for (const SurfaceMesh& wall :
       {shapes::concave_facade(0.3, 20), shapes::sine_facade(0.1, 2, 20)}) {
    options.goal = GoalKind::kPoint;
    options.place = "0,-3,0";
    const ReflectResult point = shaped(wall, options);
    EXPECT_GT(point.after.total, 3.5 * point.before.total);
    options.goal = GoalKind::kDeflect;
    const ReflectResult deflect = shaped(wall, options);
    EXPECT_LT(deflect.after.total, 0.09 * deflect.before.total);
    options.goal = GoalKind::kLine;
    options.place = "-2,-3,0,2,-3,0";
    const ReflectResult line = shaped(wall, options);
    EXPECT_GT(line.after.total, 2.8 * line.before.total);
  }
}

/// Remeshed to so many faces the fish has one of 1e-16 of the others' area.
TEST(ReflectShape, AFaceWithoutAreaDoesNotHoldTheOthers) {
  ReflectOptions options = quick();
  options.faces = 2000;
  const ReflectResult result = shaped(shapes::fish(), options);
  EXPECT_LT(result.after.total, 0.5 * result.before.total);
}

TEST(ReflectShape, ATenthOfTheEnergyHasToBeGained) {
  EXPECT_TRUE(gained_enough(GoalKind::kStealth, 0.1, 0.05));
  EXPECT_FALSE(gained_enough(GoalKind::kDeflect, 0.1, 0.095));
  EXPECT_FALSE(gained_enough(GoalKind::kStealth, 0.1, 0.2));
  EXPECT_TRUE(gained_enough(GoalKind::kPoint, 0.2, 0.3));
  EXPECT_FALSE(gained_enough(GoalKind::kLine, 0.2, 0.21));
  EXPECT_FALSE(gained_enough(GoalKind::kPoint, 0.0, 0.0));
  // There is nothing to gain.
  EXPECT_TRUE(gained_enough(GoalKind::kStealth, 8e-5, 8e-5));
  EXPECT_FALSE(gained_enough(GoalKind::kStealth, 8e-5, 0.02));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const GoalKind goal : {GoalKind::kStealth, GoalKind::kPoint}) {
    EXPECT_FALSE(gained_enough(goal, 0.1, nan));
  }
}

TEST(ReflectShape, ARunThatGainedTooLittleSaysSo) {
  ReflectOptions options = quick();
  options.max_displacement = 1e-6;
  const ReflectResult result = shaped(shapes::icosphere(2), options);
  ASSERT_EQ(result.unmet.size(), 1U);
  EXPECT_THAT(result.unmet.front(), ::testing::HasSubstr("less than a tenth of it was gained"));
}

TEST(ReflectShape, ContradictingPlacesAreRefused) {
  ReflectOptions options;
  options.place = "0,0,0";
  EXPECT_THROW(validate(options), InputError);
  options.goal = GoalKind::kLine;
  EXPECT_THROW(validate(options), InputError);
  options.place = "0,0,0,0,0,0";
  EXPECT_THROW(validate(options), InputError);
  options.place = "0,0,0,nan,0,0";
  EXPECT_THROW(validate(options), InputError);
  options.place = "0,0,0,1,0,0";
  EXPECT_NO_THROW(validate(options));
  options.light = "0,0,1;0,0,0";
  EXPECT_THROW(validate(options), InputError);
}

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

TEST(ReflectCheckpoint, AFileIsThatOfEarlierVersions) {
  const TempFolder folder;
  write_checkpoint(sample(), folder / "checkpoint");
  const std::string head =
      "lensforge reflect checkpoint 1\n"
      R"({"direct":0.3333333333333333,"faces":2,"fingerprint":18364758544493064720,"first":1,)"
      R"("seconds":0.30000000000000004,"split":[3,7],"stage":2,"total":0.14285714285714285,)"
      R"("updates":[[1,"face",0.1,1e-17,0.1111111111111111,0.7],[2,"split",0.2,0.3,0.4,0.5]],)"
      R"("vertices":5})"
      "\n";
  const std::string bytes = testing::read_bytes(folder / "checkpoint");
  EXPECT_EQ(bytes.substr(0, head.size()), head);
  EXPECT_EQ(bytes.size(), head.size() + (3 * 5 + 3 * 2 + 1) * sizeof(double));
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
  for (const Field& field : description_of(options)) {
    const FieldValue now = field.get();
    if (field.kind == FieldKind::kFlag) field.set(!std::get<bool>(now));
    if (field.kind == FieldKind::kText) field.set("x");
    if (field.kind == FieldKind::kWord) field.set(field.words.back());
    if (field.kind == FieldKind::kWhole) field.set(std::get<int>(now) + 1);
    if (field.kind == FieldKind::kNumber) field.set(std::get<double>(now) + 1.0);
    const bool is_new = seen.insert(reflect_fingerprint(input, options)).second;
    EXPECT_EQ(is_new, field.left_out.empty()) << field.name;
    field.set(now);
  }
  ReflectInput fixed = input;
  fixed.fixed.assign(static_cast<std::size_t>(input.mesh.vertex_count()), 1);
  EXPECT_TRUE(seen.insert(reflect_fingerprint(fixed, usual)).second);
  ReflectInput moved = input;
  moved.mesh.vertices(0, 0) += 1e-9;
  EXPECT_TRUE(seen.insert(reflect_fingerprint(moved, usual)).second);
}

/// Runs a shape that is stopped after every update and resumed until it is done.
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

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/error.h"
#include "core/io/lens_folder.h"
#include "core/temp_folder.h"
#include "core/text/version.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::message_of;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::HasSubstr;

std::string refusal(const fs::path& path, bool force = false) {
  return message_of<InputError>([&] { require_replaceable("--out", path, force); });
}

TEST(OutputGuard, AMarkIsFoundAtTheHeadOrTheTail) {
  const TempFolder folder;
  const std::string filler(100'000, 'x');
  write_bytes(folder / "head", "ply\ncomment " + program_mark() + "\n" + filler);
  write_bytes(folder / "tail", filler + program_mark());
  write_bytes(folder / "middle", filler + program_mark() + filler);
  write_bytes(folder / "word", "made for lensforge by hand");
  EXPECT_TRUE(written_by_lensforge(folder / "head"));
  EXPECT_TRUE(written_by_lensforge(folder / "tail"));
  EXPECT_FALSE(written_by_lensforge(folder / "middle"));
  EXPECT_FALSE(written_by_lensforge(folder / "word"));
  EXPECT_FALSE(written_by_lensforge(folder / "missing"));
  EXPECT_FALSE(written_by_lensforge(folder.path()));
}

TEST(OutputGuard, ANewNameAndAnOwnFileAreFreeToWrite) {
  const TempFolder folder;
  require_replaceable("--out", folder / "new.stl", false);
  write_bytes(folder / "old.stl", program_mark() + " lens");
  require_replaceable("--out", folder / "old.stl", false);
}

TEST(OutputGuard, AForeignFileNeedsForce) {
  const TempFolder folder;
  write_bytes(folder / "notes.stl", "solid mine");
  EXPECT_THAT(refusal(folder / "notes.stl"), HasSubstr("--force"));
  require_replaceable("--out", folder / "notes.stl", true);
  fs::create_symlink(folder / "notes.stl", folder / "link.stl");
  EXPECT_THAT(refusal(folder / "link.stl"), HasSubstr("--force"));
}

TEST(OutputGuard, AFileOfALensFolderIsNeverReplaced) {
  const TempFolder folder;
  fs::create_directory(folder / "cam");
  write_bytes(folder / "lens.json", "{}");
  for (const char* name : {"surface.ply", "target.exr", "lens.json", "checkpoint.bin",
                           "cam/milled.ply", "cam/../surface.ply"}) {
    EXPECT_THAT(refusal(folder / name, true), HasSubstr("lens folder")) << name;
  }
  require_replaceable("--out", folder / "lens.stl", false);
  require_replaceable("--out", folder / "cam/other.ply", false);
}

TEST(OutputGuard, TheSameNamesElsewhereAreFree) {
  const TempFolder folder;
  require_replaceable("--out", folder / "surface.ply", false);
}

TEST(OutputGuard, NamesThatNoFileCanHaveAreBadInput) {
  const TempFolder folder;
  EXPECT_THAT(refusal(folder / (std::string(300, 'n') + ".stl")), HasSubstr("name too long"));
  fs::create_symlink(folder / "loop.stl", folder / "loop.stl");
  EXPECT_THAT(refusal(folder / "loop.stl"), HasSubstr("symbolic links"));
}

TEST(OutputGuard, DevicesAndFoldersAreNeverReplaced) {
  const TempFolder folder;
  EXPECT_THAT(refusal("/dev/null", true), HasSubstr("no regular file"));
  EXPECT_THAT(refusal(folder.path(), true), HasSubstr("no regular file"));
  EXPECT_THAT(refusal(folder.path().string() + "/", true), HasSubstr("names no file"));
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/lens_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "core/error.h"
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

using Kind = FolderLock::Kind;

TEST(FolderLock, OnlyOneWriterIsLetIn) {
  const TempFolder folder;
  std::optional<FolderLock> first(std::in_place, folder.path(), Kind::kExclusive);
  EXPECT_THAT(message_of<InputError>([&] { FolderLock(folder.path(), Kind::kExclusive); }),
              HasSubstr("another lensforge command"));
  EXPECT_THROW(FolderLock(folder.path(), Kind::kShared), InputError);
  first.reset();
  const FolderLock second(folder.path(), Kind::kExclusive);
}

TEST(FolderLock, ReadersShareAndKeepWritersOut) {
  const TempFolder folder;
  const FolderLock first(folder.path(), Kind::kShared);
  const FolderLock second(folder.path(), Kind::kShared);
  EXPECT_THROW(FolderLock(folder.path(), Kind::kExclusive), InputError);
}

TEST(FolderLock, LeavesNothingBehind) {
  const TempFolder folder;
  { const FolderLock lock(folder.path(), Kind::kExclusive); }
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(FolderLock, AMissingFolderIsNamed) {
  const TempFolder folder;
  EXPECT_THAT(message_of<InputError>([&] { FolderLock(folder / "missing", Kind::kShared); }),
              HasSubstr("missing"));
}

TEST(FolderLock, MakesTheFolderOnce) {
  const TempFolder parent;
  const MadeFolder first = FolderLock::make(parent / "new", Kind::kShared);
  EXPECT_TRUE(first.made);
  const MadeFolder second = FolderLock::make(parent / "new", Kind::kShared);
  EXPECT_FALSE(second.made);
  EXPECT_TRUE(first.lock && second.lock);
  EXPECT_THAT(message_of<InputError>([&] { FolderLock::make(parent / "new", Kind::kExclusive); }),
              HasSubstr("another lensforge command"));
}

TEST(FolderLock, WhereAWriterStaysASharedLockIsNotHad) {
  const TempFolder folder;
  const FolderLock writer(folder.path(), Kind::kExclusive);
  EXPECT_FALSE(FolderLock::make(folder.path(), Kind::kShared).lock);
}

/// Commands that come and go, each of which takes the folder away if it may.
TEST(FolderLock, NobodyTakesTheFolderFromAnother) {
  const TempFolder parent;
  const std::filesystem::path folder = parent / "shared";
  std::atomic<int> lost = 0;
  const auto come_and_go = [&](int id) {
    for (int i = 0; i < 300; ++i) {
      MadeFolder shared = FolderLock::make(folder, Kind::kShared);
      if (!shared.lock) continue;  // On a busy machine the wait for the other may run out.
      const std::filesystem::path file = folder / std::to_string(id);
      if (!std::ofstream(file).put('x')) ++lost;
      std::filesystem::remove(file);
      std::error_code ignored;
      if (shared.made && shared.lock->become_exclusive()) std::filesystem::remove(folder, ignored);
    }
  };
  {
    const std::jthread other(come_and_go, 1);
    come_and_go(2);
  }
  EXPECT_EQ(lost, 0);
}

}  // namespace

}  // namespace lensforge

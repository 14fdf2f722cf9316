// SPDX-License-Identifier: GPL-3.0-or-later
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
#include "core/io/lens_folder.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::message_of;
using lensforge::testing::TempFolder;
using ::testing::HasSubstr;
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

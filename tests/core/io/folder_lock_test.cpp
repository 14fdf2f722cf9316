// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/folder_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "core/error.h"
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

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/files.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

using lensforge::testing::TempFolder;
using ::testing::ElementsAre;

TEST(PendingFiles, AppearTogetherInTheirOrder) {
  const TempFolder folder;
  PendingFiles files(folder.path());
  files.add("b.txt", "first");
  files.add("a.txt", [](const std::filesystem::path& beside) {
    EXPECT_EQ(beside.extension(), ".txt");
    write_whole_file(beside, "second");
  });
  EXPECT_TRUE(files.has("a.txt"));
  EXPECT_FALSE(files.has("c.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder / "b.txt"));
  EXPECT_THAT(files.publish(), ElementsAre(folder / "b.txt", folder / "a.txt"));
  EXPECT_EQ(read_whole_file(folder / "b.txt", 10), "first");
  EXPECT_EQ(read_whole_file(folder / "a.txt", 10), "second");
  EXPECT_EQ(folder.file_count(), 2U);
}

TEST(PendingFiles, NoneAppearsWhereOneCannotBeWritten) {
  const TempFolder folder;
  {
    PendingFiles files(folder.path());
    files.add("a.txt", "first");
    EXPECT_THROW(files.add("b.txt", [](const auto&) { throw RunError("full"); }), RunError);
  }
  EXPECT_EQ(folder.file_count(), 0U);
}

}  // namespace
}  // namespace lensforge

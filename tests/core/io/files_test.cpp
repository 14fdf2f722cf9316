// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/files.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/full_disk.h"
#include "core/temp_folder.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using lensforge::testing::FullDisk;
using lensforge::testing::message_of;
using lensforge::testing::read_bytes;
using lensforge::testing::TempFolder;
using lensforge::testing::write_bytes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Files, WritesTheContentUnderTheNameAndNothingElse) {
  const TempFolder folder;
  const std::string content("a\0b\n", 4);
  write_whole_file(folder / "data.bin", content);
  EXPECT_EQ(read_bytes(folder / "data.bin"), content);
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(Files, ReplacesAnOlderFile) {
  const TempFolder folder;
  write_whole_file(folder / "data.txt", "a longer first content");
  write_whole_file(folder / "data.txt", "second");
  EXPECT_EQ(read_bytes(folder / "data.txt"), "second");
}

TEST(Files, AnEmptyFileIsWritten) {
  const TempFolder folder;
  write_whole_file(folder / "empty", "");
  EXPECT_TRUE(fs::is_regular_file(folder / "empty"));
}

TEST(Files, ANewFileHasTheRightsOfAnyOther) {
  const TempFolder folder;
  write_whole_file(folder / "ours", "x");
  write_bytes(folder / "theirs", "x");
  EXPECT_EQ(fs::status(folder / "ours").permissions(), fs::status(folder / "theirs").permissions());
}

TEST(Files, APendingFileAppearsWhenItIsPublishedOnly) {
  const TempFolder folder;
  {
    PendingFile dropped(folder / "a.txt");
    write_bytes(dropped.beside(), "a");
    PendingFile moved(std::move(dropped));
    EXPECT_EQ(folder.file_count(), 1U);
    EXPECT_FALSE(fs::exists(folder / "a.txt"));
  }
  EXPECT_EQ(folder.file_count(), 0U);
  PendingFile kept(folder / "b.txt");
  write_bytes(kept.beside(), "b");
  kept.publish();
  EXPECT_EQ(read_bytes(folder / "b.txt"), "b");
  PendingFile renamed(folder / "b.txt");
  write_bytes(renamed.beside(), "c");
  renamed.publish_as(folder / "c.txt");
  EXPECT_EQ(read_bytes(folder / "b.txt"), "b");
  EXPECT_EQ(read_bytes(folder / "c.txt"), "c");
  EXPECT_EQ(folder.file_count(), 2U);
}

TEST(Files, TheFileBesideHasTheSameFolderAndExtension) {
  const TempFolder folder;
  write_whole_file(folder / "picture.exr", [&](const fs::path& beside) {
    EXPECT_EQ(beside.extension(), ".exr");
    EXPECT_EQ(beside.parent_path(), folder.path());
    EXPECT_NE(beside.filename(), "picture.exr");
    EXPECT_FALSE(fs::exists(folder / "picture.exr"));
  });
  EXPECT_TRUE(fs::exists(folder / "picture.exr"));
}

TEST(Files, AThrowingWriterLeavesTheOlderFileAndNothingBeside) {
  const TempFolder folder;
  write_whole_file(folder / "data.txt", "old");
  EXPECT_THROW(write_whole_file(folder / "data.txt",
                                [](const fs::path& beside) {
                                  write_bytes(beside, "half");
                                  throw InputError("stop");
                                }),
               InputError);
  EXPECT_EQ(read_bytes(folder / "data.txt"), "old");
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(Files, AWriterThatRemovesItsFileIsAnErrorNamingTheFile) {
  const TempFolder folder;
  const auto write = [&] {
    write_whole_file(folder / "gone.txt", [](const fs::path& beside) { fs::remove(beside); });
  };
  EXPECT_THAT(message_of<RunError>(write), StartsWith((folder / "gone.txt").string() + ": "));
}

TEST(Files, AFullDiskIsAnErrorWithFileAndReasonAndLeavesNothing) {
  const TempFolder folder;
  const FullDisk full(1000);
  const std::string message = message_of<RunError>(
      [&] { write_whole_file(folder / "big.bin", std::string(100'000, 'x')); });
  EXPECT_THAT(message, StartsWith((folder / "big.bin").string() + ": "));
  EXPECT_THAT(message, HasSubstr("File too large"));
  EXPECT_EQ(folder.file_count(), 0U);
}

TEST(Files, AMissingFolderIsAnErrorWithFileAndReason) {
  const TempFolder folder;
  const fs::path path = folder / "missing/data.txt";
  EXPECT_THAT(message_of<RunError>([&] { write_whole_file(path, "x"); }),
              AllOf(StartsWith(path.string() + ": "), HasSubstr("No such file or directory")));
}

TEST(Files, AFolderIsNotReplacedByAFile) {
  const TempFolder folder;
  fs::create_directory(folder / "taken");
  EXPECT_THAT(message_of<RunError>([&] { write_whole_file(folder / "taken", "x"); }),
              HasSubstr("Is a directory"));
  EXPECT_EQ(folder.file_count(), 1U);
}

TEST(Files, ABareNameIsWrittenIntoTheCurrentFolder) {
  const TempFolder folder;
  const fs::path old = fs::current_path();
  fs::current_path(folder.path());
  write_whole_file("bare.txt", "here");
  fs::current_path(old);
  EXPECT_EQ(read_bytes(folder / "bare.txt"), "here");
}

TEST(Files, RequireWritableFolderMakesItWithParentsAndLeavesItEmpty) {
  const TempFolder folder;
  require_writable_folder(folder / "a" / "b");
  EXPECT_TRUE(fs::is_empty(folder / "a" / "b"));
  require_writable_folder(folder / "a" / "b");
}

TEST(Files, RequireWritableFolderRefusesAFileInTheWay) {
  const TempFolder folder;
  write_bytes(folder / "file", "x");
  EXPECT_THAT(message_of<InputError>([&] { require_writable_folder(folder / "file"); }),
              AllOf(StartsWith((folder / "file").string() + ": "), HasSubstr("Not a directory")));
  EXPECT_THAT(message_of<InputError>([&] { require_writable_folder(folder / "file" / "below"); }),
              HasSubstr("Not a directory"));
}

TEST(Files, RequireWritableFolderRefusesWhereNoFileCanBeMade) {
  // Not even the administrator can make files in /proc.
  EXPECT_THAT(message_of<InputError>([] { require_writable_folder("/proc"); }),
              StartsWith("/proc: files cannot be made in this folder: "));
}

TEST(Files, OnlyRegularFilesAreRead) {
  const TempFolder folder;
  const fs::path pipe = folder / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto refusal = [](const fs::path& path) {
    return message_of<InputError>([&] { open_input(path); });
  };
  EXPECT_THAT(refusal(pipe), AllOf(HasSubstr("pipe: is a named pipe"), HasSubstr("regular")));
  EXPECT_THAT(refusal(folder.path()), HasSubstr("is a folder"));
  EXPECT_THAT(refusal("/dev/zero"), HasSubstr("is a device"));
  EXPECT_THAT(refusal(folder / "missing"), HasSubstr("missing: cannot be read: No such file"));
  write_bytes(folder / "file", "abc");
  EXPECT_EQ(open_input(folder / "file").get(), 'a');
}

TEST(Files, AWholeFileIsReadUpToALimit) {
  const TempFolder folder;
  const std::string content("a\0b", 3);
  write_bytes(folder / "file", content);
  EXPECT_EQ(read_whole_file(folder / "file", 3), content);
  EXPECT_THAT(message_of<InputError>([&] { read_whole_file(folder / "file", 2); }),
              HasSubstr("has 3 bytes; at most 2 are read"));
}

TEST(Files, NamesOfFilesInTheMakingAreKnown) {
  const TempFolder folder;
  const PendingFile pending(folder / "picture.exr");
  EXPECT_EQ(name_of_partial(pending.beside().filename().string()), "picture.exr");
  EXPECT_EQ(name_of_partial(".lens.partial-123"), "lens");
  const PendingFile inner(pending.beside());
  EXPECT_EQ(name_of_partial(inner.beside().filename().string()), "picture.exr");
  for (const char* name : {"picture.exr", "a.partial-12.exr", ".a.partial-.exr", ".partial-1.exr",
                           ".a.partial-12x.exr", ".my.partial-notes.txt"}) {
    EXPECT_EQ(name_of_partial(name), "") << name;
  }
}

TEST(Files, ANameThatJustFitsItsFolderIsWritten) {
  const TempFolder folder;
  for (const std::string& name : {std::string(251, 'n') + ".stl", std::string(255, 'n')}) {
    write_whole_file(folder / name, "x");
    EXPECT_EQ(read_bytes(folder / name), "x");
  }
}

TEST(Files, ALoopOfLinksIsNoFolder) {
  const TempFolder folder;
  std::filesystem::create_symlink("loop", folder / "loop");
  EXPECT_FALSE(is_folder(folder / "loop"));
  EXPECT_FALSE(is_folder(folder / "none"));
  EXPECT_TRUE(is_folder(folder.path()));
}

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

int open_nothing() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }
bool is_open(int number) { return ::fcntl(number, F_GETFD) >= 0; }

TEST(Descriptor, IsNeverAStandardOne) {
  const int kept = ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 10);
  ::close(STDIN_FILENO);
  {
    const Descriptor file(open_nothing());
    EXPECT_GT(file.number(), STDERR_FILENO);
    EXPECT_TRUE(is_open(file.number()));
    EXPECT_FALSE(is_open(STDIN_FILENO)) << "the number itself is given back";
  }
  ::dup2(kept, STDIN_FILENO);
  ::close(kept);
}

TEST(Descriptor, ClosesItselfOnceWhereverItWent) {
  int number = -1;
  {
    Descriptor first(open_nothing());
    number = first.number();
    Descriptor second;
    EXPECT_FALSE(second.open());
    second = std::move(first);
    const Descriptor third(std::move(second));
    EXPECT_EQ(third.number(), number);
    EXPECT_TRUE(is_open(number));
  }
  EXPECT_FALSE(is_open(number));
}

TEST(Descriptor, CloseTellsTheSystemsError) {
  Descriptor file(open_nothing());
  EXPECT_EQ(file.close(), 0);
  EXPECT_EQ(file.close(), 0) << "closed already";
  Descriptor gone(open_nothing());
  ::close(gone.number());
  EXPECT_EQ(gone.close(), EBADF);
}

std::string hash_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.finish();
}

TEST(Sha256, EqualsThePublishedExamples) {
  EXPECT_EQ(hash_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_of(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PiecesCountAsTheWhole) {
  Sha256 hash;
  for (const char c : std::string("abc")) hash.update({&c, 1});
  Sha256 moved = std::move(hash);
  EXPECT_EQ(moved.finish(), hash_of("abc"));
}

}  // namespace

}  // namespace lensforge

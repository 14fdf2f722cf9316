// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <stop_token>
#include <string>

#include "core/error.h"
#include "core/io/files.h"
#include "core/temp_folder.h"
#include "machine/stream/program_facts.h"
#include "machine/stream/program_feed.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::message_of;
using testing::TempFolder;
using testing::write_bytes;

std::string all_of(std::istream& in) {
  std::string text;
  for (char c = 0; in.get(c);) text += c;
  return text;
}

/// Some 200 KB: pieces and a part of one.
std::string long_program() {
  std::string text = "G21 G90\n";
  for (int i = 0; text.size() < 200'000; ++i) text += "G0 X" + std::to_string(i) + "\n";
  return text;
}

class ProgramFiles : public ::testing::Test {
 protected:
  ProgramFiles() { write_bytes(path(), program_); }
  [[nodiscard]] fs::path path() const { return folder_ / "job.ngc"; }

  TempFolder folder_;
  std::string program_ = long_program();
};

TEST_F(ProgramFiles, GiveTheirBytesFromAnywhere) {
  const ProgramFile file(path());
  Sha256 hash;
  hash.update(program_);
  EXPECT_EQ(file.identity().sha256, hash.finish());
  EXPECT_EQ(file.identity().bytes, static_cast<std::int64_t>(program_.size()));
  EXPECT_EQ(file.identity().name, "job.ngc");
  EXPECT_EQ(all_of(*file.open()), program_);
  const auto in = file.open();
  for (const std::size_t at : {std::size_t{0}, std::size_t{65535}, std::size_t{65536},
                               std::size_t{131'071}, program_.size() - 1, program_.size()}) {
    in->clear();
    in->seekg(static_cast<std::streamoff>(at));
    EXPECT_EQ(static_cast<std::size_t>(in->tellg()), at);
    EXPECT_TRUE(all_of(*in) == program_.substr(at)) << at;
  }
  in->clear();
  in->seekg(static_cast<std::streamoff>(program_.size()) + 1);
  EXPECT_TRUE(in->fail());
}

TEST_F(ProgramFiles, StayThemselvesWhenAnotherTakesTheirName) {
  const ProgramFile file(path());
  write_bytes(folder_ / "other", "G0 Z-99\n");
  fs::rename(folder_ / "other", path());
  EXPECT_EQ(all_of(*file.open()), program_);
  fs::remove(path());
  EXPECT_EQ(all_of(*file.open()), program_);
}

TEST_F(ProgramFiles, GiveNothingThatWasWrittenOverThem) {
  const ProgramFile file(path());
  for (const std::size_t at : {std::size_t{9}, std::size_t{65536}, program_.size() - 2}) {
    std::string changed = program_;
    changed[at] = changed[at] == '7' ? '8' : '7';
    write_bytes(path(), changed);  // In place, as editors and cp do.
    std::string given;
    const std::string message = message_of<RunError>([&] {
      const auto in = file.open();
      for (char c = 0; in->get(c);) given += c;
    });
    EXPECT_THAT(message, HasSubstr("job.ngc: was changed on the disk"));
    EXPECT_TRUE(program_.starts_with(given));
    EXPECT_LE(given.size(), at);
  }
  write_bytes(path(), program_.substr(0, program_.size() - 1));
  EXPECT_THROW((void)all_of(*file.open()), RunError);
  write_bytes(path(), program_ + "G0 Z-99\n");
  EXPECT_EQ(all_of(*file.open()), program_) << "what was appended belongs to another program";
}

TEST_F(ProgramFiles, FeedNoLineThatWasNotChecked) {
  const ProgramFile file(path());
  const auto in = file.open();
  ProgramFeed feed(*in, {grbl_dialect(), false, {}, 1, 0, {}});
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(feed.next());
  std::string changed = program_;
  for (std::size_t at = 0; (at = changed.find('X', at)) != std::string::npos;) changed[at] = 'Z';
  write_bytes(path(), changed);
  EXPECT_THROW(
      {
        while (const auto line = feed.next()) ASSERT_EQ(line->text.find('Z'), std::string::npos);
      },
      RunError);
}

TEST_F(ProgramFiles, AreRegularFilesOnly) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  for (const fs::path& other : {folder_ / "none", folder_ / "pipe", folder_.path(),
                                fs::path("/dev/zero"), fs::path("/dev/null")}) {
    EXPECT_THAT(message_of<InputError>([&] { const ProgramFile file(other); }),
                HasSubstr(other.string()));
  }
  write_bytes(path(), "");
  EXPECT_EQ(all_of(*ProgramFile(path()).open()), "");
}

TEST_F(ProgramFiles, StopReadingWhenAskedTo) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(ProgramFile(path(), RunControl(stop.get_token(), {})), Interrupted);
}

}  // namespace
}  // namespace lensforge

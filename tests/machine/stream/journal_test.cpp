// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <string>

#include "core/full_disk.h"
#include "core/temp_folder.h"
#include "machine/stream/program_facts.h"

namespace lensforge {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::message_of;
using testing::read_bytes;
using testing::TempFolder;
using testing::write_bytes;

const JobIdentity kJob{std::string(64, 'a'), 123456, "lens.ngc"};

JobProgress at_line(std::int64_t line) {
  JobProgress at;
  at.sent = line + 2;
  at.acknowledged = line + 1;
  at.executed = line;
  at.byte = line * 20;
  at.state = "Run";
  at.position = Eigen::Vector3d(0.5 * static_cast<double>(line), -1.25, 3.0);
  at.spindle = "at speed";
  at.rpm = 22950.0;
  return at;
}

class JournalTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "job.journal"; }
  /// A journal of a run that ended in a hold at line 40.
  void write_held() const {
    const auto journal = Journal::create(path(), kJob, {});
    for (std::int64_t line = 1; line <= 40; ++line) {
      journal->before_sending(line + 2);
      journal->progress(at_line(line));
    }
    journal->note(40, "rpm fell to 21000");
    journal->end("held", "the door was opened", at_line(40));
  }

 private:
  TempFolder folder_;
};

using Journals = JournalTest;

TEST_F(Journals, ReadBackAsWritten) {
  write_held();
  const JournalRecord record = read_journal(path());
  EXPECT_TRUE(record.job.same_program(kJob));
  EXPECT_EQ(record.job.name, "lens.ngc");
  EXPECT_FALSE(record.finished);
  EXPECT_EQ(record.status, "held");
  EXPECT_EQ(record.reason, "the door was opened");
  EXPECT_EQ(record.last.sent, 42);
  EXPECT_EQ(record.last.acknowledged, 41);
  EXPECT_EQ(record.last.executed, 40);
  EXPECT_EQ(record.last.byte, 800);
  EXPECT_EQ(*record.last.position, Eigen::Vector3d(20.0, -1.25, 3.0));
  EXPECT_EQ(record.last.spindle, "at speed");
  EXPECT_EQ(record.last.rpm, 22950.0);
  EXPECT_EQ(record.runs, 1);
  EXPECT_EQ(record.torn, 0);
}

TEST_F(Journals, AFileIsThatOfEarlierVersions) {
  const auto journal = Journal::create(path(), kJob, {});
  WorkOrigins origins;
  origins.fill(Eigen::Vector3d::Zero());
  origins.back() = {1.5, -2.0, 0.25};
  journal->origins(origins);
  journal->progress(at_line(1));
  journal->note(1, "rpm fell to 21000");
  JobProgress last = at_line(2);
  last.position.reset();
  journal->end("held", "the door was opened", last);
  std::string text = R"(b6c77536 {"bytes":123456,"format":"lensforge.journal","kind":"job",)";
  text += R"("name":"lens.ngc","sha256":")" + kJob.sha256;
  text += R"(","version":1}
f2aefe81 {"kind":"run"}
3dd0fe8a {"kind":"origins","origins":[[0.0,0.0,0.0],[0.0,0.0,0.0],[0.0,0.0,0.0],[0.0,0.0,0.0],)";
  text += R"([0.0,0.0,0.0],[1.5,-2.0,0.25]]}
8876fee4 {"ack":2,"at":[0.5,-1.25,3.0],"byte":20,"done":1,"kind":"at","rpm":22950.0,"sent":3,)";
  text += R"("spindle":"at speed","state":"Run"}
4fae59b2 {"kind":"note","line":1,"text":"rpm fell to 21000"}
3340bbe2 {"ack":3,"byte":40,"done":2,"kind":"end","reason":"the door was opened","rpm":22950.0,)";
  text += R"("sent":4,"spindle":"at speed","state":"Run","status":"held"}
)";
  EXPECT_EQ(read_bytes(path()), text);
}

TEST_F(Journals, KnowAFinishedJob) {
  Journal::create(path(), kJob, {})->end("done", "", at_line(9));
  EXPECT_TRUE(read_journal(path()).finished);
}

TEST_F(Journals, OfADeadProcessBoundWhatWasSentByItsReservations) {
  const pid_t child = ::fork();
  if (child == 0) {
    const auto journal = Journal::create(path(), kJob, {});
    for (std::int64_t line = 1; line <= 1000; ++line) {
      journal->before_sending(line);
      if (line % 10 == 0) journal->progress(at_line(line - 3));
    }
    ::kill(::getpid(), SIGKILL);
  }
  ::waitpid(child, nullptr, 0);
  const JournalRecord record = read_journal(path());
  EXPECT_EQ(record.status, "");
  EXPECT_EQ(record.last.executed, 997);
  EXPECT_GE(record.last.sent, 1000);
  EXPECT_LT(record.last.sent, 1000 + (1 << 17));
}

TEST_F(Journals, GoOnWhereTheyEnded) {
  write_held();
  const JournalRecord before = read_journal(path());
  Journal::resume(path(), before, {})->end("held", "again", at_line(30));
  const JournalRecord after = read_journal(path());
  EXPECT_EQ(after.runs, 2);
  EXPECT_EQ(after.reason, "again");
  EXPECT_EQ(after.last.executed, 40) << "lines that an earlier run carried out stay carried out";
  EXPECT_EQ(after.last.sent, 42);
}

TEST_F(Journals, CutATornRecordWhereverItIsTorn) {
  write_held();
  const std::string whole = read_bytes(path());
  const std::size_t last = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t size = last; size < whole.size(); ++size) {
    write_bytes(path(), whole.substr(0, size));
    const JournalRecord record = read_journal(path());
    EXPECT_EQ(record.bytes, static_cast<std::int64_t>(last));
    EXPECT_EQ(record.torn, static_cast<std::int64_t>(size - last));
    EXPECT_EQ(record.status, "");
    EXPECT_EQ(record.last.executed, 40);
  }
  Journal::resume(path(), read_journal(path()), {})->end("held", "again", at_line(41));
  EXPECT_EQ(read_journal(path()).last.executed, 41);
  EXPECT_EQ(read_journal(path()).torn, 0);
}

TEST_F(Journals, DamagedBeforeTheirEndAreRefused) {
  write_held();
  const std::string whole = read_bytes(path());
  for (std::size_t at = 0; at + 400 < whole.size(); at += 97) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    write_bytes(path(), damaged);
    EXPECT_THROW(read_journal(path()), InputError) << at;
  }
}

TEST_F(Journals, RefuseWhatIsNone) {
  EXPECT_THAT(message_of<InputError>([&] { read_journal(path()); }), HasSubstr("job.journal"));
  for (const char* bytes : {"", "G0 X1\n", "00000000 {}\n"}) {
    write_bytes(path(), bytes);
    EXPECT_THROW(read_journal(path()), InputError) << bytes;
  }
}

/// A journal of these records behind one that begins it.
std::string journal_of(const std::vector<std::string>& records) {
  std::string text = journal_text::line_of({{"kind", "job"},
                                            {"format", journal_text::kFormat},
                                            {"version", journal_text::kVersion},
                                            {"sha256", std::string(64, 'a')},
                                            {"bytes", 1000},
                                            {"name", "a.ngc"}});
  for (const std::string& record : records) {
    text += journal_text::line_of(nlohmann::json::parse(record));
  }
  return text;
}

TEST_F(Journals, RefuseRecordsThatNoSenderWrites) {
  const std::string points = "[[0,0,0],[0,0,0],[0,0,0],[0,0,0],[0,0,0]";
  for (const std::string& record :
       std::vector<std::string>{R"({"kind":"at","sent":"9"})",
                                R"({"kind":"at","sent":9.5})",
                                R"({"kind":"at","sent":1e300})",
                                R"({"kind":"at","sent":-1})",
                                R"({"kind":"at","sent":18446744073709551615})",
                                R"({"kind":"at","sent":null})",
                                R"({"kind":"at","state":7})",
                                R"({"kind":"at","rpm":"fast"})",
                                R"({"kind":"at","rpm":1e300})",
                                R"({"kind":"at","at":[1,2]})",
                                R"({"kind":"at","at":[1,2,"3"]})",
                                R"({"kind":"at","at":{"x":1}})",
                                R"({"kind":"at","at":[1,2,1e300]})",
                                R"({"kind":7})",
                                R"({"kind":["at"]})",
                                R"({"kind":"reserve","sent":[1]})",
                                R"({"kind":"end","status":1})",
                                R"({"kind":"end","reason":{}})",
                                R"({"kind":"origins"})",
                                R"({"kind":"origins","origins":[[1,2,3]]})",
                                R"({"kind":"origins","origins":)" + points + R"(,[0,0,"0"]]})",
                                R"({"kind":"at","sent":5,"ack":6})",
                                R"({"kind":"at","sent":6,"ack":5,"done":6})",
                                R"({"kind":"at","byte":1001})",
                                R"({"kind":"at","sent":2000,"ack":2000})"}) {
    write_bytes(path(), journal_of({R"({"kind":"run"})", record}));
    const std::string message = message_of<InputError>([&] { read_journal(path()); });
    EXPECT_THAT(message, HasSubstr("job.journal: record 3: '")) << record;
    EXPECT_THAT(message, HasSubstr("--restart")) << record;
  }
  write_bytes(path(), journal_of({R"({"kind":"run"})", R"({"kind":"at","sent":7,"ack":6,"done":5})",
                                  R"({"kind":"origins","origins":)" + points + ",[0,0,0]]}",
                                  R"({"kind":"what a later version adds","x":[]})"}));
  EXPECT_EQ(read_journal(path()).last.executed, 5);
}

TEST_F(Journals, TakeTextsOfAnyBytesAndLength) {
  for (const char byte : {'\x01', '\x80', '"', '\\', '\n'}) {
    const std::string text(5000, byte);
    JobIdentity job = kJob;
    job.name = text;
    const auto journal = Journal::create(path(), job, {});
    journal->note(1, text);
    journal->end("fault", text, at_line(2));
    EXPECT_EQ(read_journal(path()).torn, 0);
    EXPECT_EQ(read_journal(path()).status, "fault");
  }
}

TEST_F(Journals, AreRegularFilesOnly) {
  ASSERT_EQ(::mkfifo(path().c_str(), 0600), 0);
  for (const fs::path& other : {path(), fs::path("/dev/zero"), path().parent_path()}) {
    EXPECT_THROW(read_journal(other), InputError) << other;
  }
  for (const fs::path& other : {path(), fs::path("/dev/null")}) {
    EXPECT_THROW(Journal::create(other, kJob, {}), InputError) << other;
  }
}

TEST_F(Journals, AreReadInConstantMemory) {
  std::string torn;
  torn.resize(50'000'000, 'x');
  write_bytes(path(), journal_of({}) + torn);
  EXPECT_EQ(read_journal(path()).torn, 50'000'000);
}

TEST_F(Journals, TakeThePlaceOfNothingElse) {
  for (const std::string& bytes :
       {std::string("G21 G90\nG0 X1\n"), std::string("\n"), std::string("x"),
        std::string("00000000 {}\n"), journal_text::line_of({{"kind", "job"}}),
        journal_text::line_of({{"format", 7}}), "x" + journal_of({})}) {
    write_bytes(path(), bytes);
    const std::string message = message_of<InputError>([&] { Journal::create(path(), kJob, {}); });
    EXPECT_THAT(message, HasSubstr("job.journal: exists and is no journal"));
    EXPECT_EQ(read_bytes(path()), bytes);
  }
  for (const std::string& bytes : {std::string(), journal_of({R"({"kind":"run"})"})}) {
    write_bytes(path(), bytes);
    Journal::create(path(), kJob, {});
    EXPECT_TRUE(read_journal(path()).job.same_program(kJob));
  }
}

TEST_F(Journals, AreWrittenByOneSenderOnly) {
  const auto journal = Journal::create(path(), kJob, {});
  EXPECT_THAT(message_of<InputError>([&] { Journal::create(path(), kJob, {}); }),
              HasSubstr("another sender"));
}

TEST_F(Journals, SayThatTheDiskIsFullAndStayReadable) {
  const auto journal = Journal::create(path(), kJob, {});
  journal->before_sending(1);
  std::int64_t line = 0;
  std::string message;
  {
    const testing::FullDisk full(8192);
    message = message_of<JournalFailed>([&] {
      for (line = 1; line < 10000; ++line) journal->progress(at_line(line));
    });
  }
  EXPECT_THAT(message, HasSubstr("job.journal"));
  EXPECT_THAT(message, HasSubstr("File too large"));
  EXPECT_GT(line, 10);
  const JournalRecord record = read_journal(path());
  EXPECT_EQ(record.last.executed, line - 1);
  EXPECT_EQ(record.torn, 0) << "what was written of the record that did not fit is taken back";
}

TEST_F(Journals, TakeFastLinesWithFewReservations) {
  const auto journal = Journal::create(path(), kJob, {});
  for (std::int64_t line = 1; line <= 1'000'000; ++line) journal->before_sending(line);
  EXPECT_LT(std::filesystem::file_size(path()), 10'000U);
}

JobIdentity identity_of(const fs::path& path) { return ProgramFile(path).identity(); }

TEST(JobIdentity, IsTheFileAndNotItsName) {
  const TempFolder folder;
  write_bytes(folder / "a.ngc", "abc");
  write_bytes(folder / "b.ngc", "abc");
  write_bytes(folder / "c.ngc", "abd");
  const JobIdentity a = identity_of(folder / "a.ngc");
  EXPECT_EQ(a.sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(a.bytes, 3);
  EXPECT_TRUE(a.same_program(identity_of(folder / "b.ngc")));
  EXPECT_FALSE(a.same_program(identity_of(folder / "c.ngc")));
  EXPECT_THROW(identity_of(folder / "d.ngc"), InputError);
  EXPECT_THROW(identity_of(folder.path()), InputError);
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <csignal>
#include <cstdlib>
#include <map>
#include <random>
#include <sstream>

#include "scenario/driver.h"
#include "scenario/small_disk.h"

namespace lensforge::scenario {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr const char* kThenStl =
    ",\"then\":[{\"command\":\"export\",\"options\":{\"out\":\"lens.stl\"}}]";

/// Jobs of half a second.
class Batch : public Scenario {
 protected:
  static std::string job(const std::string& name, const std::string& more = "",
                         const std::string& options = "") {
    return "{\"name\":\"" + name + "\",\"command\":\"design\",\"target\":\"" +
           picture("stripes.png") +
           "\",\"options\":{\"pixels\":16,\"rounds\":2,\"quality\":\"draft\"" + options + "}" +
           more + "}\n";
  }
  void jobs(const std::string& text) const { write(at("jobs.jsonl"), text); }
  /// job0, job1, … of three kinds.
  void several_jobs(int count) const {
    const std::array<const char*, 3> more{"", ",\"then\":[\"render\"]", kThenStl};
    std::string text;
    for (int i = 0; i < count; ++i) {
      text += job("job" + std::to_string(i), more[static_cast<std::size_t>(i) % more.size()]);
    }
    jobs(text);
  }
  [[nodiscard]] Arguments batch(const Arguments& more = {}) const {
    Arguments arguments{"batch", path("jobs.jsonl"), "--out", path("runs"), "--threads", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  /// Every job that has its name is whole.
  void expect_whole_jobs(const fs::path& runs) const {
    for (const std::string& name : listing(runs)) {
      if (name == ".work") continue;
      const auto done = nlohmann::json::parse(content(runs / name / "job.json"));
      EXPECT_EQ(done["status"], "done") << name;
      EXPECT_TRUE(fs::exists(runs / name / "surface.ply")) << name;
      EXPECT_EQ(done["steps"].size(), done["job"]["steps"].size()) << name;
    }
  }
  [[nodiscard]] nlohmann::json record(const std::string& name) const {
    return nlohmann::json::parse(content(at("runs") / name / "job.json"));
  }
};

TEST_F(Batch, DoesEveryJobOnceAndCollectsATable) {
  jobs(job("a", kThenStl) + job("b"));
  const Outcome first = run(batch({"--parallel", "2", "--table", path("table.csv"), "--json"}));
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_EQ(first.json()["jobs"][1]["status"], "done");
  EXPECT_TRUE(fs::exists(at("runs/a/lens.stl")));
  EXPECT_EQ(record("a")["steps"].size(), 2U);
  EXPECT_THAT(listing(at("runs/.work")), IsEmpty());
  const std::string table = content(at("table.csv"));
  EXPECT_THAT(table, HasSubstr("design.metrics.smooth.mae"));
  EXPECT_THAT(table, HasSubstr("\r\nb,done,"));
  const auto before = fs::last_write_time(at("runs/a/job.json"));
  const Outcome second = run(batch());
  EXPECT_EQ(second.exit_code, 0);
  EXPECT_THAT(second.err, HasSubstr("a: was done before"));
  EXPECT_EQ(fs::last_write_time(at("runs/a/job.json")), before);
}

TEST_F(Batch, ShardsShareTheJobs) {
  jobs(job("a") + job("b") + job("c"));
  ASSERT_EQ(run(batch({"--shard", "1/2"})).exit_code, 0);
  EXPECT_THAT(listing(at("runs")), ElementsAre(".work", "a", "c"));
  ASSERT_EQ(run(batch({"--shard", "2/2"})).exit_code, 0);
  EXPECT_THAT(listing(at("runs")), ElementsAre(".work", "a", "b", "c"));
}

TEST_F(Batch, FailedJobsAreToldAndRepeated) {
  jobs(job("bad", "", ",\"focal\":5") + job("good"));
  const Outcome first = run(batch({"--quiet"}));
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_THAT(first.out, HasSubstr("bad: design: --focal 5: must be above the thickness"));
  EXPECT_TRUE(fs::exists(at("runs/good/lens.json")));
  EXPECT_FALSE(fs::exists(at("runs/bad")));
  jobs(job("bad") + job("good"));
  EXPECT_EQ(run(batch()).exit_code, 0);
  EXPECT_EQ(record("bad")["status"], "done");
}

TEST_F(Batch, AGridReachesTheCommandsThatAreMeant) {
  jobs(job("a", ",\"then\":[\"render\"]"));
  ASSERT_EQ(run(batch({"--grid", "focal=250,300", "render.pixels=16,24"})).exit_code, 0);
  EXPECT_THAT(listing(at("runs")),
              ElementsAre(".work", "a-focal250-pixels16", "a-focal250-pixels24",
                          "a-focal300-pixels16", "a-focal300-pixels24"));
  const nlohmann::json steps = record("a-focal250-pixels24")["steps"];
  EXPECT_EQ(steps[0]["result"]["pixels"][0], 16);
  EXPECT_EQ(steps[1]["result"]["pixels"][0], 24);
  const auto lens = nlohmann::json::parse(content(at("runs/a-focal250-pixels24/lens.json")));
  EXPECT_EQ(lens["focal_length"], 250.0);
}

TEST_F(Batch, ATableTellsOfOtherShardsAndIsReplacedByTheNext) {
  jobs(job("bad", "", ",\"focal\":5") + job("good"));
  const Arguments table{"--table", path("table.csv")};
  EXPECT_EQ(run(batch({"--shard", "1/2"})).exit_code, 1);
  EXPECT_EQ(run(batch({"--shard", "2/2", "--table", path("table.csv")})).exit_code, 0);
  EXPECT_THAT(content(at("table.csv")), HasSubstr("\r\nbad,failed,\"design: --focal 5: must be"));
  EXPECT_THAT(content(at("table.csv")), HasSubstr("\r\ngood,done,,"));
  EXPECT_EQ(run(batch({"--shard", "2/2", "--table", path("table.csv")})).exit_code, 0);
  write(at("table.csv"), "name,of,mine\n");
  expect_refusal(run(batch(table)), 2, {"--table", "table.csv", "--force"});
}

TEST_F(Batch, AMissedLimitIsToldByEveryRun) {
  // The STEP file of a mesh does not hold the default tolerances everywhere.
  jobs(job("a", ",\"then\":[\"export\"]", ",\"model\":\"smooth\""));
  EXPECT_EQ(run(batch()).exit_code, 3);
  EXPECT_EQ(record("a")["status"], "limit");
  const Outcome second = run(batch());
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.err, HasSubstr("a: was done before, export: "));
}

TEST_F(Batch, AChangedJobIsDoneAgainWithForceOnly) {
  jobs(job("a"));
  ASSERT_EQ(run(batch()).exit_code, 0);
  jobs(job("a", "", ",\"focal\":250"));
  expect_refusal(run(batch()), 2, {"runs/a", "was done with other options", "--force"});
  ASSERT_EQ(run(batch({"--force"})).exit_code, 0);
  EXPECT_EQ(record("a")["job"]["steps"][0]["options"]["focal"], 250);
  fs::create_directories(at("runs/mine"));
  jobs(job("mine"));
  expect_refusal(run(batch({"--force"})), 2, {"runs/mine", "is no job's"});
}

TEST_F(Batch, RefusesBadInputBeforeTheFirstJob) {
  jobs(job("a") + "{\"name\":\"b\",\"command\":\"design\",\"target\":\"" + path("none.png") +
       "\"}");
  expect_refusal(run(batch()), 2, {"target of job \"b\"", "none.png", "No such file"});
  jobs(job("a"));
  expect_refusal(run(batch({"--shard", "3/2"})), 2, {"--shard 3/2", "I from 1 to N"});
  expect_refusal(run(batch({"--shard", "0/2"})), 2, {"--shard 0/2", "I from 1 to N"});
  expect_refusal(run(batch({"--grid", "focals=1"})), 2, {"--grid focals"});
  expect_refusal(run(batch({"--grid", "focal=250,-1"})), 2,
                 {"--grid focal=-1", "design --focal -1"});
  expect_refusal(run(batch({"--parallel", "0"})), 2, {"--parallel"});
  EXPECT_FALSE(fs::exists(at("runs")));
}

TEST_F(Batch, InterruptedItGoesOnWithTheSameBytes) {
  const std::string slow = ",\"mesh-ratio\":3";
  jobs(job("whole", "", slow));
  ASSERT_EQ(run(batch()).exit_code, 0);
  jobs(job("halved", "", slow));
  Process process(batch());
  while (!fs::exists(at("runs/.work/halved/out/checkpoint.bin"))) {
    ASSERT_TRUE(process.runs_for(milliseconds(5))) << process.wait().err;
  }
  process.send(SIGINT);
  EXPECT_EQ(process.wait().exit_code, 130);
  EXPECT_FALSE(fs::exists(at("runs/halved")));
  ASSERT_EQ(run(batch()).exit_code, 0);
  EXPECT_TRUE(content(at("runs/whole/surface.ply")) == content(at("runs/halved/surface.ply")));
}

TEST_F(Batch, AFullDiskFailsTheJobAndTheNextRunDoesIt) {
  jobs(job("a"));
  const Outcome full = run(batch({"--quiet"}), 8 * 1024);
  EXPECT_EQ(full.exit_code, 1);
  EXPECT_FALSE(fs::exists(at("runs/a")));
  EXPECT_EQ(run(batch()).exit_code, 0);
}

TEST_F(Batch, OnADiskThatIsFullAgainAndAgainNothingIsLostOrHalfDone) {
  const SmallDisk disk(at("disk"), "64k");
  if (!disk.mounted()) GTEST_SKIP() << "file systems can only be mounted by root";
  jobs(job("a") + job("b", kThenStl));
  const Arguments full = {"batch", path("jobs.jsonl"), "--out", path("disk/runs"), "--quiet"};
  int failures = 0;
  for (int kibibytes = 64; kibibytes <= 16384; kibibytes += kibibytes / 2) {
    ASSERT_TRUE(disk.resize(std::to_string(kibibytes) + "k"));
    const Outcome outcome = run(full);
    failures += outcome.exit_code == 0 ? 0 : 1;
    EXPECT_THAT(outcome.exit_code, ::testing::AnyOf(0, 1, 2)) << outcome.err;
    expect_whole_jobs(at("disk/runs"));
  }
  EXPECT_GT(failures, 1);
  ASSERT_EQ(run(full).exit_code, 0);
  jobs(job("whole"));
  ASSERT_EQ(run(batch()).exit_code, 0);
  const std::string surface = content(at("runs/whole/surface.ply"));
  EXPECT_TRUE(content(at("disk/runs/a/surface.ply")) == surface);
  EXPECT_TRUE(content(at("disk/runs/b/surface.ply")) == surface);
}

TEST_F(Batch, TwoInOneFolderShareTheJobs) {
  several_jobs(6);
  Process one(batch({"--json"}));
  const nlohmann::json other = run(batch({"--json"})).json();
  const nlohmann::json first = one.wait().json();
  const auto was_done_by = [](const nlohmann::json& told) {
    return told["status"] == "done" && told["earlier"] == false ? 1 : 0;
  };
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(was_done_by(first["jobs"][i]) + was_done_by(other["jobs"][i]), 1) << i;
  }
  expect_whole_jobs(at("runs"));
}

/// Kills that a campaign takes: a few here; LENSFORGE_BATCH_KILLS says how many otherwise.
int kills() {
  const char* const asked = std::getenv("LENSFORGE_BATCH_KILLS");
  return asked == nullptr ? 8 : std::atoi(asked);
}

TEST_F(Batch, KilledAtAnyMomentNothingIsLostOrDoneTwice) {
  int count = 6;
  std::map<std::string, fs::file_time_type> done;
  const auto expect_untouched = [&] {
    for (const auto& [name, time] : done) {
      EXPECT_EQ(fs::last_write_time(at("runs") / name / "job.json"), time) << name;
    }
  };
  std::mt19937 random(7);
  for (int killed = 0; killed < kills();) {
    several_jobs(count);
    Process process(batch({"--parallel", "2", "--quiet"}));
    if (process.runs_for(milliseconds(50 + random() % 1200))) {
      // Every second time its commands are killed with it; otherwise they end by themselves.
      ++killed % 2 == 0 ? process.send(SIGKILL) : process.kill_all();
      process.wait();
    } else {
      ASSERT_EQ(process.wait().exit_code, 0);
      count += 4;  // There was nothing left to be killed in.
    }
    expect_untouched();
    expect_whole_jobs(at("runs"));
    for (const std::string& name : listing(at("runs"))) {
      if (name == ".work") continue;
      done.emplace(name, fs::last_write_time(at("runs") / name / "job.json"));
    }
  }
  RecordProperty("jobs", count);
  RecordProperty("done_before_the_last_run", static_cast<int>(done.size()));
  const Outcome last = run(batch({"--parallel", "2"}));
  ASSERT_EQ(last.exit_code, 0) << last.err;
  EXPECT_THAT(listing(at("runs/.work")), IsEmpty());
  expect_untouched();
  const std::string surface = content(at("runs/job0/surface.ply"));
  for (int i = 0; i < count; ++i) {
    EXPECT_TRUE(content(at("runs/job" + std::to_string(i)) / "surface.ply") == surface) << i;
  }
}

}  // namespace
}  // namespace lensforge::scenario

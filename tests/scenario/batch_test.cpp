// SPDX-License-Identifier: GPL-3.0-or-later
#include <csignal>
#include <cstdlib>
#include <map>
#include <random>
#include <sstream>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

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
  [[nodiscard]] Arguments batch(const Arguments& more = {}) const {
    Arguments arguments{"batch", path("jobs.jsonl"), "--out", path("runs"), "--threads", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  [[nodiscard]] nlohmann::json record(const std::string& name) const {
    return nlohmann::json::parse(content(at("runs") / name / "job.json"));
  }
};

TEST_F(Batch, DoesEveryJobOnceAndCollectsATable) {
  jobs(job("a", ",\"then\":[{\"command\":\"export\",\"options\":{\"out\":\"a.stl\"}}]") + job("b"));
  const Outcome first = run(batch({"--parallel", "2", "--table", path("table.csv"), "--json"}));
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_EQ(first.json()["jobs"][1]["status"], "done");
  EXPECT_TRUE(fs::exists(at("runs/a/a.stl")));
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
  expect_refusal(run(batch()), 2, {"none.png", "No such file"});
  jobs(job("a"));
  expect_refusal(run(batch({"--shard", "3/2"})), 2, {"--shard 3/2", "I from 1 to N"});
  expect_refusal(run(batch({"--grid", "focals=1"})), 2, {"--grid focals"});
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

/// Kills that a campaign takes: a few here; LENSFORGE_BATCH_KILLS says how many otherwise.
int kills() {
  const char* const asked = std::getenv("LENSFORGE_BATCH_KILLS");
  return asked == nullptr ? 8 : std::atoi(asked);
}

TEST_F(Batch, KilledAtAnyMomentNothingIsLostOrDoneTwice) {
  std::string text;
  for (int i = 0; i < 4 + kills() / 4; ++i) {
    text += job("job" + std::to_string(i), i % 2 == 0 ? ",\"then\":[\"render\"]" : "");
  }
  jobs(text);
  std::map<std::string, fs::file_time_type> done;
  std::mt19937 random(7);
  for (int kill = 0; kill < kills(); ++kill) {
    Process process(batch({"--parallel", "2", "--quiet"}));
    if (process.runs_for(milliseconds(50 + random() % 1200))) process.send(SIGKILL);
    process.wait();
    // What was done stays as it is, and whatever has its name is whole.
    for (const auto& [name, time] : done) {
      EXPECT_EQ(fs::last_write_time(at("runs") / name / "job.json"), time) << name;
    }
    if (!fs::exists(at("runs"))) continue;
    for (const std::string& name : listing(at("runs"))) {
      if (name == ".work") continue;
      EXPECT_EQ(record(name)["status"], "done");
      EXPECT_TRUE(fs::exists(at("runs") / name / "surface.ply"));
      done.emplace(name, fs::last_write_time(at("runs") / name / "job.json"));
    }
  }
  const Outcome last = run(batch({"--parallel", "2"}));
  ASSERT_EQ(last.exit_code, 0) << last.err;
  EXPECT_THAT(listing(at("runs/.work")), IsEmpty());
  for (const auto& [name, time] : done) {
    EXPECT_EQ(fs::last_write_time(at("runs") / name / "job.json"), time) << name;
  }
  const std::string surface = content(at("runs/job0/surface.ply"));
  for (int i = 0; i < 4 + kills() / 4; ++i) {
    EXPECT_TRUE(content(at("runs/job" + std::to_string(i)) / "surface.ply") == surface) << i;
  }
}

}  // namespace
}  // namespace lensforge::scenario

// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/batch/batch_job.h"

#include <gmock/gmock.h>

#include "core/error.h"
#include "core/temp_folder.h"

namespace lensforge::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class BatchJobs : public ::testing::Test {
 protected:
  std::vector<BatchJob> read(const std::string& text) const {
    const auto file = folder_.path() / "jobs.jsonl";
    testing::write_bytes(file, text);
    return read_jobs(file);
  }
  void expect_refused(const std::string& line, const std::string& why) const {
    EXPECT_THAT([&] { read(line + "\n"); }, ThrowsMessage<InputError>(HasSubstr(why))) << line;
  }

 private:
  testing::TempFolder folder_;
};

TEST_F(BatchJobs, AreReadLineByLine) {
  const auto jobs = read(
      "{\"name\":\"a\",\"command\":\"design\",\"target\":\"a.png\",\"options\":{\"focal\":250,"
      "\"fresnel\":true,\"model\":\"facet\"},\"then\":[\"cam\",{\"command\":\"export\",\"options\":"
      "{\"out\":\"x.stl\"}}]}\n\n  \n"
      "{\"name\":\"b\",\"command\":\"reflect\",\"target\":\"b.stl\"}");
  ASSERT_EQ(jobs.size(), 2U);
  ASSERT_EQ(jobs[0].steps.size(), 3U);
  EXPECT_THAT(jobs[0].steps[0].words(),
              ElementsAre("--focal", "250", "--fresnel", "--model", "facet"));
  EXPECT_EQ(jobs[0].steps[2].command, "export");
  EXPECT_EQ(jobs[1].steps[0].command, "reflect");
}

TEST_F(BatchJobs, AreStoredAsByEarlierVersions) {
  const auto jobs = read(
      "{\"name\":\"a\",\"command\":\"design\",\"target\":\"a.png\",\"options\":{\"focal\":250,"
      "\"fresnel\":true},\"then\":[\"cam\"]}");
  EXPECT_EQ(jobs[0].json().dump(),
            R"({"name":"a","steps":[{"command":"design","options":{"focal":250,"fresnel":true}},)"
            R"({"command":"cam","options":{}}],"target":"a.png","target_sha256":""})");
}

TEST_F(BatchJobs, ListsBecomeSeveralWords) {
  const auto jobs = read(
      "{\"name\":\"a\",\"command\":\"design\",\"target\":\"a.png\",\"then\":[{\"command\":\"cam\","
      "\"options\":{\"compare\":[\"tool=0.3,0.4\",\"pitch=0.05\"]}}]}");
  EXPECT_THAT(jobs[0].steps[1].words(), ElementsAre("--compare", "tool=0.3,0.4", "pitch=0.05"));
}

TEST_F(BatchJobs, AFlagCanBeOff) {
  const auto jobs = read(
      "{\"name\":\"a\",\"command\":\"design\",\"target\":\"a.png\",\"options\":{\"fresnel\":false,"
      "\"focal\":250}}");
  EXPECT_THAT(jobs[0].steps[0].words(), ElementsAre("--focal", "250"));
}

TEST_F(BatchJobs, SayWhichLineIsWrongAndWhy) {
  const std::string design = "{\"name\":\"a\",\"command\":\"design\",\"target\":\"a.png\"";
  expect_refused("{", "jobs.jsonl line 1: is no JSON");
  expect_refused("[1]", "jobs.jsonl line 1");
  expect_refused(design + ",\"option\":{}}", "'option': no such key");
  expect_refused(design + ",\"options\":{\"focals\":1}}",
                 "option 'focals' of design: no such option");
  expect_refused(design + ",\"options\":{\"foc\":1}}", "no such option");
  expect_refused(design + ",\"options\":{\"out\":\"x\"}}", "is set by batch itself");
  expect_refused(design + ",\"options\":{\"help-all\":true}}", "is set by batch itself");
  expect_refused(design + ",\"options\":{\"focal\":null}}",
                 "--focal null: must be a text or a number");
  expect_refused(design + ",\"options\":{\"focal\":[250,300]}}", "--grid makes a job of each");
  expect_refused(design + ",\"options\":{\"focal\":\"far\"}}",
                 "line 1: design --focal: 'far' is no length");
  expect_refused(design + ",\"options\":{\"focal\":-1}}", "line 1: design --focal -1: must be ");
  expect_refused(design + ",\"options\":{\"model\":\"round\"}}", "must be one of");
  expect_refused(design + ",\"options\":{\"fresnel\":1}}", "--fresnel 1: must be true or false");
  expect_refused(design + ",\"options\":[]}", "an object of option names");
  expect_refused(design + ",\"then\":\"cam\"}", "a list of commands");
  expect_refused(
      design + ",\"then\":[{\"command\":\"export\",\"options\":{\"out\":\"stl/a.stl\"}}]}",
      "the name of a file in the job's folder");
  expect_refused(design + ",\"then\":[\"design\"]}", "cam, export or render after a design");
  expect_refused("{\"name\":\"a\",\"command\":\"send\",\"target\":\"x\"}", "design or reflect");
  expect_refused("{\"name\":\"a\",\"command\":\"reflect\",\"target\":\"x\",\"then\":[\"cam\"]}",
                 "only a design can be followed");
  expect_refused("{\"name\":\"a\",\"command\":\"design\"}", "target");
  for (const char* name : {"", "../a", ".a", "-a", "a/b", "a b"}) {
    expect_refused(
        "{\"name\":\"" + std::string(name) + "\",\"command\":\"design\",\"target\":\"a.png\"}",
        "letters, digits");
  }
  expect_refused(design + "}\n" + design + "}", "two jobs have it");
  expect_refused("", "holds no job");
}

BatchJob portrait() {
  return {"portrait", "p.png", {{"design", {{"width", 50}}}, {"cam", nlohmann::json::object()}}};
}

TEST(JobGrid, MakesEveryCombinationTheLastAxisFastest) {
  const auto jobs = expanded({portrait()}, read_grid({"focal=250,300", "cam.pitch=0.05,0.06"}));
  ASSERT_EQ(jobs.size(), 4U);
  EXPECT_EQ(jobs[1].name, "portrait-focal250-pitch0.06");
  EXPECT_EQ(jobs[2].name, "portrait-focal300-pitch0.05");
  EXPECT_THAT(jobs[1].steps[0].words(), ElementsAre("--focal", "250", "--width", "50"));
  EXPECT_THAT(jobs[1].steps[1].words(), ElementsAre("--pitch", "0.06"));
}

TEST(JobGrid, WithoutACommandGoesToTheFirstThatHasTheOption) {
  const auto jobs = expanded({portrait()}, read_grid({"polish-sigma=0.03"}));
  EXPECT_THAT(jobs[0].steps[1].words(), ElementsAre("--polish-sigma", "0.03"));
}

TEST(JobGrid, TurnsFlagsOnAndOff) {
  const auto jobs = expanded({portrait()}, read_grid({"fresnel=true,false"}));
  ASSERT_EQ(jobs.size(), 2U);
  EXPECT_EQ(jobs[0].name, "portrait-fresneltrue");
  EXPECT_THAT(jobs[0].steps[0].words(), ElementsAre("--fresnel", "--width", "50"));
  EXPECT_THAT(jobs[1].steps[0].words(), ElementsAre("--width", "50"));
}

TEST(JobGrid, RefusesValuesAsALineDoes) {
  EXPECT_THAT([] { expanded({portrait()}, read_grid({"focal=250,far"})); },
              ThrowsMessage<InputError>(HasSubstr("--grid focal=far: design --focal: 'far'")));
  EXPECT_THAT([] { expanded({portrait()}, read_grid({"resume=true"})); },
              ThrowsMessage<InputError>(HasSubstr("is set by batch itself")));
}

TEST(JobGrid, RefusesWhatNoCommandHasAndNamesThatBecomeTheSame) {
  EXPECT_THAT([] { expanded({portrait()}, read_grid({"focals=1"})); },
              ThrowsMessage<InputError>(HasSubstr("no command of job \"portrait\"")));
  EXPECT_THAT([] { expanded({portrait()}, read_grid({"cam.focal=1"})); },
              ThrowsMessage<InputError>(HasSubstr("no cam of job")));
  EXPECT_THAT([] { expanded({portrait()}, read_grid({"focal=1,1"})); },
              ThrowsMessage<InputError>(HasSubstr("two jobs have it")));
  for (const char* word : {"focal", "=1", "focal=", "focal=1,,2"}) {
    EXPECT_THROW(read_grid({word}), InputError) << word;
  }
}

TEST(JobTable, HasAColumnForEveryOptionAndResultAndQuotes) {
  const auto job = [](const char* name, int focal) {
    return BatchJob{name, "p.png", {{"design", {{"focal", focal}}}}}.json();
  };
  const nlohmann::json record = {
      {"seconds", 1.5},
      {"steps",
       {{{"command", "design"},
         {"result",
          {{"out", "x"}, {"metrics", {{"smooth", {{"mae", 0.25}}}}}, {"list", {1, 2}}}}}}}};
  const std::string text = job_table({{job("a", 250), "done", "", record},
                                      {job("b", 300), "failed", "says \"no\", twice", nullptr}});
  EXPECT_EQ(text,
            "name,status,message,seconds,design.focal,design.metrics.smooth.mae\r\n"
            "a,done,,1.5,250,0.25\r\n"
            "b,failed,\"says \"\"no\"\", twice\",,300,\r\n");
}

TEST(JobTable, KnowsItself) {
  const testing::TempFolder folder;
  testing::write_bytes(folder / "a.csv", job_table({}));
  testing::write_bytes(folder / "b.csv", "name,status\r\n");
  EXPECT_TRUE(is_job_table(folder / "a.csv"));
  EXPECT_FALSE(is_job_table(folder / "b.csv"));
  EXPECT_FALSE(is_job_table(folder / "none.csv"));
}

}  // namespace
}  // namespace lensforge::app

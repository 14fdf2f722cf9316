// SPDX-License-Identifier: GPL-3.0-or-later
// Files of jobs.
#include <sstream>

#include "fuzz/scene.h"

namespace lensforge::fuzz {
namespace {

/// Jobs of which one is changed, or the text of all of them.
std::string bad_jobs(const std::string& good, Random& random) {
  if (random.one_in(3)) return mutated_text(good, random);
  std::istringstream lines(good);
  std::vector<std::string> jobs;
  for (std::string line; std::getline(lines, line);) jobs.push_back(line);
  std::string& job = jobs[random.below(jobs.size())];
  job = random.one_in(6) ? "" : mutated_json(job, random);
  std::string text;
  for (const std::string& each : jobs) text += each + "\n";
  return text;
}

/// A batch starts the built command for every job, so that it is no forked campaign itself.
void jobs_file(Scene& scene) {
  scene.copy("pictures/a.png", "a.png");
  scene.copy("cube.off", "cube.off");
  scene.write("jobs.jsonl", bad_jobs(scene.base.bytes("jobs.jsonl"), scene.random));
  CommandLine line = scene.batch("jobs.jsonl", "jobs");
  if (scene.random.one_in(4)) line.set("--parallel", "2");
  if (scene.random.one_in(6)) scene.spoil_options(line, 1);
  scene.plan.may_fail = true;  // Jobs may.
  scene.run(line).exec = true;
}

}  // namespace

std::vector<Kind> batch_kinds() { return {{"jobs.jsonl", 2, jobs_file}}; }

}  // namespace lensforge::fuzz

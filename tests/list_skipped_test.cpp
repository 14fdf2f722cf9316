// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "core/temp_folder.h"

namespace {

using lensforge::testing::TempFolder;

// What the tests below run on: kept from an ordinary run by its name.
TEST(DISABLED_Sample, NeedsATool) { GTEST_SKIP() << "\"gmsh\" & <friends> are not\ninstalled"; }
TEST(DISABLED_Sample, NeedsAGpu) { GTEST_SKIP() << "no GPU: none was found"; }
TEST(DISABLED_Sample, Passes) {}

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::string text;
  for (int c = std::fgetc(pipe.get()); c != EOF; c = std::fgetc(pipe.get())) {
    text.push_back(static_cast<char>(c));
  }
  return text;
}

/// The script's output for a run of the samples.
std::string listed(const std::string& option) {
  const TempFolder folder;
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  output_of("GTEST_TOTAL_SHARDS=1 GTEST_SHARD_INDEX=0 '" + program +
            "' --gtest_filter='DISABLED_Sample.*' --gtest_also_run_disabled_tests"
            " --gtest_output='xml:" +
            (folder.path() / "samples.xml").string() + "'");
  return output_of(LENSFORGE_LIST_SKIPPED " '" + folder.path().string() + "' " + option);
}

TEST(ListSkipped, NamesEverySkippedTestWithItsReason) {
  EXPECT_EQ(listed(""),
            "DISABLED_Sample.NeedsAGpu: no GPU: none was found\n"
            "DISABLED_Sample.NeedsATool: \"gmsh\" & <friends> are not installed\n");
}

TEST(ListSkipped, LeavesOutTheGpusOnDemand) {
  EXPECT_EQ(listed("--without-gpu"),
            "DISABLED_Sample.NeedsATool: \"gmsh\" & <friends> are not installed\n");
}

TEST(ListSkipped, IsEmptyWithoutResults) {
  const TempFolder folder;
  EXPECT_EQ(output_of(LENSFORGE_LIST_SKIPPED " '" + folder.path().string() + "'"), "");
}

}  // namespace

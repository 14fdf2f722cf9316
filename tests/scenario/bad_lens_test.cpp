// SPDX-License-Identifier: GPL-3.0-or-later
#include <sys/stat.h>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

/// A lens folder that is damaged in one way at a time; every command that reads it must say how.
class BadLens : public Scenario {
 protected:
  void SetUp() override {
    place_small_lens(at("lens"));
    json_ = nlohmann::json::parse(content(at("lens/lens.json")));
  }

  void expect_refused(const std::vector<std::string>& parts) {
    for (const char* command : {"render", "cam", "info"}) {
      expect_refusal(run({command, path("lens")}), 2, parts);
      EXPECT_FALSE(fs::exists(at("lens/cam")));
    }
  }

  nlohmann::json json_;
};

TEST_F(BadLens, MissingFieldIsNamed) {
  for (const auto& [field, value] : json_.items()) {
    // A file without front and screen is of a flat front, and of a screen parallel to the lens.
    if (field == "provenance" || field == "metrics" || field == "front" || field == "screen") {
      continue;
    }
    nlohmann::json damaged = json_;
    damaged.erase(field);
    write(at("lens/lens.json"), damaged.dump());
    expect_refusal(run({"info", path("lens")}), 2, {"lens.json", field});
  }
  json_.erase("ior");
  write(at("lens/lens.json"), json_.dump());
  expect_refused({"lens.json", "ior"});
}

TEST_F(BadLens, OtherVersionIsNamed) {
  json_["version"] = 2;
  write(at("lens/lens.json"), json_.dump());
  expect_refused({"lens.json", "version", "2"});
}

TEST_F(BadLens, FieldOfAnotherTypeIsNamed) {
  json_["focal_length"] = "far away";
  write(at("lens/lens.json"), json_.dump());
  expect_refused({"lens.json", "focal_length"});
}

TEST_F(BadLens, BrokenJsonIsRefused) {
  write(at("lens/lens.json"), content(at("lens/lens.json")).substr(0, 100));
  expect_refused({"lens.json"});
}

TEST_F(BadLens, TruncatedSurfaceIsRefused) {
  const std::string whole = content(at("lens/surface.ply"));
  write(at("lens/surface.ply"), whole.substr(0, whole.size() / 2));
  expect_refused({"surface.ply"});
}

TEST_F(BadLens, MissingTargetIsRefused) {
  fs::remove(at("lens/target.exr"));
  expect_refused({"target.exr"});
}

TEST_F(BadLens, FolderWithoutALensIsRefused) {
  fs::remove_all(at("lens"));
  fs::create_directory(at("lens"));
  expect_refused({"lens"});
}

TEST_F(BadLens, ControlCharactersOfALensStayOffTheTerminal) {
  json_["provenance"]["no\x1b[31mte"] = "red \x1b]0;title\x07 \xc2\x9b text";
  write(at("lens/lens.json"), json_.dump());
  const Outcome outcome = run({"info", path("lens")});
  EXPECT_EQ(outcome.exit_code, 0);
  for (const char* control : {"\x1b", "\x07", "\xc2\x9b"}) {
    EXPECT_EQ(outcome.out.find(control), std::string::npos);
  }
}

TEST_F(BadLens, AConfigThatIsDeepOrNoRegularFileIsRefused) {
  std::string key = "pixels";
  for (int i = 0; i < 100'000; ++i) key += ".a";
  write(at("deep.toml"), key + " = 1\n");
  expect_refusal(run({"info", path("lens"), "--config", path("deep.toml")}), 2,
                 {"--config", "more than 32 parts"});
  ASSERT_EQ(::mkfifo(at("pipe.toml").c_str(), 0600), 0);
  for (const std::string& file : {path("pipe.toml"), std::string("/dev/zero")}) {
    expect_refusal(run({"info", path("lens"), "--config", file}), 2, {file, "regular files"});
    expect_refusal(run({"info", path("lens"), "--config=" + file}), 2, {file, "regular files"});
  }
}

TEST_F(BadLens, CamOptionsThatBreakTheirRuleAreRefused) {
  const std::string lens = path("lens");
  expect_refusal(run({"cam", lens, "--pitch", "0"}), 2, {"--pitch", "0", "1e-06 to 100"});
  expect_refusal(run({"cam", lens, "--pitch", "2", "--tool-diameter", "1"}), 2, {"pitch", "2"});
  expect_refusal(run({"cam", lens, "--feed", "-5"}), 2, {"--feed", "-5"});
  expect_refusal(run({"cam", lens, "--post", "heidenhain"}), 2, {"--post", "heidenhain"});
  expect_refusal(run({"cam", lens, "--tool-diameter", "2m"}), 2, {"tool-diameter"});
  EXPECT_FALSE(fs::exists(at("lens/cam")));
}

TEST_F(BadLens, RenderOptionsThatBreakTheirRuleAreRefused) {
  const std::string lens = path("lens");
  expect_refusal(run({"render", lens, "--focal", "1"}), 2, {"--focal", "1"});
  expect_refusal(run({"render", lens, "--out", path("picture.jpg")}), 2, {"--out", ".png"});
  expect_refusal(run({"render", lens, "--pixels", "0"}), 2, {"--pixels", "0"});
  expect_refusal(run({"render", path("none.ply")}), 2, {"none.ply"});
}

}  // namespace
}  // namespace lensforge::scenario

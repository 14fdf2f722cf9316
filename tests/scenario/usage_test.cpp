// SPDX-License-Identifier: GPL-3.0-or-later
#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class Usage : public Scenario {
 protected:
  /// A design that is refused for `extra`, before anything is written.
  void expect_option_refused(const Arguments& extra, const std::vector<std::string>& parts) {
    Arguments arguments = {"design", picture("rings.png"), "--out", path("lens")};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    expect_refusal(run(arguments), 2, parts);
    EXPECT_FALSE(fs::exists(at("lens")));
  }
};

TEST_F(Usage, HelpOfEveryCommandIsPrintedOnStdout) {
  for (const Arguments& arguments : std::vector<Arguments>{{"--help"},
                                                           {"plan", "--help"},
                                                           {"design", "--help"},
                                                           {"render", "-h"},
                                                           {"cam", "--help"},
                                                           {"nest", "--help"},
                                                           {"coupon", "--help"},
                                                           {"send", "-h"},
                                                           {"view", "--help"},
                                                           {"info", "-h"}}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_THAT(outcome.out, HasSubstr("lensforge"));
    EXPECT_EQ(outcome.err, "");
  }
}

TEST_F(Usage, HelpNamesDefaultsAndUnits) {
  const std::string help = run({"design", "--help"}).out;
  EXPECT_THAT(help, HasSubstr("--width MM = 100"));
  EXPECT_THAT(help, HasSubstr("--quality draft|standard|paper = standard"));
  EXPECT_THAT(run({"design", "--help-all"}).out, HasSubstr("--ior NUMBER = 1.49"));
}

TEST_F(Usage, HelpShowsWhatMattersAndHelpAllTheRest) {
  for (const std::string command : {"design", "cam"}) {
    const std::string some = run({command, "--help"}).out;
    const std::string all = run({command, "--help-all"}).out;
    EXPECT_THAT(some, HasSubstr("Example:\n  lensforge " + command + " "));
    EXPECT_THAT(some, HasSubstr("--help-all lists "));
    EXPECT_LT(std::count(some.begin(), some.end(), '\n'), 40);
    EXPECT_GT(std::count(all.begin(), all.end(), '\n'), 50);
  }
  EXPECT_EQ(run({"view", "--help-all"}).out, run({"view", "--help"}).out);
}

TEST_F(Usage, ShortOutIsTheSameOption) {
  expect_refusal(run({"design", "missing.png", "-o", path("lens")}), 2, {"missing.png"});
}

TEST_F(Usage, VersionIsOneLine) {
  for (const Arguments& arguments : std::vector<Arguments>{{"--version"}, {"cam", "--version"}}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_THAT(outcome.out, ::testing::MatchesRegex("lensforge [0-9]+\\.[0-9]+\\.[0-9]+\n"));
  }
}

TEST_F(Usage, NoCommandIsRefused) { expect_refusal(run({}), 2, {"no command"}); }

TEST_F(Usage, UnknownCommandIsRefused) {
  expect_refusal(run({"desing"}), 2, {"desing", "did you mean design?"});
}

TEST_F(Usage, MissingArgumentsAreRefused) {
  expect_refusal(run({"design"}), 2, {"required"});
  expect_refusal(run({"design", picture("rings.png")}), 2, {"--out"});
  expect_refusal(run({"render"}), 2, {"SOURCE"});
  expect_refusal(run({"cam"}), 2, {"DIR"});
  expect_refusal(run({"view"}), 2, {"DIR"});
  expect_refusal(run({"info"}), 2, {"SOURCE"});
}

TEST_F(Usage, UnknownOptionIsRefused) {
  expect_option_refused({"--widht", "5"}, {"--widht", "did you mean --width?"});
  expect_option_refused({"--widht=5"}, {"--widht=5", "did you mean --width?"});
  expect_option_refused({"--hologram"}, {"--hologram", "design --help lists the options"});
}

TEST_F(Usage, SecondValueIsRefused) {
  expect_option_refused({"--width", "50", "--width", "60"}, {"--width"});
}

TEST_F(Usage, OptionsThatBreakTheirRuleAreRefused) {
  expect_option_refused({"--focal", "0"}, {"--focal", "0", "above 0"});
  expect_option_refused({"--focal", "-3cm"}, {"--focal", "-3cm", "above 0"});
  expect_option_refused({"--ior", "0.9"}, {"--ior", "0.9", "1.01 to 10"});
  expect_option_refused({"--ior", "nan"}, {"--ior", "nan"});
  expect_option_refused({"--width", "10furlongs"}, {"--width", "furlongs"});
  expect_option_refused({"--width", "inf"}, {"--width", "inf"});
  expect_option_refused({"--width="}, {"--width"});
  expect_option_refused({"--rounds", "2.5"}, {"--rounds", "2.5", "whole number"});
  expect_option_refused({"--quality", "best"}, {"--quality", "best", "draft, standard, paper"});
  expect_option_refused({"--mesh-ratio", "9"}, {"--mesh-ratio", "9", "0.25 to 8"});
  expect_option_refused({"--weight-edge", "-1"}, {"--weight-edge", "-1", "0 to 1e+12"});
  expect_option_refused({"--threads", "-1"}, {"--threads", "-1"});
  expect_option_refused({"--pixels", "193"}, {"--pixels 193", "192"});
  expect_option_refused({"--thickness", "40cm"}, {"--focal", "thickness"});
}

TEST_F(Usage, ALongValueIsCutAndItsRuleStillStands) {
  std::string wavelengths = "380";
  for (int i = 1; i < 5000; ++i) wavelengths += "," + std::to_string(380 + i);
  for (const Arguments& extra : {Arguments{"--wavelengths", wavelengths},
                                 Arguments{"--ior", "1." + std::string(3000, '4') + "x"}}) {
    Arguments arguments = {"design", picture("rings.png"), "--out", path("lens")};
    arguments.insert(arguments.end(), extra.begin(), extra.end());
    const Outcome outcome = run(arguments);
    expect_refusal(outcome, 2, {extra.front() + " ", " ... ", "must be"});
    EXPECT_LT(outcome.err.size(), 420U);
  }
}

TEST_F(Usage, ALongPathIsNotCut) {
  const std::string name = path(std::string(120, 'a') + "/" + std::string(200, 'b') + ".png");
  expect_refusal(run({"info", name}), 2, {name});
}

TEST_F(Usage, CudaIsRefusedWhereThereIsNoGpu) {
  if (fs::exists("/dev/nvidiactl")) GTEST_SKIP() << "there is a GPU";
  expect_option_refused({"--device", "cuda"}, {"--device cuda: "});
}

TEST_F(Usage, AnErrorWithJsonIsAnObjectAndALine) {
  const Outcome outcome = run({"design", path("none.png"), "--out", path("lens"), "--json"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.json()["exit_code"], 2);
  EXPECT_THAT(outcome.json()["error"].get<std::string>(), HasSubstr("none.png"));
  EXPECT_EQ(outcome.err, "lensforge: " + outcome.json()["error"].get<std::string>() + "\n");
}

TEST_F(Usage, AConfigFileThatAsksForJsonIsHeededByErrorsToo) {
  write(at("json.toml"), "json = true\n");
  for (const Arguments& last : {Arguments{"--config", path("json.toml")},
                                Arguments{"--config=" + path("json.toml"), "--ior", "0.5"}}) {
    Arguments arguments = {"design", path("none.png"), "--out", path("lens")};
    arguments.insert(arguments.end(), last.begin(), last.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.json()["exit_code"], 2);
  }
}

TEST_F(Usage, JsonEscapesWhatTerminalsObey) {
  const std::string name =
      "\xc2\x9b"
      "2J\x7f.png";
  fs::copy_file(picture("rings.png"), at(name));
  const Outcome outcome = run({"info", path(name), "--json"});
  EXPECT_EQ(outcome.json()["source"], path(name));
  EXPECT_THAT(outcome.out, HasSubstr("\\u009b2J\\u007f.png"));
}

TEST_F(Usage, MoreThreadsThanProcessorsAreNoError) {
  Arguments arguments = small_design(picture("rings.png"), path("lens"));
  arguments.back() = "1024";
  arguments.emplace_back("--quiet");
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
}

TEST_F(Usage, ConfigFileSetsOptionsAndTheCommandLineWins) {
  write(at("lens.toml"),
        "pixels = 16\nior = 1.6 # glass\nwidth = \"4cm\"\nrounds = 1\n"
        "quality = \"draft\"\njson = true\n");
  const Outcome outcome = run({"design", picture("rings.png"), "--out", path("lens"), "--config",
                               path("lens.toml"), "--width", "50mm"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.json()["lens_size"][0], 50.0);
  EXPECT_EQ(outcome.json()["pixels"][0], 16);
  EXPECT_EQ(run({"info", path("lens"), "--json"}).json()["ior"], 1.6);
}

TEST_F(Usage, BrokenConfigFilesAreRefused) {
  write(at("unknown.toml"), "pixles = 16\n");
  expect_option_refused({"--config", path("unknown.toml")}, {"--config", "pixles"});
  write(at("value.toml"), "ior = 0.5\n");
  expect_option_refused({"--config", path("value.toml")}, {"--ior 0.5", "1.01 to 10"});
  for (const char* value : {"\"abc\"", "\"0x\"", "\"99999999999999999999\"", "1.5", "2", "\"\""}) {
    write(at("flag.toml"), std::string("resume = ") + value + "\n");
    expect_option_refused({"--config", path("flag.toml")}, {"--resume", "true or false"});
  }
  expect_option_refused({"--resume=abc"}, {"--resume abc", "true or false"});
  write(at("syntax.toml"), "pixels = = 3\n");
  expect_option_refused({"--config", path("syntax.toml")}, {"--config", "line 1"});
  write(at("table.toml"), "[design]\npixels = 3\n");
  expect_option_refused({"--config", path("table.toml")}, {"--config", "design"});
  expect_option_refused({"--config", path("missing.toml")}, {"missing.toml", "No such file"});
  expect_option_refused({"--config", path("")}, {"is a folder"});
  expect_option_refused({"--config", ""}, {"--config: must not be empty"});
}

TEST_F(Usage, AResultThatCannotBePrintedFails) {
  const std::string shell = std::string("\"") + LENSFORGE_COMMAND + "\" info \"" +
                            picture("rings.png") + "\" >/dev/full 2>\"" + path("err") + "\"";
  const int status = std::system(shell.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_THAT(content(at("err")), StartsWith("lensforge: standard output: "));
}

}  // namespace
}  // namespace lensforge::scenario

// SPDX-License-Identifier: GPL-3.0-or-later
#include <map>
#include <set>
#include <sstream>

#include "scenario/driver.h"

namespace lensforge::scenario::readme_test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kCommand = "build/release/lensforge";

/// The arguments of README's commands, in its order.
std::vector<Arguments> readme_commands() {
  std::istringstream readme(content(LENSFORGE_README));
  std::vector<Arguments> commands;
  bool within = false;
  for (std::string line; std::getline(readme, line);) {
    if (line.starts_with("## ")) within = line == "## The commands";
    if (!within || !line.starts_with("    ")) continue;
    std::istringstream words(line.substr(0, line.find('#')));
    std::string word;
    if (!(words >> word) || word != kCommand) continue;
    Arguments arguments;
    while (words >> word) arguments.push_back(word);
    commands.push_back(arguments);
  }
  return commands;
}

/// Options that make a command take seconds.
Arguments small_options(const std::string& command) {
  const Arguments coarse = {"--pitch", "1mm", "--tool-diameter", "2mm", "--no-semi", "--no-render"};
  const std::map<std::string, Arguments> options = {
      {"plan", {"--pixels", "16", "--width", "10mm", "--focal", "50mm"}},
      {"design",
       {"--pixels", "24", "--width", "12mm", "--focal", "60mm", "--quality", "draft", "--rounds",
        "1"}},
      {"cam", coarse},
      {"nest", coarse},
      {"reflect",
       {"--faces", "60", "--rim-updates", "1", "--face-updates", "1", "--direction-rows", "2"}},
  };
  const auto found = options.find(command);
  return found == options.end() ? Arguments() : found->second;
}

/// Runs commands in the test's folder, as one who follows README.
class Readme : public Scenario {
 protected:
  Readme() : before_(fs::current_path()) {
    fs::current_path(at("."));
    fs::copy(picture("portrait.png"), "portrait.png");
    write("jobs.jsonl",
          R"({"name": "small", "command": "design", "target": "portrait.png", "options": )"
          R"({"pixels": 16, "width": 10, "focal": 50, "quality": "draft", "rounds": 1}})");
    write("shape.stl", "solid shape\n" + facet("0 0 0", "0 10 0", "10 0 0") +
                           facet("0 0 0", "10 0 0", "0 0 10") + facet("0 0 0", "0 0 10", "0 10 0") +
                           facet("10 0 0", "0 10 0", "0 0 10") + "endsolid shape\n");
  }
  ~Readme() override { fs::current_path(before_); }

  /// README's command with the simulated controller and options for a test.
  static Arguments as_tried(Arguments arguments) {
    for (std::string& word : arguments) {
      if (word == "/dev/ttyUSB0") word = "sim:grbl";
    }
    for (const std::string& word : small_options(arguments.front())) arguments.push_back(word);
    return arguments;
  }

 private:
  static std::string facet(const std::string& a, const std::string& b, const std::string& c) {
    return "facet normal 0 0 0\nouter loop\nvertex " + a + "\nvertex " + b + "\nvertex " + c +
           "\nendloop\nendfacet\n";
  }

  fs::path before_;
};

TEST_F(Readme, ItsCommandsWorkInTheirOrder) {
  const std::vector<Arguments> commands = readme_commands();
  std::set<std::string> names;
  for (const Arguments& command : commands) {
    const Outcome outcome = run(as_tried(command));
    // So few updates of a shape gain too little for exit code 0.
    const bool little = command.front() == "reflect" && outcome.exit_code == 3;
    EXPECT_TRUE(outcome.exit_code == 0 || little)
        << ::testing::PrintToString(command) << outcome.err;
    names.insert(command.front());
  }
  EXPECT_EQ(names, (std::set<std::string>{"batch", "cam", "coupon", "design", "export", "info",
                                          "nest", "plan", "reflect", "render", "send", "view"}));
}

TEST_F(Readme, NotesNameTheNextCommandAndFilesThatExist) {
  place_small_lens("lens");
  const Outcome cut = run(as_tried({"cam", "lens", "--post", "grbl", "--surface", "facet"}));
  ASSERT_EQ(cut.exit_code, 0) << cut.err;
  EXPECT_THAT(cut.err, HasSubstr("look at lens/cam/report.html; then: lensforge send "
                                 "lens/cam/rough.ngc --dry-run\n"));
  EXPECT_EQ(run({"send", "lens/cam/rough.ngc", "--dry-run"}).exit_code, 0);
}

TEST_F(Readme, AProgramForAnotherFamilyIsRefusedWithTheCommandThatMakesTheRightOne) {
  place_small_lens("my lens");
  ASSERT_EQ(run(as_tried({"cam", "my lens", "--surface", "facet"})).exit_code, 0);
  for (const Arguments& way : {Arguments{"--port", "sim:grbl"}, Arguments{"--dry-run"}}) {
    Arguments send = {"send", "my lens/cam/rough.ngc"};
    send.insert(send.end(), way.begin(), way.end());
    expect_refusal(run(send), 2,
                   {"my lens/cam/rough.ngc: line 2 states the dialect linuxcnc",
                    "send takes programs for grbl and grblhal only",
                    "make it with lensforge cam 'my lens' --post grbl"});
  }
  EXPECT_FALSE(fs::exists("my lens/cam/rough.ngc.journal"));
}

TEST_F(Readme, ForeignWordsAreRecognisedWithoutAStatement) {
  const std::map<std::string, std::string> programs = {
      {"G21 G90\nG64 P0.01\nG0 X1\nM2\n",
       "line 2: G64 is not supported for grblhal: the program "
       "is written for linuxcnc; send takes"},
      {"%\nO1001\nG21 G90\nG0 X1\nM30\n%\n", "written for fanuc"},
      {"G21 G90\nG43 H1\nG0 X1\nM2\n", "written for linuxcnc or fanuc"}};
  for (const auto& [program, words] : programs) {
    write("job.ngc", program);
    expect_refusal(run({"send", "job.ngc", "--dry-run"}), 2,
                   {"job.ngc: ", words, "make it again by lensforge cam with --post grbl"});
  }
}

TEST_F(Readme, AWorkshopStatesItsDialectOnce) {
  place_small_lens("lens");
  const Outcome shown = run({"cam", "--show-workshop", "--post", "grbl"});
  EXPECT_THAT(shown.out, HasSubstr("post = \"grbl\""));
  write("mine.toml", "[machine]\npost = \"grbl\"\n");
  const auto first_lines = [](const std::string& file) { return content(file).substr(0, 60); };
  Arguments cam = as_tried({"cam", "lens", "--surface", "facet", "--workshop", "mine.toml"});
  ASSERT_EQ(run(cam).exit_code, 0);
  EXPECT_THAT(first_lines("lens/cam/rough.ngc"), HasSubstr("(dialect: grbl)"));
  cam.insert(cam.end(), {"--post", "grblhal"});
  ASSERT_EQ(run(cam).exit_code, 0);
  EXPECT_THAT(first_lines("lens/cam/rough.ngc"), HasSubstr("(dialect: grblhal)"));
  ASSERT_EQ(run({"coupon", "--out", "coupon", "--workshop", "mine.toml"}).exit_code, 0);
  EXPECT_THAT(first_lines("coupon/coupon.ngc"), HasSubstr("(dialect: grbl)"));
  write("bad.toml", "[machine]\npost = \"heidenhain\"\n");
  expect_refusal(run({"cam", "lens", "--workshop", "bad.toml"}), 2,
                 {"bad.toml: machine.post: 'heidenhain' is none of linuxcnc, grbl"});
}

}  // namespace
}  // namespace lensforge::scenario::readme_test

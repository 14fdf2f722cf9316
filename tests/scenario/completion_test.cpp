// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "scenario/driver.h"

namespace lensforge::scenario {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsSupersetOf;
using ::testing::Not;

/// The completions that shells make of what `lensforge completions SHELL` prints.
class Completion : public Scenario {
 protected:
  /// What a shell prints that runs `script`, line by line.
  std::vector<std::string> lines_of(const std::string& shell, const std::string& script) {
    write(at("script"), script);
    const std::string command = "cd '" + path("") + "' && HOME='" + path("") + "' " + shell + " '" +
                                path("script") + "' 2>&1";
    FILE* const pipe = popen(command.c_str(), "r");
    std::string text;
    std::array<char, 4096> block{};
    for (std::size_t n = 0; (n = fread(block.data(), 1, block.size(), pipe)) > 0;) {
      text.append(block.data(), n);
    }
    EXPECT_EQ(pclose(pipe), 0) << text;
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
      while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
      if (!line.empty()) lines.push_back(line);
    }
    return lines;
  }

  void place_script(const std::string& shell, const std::string& name) {
    const Outcome printed = run({"completions", shell});
    ASSERT_EQ(printed.exit_code, 0) << printed.err;
    write(at(name), printed.out);
  }

  static bool has(const char* shell) {
    return std::system((std::string("command -v ") + shell + " >/dev/null").c_str()) == 0;
  }

  /// What bash offers for a line, as it calls completions: words split at '='.
  std::vector<std::string> bash(const std::string& words) {
    place_script("bash", "lensforge.bash");
    return lines_of("bash",
                    "source ./lensforge.bash\ncomplete -p lensforge >/dev/null || exit 1\n"
                    "COMP_WORDS=(" +
                        words +
                        ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n"
                        "_lensforge\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n");
  }

  std::vector<std::string> fish(const std::string& line) {
    place_script("fish", "lensforge.fish");
    std::vector<std::string> offered =
        lines_of("fish", "source ./lensforge.fish\ncomplete -C '" + line + "'\n");
    for (std::string& one : offered) one = one.substr(0, one.find('\t'));
    return offered;
  }

  /// What zsh at a terminal makes of a line that is typed, with \t where it is to complete; the
  /// command itself only prints its words there.
  std::string zsh(const std::string& typed) {
    place_script("zsh", "_lensforge");
    const std::vector<std::string> lines = lines_of("zsh -f", R"(zmodload zsh/zpty
zpty shell zsh -f -i
zpty -w shell 'PS1=; fpath=($PWD $fpath); autoload -Uz compinit; compinit -D -u
lensforge() { print -r -- "ran $*" }; print RE"ADY"'
while zpty -r shell text; do [[ $text == *READY* ]] && break; done
zpty -w shell $')" + typed + R"('
while zpty -r shell text; do [[ $text == ran* ]] && break; done
print -r -- $text
)");
    return lines.empty() ? "" : lines.back();
  }
};

TEST_F(Completion, BashOffersCommandsOptionsAndTheirWords) {
  EXPECT_THAT(bash("lensforge ''"), IsSupersetOf({"design", "cam", "export", "send", "info"}));
  EXPECT_THAT(bash("lensforge de"), ElementsAre("design"));
  EXPECT_THAT(bash("lensforge --h"), ElementsAre("--help", "--help-all"));
  EXPECT_THAT(bash("lensforge design --help-"), ElementsAre("--help-all"));
  EXPECT_THAT(bash("lensforge design --foc"), ElementsAre("--focal"));
  EXPECT_THAT(bash("lensforge design a.png --model ''"),
              IsSupersetOf({"facet", "smooth", "spline"}));
  EXPECT_THAT(bash("lensforge design --model = sp"), ElementsAre("spline"));
  EXPECT_THAT(bash("lensforge export --format s"), ElementsAre("step", "stl"));
  EXPECT_THAT(bash("lensforge export --model ''"), Not(Contains("facet")));
}

TEST_F(Completion, BashOffersTheFilesThatAnOptionTakes) {
  write(at("shop.toml"), "");
  write(at("shop.txt"), "");
  fs::create_directory(at("folder"));
  EXPECT_THAT(bash("lensforge cam --workshop sh"), ElementsAre("shop.toml"));
  EXPECT_THAT(bash("lensforge design --made-by d"), ElementsAre("default"));
  EXPECT_THAT(bash("lensforge design --out fo"), ElementsAre("folder"));
  EXPECT_THAT(bash("lensforge design sh"), IsSupersetOf({"shop.toml", "shop.txt"}));
}

TEST_F(Completion, FishOffersTheSame) {
  if (!has("fish")) GTEST_SKIP() << "fish is not installed";
  EXPECT_THAT(fish("lensforge de"), ElementsAre("design"));
  // fish 4 matches letters anywhere: --force, too.
  EXPECT_THAT(fish("lensforge design --foc"), AllOf(Contains("--focal"), Not(Contains("--out"))));
  EXPECT_THAT(fish("lensforge design --model "), IsSupersetOf({"facet", "smooth", "spline"}));
}

TEST_F(Completion, ZshOffersTheSame) {
  if (!has("zsh")) GTEST_SKIP() << "zsh is not installed";
  EXPECT_EQ(zsh("lensforge de\\t--foc\\t3 --model sp\\t"), "ran design --focal=3 --model spline");
}

TEST_F(Completion, AnUnknownShellIsRefused) {
  expect_refusal(run({"completions", "csh"}), 2, {"csh", "bash, zsh or fish"});
  expect_refusal(run({"completions"}), 2, {"bash, zsh or fish"});
}

}  // namespace
}  // namespace lensforge::scenario

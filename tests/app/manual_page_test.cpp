// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "app/frame/command_line.h"
#include "core/temp_folder.h"

namespace lensforge::app {
namespace {

/// Those with options of their own, as the page has them.
constexpr std::array kCommands{"studio", "plan",   "design", "render",  "cam",  "nest",  "coupon",
                               "check",  "export", "send",   "reflect", "view", "batch", "info"};

/// Output of a command on standard output.
std::string printed(const std::vector<std::string>& arguments) {
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(run_command_line(arguments), 0);
  return ::testing::internal::GetCapturedStdout();
}

/// The page's part on the options, as the tables of the commands have it.
std::string options_part() {
  std::string text = ".Sh OPTIONS\n";
  for (const char* command : kCommands) {
    text += ".Ss Options of " + std::string(command) + "\n.Bl -tag -width Ds\n" +
            printed({command, "--help-man"}) + ".El\n";
  }
  return text;
}

TEST(ManualPage, HasEveryOptionAsTheTablesHaveIt) {
  const std::string page = testing::read_bytes(LENSFORGE_MANUAL_PAGE);
  const std::size_t begin = page.find(".Sh OPTIONS\n");
  const std::size_t end = page.find(".Sh COMMON OPTIONS\n");
  ASSERT_LT(begin, end);
  ASSERT_NE(end, std::string::npos);
  const std::string wanted = page.substr(0, begin) + options_part() + page.substr(end);
  if (page == wanted) return;
  const auto file = std::filesystem::temp_directory_path() / "lensforge.1";
  testing::write_bytes(file, wanted);
  FAIL() << LENSFORGE_MANUAL_PAGE << " is not as the options are; put " << file << " in its place";
}

TEST(ManualPage, HelpAndManualHaveTheSameOptions) {
  for (const char* command : kCommands) {
    const std::string help = printed({command, "--help-all"});
    const std::string manual = "\n" + printed({command, "--help-man"});
    for (std::size_t at = manual.find("\n.It Fl -"); at != std::string::npos;
         at = manual.find("\n.It Fl -", at + 1)) {
      const std::size_t name = at + std::string("\n.It Fl -").size();
      const std::string option =
          "--" + manual.substr(name, manual.find_first_of(" \n", name) - name);
      EXPECT_NE(help.find(option + " "), std::string::npos) << command << " " << option;
    }
  }
}

}  // namespace
}  // namespace lensforge::app

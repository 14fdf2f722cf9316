// SPDX-License-Identifier: GPL-3.0-or-later
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>

#include "machine/pty_controller.h"
#include "machine/sim_talk.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;

/// A terminal's end of the line, by the system's own calls.
class Terminal {
 public:
  explicit Terminal(const std::string& path)
      : file_(::open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK)) {}
  ~Terminal() { ::close(file_); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  [[nodiscard]] bool is_open() const { return file_ >= 0; }
  void send(const std::string& text) const {
    EXPECT_EQ(::write(file_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  /// Reads until `end` was heard, for ten seconds at most.
  [[nodiscard]] std::string hear(const std::string& end) const {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    std::string heard;
    while (heard.find(end) == std::string::npos && std::chrono::steady_clock::now() < limit) {
      pollfd wanted{file_, POLLIN, 0};
      ::poll(&wanted, 1, 50);
      std::array<char, 256> bytes{};
      const ssize_t count = ::read(file_, bytes.data(), bytes.size());
      if (count > 0) heard.append(bytes.data(), static_cast<std::size_t>(count));
    }
    return heard;
  }

 private:
  int file_;
};

TEST(PtyController, TalksToAnyTerminal) {
  const PtyController controller(ready_grbl(), 50.0);
  const Terminal terminal(controller.path());
  ASSERT_TRUE(terminal.is_open()) << controller.path();
  EXPECT_THAT(terminal.hear("for help]\r\n"), HasSubstr("Grbl 1.1h"));
  terminal.send("$$\n");
  EXPECT_THAT(terminal.hear("ok\r\n"), HasSubstr("$132=100.000"));
  terminal.send("G21 G91 G1 X10 F600\n");
  EXPECT_EQ(terminal.hear("ok\r\n"), "ok\r\n");
  terminal.send("G4 P0\n");  // answered once the motion has ended
  EXPECT_EQ(terminal.hear("ok\r\n"), "ok\r\n");
  terminal.send("?");
  EXPECT_THAT(terminal.hear(">\r\n"), HasSubstr("<Idle|MPos:10.000,0.000,0.000"));
}

TEST(PtyController, LetsSendersComeAndGo) {
  const PtyController controller(ready_grblhal(), 50.0);
  {
    const Terminal first(controller.path());
    EXPECT_THAT(first.hear("for help]\r\n"), HasSubstr("GrblHAL"));
  }
  const Terminal second(controller.path());
  second.send("$I\n");
  EXPECT_THAT(second.hear("ok\r\n"), HasSubstr("[OPT:VNMSL,35,1024,3,0]"));
}

}  // namespace
}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <mutex>

#include "machine/guard_server.h"
#include "scenario/driver.h"
#include "scenario/mill.h"

namespace lensforge::scenario {
namespace {

using lensforge::testing::drive_map;
using lensforge::testing::DriveServer;
using lensforge::testing::Manner;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A mill with a drive on a loopback Modbus server, which nothing but the sender connects.
class SendSpindle : public Scenario {
 protected:
  void SetUp() override {
    // The spindle comes before any motion.
    std::string program = zig_zag(20);
    program.erase(program.find("G0 Z-30\n"), 8);
    program.insert(program.find("G0 X-200"), "G0 Z-30\n");
    write(at("job.ngc"), program);
    write(at("drive.toml"),
          drive_map("kind = \"tcp\"\nhost = \"127.0.0.1\"\nport = " +
                    std::to_string(drive->port()) + "\nunit = 1\nconnect_timeout = 0.5"));
  }
  [[nodiscard]] Arguments send() const {
    return {"send",   path("job.ngc"), "--quiet",   "--port",          mill.path(),
            "--home", "--json",        "--spindle", path("drive.toml")};
  }
  /// What the drive's shaft did whenever a motion of the program began, rpm.
  std::vector<double> speeds() {
    const std::lock_guard lock(mutex_);
    return speeds_;
  }

  std::unique_ptr<DriveServer> drive = DriveServer::on_tcp();
  Mill mill{20.0, [this](const ExecutedPiece& piece) {
              const std::lock_guard lock(mutex_);
              if (piece.number > 0) speeds_.push_back(drive->rpm());
            }};

 private:
  std::mutex mutex_;
  std::vector<double> speeds_;
};

TEST_F(SendSpindle, NothingMovesBeforeTheDriveIsAtSpeed) {
  drive->set_ramp(30000.0);  // 0.4 s: eight seconds of the mill.
  const Outcome outcome = run(send());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err << outcome.out;
  std::vector<double> turning = speeds();
  ASSERT_GT(turning.size(), 400U);
  turning.resize(400);  // The last motions come after M5.
  EXPECT_THAT(turning, Each(::testing::DoubleNear(12000.0, 600.0)));
  EXPECT_LT(drive->rpm(), 12000.0) << "M5 stops the drive";
}

TEST_F(SendSpindle, AShaftThatNeverTurnsLetsNothingMove) {
  drive->set_manner(Manner::kLies);
  const Outcome outcome = run(send());
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_EQ(outcome.json()["result"]["cause"], "spindle");
  EXPECT_THAT(speeds(), IsEmpty());
}

TEST_F(SendSpindle, AShaftThatStallsHoldsTheJob) {
  Process process(send());
  ASSERT_TRUE(mill.cut(60));
  drive->set_manner(Manner::kLies);  // At-speed stays on; the output frequency falls to zero.
  const Outcome outcome = process.wait();
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const nlohmann::json result = outcome.json()["result"];
  EXPECT_EQ(result["cause"], "spindle");
  EXPECT_THAT(result["reason"].get<std::string>(), HasSubstr("the spindle lost its speed"));
  EXPECT_EQ(result["at_rest"], true);
  EXPECT_LT(result["executed"], 428);
  const std::size_t moved = mill.pieces().size();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // Two seconds of the mill.
  EXPECT_EQ(mill.pieces().size(), moved);
  EXPECT_TRUE(drive->told_to_turn()) << "a feed hold, and the spindle left turning";
  EXPECT_THAT(content(at("job.ngc.log")), HasSubstr("STOP: the spindle lost its speed"));
  EXPECT_THAT(content(at("job.ngc.log")), HasSubstr("end: fault: "));
}

}  // namespace
}  // namespace lensforge::scenario

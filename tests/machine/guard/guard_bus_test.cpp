// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <thread>

#include "machine/guard/modbus_bus.h"
#include "machine/guard/register_map.h"
#include "machine/guard/spindle_guard.h"
#include "machine/guard_server.h"
#include "machine/link/link.h"

namespace lensforge {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using testing::DriveServer;
using ::testing::HasSubstr;
using testing::Manner;
using testing::TerminalPair;

/// A guard with its thread, over a real bus to a DriveServer.
class Shop {
 public:
  explicit Shop(bool is_tcp) : is_tcp_(is_tcp) {
    if (!is_tcp) terminals_.emplace();
    revive();
    map_ = parse_register_map(testing::drive_map(transport()), "drive.toml");
    guard_ = guard_devices({map_}, {}, clock_);
  }

  BackgroundGuard& guard() { return *guard_; }
  DriveServer& server() { return *server_; }
  const RegisterMap& map() const { return map_; }
  const TerminalPair& terminals() const { return *terminals_; }
  SteadyClock& clock() { return clock_; }
  /// The server goes, with its connections and its listener.
  void kill() { server_.reset(); }
  /// Another one comes in its place.
  void revive() {
    server_ = is_tcp_ ? DriveServer::on_tcp(port_) : DriveServer::on_terminal(terminals_->second());
    port_ = server_->port();
  }
  void close_guard() { guard_.reset(); }

  /// Polls until `wanted` holds, at most `limit` s; @return how long it took.
  double time_to(const std::function<bool(const GuardReport&)>& wanted, double limit = 5.0) {
    const double start = clock_.now();
    while (!wanted(poll()) && clock_.now() - start < limit) clock_.wait(0.002);
    return clock_.now() - start;
  }
  double time_to(SpindleState state, double limit = 5.0) {
    return time_to([state](const GuardReport& report) { return report.spindle == state; }, limit);
  }
  GuardReport poll() {
    const double start = clock_.now();
    last_ = guard_->poll();
    longest_poll_ = std::max(longest_poll_, clock_.now() - start);
    return last_;
  }
  const GuardReport& last() const { return last_; }
  double longest_poll() const { return longest_poll_; }
  [[nodiscard]] bool reach(double rpm, bool clockwise = true) {
    guard_->spin(rpm, clockwise);
    return time_to(SpindleState::kAtSpeed) < 5.0;
  }

 private:
  std::string transport() const {
    if (is_tcp_) {
      return "kind = \"tcp\"\nhost = \"127.0.0.1\"\nport = " + std::to_string(port_) +
             "\nunit = 1\nconnect_timeout = 0.2";
    }
    return "kind = \"rtu\"\ndevice = \"" + terminals_->first() +
           "\"\nbaud = 19200\nparity = \"none\"\nstop_bits = 1\nunit = 1\n"
           "late_answer_window = 0.2";
  }
  bool is_tcp_;
  int port_ = 0;
  SteadyClock clock_;
  std::optional<TerminalPair> terminals_;
  std::unique_ptr<DriveServer> server_;
  RegisterMap map_;
  std::unique_ptr<BackgroundGuard> guard_;
  GuardReport last_;
  double longest_poll_ = 0.0;
};

class RealBus : public ::testing::TestWithParam<bool> {
 protected:
  Shop shop_{GetParam()};
};

INSTANTIATE_TEST_SUITE_P(Transport, RealBus, ::testing::Values(true, false),
                         [](const auto& test) { return test.param ? "Tcp" : "Rtu"; });

TEST_P(RealBus, TurnsBothWaysAndStops) {
  for (const bool clockwise : {true, false}) {
    ASSERT_TRUE(shop_.reach(12000.0, clockwise)) << shop_.last().reason;
    EXPECT_NEAR(shop_.server().rpm(), clockwise ? 12000.0 : -12000.0, 600.0);
    EXPECT_TRUE(shop_.last().interlocks_ok);
  }
  shop_.guard().stop();
  EXPECT_LT(shop_.time_to(SpindleState::kStopped), 5.0) << shop_.last().reason;
  EXPECT_LE(std::abs(shop_.server().rpm()), 60.0);
}

// 12000 rpm at 150000 rpm/s take 0.076 s to come within 5 %.
TEST_P(RealBus, WaitsForTheRamp) {
  shop_.guard().spin(12000.0, true);
  EXPECT_GE(shop_.time_to(SpindleState::kAtSpeed), 0.076 + 0.04);
}

TEST_P(RealBus, DoesNotBelieveALiar) {
  shop_.server().set_manner(Manner::kLies);
  shop_.guard().spin(12000.0, true);
  bool believed = false;
  shop_.time_to([&](const GuardReport& report) {
    believed |= report.spindle == SpindleState::kAtSpeed;
    return report.spindle == SpindleState::kFailed;
  });
  EXPECT_FALSE(believed);
  EXPECT_THAT(shop_.last().reason, HasSubstr("drive: speed reads 0 rpm"));
}

TEST_P(RealBus, FailsWhereTheServerDiesAndFindsTheNextOne) {
  ASSERT_TRUE(shop_.reach(12000.0)) << shop_.last().reason;
  shop_.kill();
  EXPECT_LT(shop_.time_to(SpindleState::kFailed), 1.5);
  EXPECT_THAT(shop_.last().reason,
              AllOf(HasSubstr("drive: spindle.status."),
                    AnyOf(HasSubstr("127.0.0.1:"), HasSubstr("no answer within 0.1 s"),
                          HasSubstr("no good answer for"))));
  EXPECT_FALSE(shop_.last().interlocks_ok);
  EXPECT_LT(shop_.longest_poll(), 0.1) << "a sender must not wait for the bus";
  shop_.revive();
  EXPECT_LT(shop_.time_to([](const GuardReport& report) { return report.interlocks_ok; }), 2.0)
      << shop_.last().reason;
  EXPECT_EQ(shop_.last().spindle, SpindleState::kFailed) << "until somebody asks anew";
  EXPECT_TRUE(shop_.reach(9000.0)) << shop_.last().reason;
}

TEST_P(RealBus, FailsWhereAnswersStayAway) {
  ASSERT_TRUE(shop_.reach(12000.0)) << shop_.last().reason;
  shop_.server().set_manner(Manner::kMute);
  EXPECT_LT(shop_.time_to(SpindleState::kFailed), 1.5);
  EXPECT_LT(shop_.longest_poll(), 0.1);
  EXPECT_NEAR(shop_.server().rpm(), 12000.0, 600.0) << "the spindle is kept turning";
}

// Late by 0.25 s: the time-out is 0.1 s, the window after it 0.2 s.
TEST_P(RealBus, FailsWhereAnswersAreLateAndTakesNoneForAnother) {
  ASSERT_TRUE(shop_.reach(12000.0)) << shop_.last().reason;
  shop_.server().set_manner(Manner::kLate);
  EXPECT_LT(shop_.time_to(SpindleState::kFailed), 1.5);
  EXPECT_THAT(shop_.last().reason, HasSubstr("no "));
  EXPECT_NEAR(shop_.last().rpm, 12000.0, 120.0);
  shop_.server().set_manner(Manner::kHonest);
  shop_.clock().wait(0.4);
  ASSERT_TRUE(shop_.reach(6000.0)) << shop_.last().reason;
  for (const GuardRecord& record : shop_.guard().take_records()) {
    EXPECT_THAT(record.text, ::testing::Not(HasSubstr("fault"))) << "a speed was taken for a code";
  }
}

TEST_P(RealBus, BelievesNoWriteThatIsEchoedWrong) {
  shop_.server().set_manner(Manner::kWrongEcho);
  shop_.guard().spin(12000.0, true);
  EXPECT_LT(shop_.time_to(SpindleState::kFailed), 3.0);
  EXPECT_THAT(shop_.last().reason, AllOf(HasSubstr("writing 2000 to holding register 0x2001"),
                                         HasSubstr("answered 06 20 01 07 D1 to 06 20 01 07 D0")));
  EXPECT_EQ(shop_.server().rpm(), 0.0);
}

TEST_P(RealBus, FailsOnGarbledAnswers) {
  ASSERT_TRUE(shop_.reach(12000.0)) << shop_.last().reason;
  shop_.server().set_manner(Manner::kBroken);
  EXPECT_LT(shop_.time_to(SpindleState::kFailed), 1.5);
  EXPECT_NEAR(shop_.last().rpm, 12000.0, 120.0) << "no value of a garbled answer is taken";
}

TEST_P(RealBus, TellsFaultsAndInterlocks) {
  ASSERT_TRUE(shop_.reach(12000.0)) << shop_.last().reason;
  shop_.server().set_door(false);
  EXPECT_LT(shop_.time_to([](const GuardReport& report) { return !report.interlocks_ok; }), 1.5);
  EXPECT_THAT(shop_.last().reason, HasSubstr("drive: door: reads 0: 1 is needed"));
  shop_.server().set_fault(9);
  EXPECT_LT(shop_.time_to([](const GuardReport& report) {
    return report.reason.find("fault 9: too hot") != std::string::npos;
  }),
            1.5);
  EXPECT_EQ(shop_.last().spindle, SpindleState::kFailed);
}

TEST_P(RealBus, DeliversAStopBeforeItGoes) {
  ASSERT_TRUE(shop_.reach(12000.0)) << shop_.last().reason;
  shop_.guard().stop();
  shop_.close_guard();
  ModbusBus reader(shop_.map().transport);
  reader.open();
  EXPECT_EQ(reader.read({3, 0x2000}), 0x01);
}

TEST_P(RealBus, GoesOnTryingAStopWhileItGoes) {
  ASSERT_TRUE(shop_.reach(12000.0)) << shop_.last().reason;
  shop_.server().set_manner(Manner::kWrongEcho);
  shop_.guard().stop();
  std::thread heals([this] {
    shop_.clock().wait(0.3);
    shop_.server().set_manner(Manner::kHonest);
  });
  shop_.close_guard();
  heals.join();
  ModbusBus reader(shop_.map().transport);
  reader.open();
  EXPECT_EQ(reader.read({3, 0x2000}), 0x01);
}

TEST_P(RealBus, RefusalsOfTheDeviceAreTold) {
  shop_.close_guard();
  ModbusBus bus(shop_.map().transport);
  bus.open();
  const auto fault_of = [](const std::function<void()>& exchange) -> std::optional<BusFault> {
    try {
      exchange();
    } catch (const BusError& error) {
      EXPECT_THAT(error.what(), HasSubstr("refused: "));
      return error.fault();
    }
    return std::nullopt;
  };
  EXPECT_EQ(fault_of([&] { (void)bus.read({3, 0x4000}); }), BusFault::kRefused);
  EXPECT_EQ(fault_of([&] { bus.write({6, 0x4000}, 1); }), BusFault::kRefused);
  EXPECT_EQ(fault_of([&] { bus.write({5, 0}, 1); }), BusFault::kRefused);
  EXPECT_EQ(bus.read({2, 0}), 1) << "the bus goes on";
}

TEST_P(RealBus, WritesSeveralRegistersWhereTheDeviceWantsThat) {
  shop_.close_guard();
  ModbusBus bus(shop_.map().transport);
  bus.open();
  bus.write({16, 0x2001}, 0xABCD);
  EXPECT_EQ(bus.read({3, 0x2001}), 0xABCD);
}

std::string output_of(const std::string& command) {
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  std::string output;
  std::array<char, 256> part{};
  while (pipe != nullptr && std::fgets(part.data(), part.size(), pipe) != nullptr) {
    output += part.data();
  }
  if (pipe != nullptr) ::pclose(pipe);
  return output;
}

// 18000 rpm are 300 Hz: 3000 in the register of 0.1 Hz; 18 is 0x12, forward.
TEST_P(RealBus, MbpollReadsBackWhatWasWritten) {
  if (output_of("mbpoll -h").find("usage") == std::string::npos) {
    GTEST_SKIP() << "mbpoll is not installed";
  }
  ASSERT_TRUE(shop_.reach(18000.0)) << shop_.last().reason;
  shop_.close_guard();
  const std::string reach =
      GetParam() ? "-m tcp -p " + std::to_string(shop_.server().port()) + " 127.0.0.1"
                 : "-m rtu -b 19200 -P none " + shop_.terminals().first();
  const std::string output = output_of("mbpoll -a 1 -t 4 -0 -1 -r 8192 -c 2 " + reach);
  EXPECT_THAT(output, AllOf(HasSubstr("[8192]: \t18\n"), HasSubstr("[8193]: \t3000\n")));
}

TEST(ModbusBus, IsBoundedWhereNobodyIsThere) {
  const std::unique_ptr<DriveServer> server = DriveServer::on_tcp();
  RegisterMap map = parse_register_map(
      testing::drive_map("kind = \"tcp\"\nhost = \"localhost\"\nport = " +
                         std::to_string(server->port()) + "\nunit = 1\nconnect_timeout = 0.2"),
      "drive.toml");
  ModbusBus by_name(map.transport);
  by_name.open();
  EXPECT_EQ(by_name.read({2, 0}), 1);
  map.transport.port = 1;
  ModbusBus nowhere(map.transport);
  EXPECT_THROW(nowhere.open(), BusError);
  map.transport.is_tcp = false;
  map.transport.device = "/dev/no-such-port";
  ModbusBus unplugged(map.transport);
  try {
    unplugged.open();
    ADD_FAILURE() << "opened";
  } catch (const BusError& error) {
    EXPECT_EQ(error.fault(), BusFault::kDown);
    EXPECT_THAT(error.what(), HasSubstr("no connection to /dev/no-such-port: No such file"));
  }
}

/// All registers read 0. One answer of all may keep the thread long, as a resolver or a driver can.
class ZeroBus final : public RegisterBus {
 public:
  ZeroBus(double each, int stuck_at) : each_(each), stuck_at_(stuck_at) {}
  void open() override { open_ = true; }
  void close() override { open_ = false; }
  [[nodiscard]] bool is_open() const override { return open_; }
  void discard() override {}
  std::uint16_t read(const RegisterAddress& /*at*/) override {
    SteadyClock().wait(++reads_ == stuck_at_ ? 0.6 : each_);
    return 0;
  }
  void write(const RegisterAddress& /*at*/, std::uint16_t /*value*/) override {}

 private:
  double each_;
  int stuck_at_;
  bool open_ = false;
  int reads_ = 0;
};

std::unique_ptr<SpindleGuard> guard_over(std::unique_ptr<RegisterBus> bus, Clock& clock) {
  std::vector<GuardedDevice> devices;
  devices.push_back(
      {parse_register_map(testing::drive_map("kind = \"tcp\"\nhost = \"127.0.0.1\"\nport = 1\n"
                                             "unit = 1\nconnect_timeout = 0.2"),
                          "drive.toml"),
       std::move(bus)});
  return std::make_unique<SpindleGuard>(std::move(devices), GuardOptions{}, clock);
}

TEST(BackgroundGuard, AReportThatIsTooOldIsAFailure) {
  SteadyClock clock;
  BackgroundGuard guard(guard_over(std::make_unique<ZeroBus>(0.0, 50), clock), 0.2);
  std::string reason;
  const double end = clock.now() + 3.0;
  while (clock.now() < end && reason.find("kept its thread") == std::string::npos) {
    const double start = clock.now();
    const GuardReport report = guard.poll();
    EXPECT_LT(clock.now() - start, 0.1);
    reason = report.spindle == SpindleState::kFailed ? report.reason : "";
    clock.wait(0.002);
  }
  EXPECT_THAT(reason, HasSubstr("at most 0.2 s are borne"));
}

// A round of readings takes 0.1 s and is under way when the request comes: what it brings is old.
TEST(BackgroundGuard, AReportThatWasBegunBeforeARequestSaysNothing) {
  SteadyClock clock;
  BackgroundGuard guard(guard_over(std::make_unique<ZeroBus>(0.02, -1), clock), 2.0);
  const double end = clock.now() + 5.0;
  while (guard.poll().spindle != SpindleState::kStopped && clock.now() < end) clock.wait(0.002);
  ASSERT_EQ(guard.poll().spindle, SpindleState::kStopped);
  clock.wait(0.03);
  guard.spin(12000.0, true);
  for (const double start = clock.now(); clock.now() < start + 0.4; clock.wait(0.002)) {
    ASSERT_EQ(guard.poll().spindle, SpindleState::kChanging) << clock.now() - start;
  }
}

TEST(BackgroundGuard, SaysNothingOldAfterARequest) {
  Shop shop(true);
  ASSERT_TRUE(shop.reach(12000.0)) << shop.last().reason;
  for (int i = 0; i < 50; ++i) {
    shop.guard().spin(i % 2 == 0 ? 18000.0 : 12000.0, true);
    EXPECT_EQ(shop.guard().poll().spindle, SpindleState::kChanging) << i;
  }
}

TEST(BackgroundGuard, AShortFailureIsSeenByThePollAfterIt) {
  Shop shop(true);
  ASSERT_TRUE(shop.reach(12000.0)) << shop.last().reason;
  shop.server().set_door(false);
  shop.clock().wait(0.2);
  shop.server().set_door(true);
  shop.clock().wait(0.2);
  const GuardReport report = shop.poll();
  EXPECT_FALSE(report.interlocks_ok);
  EXPECT_THAT(report.reason, HasSubstr("door: reads 0"));
  EXPECT_TRUE(shop.poll().interlocks_ok);
}

}  // namespace
}  // namespace lensforge

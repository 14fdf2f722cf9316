// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "machine/guard/modbus_bus.h"
#include "machine/guard_clock.h"

namespace lensforge {
namespace {

using ::testing::DoubleNear;
using ::testing::ElementsAre;
using testing::ManualClock;

/// What a ScriptedBus did, and is told to do.
struct BusLog {
  bool reachable = true;
  std::optional<BusFault> fault;  ///< Of every exchange.
  std::vector<double> opened;     ///< When open() was called, s since the start.
  int closed = 0;
  std::vector<double> discarded;
};

class ScriptedBus final : public RegisterBus {
 public:
  ScriptedBus(BusLog& log, Clock& clock) : log_(log), clock_(clock), start_(clock.now()) {}
  void open() override {
    log_.opened.push_back(clock_.now() - start_);
    if (!log_.reachable) throw BusError(BusFault::kDown, "unreachable");
    open_ = true;
  }
  void close() override {
    ++log_.closed;
    open_ = false;
  }
  [[nodiscard]] bool is_open() const override { return open_; }
  void discard() override { log_.discarded.push_back(clock_.now() - start_); }
  std::uint16_t read(const RegisterAddress& /*at*/) override {
    if (log_.fault) throw BusError(*log_.fault, "scripted");
    return 7;
  }
  void write(const RegisterAddress& at, std::uint16_t /*value*/) override { (void)read(at); }

 private:
  BusLog& log_;
  Clock& clock_;
  double start_;
  bool open_ = false;
};

class BusSessionTest : public ::testing::Test {
 protected:
  BusSession session(bool is_tcp) {
    BusTransport transport;
    transport.is_tcp = is_tcp;
    transport.response_timeout = 0.3;
    transport.late_answer_window = 0.5;
    transport.reconnect_pause = 0.25;
    transport.reconnect_pause_max = 1.0;
    return {std::make_unique<ScriptedBus>(log_, clock_), transport, clock_};
  }
  /// Reads whenever the session lets it, for `seconds`; @return how many were answered.
  int read_for(BusSession& session, double seconds) {
    int answers = 0;
    for (const double end = clock_.now() + seconds; clock_.now() < end; clock_.wait(kStep)) {
      if (!session.ready()) continue;
      try {
        answers += session.read({3, 0}) == 7 ? 1 : 0;
      } catch (const BusError&) {
      }
    }
    return answers;
  }

  static constexpr double kStep = 0.001;
  ManualClock clock_;
  BusLog log_;
};

TEST_F(BusSessionTest, OpensOnceForManyExchanges) {
  BusSession session = this->session(true);
  EXPECT_NEAR(read_for(session, 0.1), 100, 1);
  EXPECT_EQ(log_.opened.size(), 1U);
}

// 0, then pauses of 0.25, 0.5, 1, 1, 1 ...
TEST_F(BusSessionTest, PausesLongerAndLongerWhileTheDeviceIsUnreachable) {
  log_.reachable = false;
  BusSession session = this->session(true);
  read_for(session, 4.0);
  EXPECT_THAT(log_.opened,
              ElementsAre(DoubleNear(0.0, 0.01), DoubleNear(0.25, 0.01), DoubleNear(0.75, 0.01),
                          DoubleNear(1.75, 0.01), DoubleNear(2.75, 0.01), DoubleNear(3.75, 0.01)));
}

TEST_F(BusSessionTest, AConnectionAloneDoesNotShortenThePause) {
  log_.fault = BusFault::kSilent;
  BusSession session = this->session(true);
  read_for(session, 3.0);
  // each time-out of 0.3 s and the pause after it: 0.55, 0.8, 1.3
  EXPECT_THAT(log_.opened, ElementsAre(DoubleNear(0.0, 0.01), DoubleNear(0.55, 0.01),
                                       DoubleNear(1.35, 0.01), DoubleNear(2.65, 0.01)));
}

TEST_F(BusSessionTest, AnAnswerBringsTheShortPauseBack) {
  log_.reachable = false;
  BusSession session = this->session(true);
  read_for(session, 2.0);
  log_.reachable = true;
  EXPECT_GT(read_for(session, 1.0), 0);
  log_.reachable = false;
  log_.fault = BusFault::kDown;
  log_.opened.clear();
  const double broke = clock_.now();
  read_for(session, 0.3);
  ASSERT_EQ(log_.opened.size(), 1U);
  EXPECT_NEAR(log_.opened[0] - (broke - 1000.0), 0.25, 0.01);
}

TEST_F(BusSessionTest, ASerialLineIsWaitedOutAndEmptiedAfterATimeOut) {
  BusSession session = this->session(false);
  EXPECT_NEAR(read_for(session, 0.01), 10, 1);
  log_.fault = BusFault::kSilent;
  EXPECT_THROW(session.read({3, 0}), BusError);
  const double failed = clock_.now() - 1000.0;
  log_.fault.reset();
  EXPECT_FALSE(session.ready());
  read_for(session, 1.0);
  EXPECT_EQ(log_.opened.size(), 1U) << "the port stays open";
  EXPECT_THAT(log_.discarded, ElementsAre(DoubleNear(0.0, 0.01), DoubleNear(failed + 0.8, 0.01)));
}

TEST_F(BusSessionTest, ASilentSerialPortIsReopenedAfterThreeTimeOuts) {
  log_.fault = BusFault::kSilent;
  BusSession session = this->session(false);
  read_for(session, 3.0);
  EXPECT_EQ(log_.closed, 1);
  EXPECT_THAT(log_.opened, ElementsAre(DoubleNear(0.0, 0.01), DoubleNear(2.4, 0.01)));
}

TEST_F(BusSessionTest, ARefusalNeedsNoRecovery) {
  log_.fault = BusFault::kRefused;
  BusSession session = this->session(true);
  read_for(session, 0.1);
  EXPECT_TRUE(session.ready());
  EXPECT_EQ(log_.closed, 0);
  EXPECT_EQ(log_.opened.size(), 1U);
}

}  // namespace
}  // namespace lensforge

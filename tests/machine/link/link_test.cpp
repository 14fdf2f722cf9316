// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/link.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/io/files.h"
#include "core/temp_folder.h"
#include "machine/link/port.h"
#include "machine/pseudo_terminal.h"

namespace lensforge {
namespace {

using ::testing::HasSubstr;
using testing::message_of;
using testing::PseudoTerminal;

constexpr double kSoon = 5.0;  ///< Longer than loopback ever takes, s.

TEST(PortSpec, NamesEveryKindOfPort) {
  const PortSpec plain = parse_port_spec("/dev/ttyUSB0");
  EXPECT_EQ(plain.kind, PortSpec::Kind::kSerial);
  EXPECT_EQ(plain.place, "/dev/ttyUSB0");
  EXPECT_EQ(plain.baud, 115200);
  EXPECT_EQ(parse_port_spec("/dev/ttyACM1:250000").baud, 250000);
  const PortSpec tcp = parse_port_spec("tcp:192.168.0.7:23");
  EXPECT_EQ(tcp.kind, PortSpec::Kind::kTcp);
  EXPECT_EQ(tcp.place, "192.168.0.7");
  EXPECT_EQ(tcp.tcp_port, 23);
  EXPECT_EQ(parse_port_spec("tcp:[::1]:8880").place, "::1");
  EXPECT_EQ(parse_port_spec("sim:dialect=grbl").place, "dialect=grbl");
}

TEST(PortSpec, TakesColonsInADeviceName) {
  const PortSpec spec = parse_port_spec("/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0");
  EXPECT_EQ(spec.place, "/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0");
  EXPECT_EQ(spec.baud, 115200);
}

TEST(PortSpec, IsReadBackFromItsName) {
  for (const char* text : {"/dev/ttyS0:9600", "tcp:mill:23", "tcp:[fe80::1]:8080", "sim:grblhal"}) {
    EXPECT_EQ(port_name(parse_port_spec(text)), text);
  }
}

TEST(PortSpec, RefusesWhatIsNoPort) {
  for (const char* text :
       {"", "COM3", "ttyUSB0", "tcp:", "tcp:mill", "tcp:mill:0", "tcp:mill:65536", "tcp:mill:x",
        "tcp::23", "tcp:::1:23", "/dev/ttyS0:100000000", "udp:mill:23"}) {
    EXPECT_THAT(message_of<InputError>([&] { parse_port_spec(text); }), HasSubstr("--port"))
        << text;
  }
}

TEST(SteadyClock, LetsTimePass) {
  SteadyClock clock;
  const double before = clock.now();
  clock.wait(0.02);
  EXPECT_GE(clock.now() - before, 0.02);
}

std::string read_from(int descriptor, std::size_t count) {
  std::string bytes;
  std::array<char, 256> piece{};
  while (bytes.size() < count) {
    const ssize_t got = ::read(descriptor, piece.data(), piece.size());
    if (got <= 0) break;
    bytes.append(piece.data(), static_cast<std::size_t>(got));
  }
  return bytes;
}

std::string read_from(Link& link, std::size_t count) {
  std::string bytes;
  while (bytes.size() < count) {
    const std::string piece = link.read(kSoon);
    if (piece.empty()) break;
    bytes += piece;
  }
  return bytes;
}

/// Bytes that a terminal in its usual mode would change, hold back or act on.
const std::string kEveryKind = std::string("\x18\x03\r\n!~?\x11\x13\x7f\x84\xff", 12) + '\0' + "ok";

TEST(SerialLink, CarriesEveryByteBothWays) {
  PseudoTerminal terminal;
  SerialLink link({PortSpec::Kind::kSerial, terminal.device()});
  EXPECT_EQ(link.write(kEveryKind), kEveryKind.size());
  EXPECT_EQ(read_from(terminal.master(), kEveryKind.size()), kEveryKind);
  ASSERT_EQ(::write(terminal.master(), kEveryKind.data(), kEveryKind.size()),
            static_cast<ssize_t>(kEveryKind.size()));
  EXPECT_EQ(read_from(link, kEveryKind.size()), kEveryKind);
}

TEST(SerialLink, FollowsANameThatPointsToTheDevice) {
  PseudoTerminal terminal;
  const testing::TempFolder folder;
  std::filesystem::create_symlink(terminal.device(), folder / "mill");
  SerialLink link({PortSpec::Kind::kSerial, (folder / "mill").string()});
  link.write("?");
  EXPECT_EQ(read_from(terminal.master(), 1), "?");
}

TEST(SerialLink, ReadsNothingAfterTheWait) {
  PseudoTerminal terminal;
  SerialLink link({PortSpec::Kind::kSerial, terminal.device()});
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(link.read(0.05), "");
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  EXPECT_GE(spent.count(), 0.045);
  EXPECT_EQ(link.read(0.0), "");
}

TEST(SerialLink, WritesNoMoreThanThePortTakes) {
  PseudoTerminal terminal;
  SerialLink link({PortSpec::Kind::kSerial, terminal.device()});
  const std::string much(1 << 20, 'x');
  std::size_t taken = 0;
  while (const std::size_t count = link.write(std::string_view(much).substr(taken))) taken += count;
  EXPECT_GT(taken, 0U);
  EXPECT_LT(taken, much.size());
}

TEST(SerialLink, AnUnpluggedPortIsLost) {
  PseudoTerminal terminal;
  SerialLink link({PortSpec::Kind::kSerial, terminal.device()});
  terminal.unplug();
  EXPECT_THAT(message_of<LinkLost>([&] { link.read(kSoon); }), HasSubstr(terminal.device()));
  EXPECT_THROW(link.write("?"), LinkLost);
}

TEST(SerialLink, LeavesDtrRaisedWhenClosed) {
  PseudoTerminal terminal;
  { const SerialLink link({PortSpec::Kind::kSerial, terminal.device()}); }
  termios settings{};
  ASSERT_EQ(::tcgetattr(terminal.master(), &settings), 0);
  EXPECT_EQ(settings.c_cflag & HUPCL, 0U);
}

TEST(SerialLink, RefusesWhatIsNoSerialPort) {
  EXPECT_THAT(message_of<InputError>([] {
                SerialLink({PortSpec::Kind::kSerial, "/dev/no-such-port"});
              }),
              HasSubstr("/dev/no-such-port"));
  EXPECT_THROW(SerialLink({PortSpec::Kind::kSerial, "/dev/null"}), InputError);
}

/// Whether a process of its own gets the lock while this one has what it has.
bool another_process_gets(const PortSpec& spec) {
  const pid_t child = ::fork();
  if (child == 0) {
    try {
      const PortLock lock(spec);
      ::_exit(0);
    } catch (const std::exception&) {
      ::_exit(1);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

TEST(PortLock, KeepsASecondSenderOffAsLongAsItLives) {
  PseudoTerminal terminal;
  for (const PortSpec& spec : {PortSpec{PortSpec::Kind::kSerial, terminal.device()},
                               PortSpec{PortSpec::Kind::kTcp, "lock.test", 0, 4711}}) {
    {
      const PortLock lock(spec);
      EXPECT_FALSE(another_process_gets(spec)) << port_name(spec);
      EXPECT_THAT(message_of<InputError>([&] { PortLock second(spec); }),
                  HasSubstr("another sender"));
    }
    EXPECT_TRUE(another_process_gets(spec)) << port_name(spec);
  }
  std::filesystem::remove(lock_file({PortSpec::Kind::kTcp, "lock.test", 0, 4711}));
}

TEST(PortLock, GoesWithAKilledProcess) {
  const PseudoTerminal terminal;
  const PortSpec spec{PortSpec::Kind::kSerial, terminal.device()};
  const pid_t child = ::fork();
  if (child == 0) {
    const PortLock lock(spec);
    ::kill(::getpid(), SIGKILL);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_NO_THROW(PortLock again(spec));
}

/// A server on a loopback port that the system chose.
class Server {
 public:
  Server() : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listener_.number(), generic, size) != 0 || ::listen(listener_.number(), 1) != 0 ||
        ::getsockname(listener_.number(), generic, &size) != 0) {
      throw std::runtime_error("no loopback server");
    }
    spec_ = {PortSpec::Kind::kTcp, "127.0.0.1", 0, ntohs(address.sin_port)};
  }
  ~Server() { std::filesystem::remove(lock_file(spec_)); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] const PortSpec& spec() const { return spec_; }
  void take() { peer_ = Descriptor(::accept(listener_.number(), nullptr, nullptr)); }
  [[nodiscard]] int peer() const { return peer_.number(); }
  void hang_up() { peer_ = Descriptor(); }
  void close() { listener_ = Descriptor(); }

 private:
  Descriptor listener_;
  Descriptor peer_;
  PortSpec spec_;
};

// Linux lets connections beyond the backlog wait without an answer.
TEST(TcpLink, AStopEndsTheWaitForAConnection) {
  const Server server;
  std::vector<Descriptor> waiting;
  for (int i = 0; i < 4; ++i) {
    waiting.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(server.spec().tcp_port);
    ::connect(waiting.back().number(), reinterpret_cast<sockaddr*>(&address), sizeof address);
  }
  std::stop_source stop;
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    stop.request_stop();
  });
  const SteadyClock clock;
  const double begin = clock.now();
  EXPECT_THROW(TcpLink(server.spec(), stop.get_token(), 30.0), Interrupted);
  EXPECT_LT(clock.now() - begin, 1.0);
  stopper.join();
}

TEST(TcpLink, CarriesEveryByteBothWays) {
  Server server;
  TcpLink link(server.spec());
  server.take();
  EXPECT_EQ(link.read(0.01), "");
  EXPECT_EQ(link.write(kEveryKind), kEveryKind.size());
  EXPECT_EQ(read_from(server.peer(), kEveryKind.size()), kEveryKind);
  ASSERT_EQ(::write(server.peer(), kEveryKind.data(), kEveryKind.size()),
            static_cast<ssize_t>(kEveryKind.size()));
  EXPECT_EQ(read_from(link, kEveryKind.size()), kEveryKind);
}

TEST(TcpLink, WritesNoMoreThanTheConnectionTakes) {
  Server server;
  TcpLink link(server.spec());
  server.take();
  const std::string much(64 << 20, 'x');
  std::size_t taken = 0;
  while (const std::size_t count = link.write(std::string_view(much).substr(taken))) taken += count;
  EXPECT_GT(taken, 0U);
  EXPECT_LT(taken, much.size());
}

TEST(TcpLink, AClosedConnectionIsLost) {
  Server server;
  TcpLink link(server.spec());
  server.take();
  server.hang_up();
  EXPECT_THAT(message_of<LinkLost>([&] { link.read(kSoon); }), HasSubstr("closed by the other"));
}

TEST(TcpLink, SaysWhyNobodyAnswers) {
  Server server;
  server.close();
  EXPECT_THAT(message_of<InputError>([&] { TcpLink link(server.spec()); }),
              HasSubstr("Connection refused"));
}

}  // namespace
}  // namespace lensforge

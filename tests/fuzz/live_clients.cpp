// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/live_clients.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "app/view/page_client.h"
#include "fuzz/child.h"
#include "fuzz/random.h"

namespace lensforge::fuzz {
namespace {

using std::chrono::milliseconds;
using testing::PageClient;

constexpr std::size_t kMaxClients = 60;  ///< Twice what the page keeps.
constexpr milliseconds kBetween{2};      ///< Leaves the processor to the command.
constexpr milliseconds kAnswerTime{static_cast<int>(1000.0 * kMaxStop)};

bool answers(int port) {
  return testing::ask(port, testing::page_request(port), kAnswerTime).status == 200;
}

/// In the process of its own.
[[noreturn]] void ask_forever(int port, Random random, int complaints) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::vector<PageClient> clients;
  while (true) {
    std::this_thread::sleep_for(kBetween);
    try {
      clients.emplace_back(port).send(testing::hostile_request(port, random), kBetween);
      random.pick(clients).send("X: y\r\n", milliseconds(0));
      if (clients.size() == kMaxClients) {
        std::swap(clients[random.below(kMaxClients)], clients.back());
        clients.pop_back();
      }
      // A page that ends leaves one request open, and takes no second one.
      if (random.one_in(4) && !answers(port) && !answers(port)) {
        if (write(complaints, "?", 1) < 0) _exit(1);
      }
    } catch (const std::system_error&) {
      clients.clear();  // Nobody listens: not yet, or no longer.
    }
  }
}

}  // namespace

LiveClients::LiveClients(std::uint64_t seed)
    : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  // While this socket holds the port, only sockets with the same option may take it, as the page's.
  const int yes = 1;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  // The socket API takes all kinds of addresses by this type.
  auto* const any = reinterpret_cast<sockaddr*>(&address);  // NOLINT
  std::array<int, 2> ends{};
  if (setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      bind(socket_, any, size) != 0 || getsockname(socket_, any, &size) != 0 ||
      pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("no port for a live page");
  }
  port_ = ntohs(address.sin_port);
  pid_ = fork();
  if (pid_ == 0) ask_forever(port_, Random(seed), ends[1]);
  close(ends[1]);
  complaints_ = ends[0];
}

LiveClients::~LiveClients() {
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  close(complaints_);
  close(socket_);
}

bool LiveClients::unanswered() const {
  pollfd entry{complaints_, POLLIN, 0};
  return poll(&entry, 1, 0) > 0;
}

}  // namespace lensforge::fuzz

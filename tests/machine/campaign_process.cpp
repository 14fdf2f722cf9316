// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/campaign_process.h"

#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "core/io/files.h"

namespace lensforge::campaign {
namespace {

/// One question of the child, or its answer: what, how long, how many bytes follow.
struct Message {
  char what = 0;  ///< R read, W write, N now, T wait; in an answer L for a lost link.
  double number = 0.0;
  std::uint64_t bytes = 0;
};

bool send_all(int socket, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t count = ::send(socket, at, size, MSG_NOSIGNAL);
    if (count <= 0) return false;
    at += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

bool receive_all(int socket, void* data, std::size_t size) {
  char* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t count = ::recv(socket, at, size, 0);
    if (count <= 0) return false;
    at += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

bool send_message(int socket, Message message, const std::string& bytes) {
  message.bytes = bytes.size();
  return send_all(socket, &message, sizeof message) && send_all(socket, bytes.data(), bytes.size());
}

bool receive_message(int socket, Message& message, std::string& bytes) {
  if (!receive_all(socket, &message, sizeof message)) return false;
  bytes.resize(message.bytes);
  return receive_all(socket, bytes.data(), bytes.size());
}

/// The machine as the child sees it.
class RemoteMachine : public Link, public Clock {
 public:
  RemoteMachine(int socket, std::size_t dies_after) : socket_(socket), left_(dies_after) {}

  [[nodiscard]] double now() const override { return ask({'N'}, {}).number; }
  void wait(double seconds) override { ask({'T', seconds}, {}); }
  std::string read(double wait) override {
    ask({'R', wait}, {});
    return answer_;
  }
  std::size_t write(std::string_view bytes) override {
    const std::string_view lived = bytes.substr(0, left_);
    const auto count = static_cast<std::size_t>(ask({'W'}, std::string(lived)).number);
    left_ -= count;
    if (left_ == 0) ::kill(::getpid(), SIGKILL);
    return count;
  }

 private:
  Message ask(const Message& question, const std::string& bytes) const {
    Message message;
    if (!send_message(socket_, question, bytes) || !receive_message(socket_, message, answer_)) {
      ::_exit(3);
    }
    if (message.what == 'L') throw LinkLost(answer_);
    return message;
  }

  int socket_;
  std::size_t left_;
  mutable std::string answer_;
};

/// Answers the child until it is gone.
void serve(int socket, SimulatedMachine& machine) {
  const std::unique_ptr<Link> link = machine.open();
  Message question;
  std::string bytes;
  while (receive_message(socket, question, bytes)) {
    Message answer{question.what};
    std::string said;
    try {
      if (question.what == 'R') said = link->read(question.number);
      if (question.what == 'W') answer.number = static_cast<double>(link->write(bytes));
      if (question.what == 'N') answer.number = machine.now();
      if (question.what == 'T') machine.wait(question.number);
    } catch (const LinkLost& lost) {
      answer.what = 'L';
      said = lost.what();
    }
    if (!send_message(socket, answer, said)) return;
  }
}

}  // namespace

bool run_and_kill(SimulatedMachine& machine, std::size_t bytes,
                  const std::function<void(Link&, Clock&)>& job) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) {
    throw std::runtime_error("no socket pair");
  }
  Descriptor ours(ends[0]);
  Descriptor theirs(ends[1]);
  const pid_t child = ::fork();
  if (child == 0) {
    ours = Descriptor();
    RemoteMachine remote(ends[1], bytes);
    try {
      job(remote, remote);
    } catch (...) {
      ::_exit(2);
    }
    ::_exit(0);
  }
  theirs = Descriptor();
  serve(ends[0], machine);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
}

}  // namespace lensforge::campaign

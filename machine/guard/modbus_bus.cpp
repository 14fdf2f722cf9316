// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/guard/modbus_bus.h"

#include <arpa/inet.h>
#include <modbus.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "core/error.h"
#include "machine/link/link.h"

namespace lensforge {
namespace {

/// A time in seconds in libmodbus's format.
struct SecondsParts {
  explicit SecondsParts(double time)
      : seconds(static_cast<std::uint32_t>(std::floor(time))),
        micros(static_cast<std::uint32_t>((time - std::floor(time)) * 1e6)) {}
  std::uint32_t seconds;
  std::uint32_t micros;
};

std::string seconds_text(double seconds) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g s", seconds);
  return text.data();
}

bool is_ipv4(const std::string& host) {
  in_addr ignored{};
  return inet_pton(AF_INET, host.c_str(), &ignored) == 1;
}

modbus_t* new_context(const BusTransport& to) {
  if (!to.is_tcp) {
    return modbus_new_rtu(to.device.c_str(), to.baud, to.parity, 8, to.stop_bits);
  }
  if (is_ipv4(to.host)) return modbus_new_tcp(to.host.c_str(), to.port);
  return modbus_new_tcp_pi(to.host.c_str(), std::to_string(to.port).c_str());
}

std::string endpoint_text(const BusTransport& to) {
  return to.is_tcp ? to.host + ":" + std::to_string(to.port) : to.device;
}

/// The protocol data unit of a write of one value, and how much of it the device echoes.
std::vector<std::uint8_t> write_request(const RegisterAddress& at, std::uint16_t value) {
  const auto high = [](int number) { return static_cast<std::uint8_t>((number >> 8) & 0xFF); };
  const auto low = [](int number) { return static_cast<std::uint8_t>(number & 0xFF); };
  const std::uint8_t function = low(at.function);
  switch (at.function) {
    case MODBUS_FC_WRITE_SINGLE_COIL:
      return {function, high(at.address), low(at.address), low(value != 0 ? 0xFF : 0), 0};
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
      return {function, high(at.address), low(at.address), 0, 1, 1, low(value != 0 ? 1 : 0)};
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS:
      return {function, high(at.address), low(at.address), 0, 1, 2, high(value), low(value)};
    default:
      return {function, high(at.address), low(at.address), high(value), low(value)};
  }
}

constexpr std::size_t kEchoedBytes = 5;

std::string hex_text(const std::uint8_t* bytes, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<char, 4> hex{};
    std::snprintf(hex.data(), hex.size(), "%02X", static_cast<unsigned>(bytes[i]));
    text += (i == 0 ? "" : " ") + std::string(hex.data());
  }
  return text;
}

}  // namespace

void ModbusBus::Freed::operator()(_modbus* context) const {
  modbus_close(context);
  modbus_free(context);
}

ModbusBus::ModbusBus(const BusTransport& transport)
    : transport_(transport), last_exchange_(SteadyClock().now() - transport.request_gap) {}

ModbusBus::~ModbusBus() = default;

// libmodbus connects within the response time-out that is set at that moment.
void ModbusBus::open() {
  std::unique_ptr<_modbus, Freed> context(new_context(transport_));
  if (context == nullptr || modbus_set_slave(context.get(), transport_.unit) != 0) fail(errno);
  modbus_set_error_recovery(context.get(), MODBUS_ERROR_RECOVERY_NONE);
  const SecondsParts connect(transport_.is_tcp ? transport_.connect_timeout
                                               : transport_.response_timeout);
  modbus_set_response_timeout(context.get(), connect.seconds, connect.micros);
  if (modbus_connect(context.get()) != 0) {
    throw BusError(BusFault::kDown,
                   "no connection to " + endpoint_text(transport_) + ": " + modbus_strerror(errno));
  }
  const SecondsParts response(transport_.response_timeout);
  modbus_set_response_timeout(context.get(), response.seconds, response.micros);
  const SecondsParts byte(transport_.byte_timeout);
  modbus_set_byte_timeout(context.get(), byte.seconds, byte.micros);
  context_ = std::move(context);
}

void ModbusBus::close() { context_.reset(); }

void ModbusBus::discard() {
  if (context_ != nullptr) modbus_flush(context_.get());
}

std::uint16_t ModbusBus::read(const RegisterAddress& at) {
  LF_CHECK(is_open(), endpoint_text(transport_));
  begin_request();
  std::uint8_t bit = 0;
  std::uint16_t word = 0;
  int count = 0;
  if (at.function == MODBUS_FC_READ_COILS) {
    count = modbus_read_bits(context_.get(), at.address, 1, &bit);
  } else if (at.function == MODBUS_FC_READ_DISCRETE_INPUTS) {
    count = modbus_read_input_bits(context_.get(), at.address, 1, &bit);
  } else if (at.function == MODBUS_FC_READ_INPUT_REGISTERS) {
    count = modbus_read_input_registers(context_.get(), at.address, 1, &word);
  } else {
    count = modbus_read_registers(context_.get(), at.address, 1, &word);
  }
  const int error = errno;
  last_exchange_ = SteadyClock().now();
  if (count != 1) fail(error);
  return at.function <= MODBUS_FC_READ_DISCRETE_INPUTS ? std::uint16_t{bit} : word;
}

// libmodbus 3.1.6 does not compare the echo of a single write with the written value; the raw
// answer is compared here.
void ModbusBus::write(const RegisterAddress& at, std::uint16_t value) {
  LF_CHECK(is_open(), endpoint_text(transport_));
  begin_request();
  const std::vector<std::uint8_t> request = write_request(at, value);
  const std::vector<std::uint8_t> answer = answer_to(request);
  if (answer.size() >= 2 && answer[0] == (request[0] | 0x80)) {
    fail(MODBUS_ENOBASE + answer[1]);
  }
  if (answer.size() >= kEchoedBytes &&
      std::equal(answer.begin(), answer.begin() + kEchoedBytes, request.begin())) {
    return;
  }
  throw BusError(BusFault::kGarbled, "answered " + hex_text(answer.data(), answer.size()) + " to " +
                                         hex_text(request.data(), kEchoedBytes) +
                                         ", which it should have echoed");
}

/// @return the answer from its function code on; empty if another unit sent it.
std::vector<std::uint8_t> ModbusBus::answer_to(const std::vector<std::uint8_t>& request) {
  std::vector<std::uint8_t> raw{static_cast<std::uint8_t>(transport_.unit)};
  raw.insert(raw.end(), request.begin(), request.end());
  std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> answer{};
  const bool sent =
      modbus_send_raw_request(context_.get(), raw.data(), static_cast<int>(raw.size())) != -1;
  const int length = sent ? modbus_receive_confirmation(context_.get(), answer.data()) : -1;
  const int error = errno;
  last_exchange_ = SteadyClock().now();
  if (length < 0) fail(error);
  const int header = modbus_get_header_length(context_.get());
  const int end = transport_.is_tcp ? length : length - 2;
  if (end <= header || answer[static_cast<std::size_t>(header - 1)] != raw[0]) return {};
  return {answer.begin() + header, answer.begin() + end};
}

/// Discards bytes that belong to earlier requests.
void ModbusBus::begin_request() {
  SteadyClock clock;
  const double early = last_exchange_ + transport_.request_gap - clock.now();
  if (early > 0.0) clock.wait(early);
  discard();
}

void ModbusBus::fail(int error) const {
  if (error == ETIMEDOUT) {
    throw BusError(BusFault::kSilent,
                   "no answer within " + seconds_text(transport_.response_timeout));
  }
  const std::string reason = modbus_strerror(error);
  if (error > MODBUS_ENOBASE && error <= EMBXGTAR) {
    throw BusError(BusFault::kRefused, "refused: " + reason);
  }
  if (error > EMBXGTAR && error <= EMBBADSLAVE) {
    throw BusError(BusFault::kGarbled, "garbled answer: " + reason);
  }
  throw BusError(BusFault::kDown, "connection to " + endpoint_text(transport_) + ": " + reason);
}

namespace {

/// A serial adapter that was unplugged and came back answers only on a newly opened port, and does
/// not always report an error on the old one.
constexpr int kSilencesBeforeReopen = 3;

}  // namespace

BusSession::BusSession(std::unique_ptr<RegisterBus> bus, const BusTransport& transport,
                       Clock& clock)
    : bus_(std::move(bus)),
      transport_(transport),
      clock_(clock),
      not_before_(clock.now()),
      pause_(transport.reconnect_pause) {}

bool BusSession::ready() const { return clock_.now() >= not_before_; }

std::uint16_t BusSession::read(const RegisterAddress& at) {
  return exchange([&] { return bus_->read(at); });
}

void BusSession::write(const RegisterAddress& at, std::uint16_t value) {
  exchange([&] {
    bus_->write(at, value);
    return value;
  });
}

std::uint16_t BusSession::exchange(const std::function<std::uint16_t()>& exchange) {
  const double started = clock_.now();
  try {
    if (!bus_->is_open()) bus_->open();
    if (discard_first_) bus_->discard();
    discard_first_ = false;
    const std::uint16_t answer = exchange();
    silences_ = 0;
    pause_ = transport_.reconnect_pause;
    return answer;
  } catch (const BusError& error) {
    recover(error.fault(), started);
    throw;
  }
}

// Closing a TCP connection discards late answers; on an RTU line they have to be waited out. The
// response time-out is counted from the request, not from the failure: a simulated bus fails at
// once.
void BusSession::recover(BusFault fault, double started) {
  if (fault == BusFault::kRefused) return;
  if (fault == BusFault::kDown) return hang_up(clock_.now());
  const double waited = fault == BusFault::kSilent ? transport_.response_timeout : 0.0;
  const double given_up = std::max(clock_.now(), started + waited);
  ++silences_;
  if (transport_.is_tcp || silences_ >= kSilencesBeforeReopen) return hang_up(given_up);
  discard_first_ = true;
  not_before_ = given_up + transport_.late_answer_window;
}

void BusSession::hang_up(double from) {
  bus_->close();
  silences_ = 0;
  not_before_ = from + std::max(pause_, transport_.is_tcp ? 0.0 : transport_.late_answer_window);
  discard_first_ = true;
  pause_ = std::min(2.0 * pause_, transport_.reconnect_pause_max);
}

}  // namespace lensforge

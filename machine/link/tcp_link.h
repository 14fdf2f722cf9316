// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stop_token>
#include <string>
#include <string_view>

#include "core/io/descriptor.h"
#include "machine/link/link.h"
#include "machine/link/port_lock.h"
#include "machine/link/port_spec.h"

namespace lensforge {

/// A TCP connection to a controller, for one sender of this computer alone. Bytes go out as soon as
/// they are written (no Nagle delay); a peer that falls silent is found dead in about ten seconds.
class TcpLink : public Link {
 public:
  /// Connects, waiting at most `timeout` seconds for each address that the name stands for.
  /// @throw InputError if the name stands for nothing, another sender has the address, or nobody
  ///        answers there; Interrupted soon after `stop` asks for it.
  explicit TcpLink(const PortSpec& spec, const std::stop_token& stop = {}, double timeout = 5.0);

  std::string read(double wait) override;
  std::size_t write(std::string_view bytes) override;

 private:
  [[noreturn]] void lose(const std::string& why) const;

  std::string name_;
  PortLock lock_;
  Descriptor socket_;
};

}  // namespace lensforge

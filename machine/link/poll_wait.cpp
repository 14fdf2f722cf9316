// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/link/poll_wait.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>

namespace lensforge {

short wait_for(int descriptor, short events, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(std::max(seconds, 0.0));
  for (;;) {
    pollfd watched{descriptor, events, 0};
    const std::chrono::duration<double, std::milli> left = end - Clock::now();
    const int milliseconds = static_cast<int>(std::ceil(std::clamp(left.count(), 0.0, 1e6)));
    const int ready = ::poll(&watched, 1, milliseconds);
    if (ready > 0) return watched.revents;
    if (ready == 0 || errno != EINTR) return 0;
  }
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge {

/// Waits at most `seconds` until `descriptor` is ready for `events` (poll(2)); a signal does not
/// cut it short.
/// @return the events that came, 0 for none.
short wait_for(int descriptor, short events, double seconds);

}  // namespace lensforge

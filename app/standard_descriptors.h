// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace lensforge::app {

/// Occupies those of standard input, output and error that are closed, so that no file, port or
/// socket that is opened later takes their place and is written to by whatever prints. Reading and
/// writing them still fails. To be called before anything else; async-signal-safe.
void hold_standard_descriptors() noexcept;

}  // namespace lensforge::app

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text/version.h"

namespace lensforge {

std::string_view version() { return LENSFORGE_VERSION; }

std::string program_mark() { return "lensforge " + std::string(version()); }

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include "machine/stream/job_identity.h"

#include "machine/stream/program_file.h"

namespace lensforge {

JobIdentity identify_job(const std::filesystem::path& path) { return ProgramFile(path).identity(); }

}  // namespace lensforge

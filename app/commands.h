// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace lensforge::app {

using Arguments = std::vector<std::string>;

/// One subcommand each: `arguments` are those after its name; the result is the exit code.
/// @throw HelpText for --help and --version; InputError, RunError as the libraries do.
int design_command(const Arguments& arguments);
int render_command(const Arguments& arguments);
int cam_command(const Arguments& arguments);
int nest_command(const Arguments& arguments);
int coupon_command(const Arguments& arguments);
int export_command(const Arguments& arguments);
int send_command(const Arguments& arguments);
int reflect_command(const Arguments& arguments);
int view_command(const Arguments& arguments);
int batch_command(const Arguments& arguments);
int info_command(const Arguments& arguments);

}  // namespace lensforge::app

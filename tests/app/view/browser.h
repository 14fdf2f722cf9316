// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

/// Opens pages in a real browser: Debian's chromium, without a window and on a software renderer.
namespace lensforge::testing {

/// Result of a page.
struct PageRun {
  nlohmann::json result;              ///< What the script returned; null if it threw.
  std::string error;                  ///< What the script or the page threw.
  std::vector<std::string> console;   ///< Lines of the console: errors, warnings, notes.
  std::vector<std::string> requests;  ///< The page's requests.
};

/// True if there is a browser; tests are skipped without one.
bool has_browser();

/// Opens a copy of a page with `script` at its end, the body of an asynchronous function whose
/// result comes back as JSON. @param flags  further ones of the browser.
PageRun run_page(const std::filesystem::path& page, const std::string& script,
                 const std::string& flags = "");

}  // namespace lensforge::testing

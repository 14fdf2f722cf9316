// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/view/browser.h"

#include <array>
#include <cstdio>
#include <memory>
#include <string_view>
#include <utility>

#include "core/temp_folder.h"

namespace lensforge::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBrowser = "/usr/bin/chromium";
constexpr std::string_view kBegin = "RESULT:";
constexpr std::string_view kEnd = ":RESULT";

/// Runs the page's script and leaves what it returns as the page's only text.
constexpr std::string_view kFrame = R"(<script>
(async () => {
  let error = "", result = null;
  window.addEventListener("error", (e) => { error = error || String(e.message); });
  try {
    result = await (async () => { SCRIPT })();
  } catch (e) {
    error = error || String(e.stack || e);
  }
  const requests = performance.getEntriesByType("resource").map((entry) => entry.name)
    .filter((name) => !name.startsWith("data:"));
  document.body.textContent = "RESULT:" + JSON.stringify({ result, error, requests }) + ":RESULT";
})();
</script></body>)";

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string text;
  std::array<char, 65536> buffer{};
  while (pipe && !feof(pipe.get())) {
    text.append(buffer.data(), fread(buffer.data(), 1, buffer.size(), pipe.get()));
  }
  return text;
}

std::vector<std::string> console_lines(const std::string& log) {
  std::vector<std::string> lines;
  for (std::size_t at = log.find("CONSOLE"); at != std::string::npos;
       at = log.find("CONSOLE", at + 1)) {
    lines.push_back(log.substr(at, log.find('\n', at) - at));
  }
  return lines;
}

}  // namespace

bool has_browser() { return fs::exists(kBrowser); }

PageRun run_page(const fs::path& page, const std::string& script, const std::string& flags) {
  const TempFolder folder;
  const std::string html = read_bytes(page);
  const std::size_t end = html.rfind("</body>");
  write_bytes(folder / "page.html", html.substr(0, end) +
                                        replaced(std::string(kFrame), "SCRIPT", script) +
                                        html.substr(end + std::string_view("</body>").size()));
  const std::string command =
      "timeout 300 " + std::string(kBrowser) +
      " --headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
      " --enable-logging=stderr --v=0 --virtual-time-budget=600000 --window-size=1400,1000"
      " --user-data-dir=" +
      (folder / "profile").string() + " " + flags + " --dump-dom file://" +
      (folder / "page.html").string() + " 2>" + (folder / "log").string();
  const std::string dom = output_of(command);
  PageRun run;
  run.console = console_lines(read_bytes(folder / "log"));
  const std::size_t begin = dom.rfind(kBegin);
  const std::size_t stop = dom.rfind(kEnd);
  if (begin == std::string::npos || stop == std::string::npos || stop < begin) {
    run.error = "the page gave no result";
    return run;
  }
  std::string text = dom.substr(begin + kBegin.size(), stop - begin - kBegin.size());
  text = replaced(replaced(replaced(text, "&lt;", "<"), "&gt;", ">"), "&amp;", "&");
  const auto answer = nlohmann::json::parse(text);
  run.result = answer.at("result");
  run.error = answer.at("error").get<std::string>();
  run.requests = answer.at("requests").get<std::vector<std::string>>();
  return run;
}

}  // namespace lensforge::testing

// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/page/html_page.h"

#include <array>
#include <string_view>
#include <utility>

#include "core/page/html_text.h"
#include "core/text/version.h"
#include "page_files.h"

namespace lensforge {

std::string html_page(const PageContent& content) {
  const std::array<std::pair<std::string_view, std::string>, 8> values{{
      {"PROGRAM", program_mark()},
      {"TITLE", escape_html(content.title)},
      {"STYLE", std::string(page_files::kStyle)},
      {"HEAD", content.head},
      {"HEADER", content.header},
      {"BODY", content.body},
      {"FOOTER", content.footer},
      {"SCRIPT", content.script},
  }};
  return fill_in(page_files::kHtml, values);
}

}  // namespace lensforge

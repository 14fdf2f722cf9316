// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// Content of a page. All but the title are HTML and may be empty.
struct PageContent {
  std::string title;  ///< Text.
  std::string header;
  std::string body;
  std::string footer;
  std::string script;  ///< JavaScript.
  std::string head{};  ///< Added to the page's head, after the common style.
};

/// A self-contained page in the style of all reports.
std::string html_page(const PageContent& content);

}  // namespace lensforge

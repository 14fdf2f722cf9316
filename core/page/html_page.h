// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace lensforge {

/// What a page holds; all but the title are HTML, and empty where there is none.
struct PageContent {
  std::string title;  ///< Text.
  std::string header;
  std::string body;
  std::string footer;
  std::string script;  ///< JavaScript.
  std::string head{};  ///< Of the page's head, behind the style of all pages.
};

/// A page that needs nothing from outside, with the look of all of the program's reports.
std::string html_page(const PageContent& content);

}  // namespace lensforge

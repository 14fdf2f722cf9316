// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/report_html.h"

#include <array>
#include <string_view>
#include <utility>

#include "cam/report/html_text.h"
#include "cam/report/sections.h"
#include "core/text/version.h"
#include "report_page.h"

namespace lensforge {

double ReportData::minutes() const {
  double sum = 0.0;
  for (const ReportOperation& operation : operations) sum += operation.minutes;
  return sum;
}

std::string report_html(const ReportData& data) {
  namespace section = report_section;
  const std::array<std::pair<std::string_view, std::string>, 20> values{{
      {"TITLE", escape_html(data.job + " – cutting report")},
      {"PROGRAM", program_mark()},
      {"STYLE", std::string(report_page::kStyle)},
      {"HEADER", section::header(data)},
      {"PICTURES", section::pictures(data)},
      {"VERDICT", section::verdict(data)},
      {"PLACES", section::places(data)},
      {"WORK", section::work(data)},
      {"WARNINGS", section::warnings(data)},
      {"SETUP", section::setup(data)},
      {"OPERATIONS", section::operations(data)},
      {"CERTIFICATES", section::certificates(data)},
      {"LEAKAGE", section::leakage(data)},
      {"TOLERANCES", section::tolerances(data)},
      {"MAPS", section::maps(data)},
      {"VIEW", section::view(data)},
      {"CHOICES", section::choices(data)},
      {"PARAMETERS", section::parameters(data)},
      {"FOOTER", section::footer(data)},
      {"SCRIPT", std::string(report_page::kScript)},
  }};
  return fill_in(report_page::kHtml, values);
}

std::string compare_html(const ReportData& data) {
  namespace section = report_section;
  const std::array<std::pair<std::string_view, std::string>, 20> values{{
      {"TITLE", escape_html(data.job + " – choices compared")},
      {"PROGRAM", program_mark()},
      {"STYLE", std::string(report_page::kStyle)},
      {"HEADER", section::header(data)},
      {"PICTURES", ""},
      {"VERDICT", ""},
      {"PLACES", ""},
      {"WORK", ""},
      {"WARNINGS", ""},
      {"SETUP", ""},
      {"OPERATIONS", ""},
      {"CERTIFICATES", ""},
      {"LEAKAGE", ""},
      {"TOLERANCES", ""},
      {"MAPS", ""},
      {"VIEW", ""},
      {"CHOICES", section::choices(data)},
      {"PARAMETERS", section::parameters(data)},
      {"FOOTER", ""},
      {"SCRIPT", ""},
  }};
  return fill_in(report_page::kHtml, values);
}

}  // namespace lensforge

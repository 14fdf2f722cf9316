// SPDX-License-Identifier: GPL-3.0-or-later
#include "cam/report/report_html.h"

#include "cam/report/sections.h"
#include "core/page/html_page.h"
#include "core/page/html_text.h"
#include "report_page.h"

namespace lensforge {
namespace {

/// What is seen first.
std::string summary(const ReportData& data) {
  namespace section = report_section;
  const std::string panels =
      joined({section::verdict(data), section::places(data), section::work(data)});
  return element("section", "class=\"first\" aria-label=\"Summary\"",
                 section::pictures(data) + element("div", "class=\"panels\"", panels));
}

/// The page that draws the light: `view` writes it, so the command comes before the link.
std::string view_link(const ReportData& data) {
  if (data.leakage.steps.empty()) return "";
  const std::string lens = escape_html(data.job);
  return element(
      "p", "class=\"screen\"",
      joined({"After <code>lensforge view ", lens, " --out ", lens,
              "/view.html</code>: <a href=\"../view.html\">the light of this part, to be "
              "moved and asked</a>."}));
}

}  // namespace

double ReportData::minutes() const {
  double sum = 0.0;
  for (const ReportOperation& operation : operations) sum += operation.minutes;
  return sum;
}

std::string report_html(const ReportData& data) {
  namespace section = report_section;
  const std::string body = joined(
      {summary(data), section::warnings(data), section::setup(data), section::operations(data),
       section::certificates(data), section::leakage(data), section::tolerances(data),
       section::light(data), section::maps(data), section::view(data), view_link(data),
       section::choices(data), section::parameters(data)});
  return html_page({data.job + " – cutting report", section::header(data), body,
                    section::footer(data), std::string(surface_view_script())});
}

std::string surface_view_html(const ReportData& data) { return report_section::view(data); }

std::string_view surface_view_script() { return report_page::kScript; }

std::string compare_html(const ReportData& data) {
  namespace section = report_section;
  return html_page({data.job + " – choices compared", section::header(data),
                    section::choices(data) + section::parameters(data), "", ""});
}

}  // namespace lensforge

// SPDX-License-Identifier: GPL-3.0-or-later
#include <string>
#include <vector>

#include "cam/report/relief_picture.h"
#include "cam/report/sections.h"
#include "core/page/html_text.h"
#include "core/text/number_text.h"

namespace lensforge::report_section {
namespace {

using Row = std::vector<std::string>;

constexpr int kMaeDecimals = 4;

std::string stacked(const std::vector<TableColumn>& columns, const std::vector<Row>& rows) {
  return element("div", "class=\"stack\"", html_table(columns, rows));
}

/// What the programs leave without errors stands beside the exact forecast of the same part.
std::string quantile_table(const ToleranceForecast& forecast, const PictureQuality& part) {
  const auto mae = [](double value) { return decimal_text(value, kMaeDecimals); };
  const PartFigures& nominal = forecast.nominal;
  std::vector<Row> rows{{"MAE", mae(forecast.mae.p10), mae(forecast.mae.median),
                         mae(forecast.mae.p90), mae(nominal.mae), mae(part.metrics.mae)},
                        {"leakage", percent_text(forecast.leakage.p10),
                         percent_text(forecast.leakage.median), percent_text(forecast.leakage.p90),
                         percent_text(nominal.leakage), percent_text(part.leakage)}};
  if (forecast.has_dark) {
    rows.push_back({"contrast", contrast_text(forecast.contrast.p10),
                    contrast_text(forecast.contrast.median), contrast_text(forecast.contrast.p90),
                    contrast_text(nominal.contrast()), contrast_text(part.contrast())});
  }
  return stacked({{"figure", false},
                  {"1 of 10 parts below", true},
                  {"median", true},
                  {"9 of 10 parts below", true},
                  {"without errors", true},
                  {"by the forecast above", true}},
                 rows);
}

std::string signed_decimal(double value, int decimals) {
  const std::string text = decimal_text(value, decimals);
  return joined({value > 0.0 ? "+" : "", text});
}

std::string cause_table(const ToleranceForecast& forecast) {
  std::vector<Row> rows;
  for (const CauseEffect& effect : forecast.causes) {
    Row row{name_of(effect.cause), signed_decimal(effect.mae, kMaeDecimals + 1),
            "± " + decimal_text(effect.mae_error, kMaeDecimals + 1),
            signed_decimal(100.0 * effect.leakage, 3) + " %"};
    if (forecast.has_dark) row.push_back(contrast_text(contrast_with_half(forecast, effect)));
    rows.push_back(std::move(row));
  }
  std::vector<TableColumn> columns{{"half as much of", false},
                                   {"changes the MAE by", true},
                                   {"known to", true},
                                   {"the leakage by", true}};
  if (forecast.has_dark) columns.push_back({"median contrast", true});
  return stacked(columns, rows);
}

std::string spread_figure(const ToleranceForecast& forecast) {
  const double top = scale_top(forecast.deviation);
  const ColorImage picture =
      scaled_picture(forecast.deviation, forecast.columns, forecast.rows, top);
  const std::string caption =
      "<b>How much parts differ</b><br>Standard deviation of every pixel from part to part, as "
      "displayed (0 black, 1 white)" +
      html_scale("0", decimal_text(top, 3));
  return element("div", "class=\"map\" style=\"max-width:34rem\"",
                 html_figure(picture, "How much pixels differ", caption));
}

}  // namespace

std::string tolerances(const ReportData& data) {
  const ToleranceForecast& forecast = data.tolerances;
  if (forecast.empty()) return "";
  const std::string words = "Drawn: " + count_text(forecast.parts) +
                            " parts with random errors of machine, tool, polish, " +
                            "material and light, as the workshop’s [tolerances] state them (seed " +
                            std::to_string(forecast.seed) + "). To tell what matters, " +
                            count_text(forecast.paired) +
                            " of them were drawn again with half of each cause and all else the "
                            "same; “known to” is the " +
                            "standard error of that mean.";
  return element("section", "",
                 element("h2", "", "How sure is the forecast") +
                     element("p", "", element("b", "", escape_html(tolerance_words(forecast)))) +
                     quantile_table(forecast, data.leakage.part().quality) +
                     element("h3", "style=\"margin-top:1.2rem\"", "What matters") +
                     cause_table(forecast) +
                     element("div", "class=\"maps\"", spread_figure(forecast)) +
                     element("p", "class=\"soft\"", escape_html(words)));
}

}  // namespace lensforge::report_section

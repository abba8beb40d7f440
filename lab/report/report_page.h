#pragma once

#include <string_view>

// The parts of the page of `carom report`, as they are in lab/report/report_page, and Chart.js.
namespace carom::lab {

extern const std::string_view embedded_page_html;
extern const std::string_view embedded_page_css;
extern const std::string_view embedded_page_js;
extern const std::string_view embedded_chart_js;

}  // namespace carom::lab

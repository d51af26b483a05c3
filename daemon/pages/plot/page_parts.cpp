#include "daemon/pages/plot/page_parts.hpp"

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/marks.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {

std::string bench_badge(BenchKind kind) {
  return "<span class=\"badge\">" + std::string(bench_text(kind)) + "</span>";
}

std::string definition(std::string_view name, std::string_view value) {
  return "<dt>" + escape(name) + "</dt><dd>" +
         (value.empty() ? std::string(no_value) : escape(value)) + "</dd>\n";
}

std::string page_around(std::string_view title, std::string_view main_html) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
         escape(title) + "</title>\n<style>" + std::string(style_sheet()) +
         std::string(marks_style()) + std::string(scatter_style()) +
         "</style>\n</head>\n<body>\n<main>\n" + std::string(main_html) +
         "</main>\n</body>\n</html>\n";
}

}  // namespace weft::daemon

#include "daemon/pages/plot/html.hpp"

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

std::string cell(std::string_view tag, std::string_view html, std::string_view css_class) {
  std::string out = "<" + std::string(tag);
  if (!css_class.empty()) out += " class=\"" + std::string(css_class) + "\"";
  return out + ">" + std::string(html) + "</" + std::string(tag) + ">";
}

}  // namespace

HtmlTable::HtmlTable(std::vector<std::string> head_html, std::size_t figures_from)
    : figures_from_(figures_from), out_("<div class=\"scroll\"><table>\n<thead><tr>") {
  for (std::size_t i = 0; i < head_html.size(); ++i)
    out_ += cell("th", head_html[i], i >= figures_from_ ? "number" : "");
  out_ += "</tr></thead>\n<tbody>\n";
}

void HtmlTable::row(const std::vector<std::string>& cells_html, std::string_view css_class) {
  out_ += css_class.empty() ? "<tr>" : "<tr class=\"" + std::string(css_class) + "\">";
  for (std::size_t i = 0; i < cells_html.size(); ++i)
    out_ += cell(i == 0 ? "th" : "td", cells_html[i], i >= figures_from_ ? "number" : "");
  out_ += "</tr>\n";
}

std::string HtmlTable::finish() const {
  return out_ + "</tbody></table></div>\n";
}

std::string figure(std::string_view body_html, std::string_view caption_html,
                   std::string_view badge_html, std::string_view css_class) {
  std::string out = "<figure";
  if (!css_class.empty()) out += " class=\"" + std::string(css_class) + "\"";
  return out + ">\n" + std::string(body_html) + "<figcaption>" + std::string(badge_html) + " " +
         std::string(caption_html) + "</figcaption>\n</figure>\n";
}

std::string feature_html(std::string_view name) {
  const std::size_t first = name.find('.');
  if (first == std::string_view::npos) return escape(name);
  const std::size_t second = name.find('.', first + 1);
  const std::string_view phase = name.substr(first + 1, second - first - 1);
  std::string index(name.substr(0, first));
  if (second != std::string_view::npos) index += name.substr(second);
  return "<span class=\"feature\"><i>F</i><sup>" + escape(phase) + "</sup><sub>" + escape(index) +
         "</sub></span>";
}

}  // namespace weft::daemon

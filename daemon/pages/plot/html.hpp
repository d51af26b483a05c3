#pragma once
// Pieces of a page. Arguments named `html` are markup already; all others are escaped.

#include <string>
#include <string_view>
#include <vector>

namespace weft::daemon {

/// The page's style sheet.
std::string_view style_sheet();

/// A table whose first column names the row.
class HtmlTable {
 public:
  /// `head_html`: one cell per column. `figures_from`: the column from which on cells hold numbers.
  HtmlTable(std::vector<std::string> head_html, std::size_t figures_from = 1);
  void row(const std::vector<std::string>& cells_html, std::string_view css_class = {});
  [[nodiscard]] std::string finish() const;

 private:
  std::size_t figures_from_;
  std::string out_;
};

/// <figure> with the bench's badge in its caption: no picture or table can be cut out without it.
std::string figure(std::string_view body_html, std::string_view caption_html,
                   std::string_view badge_html, std::string_view css_class = {});

/// "range.M.4" as F with indices, as the paper writes it.
std::string feature_html(std::string_view name);

}  // namespace weft::daemon

#include "daemon/pages/document/document.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "daemon/pages/plot/style.hpp"

namespace weft::daemon {
namespace {

std::string element(std::string_view tag, std::string_view html, std::string_view css_class = {}) {
  std::string out = "<" + std::string(tag);
  if (!css_class.empty()) out += " class=\"" + escape(css_class) + "\"";
  return out + ">" + std::string(html) + "</" + std::string(tag) + ">";
}

Block block_of(BlockKind kind, std::string html = {}, Blocks blocks = {}) {
  Block out;
  out.kind = kind;
  out.html = std::move(html);
  out.blocks = std::move(blocks.list);
  return out;
}

Blocks unless_empty(Block block) {
  const bool is_empty =
      block.html.empty() && block.blocks.empty() && block.rows.empty() && !block.chart;
  return is_empty ? Blocks{} : Blocks(std::move(block));
}

std::string render_all(const std::vector<Block>& blocks);

std::string render_table(const Block& block) {
  std::string out = "<div class=\"scroll\" tabindex=\"0\"><table>\n<thead>";
  for (std::size_t r = 0; r < block.rows.size(); ++r) {
    const std::string css = r > 0 && r - 1 < block.classes.size() ? block.classes[r - 1] : "";
    out += css.empty() ? "<tr>" : "<tr class=\"" + escape(css) + "\">";
    for (std::size_t i = 0; i < block.rows[r].size(); ++i)
      out += element(r == 0 || i == 0 ? "th" : "td", block.rows[r][i],
                     i >= block.numbers_from ? "number" : "");
    out += r == 0 ? "</tr></thead>\n<tbody>\n" : "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string render_rows(const Block& block) {
  std::string out;
  for (const auto& row : block.rows) {
    const std::string first = row.empty() ? "" : row[0], second = row.size() < 2 ? "" : row[1];
    if (block.kind == BlockKind::list) out += "<li>" + first + "</li>\n";
    if (block.kind == BlockKind::tiles)
      out += "<div class=\"tile\"><b>" + escape(first) + "</b><span>" + escape(second) +
             "</span></div>\n";
    if (block.kind == BlockKind::definitions)
      out += "<dt>" + escape(first) + "</dt><dd>" +
             (second.empty() ? std::string(no_value) : escape(second)) + "</dd>\n";
  }
  if (block.kind == BlockKind::list) return "<ul>\n" + out + "</ul>\n";
  if (block.kind == BlockKind::tiles) return "<div class=\"tiles\">\n" + out + "</div>\n";
  return "<dl>\n" + out + "</dl>\n";
}

std::string render_box(const Block& block) {
  const std::string inside =
      block.html.empty() ? render_all(block.blocks) : "<p>" + block.html + "</p>";
  return element("div", inside, block.kind == BlockKind::alarm ? "note alarm" : "note") + "\n";
}

std::string render_section(const Block& block) {
  return "<section" + (block.id.empty() ? "" : " id=\"" + escape(block.id) + "\"") + ">\n<h2>" +
         escape(block.title) + "</h2>\n" + render_all(block.blocks) + "</section>\n";
}

std::string render(const Block& block) {
  switch (block.kind) {
    case BlockKind::section:
      return render_section(block);
    case BlockKind::paragraph:
      return "<p>" + block.html + "</p>\n";
    case BlockKind::badges:
      return block.html + "\n";
    case BlockKind::note:
    case BlockKind::alarm:
      return render_box(block);
    case BlockKind::list:
    case BlockKind::tiles:
    case BlockKind::definitions:
      return render_rows(block);
    case BlockKind::table:
      return render_table(block);
    case BlockKind::code:
      return "<pre>" + escape(block.title) + "</pre>\n";
    case BlockKind::chart:
      return block.chart
                 ? "<div class=\"scroll\" tabindex=\"0\">" + chart::draw(*block.chart) + "</div>\n"
                 : "";
    case BlockKind::figure:
      return "<figure>\n" + render_all(block.blocks) + "<figcaption>" + block.html +
             "</figcaption>\n</figure>\n";
    case BlockKind::details:
      return "<details><summary>" + escape(block.title) + "</summary>\n" +
             render_all(block.blocks) + "</details>\n";
    case BlockKind::columns:
      return "<div class=\"pair\">\n" + render_all(block.blocks) + "</div>\n";
  }
  return {};
}

std::string render_all(const std::vector<Block>& blocks) {
  std::string out;
  for (const Block& one : blocks) out += render(one);
  return out;
}

std::string folded(const char* title, const char* id, const Blocks& blocks) {
  if (blocks.empty()) return {};
  return "<section id=\"" + std::string(id) + "\">\n<details><summary><h2>" + title +
         "</h2></summary>\n" + render_all(blocks.list) + "</details>\n</section>\n";
}

/// A text of a style sheet. Letters and digits stay as they are, other printable characters become
/// numbers: no name can end the text.
std::string css_text(std::string_view text) {
  constexpr std::string_view plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-,";
  std::string out = "\"";
  for (const char c : text) {
    char number[8] = "?";
    if (c >= ' ' && c <= '~')
      std::snprintf(number, sizeof number, "\\%x ", static_cast<unsigned>(c));
    out += plain.find(c) != std::string_view::npos ? std::string(1, c) : number;
  }
  return out + "\"";
}

/// For print: title and badge at the head of every page.
std::string paper_style(const Document& document) {
  return "@page{size:A4;margin:18mm 14mm 16mm;@top-left{content:" + css_text(document.title) +
         ";font:8pt sans-serif}@top-right{content:" + css_text(document.badge) +
         ";font:bold 8pt sans-serif}"
         "@bottom-right{content:counter(page) \" / \" counter(pages);font:8pt sans-serif}}\n";
}

}  // namespace

std::string render(const Document& document) {
  const std::string heading =
      "<header>" + (document.badge.empty() ? "" : badge_markup(document.badge)) + "\n<h1>" +
      escape(document.title) + "</h1>\n" +
      (document.lead_html.empty() ? "" : "<p class=\"lead\">" + document.lead_html + "</p>\n") +
      "</header>\n";
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>" +
         escape(document.title) +
         (document.badge.empty() ? "" : " (" + escape(document.badge) + ")") + "</title>\n<style>" +
         style_sheet() + paper_style(document) + "</style>\n</head>\n<body>\n" +
         "<main class=\"weft-page\">\n" + heading + render_all(document.alerts.list) +
         render_all(document.result.list) + render_all(document.pictures.list) +
         render_all(document.tables.list) + folded("Method", "method", document.method) +
         folded("Provenance", "provenance", document.provenance) + "</main>\n</body>\n</html>\n";
}

std::string render(const Blocks& blocks) {
  return render_all(blocks.list);
}

Blocks paragraph(std::string html) {
  return unless_empty(block_of(BlockKind::paragraph, std::move(html)));
}

Blocks note(std::string html) {
  return unless_empty(block_of(BlockKind::note, std::move(html)));
}

Blocks note(Blocks blocks) {
  return unless_empty(block_of(BlockKind::note, {}, std::move(blocks)));
}

Blocks alarm(std::string html) {
  return unless_empty(block_of(BlockKind::alarm, std::move(html)));
}

Blocks bullet_list(const std::vector<std::string>& items_html) {
  Block out = block_of(BlockKind::list);
  for (const std::string& item : items_html) out.rows.push_back({item});
  return unless_empty(std::move(out));
}

Blocks tiles(std::vector<std::vector<std::string>> values_and_captions) {
  Block out = block_of(BlockKind::tiles);
  out.rows = std::move(values_and_captions);
  return unless_empty(std::move(out));
}

Blocks definitions(const std::vector<std::pair<std::string, std::string>>& entries) {
  Block out = block_of(BlockKind::definitions);
  for (const auto& [name, value] : entries) out.rows.push_back({name, value});
  return unless_empty(std::move(out));
}

Blocks warnings_of(const std::vector<std::pair<std::string, std::string>>& facts) {
  constexpr std::array others{"groups on both sides", "never tested"};
  Blocks out;
  for (const auto& [name, value] : facts) {
    const bool in_capitals = std::ranges::all_of(name, [](char c) { return c >= 'A' && c <= 'Z'; });
    if (in_capitals || value.starts_with("LEAK") || std::ranges::find(others, name) != others.end())
      out += alarm("<b>" + escape(name) + ":</b> " + escape(value));
  }
  return out;
}

Blocks code_block(std::string text) {
  Block out = block_of(BlockKind::code);
  out.title = std::move(text);
  return out;
}

Blocks picture(chart::Chart chart) {
  Block out = block_of(BlockKind::chart);
  out.chart = std::move(chart);
  return out;
}

Blocks figure(Blocks blocks, std::string_view caption_html, std::string_view badge_html) {
  if (blocks.empty()) return {};
  return block_of(BlockKind::figure, std::string(badge_html) + " " + std::string(caption_html),
                  std::move(blocks));
}

Blocks details(std::string summary, Blocks blocks) {
  if (blocks.empty()) return {};
  Block out = block_of(BlockKind::details, {}, std::move(blocks));
  out.title = std::move(summary);
  return out;
}

Blocks side_by_side(Blocks blocks) {
  return unless_empty(block_of(BlockKind::columns, {}, std::move(blocks)));
}

Blocks section(std::string title, Blocks blocks, std::string id) {
  if (blocks.empty()) return {};
  Block out = block_of(BlockKind::section, {}, std::move(blocks));
  out.title = std::move(title);
  out.id = std::move(id);
  return out;
}

HtmlTable::HtmlTable(std::vector<std::string> head_html, std::size_t numbers_from)
    : block_(block_of(BlockKind::table)) {
  block_.numbers_from = numbers_from;
  block_.rows.push_back(std::move(head_html));
}

void HtmlTable::row(std::vector<std::string> cells_html, std::string css_class) {
  block_.rows.push_back(std::move(cells_html));
  block_.classes.push_back(std::move(css_class));
}

std::string badge_markup(std::string_view text) {
  return "<span class=\"badge\">" + escape(text) + "</span>";
}

std::string bench_badge(BenchKind kind) {
  return badge_markup(bench_text(kind));
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

#pragma once
// The skeleton of all pages that show results. A document is data: it is written as JSON and
// rendered from that JSON alone, to the same bytes. Pure; any thread.
//
// Strings named `html` are inline markup (b, i, code, sub, sup, br, span, and links within the
// page); all others are plain text and are escaped.

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/chart.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

enum class BlockKind {
  section,      ///< `title`, `blocks`
  paragraph,    ///< `html`
  note,         ///< `html` or `blocks`, in a box
  alarm,        ///< as note, in the colour of errors
  badges,       ///< `html` only
  list,         ///< `rows` of one cell
  tiles,        ///< `rows` of a value and its name, plain
  table,        ///< `rows` of markup, the first is the head; `classes` of the others
  definitions,  ///< `rows` of a name and its value, plain
  code,         ///< `title` unchanged, in lines
  chart,        ///< `chart`
  figure,       ///< `blocks` with the caption `html`, which starts with a badge
  details,      ///< `blocks`, folded under `title`
  columns       ///< `blocks` side by side if there is room
};

struct Block {
  BlockKind kind = BlockKind::paragraph;
  std::string title{};
  std::string id{};  ///< of a section, for links: letters and "-"
  std::string html{};
  std::vector<std::vector<std::string>> rows{};
  std::vector<std::string> classes{};
  std::size_t numbers_from = 1;  ///< first column with numbers in a table
  std::optional<chart::Chart> chart{};
  std::vector<Block> blocks{};
};

/// A list of blocks; append with +=.
struct Blocks {
  std::vector<Block> list;

  Blocks() = default;
  Blocks(Block one) { list.push_back(std::move(one)); }  // NOLINT(google-explicit-constructor)
  [[nodiscard]] bool empty() const { return list.empty(); }
  Blocks& operator+=(Blocks more) {
    for (Block& one : more.list) list.push_back(std::move(one));
    return *this;
  }
  friend Blocks operator+(Blocks a, Blocks b) { return a += std::move(b); }
};

/// Members are in the order of the page.
struct Document {
  std::string kind{};       ///< "campaign", "evaluation", ...
  std::string title{};      ///< heading, browser title, head of printed pages
  std::string badge{};      ///< "SIMULATED", with missing parts: "SIMULATED, INCOMPLETE, 1 of 2"
  std::string lead_html{};  ///< one line below the title
  Blocks alerts{};          ///< errors and missing parts, one line each
  Blocks result{};          ///< the headline and the confusion matrix
  Blocks pictures{};
  Blocks tables{};
  Blocks method{};      ///< method and its limits; folded
  Blocks provenance{};  ///< folded
};

/// The whole page: no scripts, no outside resources, XML except for its doctype. Its style also
/// applies in a shadow root with the children of <body> and the <style>.
std::string render(const Document& document);

/// The markup of blocks, without a page around them.
std::string render(const Blocks& blocks);

/// Keys are the names of the members; NaN is null.
nlohmann::ordered_json document_json(const Document& document);
/// Errors: parse, with the place of an unknown key, a wrong type or markup that is not inline.
Result<Document> document_from(const nlohmann::ordered_json& json);

/// `record` with the document under "page" on its last line, then a newline.
std::string record_with_page(const nlohmann::ordered_json& record, const Document& document);
/// Writes both files of a report: the page `html`, and beside it its record with the ending .json.
/// Each is written whole or not at all. Errors: io.
Status write_page(const std::filesystem::path& html, const nlohmann::ordered_json& record,
                  const Document& document);

/// The page of such a record. Errors: parse; not_found if it has no page.
Result<std::string> page_of_record(std::string_view record);

/// Whether it is balanced inline markup as defined above.
bool is_inline_markup(std::string_view html);

// Builders. Empty content makes no block.

Blocks paragraph(std::string html);
Blocks note(std::string html);
Blocks note(Blocks blocks);
Blocks alarm(std::string html);
Blocks bullet_list(const std::vector<std::string>& items_html);
Blocks tiles(std::vector<std::vector<std::string>> values_and_captions);
/// Shows an empty value as a dash.
Blocks definitions(const std::vector<std::pair<std::string, std::string>>& entries);
/// An alarm for each entry that warns: a name in capitals ("WARNING", "CONFOUNDED", "LEAK"), or
/// trials on both sides of a split or never tested.
Blocks warnings_of(const std::vector<std::pair<std::string, std::string>>& facts);
Blocks code_block(std::string text);
Blocks picture(chart::Chart chart);
/// The caption has the badge, so that no picture or table can be cut out without it.
Blocks figure(Blocks blocks, std::string_view caption_html, std::string_view badge_html);
Blocks details(std::string summary, Blocks blocks);
Blocks side_by_side(Blocks blocks);
Blocks section(std::string title, Blocks blocks, std::string id = {});

/// A table with row names in the first column.
class HtmlTable {
 public:
  /// `head_html`: one cell per column. `numbers_from`: first column with numbers.
  HtmlTable(std::vector<std::string> head_html, std::size_t numbers_from = 1);
  void row(std::vector<std::string> cells_html, std::string css_class = {});
  [[nodiscard]] Blocks finish() const { return block_; }

 private:
  Block block_;
};

/// "SIMULATED" or another badge text, in a box.
std::string badge_markup(std::string_view text);
std::string bench_badge(BenchKind kind);
inline std::string simulated_badge() {
  return bench_badge(BenchKind::simulated);
}
/// "range.M.4" as F with indices, as the paper writes it.
std::string feature_html(std::string_view name);

}  // namespace weft::daemon

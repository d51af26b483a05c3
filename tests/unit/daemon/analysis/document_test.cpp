// Charts and pages as data: drawings fit, and a record gives the same page again.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "daemon/pages/document/confusion.hpp"
#include "daemon/pages/document/document.hpp"
#include "daemon/pages/plot/text_layout.hpp"
#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace document_test {

using namespace weft::daemon;
using report_test::count_of;

namespace {

struct Text {
  std::string shown;
  svg::Box box;
};

/// Size of a text by its class, from the style sheet.
double size_of(const std::string& css_class) {
  std::smatch found;
  const std::string sheet = svg::text_style_sheet();
  const std::string name = css_class.substr(0, css_class.find(' '));
  REQUIRE(std::regex_search(sheet, found, std::regex("svg ." + name + "\\{font-size:([0-9.]+)px")));
  return std::stod(found[1]);
}

/// Boxes from the markup only, with a character width that is wide for most characters.
std::vector<Text> texts_of(const std::string& markup) {
  static const std::regex text(
      R"re(<text class="([^"]*)" x="([-0-9.]+)" y="([-0-9.]+)"( text-anchor="(\w+)")?( transform[^>]*)?>(<title>[^<]*</title>)?([^<]*)</text>)re");
  std::vector<Text> out;
  for (auto it = std::sregex_iterator(markup.begin(), markup.end(), text);
       it != std::sregex_iterator(); ++it) {
    const double px = size_of((*it)[1]), x = std::stod((*it)[2]), y = std::stod((*it)[3]);
    const std::string shown = (*it)[8], anchor = (*it)[5];
    const double width = 0.5 * px * static_cast<double>(shown.size());
    const double before = anchor == "middle" ? width / 2 : anchor == "end" ? width : 0;
    out.push_back({shown, (*it)[6].matched ? svg::Box{x - px, y - width + before, px, width}
                                           : svg::Box{x - before, y - px, width, px}});
  }
  return out;
}

void check_texts(const std::string& markup) {
  std::smatch size;
  REQUIRE(std::regex_search(markup, size, std::regex("viewBox=\"0 0 ([0-9.]+) ([0-9.]+)\"")));
  const double width = std::stod(size[1]), height = std::stod(size[2]);
  const std::vector<Text> all = texts_of(markup);
  CHECK(all.size() == count_of(markup, "<text"));
  for (std::size_t i = 0; i < all.size(); ++i) {
    const svg::Box& a = all[i].box;
    INFO(all[i].shown);
    CHECK((a.x > -1 && a.y > -1 && a.x + a.width < width + 1 && a.y + a.height < height + 1));
    for (std::size_t k = i + 1; k < all.size(); ++k) {
      const svg::Box& b = all[k].box;
      INFO(all[k].shown);
      CHECK_FALSE((a.x + 1 < b.x + b.width && b.x + 1 < a.x + a.width && a.y + 1 < b.y + b.height &&
                   b.y + 1 < a.y + a.height));
    }
  }
}

std::vector<std::string> labels(std::size_t count) {
  std::vector<std::string> out;
  for (std::size_t i = 0; i < count; ++i)
    out.push_back(std::string(i % 40, i % 2 == 0 ? 'W' : 's') + std::to_string(i));
  return out;
}

weft::classifier::Confusion confusion_of(std::size_t count) {
  weft::classifier::Confusion out(labels(count));
  for (std::size_t t = 0; t < count; ++t)
    for (std::size_t p = 0; p < count; ++p) out.at(t, p) = t == p ? 100 : (t * 5 + p) % 7;
  return out;
}

chart::Plot hard_plot() {
  chart::Plot out{"words", "SIMULATED", 2};
  out.area_name = "band";
  out.front_name = "front";
  for (int k = 0; k < 3; ++k) {
    chart::Panel panel{"a title that is far too long for the width of one panel of two, surely",
                       {.title = "an axis"},
                       {.title = "another"}};
    panel.limits = {{0.5, "target 90 %"}, {0.505, "target 91 %"}};
    panel.spans = {{0, 1, "S"}, {1, 1.05, "P"}, {1.05, 3, "M"}};
    panel.areas = {{1, 2, 0.4, 0.6, "12", true}};
    for (std::size_t f = 0; f < 9; ++f) {
      chart::Series series{"family number " + std::to_string(f), f, chart::Line::solid};
      for (int i = 0; i < 4; ++i)
        series.points.push_back({0.7 * i, 0.5 + 0.001 * i, 0.45, 0.55, "a name", i % 2 == 0});
      panel.series.push_back(std::move(series));
    }
    out.panels.push_back(std::move(panel));
  }
  return out;
}

Document whole_document() {
  Document out{"test", "A <title>", "SIMULATED"};
  out.lead_html = "a <b>lead</b>";
  out.alerts = alarm("wrong") + note(paragraph("note"));
  chart::Plot plot = hard_plot();
  plot.panels[0].series[0].points.push_back({chart::no_number, chart::no_number});
  out.result = section("Result", confusion_pictures(confusion_of(3), "m"), "result");
  out.pictures = figure(picture(plot), "caption", bench_badge(BenchKind::simulated)) +
                 picture(chart::Rows{.words = "rows",
                                     .value_name = "v",
                                     .rows = {{"one", chart::no_number, 0.2, 0.3, {0.4}}}}) +
                 picture(chart::Maps{"maps", {{"tile", "note", 2, "0f3a"}}}) +
                 picture(chart::Shares{"shares", {{"a", 1.5}, {"b", 2.5}}});
  HtmlTable table({"a", "b"}, 0);
  table.row({"<i>1</i>", "2"}, "on-front");
  out.tables = side_by_side(table.finish() + tiles({{"1", "2"}}) + bullet_list({"x", "y"}));
  out.method = details("more", definitions({{"a", ""}, {"b", "c"}})) + code_block("x\n y <z>");
  out.provenance = paragraph("end");
  return out;
}

}  // namespace

TEST_CASE("no text of a picture overlaps another or leaves it") {
  for (const std::size_t count : {1U, 2U, 3U, 17U, 50U}) {
    CAPTURE(count);
    const auto confusion = confusion_of(count);
    check_texts(chart::draw(confusion_cells(confusion, "title", order_by_errors(confusion))));
    chart::Rows rows{.words = "rows", .x = {.title = "accuracy [%]"}, .value_name = "value"};
    chart::Maps maps;
    for (const std::string& label : confusion.labels) {
      rows.rows.push_back({label, 0.5, 0.4, 0.6});
      maps.tiles.push_back({label, label, 1, "3"});
    }
    check_texts(chart::draw(rows));
    check_texts(chart::draw(maps));
  }
  check_texts(chart::draw(hard_plot()));
}

TEST_CASE("shortened labels that differ stay different, and the whole is a tool tip") {
  std::vector<std::string> all{"sandpaper_of_grain_60", "sandpaper_of_grain_80"};
  for (int i = 0; i < 20; ++i)
    all.push_back(std::string(30, 'x') + std::to_string(i) + std::string(30, 'y'));
  const auto shown = svg::shorten_labels(all, 60, svg::text::tick);
  CHECK(std::set<std::string>(shown.begin(), shown.end()).size() == all.size());
  for (const std::string& one : shown) CHECK(svg::text_width(one, svg::text::tick) <= 60);
  weft::classifier::Confusion confusion({all[2], all[3]});
  confusion.at(0, 0) = confusion.at(1, 1) = 1;
  const std::string drawn = chart::draw(confusion_cells(confusion, "t", {0, 1}));
  CHECK(count_of(drawn, "<title>" + all[2] + "</title>") == 2);
}

TEST_CASE("the second order of a matrix has the row with most errors first") {
  weft::classifier::Confusion confusion({"a", "b", "c"});
  confusion.at(0, 0) = 9;
  confusion.at(1, 2) = 1;
  confusion.at(2, 0) = 4;
  CHECK(order_by_errors(confusion) == std::vector<std::size_t>{2, 1, 0});
  const Blocks blocks = confusion_pictures(confusion, "m");
  REQUIRE(blocks.list.size() == 2);
  CHECK(blocks.list[1].kind == BlockKind::details);
  confusion.at(2, 0) = confusion.at(1, 2) = 0;
  CHECK(confusion_pictures(confusion, "m").list.size() == 1);
}

TEST_CASE("a record gives the page that was written beside it, whatever it holds") {
  const Document document = whole_document();
  const std::string record = record_with_page({{"key", 1}}, document);
  const auto json = nlohmann::ordered_json::parse(record);
  CHECK(json["key"] == 1);
  const auto again = document_from(json["page"]);
  REQUIRE(again);
  CHECK(document_json(*again) == json["page"]);
  CHECK(page_of_record(record).value() == render(document));
  CHECK(report_test::unbalanced(render(document)) == "");
  for (const char* tag : {"<main class=\"weft-page\">", "<ul>", "<dl>", "<pre>", "<table>",
                          "class=\"map-level\"", "share-2", "on-front"})
    CHECK(render(document).find(tag) != std::string::npos);
}

TEST_CASE("what is no record of a page is refused with its place") {
  CHECK(page_of_record("[]").error().code == weft::Errc::parse);
  CHECK(page_of_record("{\"a\": 1}").error().code == weft::Errc::not_found);
  const auto refused = [](const char* path, const nlohmann::ordered_json& value) {
    auto json = document_json(whole_document());
    json[nlohmann::ordered_json::json_pointer(path)] = value;
    const auto document = document_from(json);
    REQUIRE_FALSE(document);
    CHECK(document.error().code == weft::Errc::parse);
    return document.error().where;
  };
  CHECK(refused("/title", 3) == "page.title");
  CHECK(refused("/unknown", 3) == "page");
  CHECK(refused("/lead_html", "<script>") == "page.lead_html");
  CHECK(refused("/pictures/0/html", "<img>") == "page.pictures[0].html");
  CHECK(refused("/pictures/0/blocks/0/chart/chart", "pie") == "page.pictures[0].blocks[0].chart");
  CHECK(refused("/pictures/0/blocks/0/chart/chart", 5) == "page.pictures[0].blocks[0].chart");
  refused("/tables/0/blocks/0/rows/1/0", "<script>alert(1)</script>");
  nlohmann::ordered_json nested = {{"kind", "paragraph"}, {"html", "x"}};
  for (int depth = 0; depth < 1000; ++depth)
    nested = {
        {"kind", "details"}, {"title", "y"}, {"blocks", nlohmann::ordered_json::array({nested})}};
  refused("/pictures/0", nested);
}

TEST_CASE("warnings are at the top of a page") {
  const Blocks warnings = warnings_of({{"data", "two.h5"},
                                       {"CONFOUNDED", "label and mounting are one"},
                                       {"leak", "LEAK: 3 % of the windows"},
                                       {"never tested", "felt"},
                                       {"split", "at random"}});
  REQUIRE(warnings.list.size() == 3);
  for (const Block& one : warnings.list) CHECK(one.kind == BlockKind::alarm);
  CHECK(warnings_of({{"leak", "No sample of a test window is in a training window."}}).empty());
}

TEST_CASE("inline markup is a few tags, closed in order, without a target elsewhere") {
  for (const char* good :
       {"", "a &lt; b &#8722;", "<b>x</b>", "<span class=\"paper\">y</span>",
        "<a href=\"#method\">z</a>", "F<sup>M</sup><br/>", "<span title=\"a &amp; b\">c</span>"})
    CHECK(is_inline_markup(good));
  for (const char* bad : {"<script>x</script>", "<b>x", "</b>", "<b><i>x</b></i>", "a > b", "a & b",
                          "&unknown;", "<a href=\"http://x\">y</a>", "<b onclick=\"x\">y</b>",
                          "<img/>", "<span class=x>y</span>", "<b", "<svg>x</svg>", "<p>x</p>"})
    CHECK_FALSE(is_inline_markup(bad));
}

}  // namespace document_test

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

// Each struct is described once, by its members' names; Writer and Reader iterate over them.

constexpr std::array<std::string_view, 14> block_names{
    "section", "paragraph",   "note", "alarm", "badges", "list",    "tiles",
    "table",   "definitions", "code", "chart", "figure", "details", "columns"};
constexpr std::array<std::string_view, 4> line_names{"none", "solid", "thin", "dashed"};
constexpr std::array<std::string_view, 3> cell_names{"empty", "hit", "miss"};
constexpr std::array<std::string_view, 5> chart_names{"plot", "rows", "cells", "maps", "shares"};

const auto& names_of(BlockKind) {
  return block_names;
}
const auto& names_of(chart::Line) {
  return line_names;
}
const auto& names_of(chart::CellKind) {
  return cell_names;
}

template <class V>
void describe(V& v, const chart::Series*) {
  using T = chart::Series;
  v("name", &T::name), v("family", &T::family), v("line", &T::line), v("marks", &T::marks);
  v("points", &T::points);
}
template <class V>
void describe(V& v, const chart::Axis*) {
  using T = chart::Axis;
  v("title", &T::title), v("logarithmic", &T::logarithmic), v("low", &T::low), v("high", &T::high);
  v("seconds", &T::seconds), v("names", &T::names);
}
template <class V>
void describe(V& v, const chart::Span*) {
  using T = chart::Span;
  v("from", &T::from), v("to", &T::to), v("name", &T::name);
}
template <class V>
void describe(V& v, const chart::Area*) {
  using T = chart::Area;
  v("x_from", &T::x_from), v("x_to", &T::x_to), v("y_from", &T::y_from), v("y_to", &T::y_to);
  v("label", &T::label), v("bar", &T::bar);
}
template <class V>
void describe(V& v, const chart::Limit*) {
  using T = chart::Limit;
  v("value", &T::value), v("label", &T::label), v("diagonal", &T::diagonal);
}
template <class V>
void describe(V& v, const chart::Panel*) {
  using T = chart::Panel;
  v("title", &T::title), v("x", &T::x), v("y", &T::y), v("spans", &T::spans), v("areas", &T::areas);
  v("series", &T::series), v("limits", &T::limits);
}
template <class V>
void describe(V& v, const chart::Plot*) {
  using T = chart::Plot;
  v("words", &T::words), v("stamp", &T::stamp), v("columns", &T::columns), v("width", &T::width);
  v("panel_height", &T::panel_height), v("shared_x", &T::shared_x), v("shared_y", &T::shared_y);
  v("area_name", &T::area_name), v("front_name", &T::front_name), v("panels", &T::panels);
}
template <class V>
void describe(V& v, const chart::Row*) {
  using T = chart::Row;
  v("name", &T::name), v("value", &T::value), v("low", &T::low), v("high", &T::high),
      v("marks", &T::marks);
}
template <class V>
void describe(V& v, const chart::Rows*) {
  using T = chart::Rows;
  v("words", &T::words), v("x", &T::x), v("value_name", &T::value_name),
      v("mark_names", &T::mark_names);
  v("limit_name", &T::limit_name), v("limit", &T::limit), v("bars", &T::bars),
      v("width", &T::width);
  v("rows", &T::rows);
}
template <class V>
void describe(V& v, const chart::Cell*) {
  using T = chart::Cell;
  v("row", &T::row), v("column", &T::column), v("text", &T::text), v("second", &T::second);
  v("shade", &T::shade), v("kind", &T::kind), v("marked", &T::marked);
}
template <class V>
void describe(V& v, const chart::Cells*) {
  using T = chart::Cells;
  v("words", &T::words), v("title", &T::title), v("x_title", &T::x_title),
      v("y_title", &T::y_title);
  v("columns", &T::columns), v("rows", &T::rows), v("notes_title", &T::notes_title);
  v("row_notes", &T::row_notes), v("cells", &T::cells);
}
template <class V>
void describe(V& v, const chart::Tile*) {
  using T = chart::Tile;
  v("title", &T::title), v("note", &T::note), v("columns", &T::columns), v("levels", &T::levels);
}
template <class V>
void describe(V& v, const chart::Maps*) {
  using T = chart::Maps;
  v("words", &T::words), v("tiles", &T::tiles);
}
template <class V>
void describe(V& v, const std::pair<std::string, double>*) {
  using T = std::pair<std::string, double>;
  v("name", &T::first), v("part", &T::second);
}
template <class V>
void describe(V& v, const chart::Shares*) {
  using T = chart::Shares;
  v("words", &T::words), v("parts", &T::parts);
}
template <class V>
void describe(V& v, const Block*) {
  using T = Block;
  v("kind", &T::kind), v("title", &T::title), v("id", &T::id), v("html", &T::html),
      v("rows", &T::rows);
  v("classes", &T::classes), v("numbers_from", &T::numbers_from), v("chart", &T::chart);
  v("blocks", &T::blocks);
}
template <class V>
void describe(V& v, const Document*) {
  using T = Document;
  v("kind", &T::kind), v("title", &T::title), v("badge", &T::badge), v("lead_html", &T::lead_html);
  v("alerts", &T::alerts), v("result", &T::result), v("pictures", &T::pictures);
  v("tables", &T::tables), v("method", &T::method), v("provenance", &T::provenance);
}

ordered_json number_json(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json json_of(const std::string& x) {
  return x;
}
ordered_json json_of(bool x) {
  return x;
}
ordered_json json_of(std::size_t x) {
  return x;
}
ordered_json json_of(double x) {
  return number_json(x);
}
ordered_json json_of(const chart::Sample& sample);
ordered_json json_of(const std::optional<chart::Chart>& chart);
ordered_json json_of(const Blocks& blocks);
template <class T>
ordered_json object_of(const T& x);
template <class T>
ordered_json json_of(const std::vector<T>& x);
template <class T>
ordered_json json_of(const T& x) {
  if constexpr (std::is_enum_v<T>)
    return names_of(x).at(static_cast<std::size_t>(x));
  else
    return object_of(x);
}
template <class T>
ordered_json json_of(const std::vector<T>& x) {
  ordered_json out = ordered_json::array();
  for (const T& one : x) out.push_back(json_of(one));
  return out;
}

/// Leaves out members with their default value.
template <class S>
class Writer {
 public:
  explicit Writer(const S& value) : value_(value) {}

  template <class M>
  void operator()(const char* key, M S::*member) {
    const S fresh{};
    ordered_json one = json_of(value_.*member);
    if (one != json_of(fresh.*member)) out[key] = std::move(one);
  }

  ordered_json out = ordered_json::object();

 private:
  const S& value_;
};

template <class T>
ordered_json object_of(const T& x) {
  Writer<T> writer(x);
  describe(writer, &x);
  return std::move(writer.out);
}

/// x and y; four numbers with an interval; six with a label or on the front.
ordered_json json_of(const chart::Sample& s) {
  ordered_json out{number_json(s.x), number_json(s.y)};
  const bool has_more = !s.label.empty() || s.front;
  if (has_more || std::isfinite(s.low) || std::isfinite(s.high)) {
    out.push_back(number_json(s.low));
    out.push_back(number_json(s.high));
  }
  if (has_more) {
    out.push_back(s.label);
    out.push_back(s.front);
  }
  return out;
}

ordered_json json_of(const Blocks& blocks) {
  return json_of(blocks.list);
}

ordered_json json_of(const std::optional<chart::Chart>& x) {
  if (!x) return nullptr;
  ordered_json out = std::visit([](const auto& one) { return object_of(one); }, *x);
  out["chart"] = chart_names.at(x->index());
  return out;
}

constexpr std::ptrdiff_t most_depth = 40;  // of blocks within blocks

/// Keeps the first error; later fields are not read.
template <class S>
class Reader {
 public:
  Reader(const ordered_json& in, S& value, std::string where, std::optional<Error>& error)
      : in_(in), value_(value), where_(std::move(where)), error_(error) {
    if (!in_.is_object()) refuse(where_, "an object", in_);
    if (std::ranges::count(where_, '.') > most_depth)
      refuse(where_, "fewer nested blocks", ordered_json());
  }

  template <class M>
  void operator()(const char* key, M S::*member) {
    if (error_) return;
    M& value = value_.*member;
    const auto found = in_.find(key);
    if (found == in_.end()) return;
    ++known_;
    read(*found, where_ + "." + key, value);
    // Such text becomes markup.
    const std::string_view name = key;
    if constexpr (std::is_same_v<M, std::string>)
      if ((name == "html" || name == "lead_html") && !is_inline_markup(value))
        refuse(where_ + "." + key, "inline markup", *found);
  }

  /// Refuses unknown keys, except for `more` of them.
  void finish(std::size_t more = 0) {
    if (!error_ && in_.size() != known_ + more) refuse(where_, "known keys only", in_);
  }

 private:
  void refuse(const std::string& where, const char* expected, const ordered_json& got) {
    if (error_) return;
    std::string text = got.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
    if (text.size() > 80) text = text.substr(0, 77) + "...";
    error_ = Error{.code = Errc::parse,
                   .where = where,
                   .what = "invalid record of the page",
                   .expected = expected,
                   .got = text,
                   .hint = "Create the report again with `weft report`"};
  }

  void read(const ordered_json& in, const std::string& where, std::string& x) {
    if (!in.is_string()) return refuse(where, "text", in);
    x = in.get<std::string>();
  }
  void read(const ordered_json& in, const std::string& where, bool& x) {
    if (!in.is_boolean()) return refuse(where, "true or false", in);
    x = in.get<bool>();
  }
  void read(const ordered_json& in, const std::string& where, std::size_t& x) {
    constexpr std::size_t most = 100000;
    if (!in.is_number_unsigned() || in.get<std::size_t>() > most)
      return refuse(where, "a whole number", in);
    x = in.get<std::size_t>();
  }
  void read(const ordered_json& in, const std::string& where, double& x) {
    if (!in.is_number() && !in.is_null()) return refuse(where, "a number or null", in);
    x = in.is_null() ? chart::no_number : in.get<double>();
  }
  void read(const ordered_json& in, const std::string& where, chart::Sample& s) {
    if (!in.is_array() || (in.size() != 2 && in.size() != 4 && in.size() != 6))
      return refuse(where, "2, 4 or 6 values", in);
    read(in[0], where, s.x);
    read(in[1], where, s.y);
    if (in.size() > 2) read(in[2], where, s.low);
    if (in.size() > 2) read(in[3], where, s.high);
    if (in.size() > 4) read(in[4], where, s.label);
    if (in.size() > 4) read(in[5], where, s.front);
  }
  template <class T>
  void read_chart(const ordered_json& in, const std::string& where,
                  std::optional<chart::Chart>& x) {
    T one;
    Reader<T> inside(in, one, where, error_);
    describe(inside, &one);
    inside.finish(1);
    x = std::move(one);
  }
  void read(const ordered_json& in, const std::string& where, std::optional<chart::Chart>& x) {
    const auto found = in.is_object() ? in.find("chart") : in.end();
    const bool is_named = in.is_object() && found != in.end() && found->is_string();
    const std::string kind = is_named ? found->get<std::string>() : std::string();
    if (kind == "plot") return read_chart<chart::Plot>(in, where, x);
    if (kind == "rows") return read_chart<chart::Rows>(in, where, x);
    if (kind == "cells") return read_chart<chart::Cells>(in, where, x);
    if (kind == "maps") return read_chart<chart::Maps>(in, where, x);
    if (kind == "shares") return read_chart<chart::Shares>(in, where, x);
    refuse(where, "a chart: plot, rows, cells, maps or shares", in);
  }
  void read(const ordered_json& in, const std::string& where, Blocks& x) {
    read(in, where, x.list);
  }
  template <class T>
  void read(const ordered_json& in, const std::string& where, std::vector<T>& x) {
    if (!in.is_array()) return refuse(where, "a list", in);
    x.clear();
    for (const ordered_json& one : in) {
      T value{};
      read(one, where + "[" + std::to_string(x.size()) + "]", value);
      x.push_back(std::move(value));
    }
  }
  template <class T>
  void read(const ordered_json& in, const std::string& where, T& x) {
    if constexpr (std::is_enum_v<T>) {
      const auto named =
          in.is_string() ? enum_named<T>(names_of(x), in.get<std::string>()) : std::optional<T>{};
      if (!named) return refuse(where, "a known name", in);
      x = *named;
    } else {
      Reader<T> inside(in, x, where, error_);
      describe(inside, &x);
      inside.finish();
    }
  }

  const ordered_json& in_;
  S& value_;
  std::string where_;
  std::optional<Error>& error_;
  std::size_t known_ = 0;
};

/// True if the cells of these blocks are markup.
bool has_markup_in_rows(const Block& block) {
  return block.kind == BlockKind::table || block.kind == BlockKind::list;
}

Status check_rows(const std::vector<Block>& blocks) {
  for (const Block& block : blocks) {
    if (has_markup_in_rows(block))
      for (const auto& row : block.rows)
        for (const std::string& cell : row)
          if (!is_inline_markup(cell))
            return fail({.code = Errc::parse,
                         .where = "page, a table",
                         .what = "invalid record of the page",
                         .expected = "inline markup",
                         .got = cell.substr(0, 80)});
    if (Status ok = check_rows(block.blocks); !ok) return ok;
  }
  return {};
}

}  // namespace

ordered_json document_json(const Document& document) {
  return object_of(document);
}

Result<Document> document_from(const ordered_json& json) {
  Document out;
  std::optional<Error> error;
  Reader<Document> reader(json, out, "page", error);
  describe(reader, &out);
  reader.finish();
  if (error) return fail(*error);
  for (const Blocks* part :
       {&out.alerts, &out.result, &out.pictures, &out.tables, &out.method, &out.provenance})
    if (Status ok = check_rows(part->list); !ok) return pass(ok.error());
  return out;
}

// Text of unknown origin may contain bytes that are not UTF-8: they become U+FFFD. NaN becomes
// null.
std::string record_with_page(const ordered_json& record, const Document& document) {
  constexpr auto replace = ordered_json::error_handler_t::replace;
  std::string out = record.dump(1, ' ', false, replace);
  out.resize(out.rfind('}'));
  while (!out.empty() && out.back() == '\n') out.pop_back();
  return out + (record.empty() ? "" : ",") +
         "\n \"page\": " + document_json(document).dump(-1, ' ', false, replace) + "\n}\n";
}

Status write_page(const std::filesystem::path& html, const ordered_json& record,
                  const Document& document) {
  const std::string text = record_with_page(record, document);
  const auto page = page_of_record(text);
  if (!page) return pass(page.error());
  if (Status ok = write_text_file(html, *page); !ok) return ok;
  return write_text_file(std::filesystem::path(html).replace_extension(".json"), text);
}

Result<std::string> page_of_record(std::string_view record) {
  const ordered_json json = ordered_json::parse(record, nullptr, false);
  if (!json.is_object())
    return fail({.code = Errc::parse,
                 .what = "not a record of a report",
                 .expected = "a JSON object",
                 .hint = "Use the JSON file in the folder of the report"});
  const auto page = json.find("page");
  if (page == json.end())
    return fail({.code = Errc::not_found,
                 .what = "record without page",
                 .expected = "the key \"page\"",
                 .hint = "Use the JSON file in the folder of the report; create reports of older "
                         "versions again with `weft report`"});
  const auto document = document_from(*page);
  if (!document) return pass(document.error());
  return render(*document);
}

}  // namespace weft::daemon

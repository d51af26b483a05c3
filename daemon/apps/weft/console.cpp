#include "daemon/apps/weft/console.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <new>
#include <nlohmann/json.hpp>
#include <ostream>

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

// External text may be invalid: bytes that are not UTF-8 become U+FFFD instead of an exception.
constexpr int pretty = 2, on_one_line = -1;
void put(std::ostream& out, const json& object, int indent = pretty) {
  out << object.dump(indent, ' ', false, json::error_handler_t::replace) << '\n';
}

// Names of fabrics or files could contain terminal control sequences.
std::string harmless(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    const bool second_set = c == 0xC2 && next >= 0x80 && next < 0xA0;  // U+0080 to U+009F
    const bool obeyed = (c < ' ' && c != '\n' && c != '\t') || c == 0x7F || second_set;
    out += obeyed ? '?' : text[i];
    i += second_set ? 1 : 0;
  }
  return out;
}

// Counts characters, not bytes: continuation bytes of UTF-8 need no space on the screen.
std::size_t text_width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

void print(Console& console, std::string_view text, const json& object, int indent) {
  if (console.json) {
    put(console.out, object, indent);
  } else {
    console.out << harmless(text);
  }
  console.out.flush();
}

}  // namespace

void print(Console& console, std::string_view text, const json& object) {
  print(console, text, object, pretty);
}

void print_line(Console& console, std::string_view text, const json& object) {
  print(console, text, object, on_one_line);
}

json error_json(const Error& error) {
  return {{"code", to_string(error.code)},
          {"number", static_cast<int>(error.code)},
          {"message", error.what},
          {"where", error.where},
          {"expected", error.expected},
          {"got", error.got},
          {"hint", error.hint},
          {"sentence", to_string(error)}};
}

int report(Console& console, const Error& error) {
  console.err << "weft: " << harmless(to_string(error)) << '\n';
  if (console.json) put(console.out, {{"error", error_json(error)}});
  return exit_failure;
}

int report_thrown(Console& console, const std::exception& thrown, const std::string& where) {
  if (dynamic_cast<const std::bad_alloc*>(&thrown) == nullptr)
    return report(console, Error{.code = Errc::io, .where = where, .what = thrown.what()});
  return report(console,
                Error{.code = Errc::range,
                      .where = where,
                      .what = "no memory is left for this",
                      .hint = "Give it less at a time, end other programs, or take a machine "
                              "with more memory"});
}

int report_usage(Console& console, const std::string& message) {
  console.err << "weft: " << harmless(message)
              << "\nweft: `weft --help` lists the commands and their options\n";
  if (console.json)
    put(console.out, {{"error", {{"code", "usage"}, {"message", message}, {"sentence", message}}}});
  return exit_usage;
}

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    const int status = app.exit(e);
    return status == 0 ? exit_ok : exit_usage;
  }
}

std::string Table::text(const std::string& indent) const {
  std::vector<std::size_t> width;
  for (const auto& row : rows_) {
    width.resize(std::max(width.size(), row.size()));
    for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], text_width(row[k]));
  }
  std::string out;
  for (const auto& row : rows_) {
    std::string line = indent;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const std::string padding(width[k] - text_width(row[k]), ' ');
      const bool left = k == 0 || others_ == Align::left;
      line += (k == 0 ? "" : "  ") + (left ? row[k] + padding : padding + row[k]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

}  // namespace weft::daemon::cli

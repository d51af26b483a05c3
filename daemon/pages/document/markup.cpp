#include <algorithm>
#include <array>
#include <cctype>
#include <vector>

#include "daemon/pages/document/document.hpp"

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 8> tags{"b", "i", "code", "sub", "sup", "span", "a", "br"};
constexpr std::array<std::string_view, 5> entities{"amp", "lt", "gt", "quot", "apos"};

bool is_one_of(std::string_view text, std::string_view more) {
  return std::ranges::all_of(text, [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           more.find(c) != std::string_view::npos;
  });
}

/// True for `name="value"` pairs: a class, a tool tip, a link within the page.
bool are_attributes(std::string_view text) {
  while (!text.empty()) {
    if (text.front() != ' ') return false;
    const std::size_t equals = text.find("=\"");
    const std::size_t end = equals == std::string_view::npos ? equals : text.find('"', equals + 2);
    if (end == std::string_view::npos) return false;
    const std::string_view name = text.substr(1, equals - 1),
                           value = text.substr(equals + 2, end - equals - 2);
    const bool known = (name == "class" && is_one_of(value, " -")) ||
                       (name == "title" && value.find_first_of("<>") == std::string_view::npos) ||
                       (name == "href" && value.starts_with('#') && is_one_of(value, "#-"));
    if (!known) return false;
    text.remove_prefix(end + 1);
  }
  return true;
}

/// Checks the inside of <...>; adds to `open` or removes from it.
bool is_tag(std::string_view inside, std::vector<std::string_view>& open) {
  if (inside.starts_with('/')) {
    const bool closes = !open.empty() && open.back() == inside.substr(1);
    if (closes) open.pop_back();
    return closes;
  }
  if (inside == "br/") return true;
  const std::size_t end = std::min(inside.find(' '), inside.size());
  const std::string_view name = inside.substr(0, end);
  if (std::ranges::find(tags, name) == tags.end() || name == "br") return false;
  open.push_back(name);
  return are_attributes(inside.substr(end));
}

bool is_entity(std::string_view name) {
  if (std::ranges::find(entities, name) != entities.end()) return true;
  return name.size() > 1 && name.size() < 8 && name.front() == '#' &&
         std::ranges::all_of(name.substr(1), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

bool is_inline_markup(std::string_view html) {
  std::vector<std::string_view> open;
  for (std::size_t i = 0; i < html.size(); ++i) {
    if (html[i] == '>') return false;
    if (html[i] != '<' && html[i] != '&') continue;
    const std::size_t end = html.find(html[i] == '<' ? '>' : ';', i);
    if (end == std::string_view::npos) return false;
    const std::string_view inside = html.substr(i + 1, end - i - 1);
    if (html[i] == '<' ? !is_tag(inside, open) : !is_entity(inside)) return false;
    i = end;
  }
  return open.empty();
}

}  // namespace weft::daemon

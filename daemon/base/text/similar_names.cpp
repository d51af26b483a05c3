#include "daemon/base/text/similar_names.hpp"

#include <array>
#include <cstdio>
#include <map>

namespace weft::daemon {
namespace {

struct Range {
  std::uint32_t first, last;
};
constexpr std::array<Range, 12> blanks{{{0x09, 0x0D},
                                        {0x20, 0x20},
                                        {0x85, 0x85},
                                        {0xA0, 0xA0},
                                        {0x1680, 0x1680},
                                        {0x2000, 0x200A},
                                        {0x2028, 0x2029},
                                        {0x202F, 0x202F},
                                        {0x205F, 0x205F},
                                        {0x3000, 0x3000},
                                        {0x2800, 0x2800},
                                        {0x3164, 0x3164}}};
constexpr std::array<Range, 11> unseen{{{0x00, 0x08},
                                        {0x0E, 0x1F},
                                        {0x7F, 0x84},
                                        {0x86, 0x9F},
                                        {0xAD, 0xAD},
                                        {0x61C, 0x61C},
                                        {0x180B, 0x180F},
                                        {0x200B, 0x200F},
                                        {0x202A, 0x202E},
                                        {0x2060, 0x206F},
                                        {0xFEFF, 0xFEFF}}};
// Characters that look alike in common fonts, from Unicode's confusables (UTS 39), each with the
// character that it resembles. Dashes, apostrophes, the micro sign, and letters of Greek and
// Cyrillic.
constexpr std::u32string_view copies =
    U"\u2010\u2011\u2012\u2013\u2014\u2015\u2212\uFE63\u2018\u2019\u02BC\u00B5"
    U"\u0391\u0392\u0395\u0396\u0397\u0399\u039A\u039C"
    U"\u039D\u039F\u03A1\u03A4\u03A5\u03A7\u03BF\u03BD"
    U"\u0410\u0412\u0415\u041A\u041C\u041D\u041E\u0420\u0421\u0422\u0425\u0405\u0406\u0408"
    U"\u0430\u0435\u043E\u0440\u0441\u0443\u0445\u0455\u0456\u0458\u0501\u04BB";
constexpr std::u32string_view originals =
    U"--------'''\u03BC"
    U"ABEZHIKM"
    U"NOPTYXov"
    U"ABEKMHOPCTXSIJ"
    U"aeopcyxsijdh";
static_assert(copies.size() == originals.size());
// Marks that follow their letter, including vowels and ends of Hangul syllables.
constexpr std::array<Range, 6> marks{{{0x300, 0x36F},
                                      {0x1160, 0x11FF},
                                      {0x1AB0, 0x1AFF},
                                      {0x1DC0, 0x1DFF},
                                      {0x20D0, 0x20FF},
                                      {0x3099, 0x309A}}};
constexpr std::array<Range, 2> variants{{{0xFE00, 0xFE0F}, {0xE0000, 0xE01EF}}};

template <class Ranges>
bool is_in(const Ranges& ranges, std::uint32_t c) {
  return std::ranges::any_of(ranges, [c](Range r) { return r.first <= c && c <= r.last; });
}

std::uint32_t original_of(std::uint32_t c) {
  const std::size_t at = copies.find(static_cast<char32_t>(c));
  return at == copies.npos ? c : originals[at];
}

constexpr std::uint32_t last_ascii = 0x7F;

// Removes and returns the first character of `text`, which is UTF-8.
std::uint32_t take_character(std::string_view& text) {
  const std::size_t length = std::max<std::size_t>(utf8_length(text), 1);
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  std::uint32_t out = length == 1 ? byte(0) : byte(0) & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) out = out << 6U | (byte(i) & 0x3FU);
  text.remove_prefix(length);
  return out;
}

using Letters = std::vector<std::u32string>;  // each with its marks

// The letters of a text without invisible characters; one blank for a run of blanks, none at the
// ends.
Letters letters_of(std::string_view text) {
  Letters out;
  bool is_behind_blank = false;
  while (!text.empty()) {
    std::uint32_t c = take_character(text);
    if (is_in(unseen, c) || is_in(variants, c)) continue;
    if (is_in(blanks, c)) {
      is_behind_blank = !out.empty();
      continue;
    }
    if (std::exchange(is_behind_blank, false)) out.emplace_back(U" ");
    c = original_of(c);
    if (is_in(marks, c) && !out.empty())
      out.back() += static_cast<char32_t>(c);
    else
      out.emplace_back(1, static_cast<char32_t>(c));
  }
  return out;
}

// Whether both may be one letter: one composed with its mark, the other followed by it.
bool can_be_equal(const std::u32string& a, const std::u32string& b) {
  if (a == b) return true;
  return (a.size() == 1 && a.front() > last_ascii && b.size() > 1) ||
         (b.size() == 1 && b.front() > last_ascii && a.size() > 1);
}

// can_be_equal() without regard to capital letters; knows those of Latin only.
bool is_equal_but_capitals(const std::u32string& a, const std::u32string& b) {
  const auto lower = [](char32_t c) { return c >= U'A' && c <= U'Z' ? c + (U'a' - U'A') : c; };
  return can_be_equal(a, b) || std::ranges::equal(a, b, {}, lower, lower);
}

// Equal for all names that may look alike or differ in capital letters only.
std::string key_of(const Letters& letters) {
  std::string out;
  for (const std::u32string& one : letters)
    out += one.size() > 1 || one.front() > last_ascii ? '\0' : static_cast<char>(one.front());
  return lower_case(out);
}

// The name with a code for each character that cannot be distinguished by eye from the `other`
// name's.
std::string visible(std::string_view text, std::string_view other) {
  std::string out = "'";
  while (!text.empty()) {
    const std::string_view before = text;
    const std::uint32_t c = take_character(text);
    const std::string_view character = before.substr(0, before.size() - text.size());
    const bool is_copy = original_of(c) != c && other.find(character) == other.npos;
    const bool is_shown = c == ' ' || !(is_in(blanks, c) || is_in(unseen, c) ||
                                        is_in(variants, c) || is_in(marks, c) || is_copy);
    std::array<char, 16> code{};
    if (!is_shown) std::snprintf(code.data(), code.size(), "<U+%04X>", c);
    out += is_shown ? character : std::string_view(code.data());
  }
  return out + "'";
}

}  // namespace

bool is_invisible(std::string_view name) {
  return letters_of(name).empty();
}

std::vector<Warning> find_similar_names(const std::set<std::string>& names, std::string_view what) {
  std::vector<Warning> out;
  std::map<std::string, std::vector<std::pair<Letters, std::string>>> by_key;
  for (const std::string& name : names) {
    Letters letters = letters_of(name);
    auto& others = by_key[key_of(letters)];
    for (const auto& [own, other] : others) {
      const std::string both = visible(other, name) + " and " + visible(name, other);
      if (std::ranges::equal(own, letters, can_be_equal))
        out.push_back({"similar_names", std::string(what) + " look alike but differ: " + both});
      else if (std::ranges::equal(own, letters, is_equal_but_capitals))
        out.push_back(
            {"capital_letters", std::string(what) + " differ only in capital letters: " + both});
    }
    others.emplace_back(std::move(letters), name);
  }
  return out;
}

}  // namespace weft::daemon

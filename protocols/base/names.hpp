#pragma once
// Names of the values of an enumeration, as one table for both directions; numbers as text.

#include <array>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft {

/// Every value with its name, in the order in which messages list them.
template <class Value, std::size_t count>
using NameTable = std::array<std::pair<Value, std::string_view>, count>;

/// "?" for a value that is not in the table.
template <class Value, std::size_t count>
constexpr std::string_view name_in(const NameTable<Value, count>& table, Value value) {
  for (const auto& [own, name] : table)
    if (own == value) return name;
  return "?";
}

/// nullopt if no value has this name.
template <class Value, std::size_t count>
constexpr std::optional<Value> value_in(const NameTable<Value, count>& table,
                                        std::string_view name) {
  for (const auto& [value, own] : table)
    if (own == name) return value;
  return std::nullopt;
}

template <class Value, std::size_t count>
std::vector<Value> values_of(const NameTable<Value, count>& table) {
  std::vector<Value> out;
  for (const auto& entry : table) out.push_back(entry.first);
  return out;
}

/// All names in table order: "NB, kNN, Tree".
template <class Value, std::size_t count>
std::string name_list(const NameTable<Value, count>& table) {
  std::string out;
  for (const auto& entry : table) out += (out.empty() ? "" : ", ") + std::string(entry.second);
  return out;
}

/// Errors: invalid_argument, with `message` and `expected`, for an unknown name.
template <class Value, std::size_t count>
Result<Value> value_from(const NameTable<Value, count>& table, std::string_view name,
                         std::string message, std::string expected) {
  if (const std::optional<Value> value = value_in(table, name)) return *value;
  return fail({.code = Errc::invalid_argument,
               .what = std::move(message),
               .expected = std::move(expected),
               .got = std::string(name)});
}

/// For messages: the shortest text that reads back as this number, such as "0.25" or "1e+308"
/// (std::to_string() gives 309 digits for the latter).
inline std::string format_number(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace weft

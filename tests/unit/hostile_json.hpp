#pragma once
// Replaces each number of a JSON document in turn by a value that no file should have.

#include <functional>
#include <string>
#include <string_view>

namespace weft::hostile {

/// `pointer` of the number, the text `value` of its replacement, and the whole document.
using Visit = std::function<void(const std::string& pointer, std::string_view value,
                                 const std::string& document)>;

/// Calls `visit` for every number under `root` and every value: too large, too small, denormal,
/// beyond any double, and not a number.
void for_each_number(const std::string& text, const std::string& root, const Visit& visit);

/// True if an error's place, possibly after the name of a file, is the field at `pointer`, the list
/// that contains it, or the object that contains both.
bool names_field(std::string_view where, std::string_view pointer);

}  // namespace weft::hostile

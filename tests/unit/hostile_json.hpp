#pragma once
// Every number of a JSON document in turn replaced by what no file should hold.

#include <functional>
#include <string>
#include <string_view>

namespace weft::hostile {

/// `pointer` of the number, the text `value` that stands there now, and the whole document.
using Visit = std::function<void(const std::string& pointer, std::string_view value,
                                 const std::string& document)>;

/// Calls `visit` for every number under `root` and every value: too large, too small, denormal,
/// beyond any double, and no number at all.
void for_each_number(const std::string& text, const std::string& root, const Visit& visit);

/// True where an error's place, which may stand behind the name of a file, is the field at
/// `pointer`, the list that it is in, or the object that holds both.
bool names_field(std::string_view where, std::string_view pointer);

}  // namespace weft::hostile

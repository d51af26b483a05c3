#pragma once
// What the pages of all trades are made of.

#include <string>
#include <string_view>

#include "daemon/base/text/bench_kind.hpp"

namespace weft::daemon {

/// "SIMULATED" and so on, in a box.
std::string bench_badge(BenchKind kind);

inline std::string simulated_badge() {
  return bench_badge(BenchKind::simulated);
}
/// A line of a definition list; a dash where there is no value.
std::string definition(std::string_view name, std::string_view value);
/// A whole page around `main_html`, with the styles of tables, marks and scatter pictures.
std::string page_around(std::string_view title, std::string_view main_html);

}  // namespace weft::daemon

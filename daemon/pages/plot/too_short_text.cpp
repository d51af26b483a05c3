#include "daemon/pages/plot/too_short_text.hpp"

#include "daemon/base/text/format.hpp"

namespace weft::daemon {

std::string format_too_short(const std::vector<classifier::vibro::TooShort>& recordings,
                             std::size_t parts) {
  std::vector<std::string> names;
  for (const classifier::vibro::TooShort& one : recordings)
    names.push_back(one.file + " (" + one.label + ")");
  const bool one = names.size() == 1;
  const std::string what = one ? "it" : "them";
  return std::to_string(names.size()) + (one ? " recording is" : " recordings are") +
         " left out, as no window fits into " +
         (parts > 1 ? "one of the " + std::to_string(parts) + " parts of " + what +
                          " (--blocks; fewer are longer)"
                    : what) +
         ": " + joined(names);
}

}  // namespace weft::daemon

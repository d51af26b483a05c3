#include "daemon/apps/weft/number_range.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

namespace weft::daemon::cli {

CLI::Validator number_range(double least, double most) {
  const CLI::Range range(least, most);
  const auto problem = [range](std::string& text) -> std::string {
    double value = 0.0;
    if (CLI::detail::lexical_cast(text, value) && std::isnan(value))
      return "Value " + text + " is not a number";
    return range(text);
  };
  return {problem, range.get_description()};
}

}  // namespace weft::daemon::cli

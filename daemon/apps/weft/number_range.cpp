#include "daemon/apps/weft/number_range.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <string>

#include "daemon/storage/imprints/image_file.hpp"

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

Result<std::vector<double>> scales_from(std::string_view text) {
  NumberLines lines("scales", text);
  if (!lines.next())
    return fail({.code = Errc::parse, .what = "no scale", .expected = "such as 1,2,4"});
  std::vector<double> out;
  for (std::size_t i = 0; i < lines.fields().size(); ++i) {
    const auto sigma = lines.number(i);
    if (!sigma)
      return fail({.code = Errc::parse,
                   .what = "a scale is not a number",
                   .expected = "such as 1,2,4",
                   .got = std::string(text)});
    out.push_back(*sigma);
  }
  return out;
}

}  // namespace weft::daemon::cli

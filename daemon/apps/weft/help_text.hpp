#pragma once
// Layout of --help: 80 columns; rarely needed options only on request.

#include <CLI/CLI.hpp>
#include <string>

namespace weft::daemon::cli {

/// Heading of options that only --help-all shows.
inline constexpr const char* rarely_needed_group = "Rarely needed";

/// Kind of value: "NUMBER" for "FLOAT:FLOAT in [0.001 - 1e+06]"; a list of words stays.
std::string value_name(const CLI::Option& option);

/// At least a line for each option: its values and default, its purpose, wrapped.
class HelpText : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
};

}  // namespace weft::daemon::cli

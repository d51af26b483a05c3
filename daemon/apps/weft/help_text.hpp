#pragma once
// How --help looks: 80 columns, and options that are rarely needed only on request.

#include <CLI/CLI.hpp>
#include <string>

namespace weft::daemon::cli {

/// Heading of options that --help leaves out and --help-all has.
inline constexpr const char* rarely_needed_group = "Rarely needed";

/// A line or more for each option: its values and default in few words, what it does, wrapped.
class HelpText : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
};

}  // namespace weft::daemon::cli

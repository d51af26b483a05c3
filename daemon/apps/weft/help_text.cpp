#include "daemon/apps/weft/help_text.hpp"

#include <utility>

#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {

namespace {

/// "NUMBER" for "FLOAT:FLOAT in [0.001 - 1e+06]"; a list of words stays.
std::string value_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t words = type.find('{');
  if (words != std::string::npos) return type.substr(words);
  if (type.starts_with("FLOAT")) return "NUMBER";
  return type.starts_with("UINT") || type.starts_with("INT") ? "COUNT" : type;
}

}  // namespace

std::string HelpText::make_help(const CLI::App* app, std::string name,
                                CLI::AppFormatMode mode) const {
  std::string out =
      make_description(app) + make_usage(app, std::move(name)) + make_positionals(app);
  for (const std::string& group : app->get_groups()) {
    if (group.empty() || (group == rarely_needed_group && mode == CLI::AppFormatMode::Normal))
      continue;
    const auto options = app->get_options([&](const CLI::Option* option) {
      return option->get_group() == group && option->nonpositional();
    });
    if (!options.empty()) out += make_group(group, false, options);
  }
  return out + make_subcommands(app, mode) + "\n" + make_footer(app);
}

std::string HelpText::make_option(const CLI::Option* option, bool is_positional) const {
  constexpr std::size_t text_column = 28;
  std::string out = "  " + make_option_name(option, is_positional);
  if (option->get_type_size() != 0) {
    out += " " + value_of(*option);
    if (!option->get_default_str().empty()) out += "=" + option->get_default_str();
    if (option->get_required()) out += " REQUIRED";
  }
  std::string text = wrapped(option->get_description(), std::string(text_column, ' '));
  if (out.size() < text_column) {
    out.resize(text_column, ' ');
    text.erase(0, text_column);
  } else {
    out += "\n";
  }
  return out + text;
}

}  // namespace weft::daemon::cli

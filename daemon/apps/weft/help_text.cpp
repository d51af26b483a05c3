#include "daemon/apps/weft/help_text.hpp"

#include <string_view>
#include <utility>

#include "daemon/apps/weft/command_specs.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {

namespace {

// The commands by kind of work, as docs/reference/cli.md lists them.
std::string all_commands(const CLI::App& root) {
  constexpr std::size_t text_column = 14;
  std::string out = root.get_description() +
                    "\nUsage: weft COMMAND [OPTIONS]        Stop all motion now: weft halt\n\n";
  for (const CommandGroupSpec& group : command_groups()) {
    out += std::string(group.name) + ": " + std::string(group.purpose) + "\n";
    for (const CommandSpec& command : command_specs()) {
      if (command.group != group.name || command.path.find(' ') != std::string_view::npos) continue;
      std::string line = "  " + std::string(command.path);
      line.resize(text_column, ' ');
      out += line + std::string(command.summary) + "\n";
    }
    out += "  e.g. " + std::string(group.example) + "\n";
  }
  std::string also, earlier;
  for (const CommandSpec& command : command_specs()) {
    if (command.group.empty()) also += std::string(command.path) + ", ";
    if (command.group == earlier_group)
      earlier += (earlier.empty() ? "" : ", ") + std::string(command.path);
  }
  return out + "Also: " + also + "--json, --version. Help of a command: weft COMMAND --help\n" +
         "Old names, removed in the next version: " + earlier + "\n";
}

}  // namespace

std::string value_name(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t words = type.find('{');
  if (words != std::string::npos) return type.substr(words);
  if (type.starts_with("FLOAT")) return "NUMBER";
  return type.starts_with("UINT") || type.starts_with("INT") ? "COUNT" : type;
}

std::string HelpText::make_help(const CLI::App* app, std::string name,
                                CLI::AppFormatMode mode) const {
  if (app->get_parent() == nullptr) return all_commands(*app);
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
  out += make_subcommands(app, mode);
  const CommandSpec& spec = command_spec(command_path(*app));
  if (spec.example.empty()) return out;
  return out + "\nExample:\n  weft " + std::string(spec.path) + " " + std::string(spec.example) +
         "\n";
}

std::string HelpText::make_option(const CLI::Option* option, bool is_positional) const {
  constexpr std::size_t text_column = 28;
  std::string out = "  " + make_option_name(option, is_positional);
  // CLI11 adds the value of a flag that clears a variable: "--no-evaluate{false}"
  if (const std::size_t value = out.find("{false}"); value != std::string::npos)
    out.erase(value, std::string_view("{false}").size());
  if (option->get_type_size() != 0) {
    out += " " + value_name(*option);
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

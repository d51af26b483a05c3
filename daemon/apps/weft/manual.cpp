#include <vector>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_name().empty(); });
}

// "weft dataset import"; the root has no parent.
std::string path_of(const CLI::App& app) {
  const CLI::App* parent = app.get_parent();
  return (parent == nullptr ? "" : path_of(*parent) + " ") + app.get_name();
}

void for_each_command(const CLI::App& app, const std::function<void(const CLI::App&)>& visit) {
  visit(app);
  for (const CLI::App* command : commands_of(app)) for_each_command(*command, visit);
}

std::vector<std::string> flags_of(const CLI::Option& option) {
  std::vector<std::string> out;
  for (const std::string& name : option.get_snames()) out.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.push_back("--" + name);
  return out;
}

// Escapes for roff: a dash would be a hyphen, a dot at the start of a line a request.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n')) out += "\\&";
    if (c == '-' || c == '\\') out += '\\';
    out += c == '\\' ? 'e' : c;
  }
  return out;
}

std::string synopsis(const CLI::App& app) {
  std::string out = "\\fB" + roff(path_of(app)) + "\\fR";
  if (!commands_of(app).empty()) return out + " \\fICOMMAND\\fR";
  for (const CLI::Option* option : app.get_options())
    if (option->get_positional()) out += " \\fI" + roff(option->get_name(true)) + "\\fR";
  return out + " [\\fIOPTION\\fR ...]";
}

std::string value_of(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return {};
  return " \\fI" + roff(option.get_type_name()) + "\\fR";
}

std::string paragraph(const CLI::Option& option) {
  const std::vector<std::string> flags = flags_of(option);
  const std::string head = flags.empty()
                               ? "\\fI" + roff(option.get_name(true)) + "\\fR"
                               : "\\fB" + roff(joined(flags, ", ")) + "\\fR" + value_of(option);
  return ".TP\n" + head + "\n" + roff(option.get_description()) + "\n";
}

std::string list_options(const CLI::App& app) {
  std::string out;
  for (const CLI::Option* option : app.get_options())
    if (app.get_parent() == nullptr || option != app.get_help_ptr()) out += paragraph(*option);
  return out;
}

std::string section(const CLI::App& app) {
  return ".SS " + roff(path_of(app)) + "\n" + synopsis(app) + "\n.PP\n" +
         roff(app.get_description()) + ".\n" + list_options(app);
}

// Words that may follow: commands and flags, those of the root everywhere.
std::string describe_command(const CLI::App& app, const CLI::App& root) {
  std::vector<std::string> words;
  for (const CLI::App* command : commands_of(app)) words.push_back(command->get_name());
  for (const CLI::Option* option : app.get_options())
    for (const std::string& flag : flags_of(*option)) words.push_back(flag);
  for (const CLI::Option* option : root.get_options())
    if (&app != &root && option != root.get_help_ptr())
      for (const std::string& flag : flags_of(*option)) words.push_back(flag);
  return joined(words, " ");
}

}  // namespace

std::string manual_page(const CLI::App& root) {
  const std::string name = root.get_name();
  std::string out = ".TH " + roff(name) + " 1 \"\" \"Weft\" \"User Commands\"\n.SH NAME\n" +
                    roff(name) + " \\- " + roff(root.get_description()) + "\n.SH SYNOPSIS\n" +
                    synopsis(root) + "\n.SH OPTIONS\n" + list_options(root);
  const std::vector<const CLI::App*> commands = commands_of(root);
  if (!commands.empty()) out += ".SH COMMANDS\n";
  for (const CLI::App* command : commands)
    for_each_command(*command, [&](const CLI::App& app) { out += section(app); });
  out += ".SH EXIT STATUS\n0: done. 1: refused or failed, with a sentence on standard error. ";
  out += "2: the command line is not understood. 128 + n: ended by signal n, tidily.\n";
  return out;
}

std::string bash_completion(const CLI::App& root) {
  const std::string name = root.get_name();
  std::string cases;
  for_each_command(root, [&](const CLI::App& app) {
    cases += "    '" + path_of(app) + "') words='" + describe_command(app, root) + "' ;;\n";
  });
  return "# bash completion of " + name + ", made by `" + name + " completion`\n_" + name +
         "() {\n"
         "  local at='" +
         name +
         "' words word current=${COMP_WORDS[COMP_CWORD]}\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    case \"$at $word\" in\n" +
         [&] {
           std::vector<std::string> paths;
           for_each_command(root, [&](const CLI::App& app) {
             if (&app != &root) paths.push_back("'" + path_of(app) + "'");
           });
           return "      " + joined(paths, "|") + ") at=\"$at $word\" ;;\n";
         }() +
         "    esac\n"
         "  done\n"
         "  case \"$at\" in\n" +
         cases +
         "  esac\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
         "}\n"
         "complete -o default -F _" +
         name + " " + name + "\n";
}

}  // namespace weft::daemon::cli

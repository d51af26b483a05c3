#include <iostream>
#include <vector>

#include "daemon/apps/weft/command_specs.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/help_text.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_name().empty(); });
}

// "weft dataset import"
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

std::string paragraph(const CLI::Option& option) {
  const std::vector<std::string> flags = flags_of(option);
  const std::string head = flags.empty() ? "\\fI" + roff(option.get_name(true)) + "\\fR"
                                         : "\\fB" + roff(joined(flags, ", ")) + "\\fR" +
                                               (option.get_items_expected_max() == 0
                                                    ? ""
                                                    : " \\fI" + roff(value_name(option)) + "\\fR");
  return ".TP\n" + head + "\n" + roff(option.get_description()) + "\n";
}

std::string list_options(const CLI::App& app) {
  std::string out;
  for (const CLI::Option* option : app.get_options())
    if (app.get_parent() == nullptr || option != app.get_help_ptr()) out += paragraph(*option);
  return out;
}

std::string example_of(const CLI::App& app) {
  const CommandSpec& spec = command_spec(command_path(app));
  if (spec.example.empty()) return {};
  return ".PP\nExample: " + roff(path_of(app) + " " + std::string(spec.example)) + "\n";
}

std::string section(const CLI::App& app) {
  return ".SS " + roff(path_of(app)) + "\n" + synopsis(app) + "\n.PP\n" +
         roff(app.get_description()) + ".\n" + list_options(app) + example_of(app);
}

/// A word that may follow, and its meaning.
struct Word {
  std::string name;
  std::string meaning;
};

// Commands and flags that may follow those of `app`; the flags of the root may follow everywhere.
std::vector<Word> words_after(const CLI::App& app, const CLI::App& root) {
  std::vector<Word> words;
  for (const CLI::App* command : commands_of(app))
    words.push_back({command->get_name(), command->get_description()});
  const auto add_flags = [&words](const CLI::App& of, const CLI::Option* except) {
    for (const CLI::Option* option : of.get_options())
      if (option != except)
        for (const std::string& flag : flags_of(*option))
          words.push_back({flag, option->get_description()});
  };
  add_flags(app, nullptr);
  if (&app != &root) add_flags(root, root.get_help_ptr());
  return words;
}

// One word of a shell.
std::string in_quotes(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

// "'weft run'|'weft check'": the pattern of all commands.
std::string pattern_of_commands(const CLI::App& root) {
  std::vector<std::string> paths;
  for_each_command(root, [&](const CLI::App& app) {
    if (&app != &root) paths.push_back(in_quotes(path_of(app)));
  });
  return paths.empty() ? "''" : joined(paths, "|");
}

}  // namespace

std::string command_path(const CLI::App& app) {
  const std::string path = path_of(app);
  const std::size_t end_of_root = path.find(' ');
  return end_of_root == std::string::npos ? "" : path.substr(end_of_root + 1);
}

std::string manual_page(const CLI::App& root) {
  const std::string name = root.get_name();
  std::string out = ".TH " + roff(name) + " 1 \"\" \"Weft\" \"User Commands\"\n.SH NAME\n" +
                    roff(name) + " \\- " + roff(root.get_description()) + "\n.SH SYNOPSIS\n" +
                    synopsis(root) + "\n.SH OPTIONS\n" + list_options(root);
  const std::vector<const CLI::App*> commands = commands_of(root);
  if (!commands.empty()) out += ".SH COMMANDS\n";
  for (const CLI::App* command : commands)
    for_each_command(*command, [&](const CLI::App& app) { out += section(app); });
  out += ".SH EXIT STATUS\n0: success. 1: refused or failed, with a sentence on standard error. ";
  out +=
      "2: invalid command line. 3: complete, but the accuracy required by --accuracy-strict is "
      "missed. 128 + n: ended by signal n, after clean-up.\n";
  return out;
}

std::string bash_completion(const CLI::App& root) {
  const std::string name = root.get_name();
  std::string cases;
  for_each_command(root, [&](const CLI::App& app) {
    std::vector<std::string> names;
    for (const Word& word : words_after(app, root)) names.push_back(word.name);
    cases +=
        "    " + in_quotes(path_of(app)) + ") words=" + in_quotes(joined(names, " ")) + " ;;\n";
  });
  return "# bash completion of " + name + ", generated by " + name + "\n_" + name +
         "() {\n"
         "  local at='" +
         name +
         "' words word current=${COMP_WORDS[COMP_CWORD]}\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    case \"$at $word\" in\n      " +
         pattern_of_commands(root) +
         ") at=\"$at $word\" ;;\n"
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

std::string zsh_completion(const CLI::App& root) {
  const std::string name = root.get_name();
  std::string cases;
  for_each_command(root, [&](const CLI::App& app) {
    cases += "    " + in_quotes(path_of(app)) + ") choices=(\n";
    for (const Word& word : words_after(app, root))
      cases += "      " + in_quotes(word.name + ":" + word.meaning) + "\n";
    cases += "    ) ;;\n";
  });
  return "#compdef " + name + "\n# zsh completion, generated by " + name + "\n_" + name +
         "() {\n"
         "  local at='" +
         name +
         "' word\n"
         "  local -a choices\n"
         "  for word in ${words[2,CURRENT-1]}; do\n"
         "    case \"$at $word\" in\n      " +
         pattern_of_commands(root) +
         ") at=\"$at $word\" ;;\n"
         "    esac\n"
         "  done\n"
         "  case \"$at\" in\n" +
         cases +
         "  esac\n"
         "  _describe '" +
         name +
         "' choices || _files\n"
         "}\n"
         "if [ \"$funcstack[1]\" = _" +
         name + " ]; then _" + name + " \"$@\"; else compdef _" + name + " " + name + "; fi\n";
}

void add_generated_texts(CLI::App& app) {
  app.add_flag_callback(
      "--manual",
      [&app] {
        std::cout << manual_page(app);
        throw CLI::Success();
      },
      "print the manual page, for `man -l -`");
  app.add_option_function<std::string>(
         "--completion",
         [&app](const std::string& shell) {
           std::cout << (shell == "zsh" ? zsh_completion(app) : bash_completion(app));
           throw CLI::Success();
         },
         "print the completion script of a shell")
      ->check(CLI::IsMember({"bash", "zsh"}));
}

}  // namespace weft::daemon::cli

#include <algorithm>
#include <optional>
#include <ostream>
#include <span>
#include <utility>

#include "daemon/apps/weft/command_specs.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/help_text.hpp"
#include "daemon/base/version/software_version.hpp"
#include "drivers/api/config.hpp"

namespace weft::daemon::cli {
namespace {

struct CompletionArgs {
  std::string shell = "bash";
};

void add_options(CLI::App& app, CompletionArgs& args) {
  app.add_option("SHELL", args.shell, "shell: bash or zsh")
      ->check(CLI::IsMember({"bash", "zsh"}))
      ->capture_default_str();
}

struct ManualArgs {};
void add_options(CLI::App&, ManualArgs&) {}

/// Commands that print the command line for other programs.
void add_texts(const CommandGroup& weft, const CLI::App& root) {
  weft.add<ManualArgs>("manual", [&root](const ManualArgs&, Console& console) -> Result<int> {
    console.out << manual_page(root);
    return exit_ok;
  });
  weft.add<CompletionArgs>(
      "completion", [&root](const CompletionArgs& args, Console& console) -> Result<int> {
        console.out << (args.shell == "zsh" ? zsh_completion(root) : bash_completion(root));
        return exit_ok;
      });
}

bool wants_json(std::span<const char* const> arguments) {
  for (const char* argument : arguments)
    if (std::string_view(argument) == "--json") return true;
  return false;
}

std::string meant(const std::string& word, const CLI::App& group) {
  std::vector<std::string> names;
  for (const CLI::App* each : group.get_subcommands({})) names.push_back(each->get_name());
  const std::string name = nearest_name(word, names);
  return name.empty() ? "" : ". Did you mean " + name + "?";
}

// An option unknown here belongs to a subcommand that was not parsed.
bool expects_value(const std::string& option, const CLI::App& root, const CLI::App& group) {
  const CLI::Option* known = group.get_option_no_throw(option);
  if (known == nullptr) known = root.get_option_no_throw(option);
  return option.find('=') == std::string::npos &&
         (known == nullptr || known->get_items_expected_max() > 0);
}

// The library only reports that a subcommand is missing; this names the wrong word.
std::string mistake(const CLI::App& root, std::span<const char* const> arguments,
                    const CLI::ParseError& e) {
  if (dynamic_cast<const CLI::RequiredError*>(&e) == nullptr &&
      dynamic_cast<const CLI::ExtrasError*>(&e) == nullptr)
    return e.what();
  const CLI::App* group = &root;
  std::string path = "weft";
  bool is_value = false;  // of the option before it
  for (const char* argument : arguments.subspan(1)) {
    const std::string word = argument;
    if (std::exchange(is_value, false)) continue;
    if (word.starts_with('-')) {
      is_value = expects_value(word, root, *group);
      continue;
    }
    const auto known =
        group->get_subcommands([&](const CLI::App* a) { return a->check_name(word); });
    if (group->get_subcommands({}).empty()) break;
    if (known.empty()) return "'" + word + "' is no subcommand of " + path + meant(word, *group);
    group = known.front();
    path += " " + word;
  }
  return e.what();
}

// The exit status if the command line itself ends the program: help, version or a mistake.
std::optional<int> parse(CLI::App& root, int argc, const char* const* argv, Console& console) {
  if (argc == 1) {
    console.out << root.help();
    return 0;
  }
  try {
    const std::span arguments(argv, static_cast<std::size_t>(argc));
    std::vector<std::string> words =
        join_learners(stop_arguments({arguments.begin() + 1, arguments.end()}));
    std::ranges::reverse(words);  // the library expects reverse order
    root.parse(std::move(words));
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return root.exit(e, console.out, console.err);
    const std::span arguments(argv, static_cast<std::size_t>(argc));
    console.json = wants_json(arguments);
    return report_usage(console, mistake(root, arguments, e));
  }
}

}  // namespace

CLI::App* CommandGroup::subcommand(const char* name) const {
  CLI::App* const command = app_->add_subcommand(name);
  command->description(std::string(command_spec(command_path(*command)).summary));
  command->fallthrough();
  return command;
}

void add_commands(CLI::App& root, ChosenCommand& chosen) {
  const CommandGroup weft(root, chosen);
  for (const auto add :
       {add_run_command,     add_check_command,     add_doctor_command, add_init_command,
        add_align_command,   add_dataset_commands,  add_verify_command, add_export_command,
        add_report_command,  add_modality_commands, add_audit_command,  add_trade_commands,
        add_design_commands, add_daemon_commands,   add_stop_commands,  add_rig_commands,
        add_data_commands,   add_page_command,      add_queue_commands, add_token_commands,
        add_sim_commands,    add_earlier_commands,  add_lab_commands})
    add(weft);
  add_texts(weft, root);
}

int run(int argc, const char* const* argv, Console& console) {
  CLI::App root("Weft runs tactile-exploration campaigns and trains models that recognise fabrics.",
                "weft");
  ChosenCommand chosen;
  root.add_flag("--json", console.json, "print one JSON object on standard output");
  root.set_version_flag("--version", "weft " + software_version());
  root.require_subcommand(1);
  root.formatter(std::make_shared<HelpText>());
  try {
    add_commands(root, chosen);
    if (const auto status = parse(root, argc, argv, console)) return *status;
    const Result<int> status = chosen(console);
    return status ? *status : report(console, status.error());
  } catch (const std::exception& e) {  // std::bad_alloc and other exceptions of libraries
    return report_thrown(console, e, "weft");
  }
}

}  // namespace weft::daemon::cli

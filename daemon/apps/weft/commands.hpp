#pragma once
// The command line as a whole, and the registration of each command. Include in .cpp files only: it
// includes CLI11.

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/options.hpp"

namespace weft::daemon::cli {

/// Runs `weft` with these arguments. Never throws. Returns exit_ok, exit_failure or exit_usage.
int run(int argc, const char* const* argv, Console& console);

/// The typed command with its arguments; empty before the command line is parsed.
using ChosenCommand = std::function<Result<int>(Console&)>;

/// Commands below one name, such as "weft" or "weft dataset". The application and `chosen` must
/// outlive it.
class CommandGroup {
 public:
  CommandGroup(CLI::App& app, ChosenCommand& chosen) : app_(&app), chosen_(&chosen) {}

  [[nodiscard]] CommandGroup group(const char* name) const {
    CLI::App* const below = subcommand(name);
    below->require_subcommand(1);
    return {*below, *chosen_};
  }

  /// Action of the group without a command.
  template <class Args>
  void by_default(const std::function<Result<int>(const Args&, Console&)>& execute) const {
    app_->require_subcommand(0, 1);
    const auto args = std::make_shared<Args>();
    add_options(*app_, *args);
    app_->callback([app = app_, chosen = chosen_, args, execute] {
      if (!app->get_subcommands().empty()) {
        // The subcommand has options of the same names; the group's would be ignored silently.
        for (const char* const name : {"--socket", "--daemon", "--token-file"})
          if (app->count(name) > 0)
            throw CLI::ExtrasError(app->get_name(), {std::string(name) + " (type it last)"});
        return;
      }
      *chosen = [args, execute](Console& console) { return execute(*args, console); };
    });
  }

  /// Adds a command. add_options(CLI::App&, Args&) declares its options; `execute` receives them.
  /// `preset`: defaults.
  template <class Args>
  CLI::App* add(const char* name, const std::function<Result<int>(const Args&, Console&)>& execute,
                const Args& preset = {}) const {
    CLI::App* const command = subcommand(name);
    const auto args = std::make_shared<Args>(preset);
    add_options(*command, *args);
    command->callback([chosen = chosen_, args, execute] {
      *chosen = [args, execute](Console& console) { return execute(*args, console); };
    });
    return command;
  }

 private:
  // Its summary is that of command_specs().
  [[nodiscard]] CLI::App* subcommand(const char* name) const;

  CLI::App* app_;
  ChosenCommand* chosen_;
};

/// All commands of `weft`, in the order in which --help lists them.
void add_commands(CLI::App& root, ChosenCommand& chosen);

// The four learning commands, under a modality, or under none for all kinds of data.
CLI::App* add_features_command(const CommandGroup& group, CommandModality modality);
CLI::App* add_evaluate_command(const CommandGroup& group, CommandModality modality);
CLI::App* add_train_command(const CommandGroup& group, CommandModality modality);
CLI::App* add_classify_command(const CommandGroup& group, CommandModality modality);
/// scene, tables and search.
void add_imprint_commands(const CommandGroup& imprint);

// Each command is in its own file, with its arguments.
void add_run_command(const CommandGroup& weft);
void add_check_command(const CommandGroup& weft);
void add_doctor_command(const CommandGroup& weft);
void add_init_command(const CommandGroup& weft);
void add_align_command(const CommandGroup& weft);
void add_dataset_commands(const CommandGroup& weft);
void add_merge_command(const CommandGroup& dataset);
void add_verify_command(const CommandGroup& weft);
void add_export_command(const CommandGroup& weft);
void add_report_command(const CommandGroup& weft);
void add_audit_command(const CommandGroup& weft);
/// fabric, vibro and imprint, each with features, evaluate, train and classify.
void add_modality_commands(const CommandGroup& weft);
/// The four learning commands without modality, as in version 1.
void add_earlier_commands(const CommandGroup& weft);
void add_trade_commands(const CommandGroup& weft);
void add_design_commands(const CommandGroup& weft);
void add_sim_commands(const CommandGroup& weft);
/// Commands for a running weftd.
void add_daemon_commands(const CommandGroup& weft);
/// halt and estop.
void add_stop_commands(const CommandGroup& weft);
/// The words after "weft". For halt and estop, unknown words move into the reason: a stop never
/// fails for its arguments. The words of other commands stay unchanged.
std::vector<std::string> stop_arguments(std::vector<std::string> words);
/// Motion outside a run.
void add_rig_commands(const CommandGroup& weft);
void add_data_commands(const CommandGroup& weft);
void add_page_command(const CommandGroup& weft);
void add_queue_commands(const CommandGroup& weft);
void add_token_commands(const CommandGroup& weft);
/// The laboratory's shared store.
void add_lab_commands(const CommandGroup& weft);
void add_lab_rig_commands(const CommandGroup& lab);

// The command line for other programs, generated from the parser's table.

/// A page of section 1 in roff (man(7)): every command with its arguments and options.
std::string manual_page(const CLI::App& root);

/// Completion scripts: commands and options of the program; files where neither fits. That for zsh
/// shows the meaning of each word.
std::string bash_completion(const CLI::App& root);
std::string zsh_completion(const CLI::App& root);

/// Words behind `weft` that select a command: "dataset import"; empty for the root.
std::string command_path(const CLI::App& app);

/// Adds --manual and --completion SHELL to a program without commands.
void add_generated_texts(CLI::App& app);

}  // namespace weft::daemon::cli

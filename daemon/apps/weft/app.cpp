#include "daemon/apps/weft/app.hpp"

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <ostream>
#include <span>
#include <utility>

#include "daemon/apps/weft/bench_commands.hpp"
#include "daemon/apps/weft/classify_command.hpp"
#include "daemon/apps/weft/daemon_commands.hpp"
#include "daemon/apps/weft/data_commands.hpp"
#include "daemon/apps/weft/evaluate_command.hpp"
#include "daemon/apps/weft/manual.hpp"
#include "daemon/apps/weft/run_command.hpp"
#include "daemon/apps/weft/study_commands.hpp"
#include "daemon/apps/weft/train_command.hpp"
#include "daemon/base/version/software_version.hpp"
#include "drivers/api/config.hpp"

namespace weft::daemon::cli {
namespace {

/// All commands with the arguments they parse into; `chosen` is the one that was given.
struct Commands {
  RunArgs run;
  CheckArgs check;
  DoctorArgs doctor;
  AlignArgs align;
  ImportArgs import;
  ExportArgs exported;
  InfoArgs info;
  VerifyArgs verify;
  CampaignExportArgs campaign_export;
  FeaturesArgs features;
  TrainArgs train;
  EvaluateArgs evaluate;
  ClassifyArgs classify;
  TradeClassifierArgs trade_classifier;
  DesignAnalyseArgs design_analyse;
  DesignRepetitionsArgs design_repetitions;
  TradeSimArgs trade_sim;
  ImprintSceneArgs imprint_scene;
  ImprintTablesArgs imprint_tables;
  ImprintSearchArgs imprint_search;
  TradeVibroArgs trade_vibro;
  StatusArgs status;
  StartArgs start;
  WatchArgs watch;
  PauseArgs pause;
  ResumeArgs resume;
  RecoverArgs recover;
  ConfirmArgs confirm;
  StopArgs stop;
  AbortArgs abort;
  ReportArgs report;
  HaltArgs halt;
  ResetArgs reset;
  EstopArgs estop;
  LogArgs log;
  CallArgs call;
  PageArgs page;
  TokenAddArgs token_add;
  TokenListArgs token_list;
  TokenRemoveArgs token_remove;
  QueueListArgs queue_list;
  QueueAddArgs queue_add;
  QueueRemoveArgs queue_remove;
  QueueMoveArgs queue_move;
  QueuePauseArgs queue_pause;
  QueueStartArgs queue_start;
  std::function<Result<int>(Console&)> chosen;
};

template <class Args>
void add(CLI::App& parent, Commands& commands, const char* name, const char* text, Args& args,
         Result<int> (*execute)(const Args&, Console&)) {
  CLI::App* command = parent.add_subcommand(name, text);
  command->fallthrough();
  add_options(*command, args);
  command->callback([&commands, &args, execute] {
    commands.chosen = [&args, execute](Console& console) { return execute(args, console); };
  });
}

void add_commands(CLI::App& root, Commands& all) {
  add(root, all, "run", "run a campaign, record, classify and report it", all.run, run_run);
  add(root, all, "check", "check a recipe against a rig, without moving", all.check, run_check);
  add(root, all, "doctor", "look over a rig: devices, ports, machine; what to fix", all.doctor,
      run_doctor);
  add(root, all, "align", "find the plate's tilt by touching, level it, touch again", all.align,
      run_align);
  CLI::App* dataset = root.add_subcommand("dataset", "import, export and describe data sets");
  dataset->fallthrough()->require_subcommand(1);
  add(*dataset, all, "import", "other people's recordings into a data set", all.import, run_import);
  add(*dataset, all, "export", "the complete trials of a campaign file", all.exported, run_export);
  add(*dataset, all, "info", "what a data set holds", all.info, run_info);
  add(root, all, "verify", "whether a campaign or data set is what was recorded", all.verify,
      run_verify);
  add(root, all, "export", "the complete trials of a campaign as one more file beside it",
      all.campaign_export, run_campaign_export);
  add(root, all, "report", "the report of a campaign that is over, to read or to print", all.report,
      run_report);
  add(root, all, "features", "the features of a data set as a table", all.features, run_features);
  add(root, all, "train", "train a model", all.train, run_train);
  add(root, all, "evaluate", "train and test on splits of a data set", all.evaluate, run_evaluate);
  add(root, all, "classify", "what a model says of a trial", all.classify, run_classify);
  CLI::App* tradeoff = root.add_subcommand("trade", "what accuracy costs in time, on one picture");
  tradeoff->fallthrough()->require_subcommand(1);
  add(*tradeoff, all, "classifier",
      "feature count, learner, slide length, speed, exploration, vote, when to stop",
      all.trade_classifier, run_trade_classifier);
  add(*tradeoff, all, "vibro", "learner, features, window and source of sound and vibration",
      all.trade_vibro, run_trade_vibro);
  add(*tradeoff, all, "sim", "the plant's levels, integrators and steps on its scenes",
      all.trade_sim, run_trade_sim);
  CLI::App* design = root.add_subcommand("design", "which setting, and how many repetitions");
  design->fallthrough()->require_subcommand(1);
  add(*design, all, "analyse", "the cells of a sweep: response, separability, time, which to take",
      all.design_analyse, run_design_analyse);
  add(*design, all, "repetitions", "learning curve, and what more repetitions would give",
      all.design_repetitions, run_design_repetitions);
}

void add_imprint_commands(CLI::App& root, Commands& all) {
  CLI::App* imprint = root.add_subcommand("imprint", "texture of static imprints (Ellis 1986)");
  imprint->fallthrough()->require_subcommand(1);
  add(*imprint, all, "scene", "simulated imprints of twelve objects as a data set",
      all.imprint_scene, run_imprint_scene);
  add(*imprint, all, "tables", "the paper's four experiments on any imprints, its figures beside",
      all.imprint_tables, run_imprint_tables);
  add(*imprint, all, "search", "the scales of smoothing that tell the classes apart best",
      all.imprint_search, run_imprint_search);
}

/// What is asked of a running weftd.
void add_daemon_commands(CLI::App& root, Commands& all) {
  add(root, all, "status", "the daemon's readiness and its runs", all.status, run_status);
  add(root, all, "start", "puts a recipe in the daemon's line", all.start, run_start);
  add(root, all, "watch", "a line for each change of a run", all.watch, run_watch);
  add(root, all, "pause", "holds a run before its next repetition", all.pause, run_pause);
  add(root, all, "resume", "goes on with a run that is held", all.resume, run_resume);
  add(root, all, "recover", "goes on with an interrupted run, discards it or keeps what there is",
      all.recover, run_recover);
  add(root, all, "confirm", "what a run waits for a person to do is done", all.confirm,
      run_confirm);
  add(root, all, "stop", "ends a run after its repetition", all.stop, run_stop);
  add(root, all, "abort", "ends a run now, the probe up", all.abort, run_abort);
  add(root, all, "halt", "stops all motion and latches the rig", all.halt, run_halt);
  add(root, all, "estop", "as halt, and only an engineer resets it", all.estop, run_estop);
  add(root, all, "reset", "somebody has looked at the rig: it may move again", all.reset,
      run_reset);
  add(root, all, "log", "the daemon's journal", all.log, run_log);
  add(root, all, "call", "any method of the daemon's API", all.call, run_call);
  add(root, all, "page", "a link to the daemon's page, good for a day", all.page, run_page);
  CLI::App* queue = root.add_subcommand("queue", "the runs that wait for the daemon's rig");
  queue->fallthrough()->require_subcommand(1);
  add(*queue, all, "list", "who waits, the next first", all.queue_list, run_queue_list);
  add(*queue, all, "add", "puts a recipe in line", all.queue_add, run_queue_add);
  add(*queue, all, "remove", "takes a run out of the line", all.queue_remove, run_queue_remove);
  add(*queue, all, "move", "another place in line", all.queue_move, run_queue_move);
  add(*queue, all, "pause", "nothing more begins", all.queue_pause, run_queue_pause);
  add(*queue, all, "start", "the next begins when the rig is free", all.queue_start,
      run_queue_start);
  CLI::App* token = root.add_subcommand("token", "tokens of the daemon's TCP clients");
  token->fallthrough()->require_subcommand(1);
  add(*token, all, "add", "makes one and prints it, once", all.token_add, run_token_add);
  add(*token, all, "list", "whose there are, their roles, until when", all.token_list,
      run_token_list);
  add(*token, all, "remove", "takes one away", all.token_remove, run_token_remove);
}

/// The command line told to other programs.
void add_texts(CLI::App& root, Commands& all) {
  const auto add_text = [&](const char* name, const char* what,
                            std::string (*text)(const CLI::App&)) {
    root.add_subcommand(name, what)->callback([&root, &all, text] {
      all.chosen = [&root, text](Console& console) -> Result<int> {
        console.out << text(root);
        return exit_ok;
      };
    });
  };
  add_text("manual", "these commands as a manual page, for `man -l -`", manual_page);
  add_text("completion", "what bash completes, for `source <(weft completion)`", bash_completion);
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

// One that nobody knows here belongs to a subcommand that was not read.
bool expects_value(const std::string& option, const CLI::App& root, const CLI::App& group) {
  const CLI::Option* known = group.get_option_no_throw(option);
  if (known == nullptr) known = root.get_option_no_throw(option);
  return option.find('=') == std::string::npos &&
         (known == nullptr || known->get_items_expected_max() > 0);
}

// The library only says that a subcommand is missing; this says which word is none.
std::string mistake(const CLI::App& root, std::span<const char* const> arguments,
                    const CLI::ParseError& e) {
  if (dynamic_cast<const CLI::RequiredError*>(&e) == nullptr) return e.what();
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
    if (group->get_require_subcommand_min() == 0) break;
    if (known.empty()) return "'" + word + "' is no subcommand of " + path + meant(word, *group);
    group = known.front();
    path += " " + word;
  }
  return e.what();
}

// The exit status when the command line itself ends the program: help, version or a mistake in it.
std::optional<int> parse(CLI::App& root, int argc, const char* const* argv, Console& console) {
  try {
    root.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return root.exit(e, console.out, console.err);
    const std::span arguments(argv, static_cast<std::size_t>(argc));
    console.json = wants_json(arguments);
    return report_usage(console, mistake(root, arguments, e));
  }
}

}  // namespace

int run(int argc, const char* const* argv, Console& console) {
  CLI::App root("Weft runs tactile-exploration campaigns and tells fabrics apart.", "weft");
  Commands commands;
  root.add_flag("--json", console.json, "one JSON object on standard output");
  root.set_version_flag("--version", "weft " + software_version());
  root.require_subcommand(1);
  try {
    add_commands(root, commands);
    add_imprint_commands(root, commands);
    add_daemon_commands(root, commands);
    add_texts(root, commands);
    if (const auto status = parse(root, argc, argv, console)) return *status;
    const Result<int> status = commands.chosen(console);
    return status ? *status : report(console, status.error());
  } catch (const std::exception& e) {  // std::bad_alloc and what else a library throws
    return report_thrown(console, e, "weft");
  }
}

}  // namespace weft::daemon::cli

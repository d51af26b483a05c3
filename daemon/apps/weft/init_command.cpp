#include <istream>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/init_text.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/setup/device_search.hpp"
#include "daemon/campaign/setup/rig_writer.hpp"

namespace weft::daemon::cli {
namespace {

struct InitArgs {
  std::filesystem::path rig, answers;
  std::string simulated, emulated, name;
  std::vector<std::string> ports, boxes, roles, stages, numbers;
  bool yes = false, no_network = false, only_named = false;
  std::string answers_json;  ///< content of the file
};

/// An option that is repeated for each value.
CLI::Option* add_repeated(CLI::App& command, const std::string& name,
                          std::vector<std::string>& values, const std::string& text,
                          const std::string& type) {
  return command.add_option(name, values, text)->allow_extra_args(false)->type_name(type);
}

void add_options(CLI::App& command, InitArgs& args) {
  command.add_option("RIG", args.rig, "rig file to write; it must not exist")->required();
  CLI::Option* const simulated = command.add_option(
      "--simulated", args.simulated,
      "write a simulated rig of this shape (5dof, xyz, xz, digital, taxels32, ...)");
  add_repeated(command, "--port", args.ports, "also query the device at this port (repeatable)",
               "PATH|tcp:HOST:PORT")
      ->excludes(simulated);
  add_repeated(command, "--netft", args.boxes,
               "also query the Net F/T box at this host (repeatable)", "HOST[:PORT[/PAGES]]")
      ->excludes(simulated);
  command
      .add_option("--emulated", args.emulated, "search the ports of the weft-rig with this console")
      ->type_name("HOST:PORT")
      ->excludes(simulated);
  command.add_flag("--only-named", args.only_named,
                   "query only the devices named by --port and --netft");
  command.add_flag("--no-network", args.no_network, "send no broadcast to find Net F/T boxes");
  add_repeated(command, "--role", args.roles,
               "set a device's role (x, y, z, rx, ry, wrench, taxels, vibro, none)", "DEVICE=ROLE");
  add_repeated(command, "--stage", args.stages,
               "name the stage of a controller that does not report it", "DEVICE=STAGE");
  add_repeated(command, "--set", args.numbers, "set a number, such as surface_z_mm=42 (repeatable)",
               "NAME=NUMBER");
  command.add_option("--answers", args.answers,
                     "read roles, stages and numbers from this file (JSON)");
  command.add_option("--name", args.name, "name the rig");
  command.add_flag("--yes", args.yes, "ask no questions; use the defaults");
}

/// Passes "A=B" to `set`. The place A may contain "=", the value B not.
Status apply_pairs(
    RigDraft& draft, const std::vector<std::string>& pairs, const char* option,
    const std::function<Status(RigDraft&, const std::string&, const std::string&)>& set) {
  for (const std::string& pair : pairs) {
    const std::size_t equals = pair.rfind('=');
    if (equals == std::string::npos)
      return fail({.where = option, .what = "missing \"=\"", .expected = "A=B", .got = pair});
    if (Status done = set(draft, pair.substr(0, equals), pair.substr(equals + 1)); !done)
      return pass(done.error(), option);
  }
  return {};
}

Status set_number_text(RigDraft& draft, const std::string& name, const std::string& text) {
  double value = 0;
  if (CLI::detail::lexical_cast(text, value)) return set_number(draft, name, value);
  return fail({.where = name, .what = "not a number", .got = text});
}

Status apply_args(RigDraft& draft, const InitArgs& args) {
  if (!args.answers.empty())
    if (Status done = apply_answers(draft, args.answers_json); !done)
      return pass(done.error(), args.answers.string());
  if (Status done = apply_pairs(draft, args.stages, "--stage", set_stage); !done) return done;
  if (Status done = apply_pairs(draft, args.roles, "--role", set_role); !done) return done;
  return apply_pairs(draft, args.numbers, "--set", set_number_text);
}

/// Checks that need no open port.
Status check_args(const InitArgs& args) {
  RigDraft scratch;
  if (!args.answers.empty())
    if (Status fine = check_answers(args.answers_json); !fine)
      return pass(fine.error(), args.answers.string());
  const auto check_role = [](RigDraft&, const std::string&, const std::string& role) {
    return check_role_name(role);
  };
  if (Status fine = apply_pairs(scratch, args.roles, "--role", check_role); !fine) return fine;
  return apply_pairs(scratch, args.numbers, "--set", set_number_text);
}

/// Repeats one question until the answer is valid; an empty line selects the default, if any.
/// Errors: wrong_state if the input has ended.
Status prompt(Console& console, const std::string& question, const std::string& preset,
              const std::function<Status(const std::string&)>& take) {
  const std::string shown = preset.empty() ? preset : " [" + preset + "]";
  for (std::string line;;) {
    console.err << question << shown << ": " << std::flush;
    if (!std::getline(*console.in, line))
      return fail({.code = Errc::wrong_state,
                   .what = "input ended before the last question; no file was written",
                   .hint = "Answer all questions, or use the defaults with --yes"});
    const std::string answer(trimmed(line, " \t\r"));
    const Status taken = answer.empty() && !preset.empty() ? Status{} : take(answer);
    if (taken) return {};
    console.err << "  " << to_string(taken.error()) << "\n";
  }
}

Status prompt_all(RigDraft& draft, Console& console) {
  for (std::size_t i = 0; i < draft.devices.size(); ++i) {
    const FoundDevice found = draft.devices[i].found;
    if (found.kind == DeviceKind::stage && draft.devices[i].stage.empty() && !found.stages.empty())
      if (Status done = prompt(
              console, "Stage at " + format_device(found) + " (" + joined(found.stages) + ")", "",
              [&](const auto& text) { return set_stage(draft, found.place, text); });
          !done)
        return done;
    const std::string question =
        "Role of " + format_device(found) + " (" + joined(possible_roles(draft.devices[i])) + ")";
    if (Status done = prompt(console, question, draft.devices[i].role,
                             [&](const auto& text) { return set_role(draft, found.place, text); });
        !done)
      return done;
    draft.devices[i].is_role_stated = true;  // an empty line accepts the role
  }
  for (const NumberKey* const key : unstated_numbers(draft))
    if (Status done = prompt(
            console, sentence_case(key->question),
            draft.has_default(*key) ? general(draft.number(key->name)) : std::string(),
            [&](const auto& text) { return set_number_text(draft, std::string(key->name), text); });
        !done)
      return done;
  return {};
}

Result<Endpoint> parse_console(const std::string& text) {
  const auto place = parse_box_place(text);
  if (!place || text.find(':') == std::string::npos || text.find('/') != std::string::npos)
    return fail({.where = "--emulated",
                 .what = "not an address of a weft-rig console",
                 .expected = "HOST:PORT, as weft-rig prints it",
                 .got = text});
  return place->records;
}

/// Devices left out by options and answers, for which no question is asked.
std::vector<std::string> left_out(const InitArgs& args) {
  std::vector<std::string> out = devices_without_role(args.answers_json);
  for (const std::string& pair : args.roles)
    if (const std::size_t equals = pair.rfind('=');
        equals != std::string::npos && pair.substr(equals + 1) == no_role)
      out.push_back(pair.substr(0, equals));
  return out;
}

/// The search result, and a draft of the rig.
struct Found {
  SearchReport report;
  RigDraft draft;
};

Result<Found> find_devices(const InitArgs& args, const std::string& name, Console& console) {
  Found out;
  if (!args.simulated.empty()) {
    auto draft = simulated_draft(args.simulated);
    if (!draft) return pass(draft.error(), "--simulated");
    out.draft = std::move(*draft);
    if (!args.name.empty()) out.draft.name = args.name;
    return out;
  }
  Endpoint order_port;
  if (!args.emulated.empty()) {
    const auto place = parse_console(args.emulated);
    if (!place) return pass(place.error());
    order_port = *place;
  }
  const bool only_named = args.only_named || !args.emulated.empty();
  console.err << "Looking for devices; nothing moves ...\n" << std::flush;
  SearchRequest request;
  request.ports = args.ports;
  request.boxes = args.boxes;
  request.left_out = left_out(args);
  request.search_ports = !only_named;
  request.search_network = !only_named && !args.no_network;
  auto report = search_devices(request);
  if (!report) return pass(report.error());
  out.draft = draft_of(name, args.emulated.empty() ? BenchMode::real : BenchMode::emulated,
                       report->devices);
  out.draft.console = order_port;
  out.draft.left_out = report->left_out;
  out.report = std::move(*report);
  return out;
}

Result<int> run_init(const InitArgs& given, Console& console) {
  InitArgs args = given;
  if (Status is_new = require_new_file(args.rig); !is_new) return pass(is_new.error());
  const bool is_found = args.simulated.empty();
  const bool can_prompt = is_found && !args.yes && args.answers.empty();
  if (can_prompt && console.keyboard < 0)
    return fail({.code = Errc::unsupported,
                 .where = "weft init",
                 .what = "no terminal for the questions",
                 .expected = "a terminal, --answers FILE or --yes"});
  if (!args.answers.empty()) {
    auto text = read_text_file(args.answers);
    if (!text) return pass(text.error());
    args.answers_json = std::move(*text);
  }
  if (Status fine = check_args(args); !fine) return pass(fine.error());
  const std::string name = args.name.empty() ? args.rig.stem().string() : args.name;
  auto found = find_devices(args, name, console);
  if (!found) return pass(found.error());
  if (is_found) console.err << format_found(found->report);
  if (const auto silent = unanswered(found->report); !silent.empty())
    return refuse_draft(silent, found->report, console);
  RigDraft& draft = found->draft;
  if (Status done = apply_args(draft, args); !done) return pass(done.error());
  if (can_prompt)
    if (Status done = prompt_all(draft, console); !done) return pass(done.error());
  if (const auto missing = missing_parts(draft); !missing.empty())
    return refuse_draft(missing, found->report, console);
  if (Status written = write_rig(draft, args.rig); !written) return pass(written.error());
  const std::string recipe = suitable_recipe(draft, args.rig);
  print(console, format_init(args.rig, recipe, draft),
        init_json(args.rig, recipe, draft, found->report));
  return exit_ok;
}

}  // namespace

void add_init_command(const CommandGroup& weft) {
  weft.add<InitArgs>("init", run_init);
}

}  // namespace weft::daemon::cli

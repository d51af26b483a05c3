#include "daemon/apps/weft/bench_options.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "daemon/base/text/format.hpp"
#include "protocols/base/json_text.hpp"
#include "recipes/schema/parameters.hpp"
#include "sim/plant/fidelity/choose.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;
using recipes::Cleanup;
using recipes::RigFact;

// Bypasses the streams, because the hanging thread may hold their locks.
void write_line(int descriptor, const std::string& line) {
  [[maybe_unused]] const auto written = ::write(descriptor, line.data(), line.size());
}

template <class Parse>
auto problem_of(Parse parse) {
  return [parse](const std::string& text) {
    const Result<double> read = parse(text);
    return read ? std::string() : to_string(read.error());
  };
}

template <class Parse>
std::optional<double> read(const std::string& text, Parse parse) {
  if (text.empty()) return std::nullopt;
  const Result<double> value = parse(text);
  return value ? std::optional<double>(*value) : std::nullopt;
}

/// JSON text of a typed value: a number, a flag or a quoted text as it is; any other text as a
/// string.
std::string scalar_text(const std::string& typed) {
  const auto value = parse_json(typed);
  const bool is_scalar = value && value->is_primitive() && !value->is_null();
  return is_scalar ? value->dump() : json(typed).dump();
}

std::string assignment_problem(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || !recipes::is_parameter_name(text.substr(0, equals)))
    return "not NAME=VALUE (expected a name of " + std::string(recipes::parameter_name_rule) +
           ", then '='): " + recipes::clipped(text);
  return is_utf8(text) ? std::string() : "the text is not UTF-8";
}

Error refusal(const std::filesystem::path& file, const std::vector<FileProblem>& problems) {
  const auto count =
      std::ranges::count_if(problems, [&](const FileProblem& p) { return p.file == file; });
  return {.code = Errc::invalid_argument,
          .where = file.string(),
          .what = "the file is refused",
          .expected = "no problem",
          .got = std::to_string(count) + (count == 1 ? " problem" : " problems")};
}

}  // namespace

void add_options(CLI::App& command, ParameterArgs& args) {
  command
      .add_option("--set", args.set,
                  "NAME=VALUE: bind a parameter of the recipe; may be given again")
      ->allow_extra_args(false)
      ->check(assignment_problem);
}

std::string parameters_json(const ParameterArgs& args) {
  std::string text;
  for (const std::string& each : args.set) {
    const std::size_t equals = each.find('=');
    (text += text.empty() ? "{" : ",") +=
        json(each.substr(0, equals)).dump() + ":" + scalar_text(each.substr(equals + 1));
  }
  return text.empty() ? text : text + "}";
}

Status put_parameters(const ParameterArgs& args, json& params) {
  if (args.set.empty()) return {};
  Result<json> values = parse_json(parameters_json(args));
  if (!values) return pass(values.error(), "--set");
  params["parameters"] = std::move(*values);
  return {};
}

void add_options(CLI::App& command, PluginArgs& args) {
  command.add_option("--plugins", args.folders,
                     "folder with drivers (weft-driver-NAME.so); may be given again");
  command.add_flag("--plugins-only", args.only,
                   "leave out the drivers that are built in: for a plugin of the same name");
}

PluginSettings make_settings(const PluginArgs& args, const Console& console) {
  PluginSettings settings;
  settings.folders = args.folders;
  settings.builtins = !args.only;
  const char* path = std::getenv("WEFT_PLUGIN_PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty()) settings.folders.emplace_back(folder);
  settings.hung = [as_json = console.json](const Error& error) {
    write_line(STDERR_FILENO, "weft: " + to_string(error) + "\n");
    if (as_json) write_line(STDOUT_FILENO, json{{"error", error_json(error)}}.dump() + "\n");
    ::_exit(exit_failure);
  };
  return settings;
}

void add_options(CLI::App& command, FidelityArgs& args) {
  command
      .add_option("--accuracy", args.accuracy,
                  "largest error of the recorded simulated force, 10mN or 0.5% of 5 N: take the "
                  "fastest setting that promises it, and check the run (exit status 3: missed)")
      ->check(problem_of(sim::parse_accuracy_n));
  command
      .add_option("--budget", args.budget,
                  "least speed of the whole run, 1000x real time: take the most accurate setting "
                  "whose forecast reaches it")
      ->check(problem_of(sim::parse_times_real_time));
}

void add_strict_option(CLI::App& command, FidelityArgs& args) {
  command
      .add_flag("--accuracy-strict", args.strict,
                "where the accuracy is missed, move the campaign to OUT/aside-N and run the next "
                "setting, at most three times")
      ->needs("--accuracy");
}

FidelityRequest fidelity_request(const FidelityArgs& args) {
  FidelityRequest out{.accuracy_n = read(args.accuracy, sim::parse_accuracy_n),
                      .times_real_time = read(args.budget, sim::parse_times_real_time)};
  out.strict = args.strict;
  return out;
}

void print_device_log(const DeviceLogEntry& line, Console& console) {
  console.err << "weft: " << line.device << ": "
              << (line.level == LogLevel::error ? "error: " : "warning: ") << line.text
              << std::endl;
}

json diagnostic_json(const recipes::Diagnostic& d) {
  return {{"pointer", d.pointer}, {"message", d.message}, {"expected", d.expected},
          {"got", d.got},         {"hint", d.hint},       {"sentence", recipes::to_string(d)}};
}

int refuse(const std::vector<FileProblem>& problems, Console& console) {
  const Error first = refusal(problems.front().file, problems);
  json object = error_json(first);
  object["problems"] = json::array();
  const std::filesystem::path* file = nullptr;
  for (const FileProblem& problem : problems) {
    if (file == nullptr || *file != problem.file)
      console.err << "weft: " << to_string(refusal(problem.file, problems)) << '\n';
    file = &problem.file;
    console.err << "  " << recipes::to_string(problem.what) << '\n';
    json one = diagnostic_json(problem.what);
    one["file"] = problem.file.string();
    object["problems"].push_back(std::move(one));
  }
  if (console.json) print(console, {}, {{"error", object}});
  return exit_failure;
}

std::string format_rig(Cleanup cleanup, RigFact rig) {
  const std::string cleanup_text =
      "; look at the bench before anything moves, and lift the probe by hand if a stage is dead: "
      "the next run homes z, upwards, before all else";
  // The final steps begin only with the probe at the clear height.
  if (cleanup == Cleanup::partial)
    return rig == RigFact::safe
               ? "the probe is up, but what the recipe does finally was not done to its end"
               : "the probe was up, but what the recipe does finally failed: where the stages "
                 "stand is not known; look at the bench before anything moves";
  if (rig == RigFact::safe) return {};
  if (rig == RigFact::holding)
    return "the probe was not lifted: the stages stand where they were, and it may bear on the "
           "cloth" +
           cleanup_text;
  return "the probe was not lifted, as far as is known: the rig is " +
         std::string(recipes::to_string(rig)) + ", and the probe may still bear on the cloth" +
         cleanup_text;
}

}  // namespace weft::daemon::cli

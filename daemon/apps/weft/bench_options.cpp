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
    return "not NAME=VALUE: " + std::string(recipes::clipped(text)) + " (expected a name of " +
           std::string(recipes::parameter_name_rule) + ", then '=')";
  return is_utf8(text) ? std::string() : "text not in UTF-8";
}

Error refusal(const std::filesystem::path& file, const std::vector<FileProblem>& problems) {
  const auto count =
      std::ranges::count_if(problems, [&](const FileProblem& p) { return p.file == file; });
  return {.code = Errc::invalid_argument,
          .where = file.string(),
          .what = "file not accepted",
          .got = std::to_string(count) + (count == 1 ? " problem" : " problems")};
}

}  // namespace

void add_options(CLI::App& command, ParameterArgs& args) {
  command
      .add_option("--set", args.set, "set a parameter of the recipe, as NAME=VALUE (repeatable)")
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
                     "load drivers (weft-driver-NAME.so) from this folder (repeatable)");
  command.add_flag("--plugins-only", args.only,
                   "use no built-in drivers, so that plugins can replace them");
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
                  "accept this error of the simulated force, such as 10mN or 0.5% of 5 N")
      ->check(problem_of(sim::parse_accuracy_n));
  command
      .add_option("--budget", args.budget, "simulate at least this fast, such as 1000x real time")
      ->check(problem_of(sim::parse_times_real_time));
}

void add_strict_option(CLI::App& command, FidelityArgs& args) {
  command
      .add_flag("--accuracy-strict", args.strict,
                "if the accuracy is missed, run again more accurately, at most three times")
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
      ". Inspect the bench before anything moves. If a stage is dead, lift the probe by hand: the "
      "next run homes z first, upwards";
  // The final steps begin only with the probe at the clear height.
  if (cleanup == Cleanup::partial)
    return rig == RigFact::safe
               ? "the probe is up, but the final steps of the recipe were not finished"
               : "the probe was up, but the final steps of the recipe failed; the stage positions "
                 "are unknown. Inspect the bench before anything moves";
  if (rig == RigFact::safe) return {};
  if (rig == RigFact::holding)
    return "the probe was not lifted: the stages stopped, and it may still press on the fabric" +
           cleanup_text;
  return "the probe was probably not lifted: the rig is " + std::string(recipes::to_string(rig)) +
         ", and the probe may still press on the fabric" + cleanup_text;
}

}  // namespace weft::daemon::cli

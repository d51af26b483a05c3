#include "daemon/cli/preflight.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "daemon/cli/bench_check.hpp"
#include "daemon/run/live_watch.hpp"
#include "daemon/run/open_rig.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;
using recipes::Diagnostic;

void add(const std::filesystem::path& file, const std::vector<Diagnostic>& list,
         std::vector<FileProblem>& problems) {
  for (const Diagnostic& diagnostic : list) problems.push_back({file, diagnostic});
}

Error refusal(const std::filesystem::path& file, const std::vector<FileProblem>& problems) {
  const auto count =
      std::ranges::count_if(problems, [&](const FileProblem& p) { return p.file == file; });
  return {Errc::invalid_argument,
          "the file is refused",
          file.string(),
          "no problem",
          std::to_string(count) + (count == 1 ? " problem" : " problems"),
          {}};
}

}  // namespace

Result<Preflight> preflight(const std::filesystem::path& recipe, const std::filesystem::path& rig,
                            std::optional<std::uint64_t> seed, const FidelityAsked& fidelity,
                            const PluginSettings& plugins) {
  const auto opened = open_rig(rig, plugins);
  if (!opened) return pass(opened.error());
  const RigFile& devices = opened->file;
  const Result<std::string> text = read_text_file(recipe, recipes::max_recipe_bytes);
  if (!text) return pass(text.error());
  recipes::CheckReport checked = recipes::check_recipe(*text, opened->limits, seed);
  Preflight out{std::move(checked.plan), {}, {}, std::move(checked.warnings)};
  add(recipe, checked.problems, out.problems);
  if (!out.plan) return out;
  if (const auto models = load_live_models(*out.plan, recipe.parent_path()); !models)
    add(recipe, {diagnostic(models.error(), pointer_in(models.error().where))}, out.problems);
  const auto chosen = choose_simulation(devices, rig, *out.plan, fidelity);
  if (chosen) out.simulation = chosen->note;
  // A fidelity that is refused is told once; the rig file as it stands may have other problems.
  Result<RigFile> settled = parse_rig_file(chosen ? chosen->rig_text : devices.text);
  if (!settled) return pass(settled.error(), rig.string());
  settled->drivers = devices.drivers;
  BenchFindings bench = check_bench(*out.plan, *settled, rig);
  if (!chosen && bench.rig.empty())
    bench.rig.push_back(diagnostic(chosen.error(), pointer_in(chosen.error().where)));
  add(recipe, bench.recipe, out.problems);
  add(rig, bench.rig, out.problems);
  return out;
}

json diagnostic_json(const Diagnostic& d) {
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

}  // namespace weft::daemon::cli

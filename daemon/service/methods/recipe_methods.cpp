#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/report/report.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "protocols/base/json_text.hpp"
#include "recipes/engine/operator_steps.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::daemon::api {
namespace {

namespace fs = std::filesystem;

json diagnostic_json(const recipes::Diagnostic& d) {
  json out{{"where", d.pointer}, {"message", d.message}};
  if (!d.expected.empty()) out["expected"] = d.expected;
  if (!d.got.empty()) out["got"] = d.got;
  if (!d.hint.empty()) out["hint"] = d.hint;
  return out;
}

json diagnostics_json(const std::vector<recipes::Diagnostic>& list) {
  json out = json::array();
  for (const auto& one : list) out.push_back(diagnostic_json(one));
  return out;
}

json plan_json(const recipes::Plan& plan) {
  json next = nullptr;
  if (const auto prompt = recipes::next_prompt(plan, 0))
    next = {{"text", prompt->text},
            {"people_s", prompt->people_s},
            {"after_s", recipes::machine_s(plan, 0, prompt->trial)}};
  const auto& force = plan.forecast.force_n;
  return {{"name", plan.name},
          {"trials", plan.trials.size()},
          {"fabrics", plan.fabrics},
          {"eta_s", plan.forecast.total_s()},
          {"people_s", plan.forecast.people_s},
          {"asks", plan.forecast.prompts},
          {"next_attention", std::move(next)},
          {"envelope", envelope_json(plan.forecast)},
          {"force_min_n", force ? json(force->min) : json()},
          {"force_max_n", force ? json(force->max) : json()},
          {"data_bytes", plan.forecast.bytes},
          {"bytes", disk_forecast(plan)}};
}

/// Null if the file cannot be read or is not a JSON object.
json read_document(const fs::path& file) {
  const auto text = read_text_file(file, recipes::max_recipe_bytes);
  auto document = text ? parse_json(*text, {}) : Result<json>(pass(text.error()));
  return document && document->is_object() ? std::move(*document) : json();
}

/// Reads each recipe of the folder.
Outcome listed(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  if (error)
    return refused({.code = Errc::io,
                    .where = folder.string(),
                    .what = "recipe folder not readable",
                    .got = error.message()});
  std::sort(names.begin(), names.end());
  json parameters = json::object(), descriptions = json::object();
  for (const std::string& name : names) {
    const json document = read_document(folder / (name + ".json"));
    if (document.is_null()) continue;
    if (json declared = document.value("parameters", json::object()); !declared.empty())
      parameters[name] = std::move(declared);
    if (document.contains("description")) descriptions[name] = document["description"];
  }
  return format_text({{"recipes", std::move(names)},
                      {"parameters", std::move(parameters)},
                      {"descriptions", std::move(descriptions)}});
}

// Runs on the server's thread: a client that shuts down its side after its last request, such as
// nc, gets no later answer.
Outcome list_recipes(const Services& services, const Call&) {
  return listed(services.recipes);
}

/// Returns the file unchanged, even if recipe.check refuses it.
Outcome get(const Services& services, const Call& call) {
  const auto file = recipe_file(services, call.params.at("recipe").get<std::string>());
  if (!file) return refused(file.error());
  const auto text = read_text_file(*file, recipes::max_recipe_bytes);
  if (!text) return refused(text.error());
  const auto document = parse_json(*text, {});
  return format_text({{"recipe", file->stem().string()},
                      {"text", *text},
                      {"content", document ? json(*document) : json()},
                      {"file_digest", "sha256:" + sha256_hex(*text)}});
}

json problems_json(const std::vector<FileProblem>& list) {
  json out = json::array();
  for (const FileProblem& one : list) {
    out.push_back(diagnostic_json(one.what));
    out.back()["file"] = one.file.string();
  }
  return out;
}

/// Uses nothing of the call, because it runs on another thread.
Outcome checked(const CampaignRequest& request, const fs::path& data) {
  const auto found = preflight(request, PluginDrivers::unread);
  if (!found) return refused(found.error());
  json out{{"ok", found->problems.empty()},
           {"digest", "sha256:" + sha256_hex(found->recipe_text)},
           {"file_digest", "sha256:" + sha256_hex(found->file_text)},
           {"parameters", json::parse(found->parameters_json)},
           {"problems", problems_json(found->problems)},
           {"warnings", diagnostics_json(found->warnings)}};
  if (found->plan) {
    out["plan"] = plan_json(*found->plan);
    out["disk_ok"] = check_space(data, disk_forecast(*found->plan)).has_value();
  }
  return format_text(out);
}

/// Errors: invalid_argument.
Result<std::string> plain_name(std::string name) {
  constexpr std::size_t longest = 100;
  if (name.ends_with(".json")) name.resize(name.size() - 5);
  if (recipes::is_name(name, longest)) return name;
  return pass(bad_param("recipe", "invalid recipe name",
                        "1 to 100 letters, digits, '-', '_' and '.', not starting with - or .",
                        recipes::clipped(name)));
}

// A model may have hundreds of megabytes; reading it here would delay a halt.
void check(const Services& services, const Call& call, const Responder& respond) {
  const bool is_given = call.params.contains("content");
  const std::string name = call.params.at("recipe").get<std::string>();
  Result<fs::path> file = fs::path();
  if (is_given) {
    const auto plain = plain_name(name);
    file = plain ? Result<fs::path>(services.recipes / (*plain + ".json")) : pass(plain.error());
  } else {
    file = recipe_file(services, name);
  }
  if (!file) return respond(refused(file.error()));
  const auto seed = read_seed(call);
  if (!seed) return respond(refused(seed.error()));
  CampaignRequest request{*file, services.rig, {}, *seed};
  request.parameters_json = read_parameters(call);
  if (is_given) request.recipe_text = call.params.at("content").dump(2) + "\n";
  answer_in_background(
      services.background, respond,
      [request = std::move(request), data = services.data] { return checked(request, data); });
}

// Storing a recipe in the daemon's folder: a new one or a replacement, checked first.

/// The recipe to store, copied from the call because another thread checks it.
struct Offered {
  std::string name, text, by;
  std::string parameters_json;          ///< parameter values for the check
  std::optional<std::string> replaces;  ///< digest of the stored file that the caller knows
};

/// The text as typed, or the content written as JSON. Errors: invalid_argument.
Result<std::string> read_offered_text(const Call& call) {
  const bool is_text = call.params.contains("text");
  if (is_text == call.params.contains("content"))
    return pass(bad_param("content", "recipe given twice or not at all", "content or text",
                          is_text ? "both" : "neither"));
  if (!is_text) return call.params.at("content").dump(2) + "\n";
  std::string text = call.params.at("text").get<std::string>();
  if (const auto read = parse_json(text, {}); !read) return pass(read.error(), "/params/text");
  return text;
}

/// Number of planned trials. Errors: the first problem that recipe.check finds; those of
/// preflight().
Result<std::size_t> count_trials(const CampaignRequest& request) {
  const auto found = preflight(request, PluginDrivers::unread);
  if (!found) return pass(found.error());
  if (found->problems.empty()) return found->plan->trials.size();
  const auto& [file, first] = found->problems.front();
  const std::size_t more = found->problems.size() - 1;
  const std::string about = file == request.recipe ? "/params/content" : file.string() + ": ";
  return fail({.code = Errc::invalid_argument,
               .where = about + first.pointer,
               .what = first.message + (more == 0 ? "" : ", and " + std::to_string(more) + " more"),
               .expected = first.expected,
               .got = first.got,
               .hint = first.hint});
}

/// A run reads its recipe when it starts and compares it when it is resumed. Therefore the recipe
/// of an unfinished run must not change. Errors: wrong_state.
Status require_unused(const Services& services, const fs::path& file) {
  runs::RunFilter not_ended;
  for (const runs::RunState state : runs::all_run_states)
    if (state != runs::RunState::ended) not_ended.states.push_back(state);
  const auto found = services.log->runs(not_ended, {}, runs::RunStore::no_limit);
  if (!found) return pass(found.error());
  std::error_code unseen;
  for (const runs::StoredRun& run : found->runs)
    if (run.recipe == file || fs::equivalent(run.recipe, file, unseen))
      return fail(
          {.code = Errc::wrong_state,
           .where = "/params/recipe",
           .what = "recipe in use by a run that has not ended",
           .got = run.id(),
           .hint = "Wait until it has ended, remove it from the queue, or use another name"});
  return {};
}

/// Digest of the stored file; empty if there is none. Errors: io.
Result<std::string> compute_digest(const fs::path& file) {
  std::error_code unseen;
  if (!fs::exists(file, unseen)) return std::string();
  const auto text = read_text_file(file, recipes::max_recipe_bytes);
  if (!text) return pass(text.error());
  return "sha256:" + sha256_hex(*text);
}

Status is_as_known(const std::string& found, const std::optional<std::string>& known) {
  if (found == known.value_or("")) return {};
  if (!known)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/recipe",
                 .what = "recipe name already in use",
                 .got = found,
                 .hint = "Pass this digest as if_digest to replace the recipe"});
  return fail({.code = Errc::wrong_state,
               .where = "/params/if_digest",
               .what = "recipe has changed meanwhile",
               .expected = found.empty() ? "none: no recipe has this name" : found,
               .got = *known,
               .hint = "Read the present file_digest with recipe.check"});
}

/// Journals first, so that every stored recipe has a recorded author. If the file cannot be
/// written, a second journal line reports that.
Outcome written(const Services& services, const Offered& offered, std::size_t trials) {
  const fs::path file = services.recipes / (offered.name + ".json");
  const auto before = compute_digest(file);
  if (!before) return refused(before.error());
  if (Status same = is_as_known(*before, offered.replaces); !same) return refused(same.error());
  if (Status free = require_unused(services, file); !free) return refused(free.error());
  const json reply{{"recipe", offered.name},
                   {"digest", "sha256:" + sha256_hex(offered.text)},
                   {"replaced", before->empty() ? json() : json(*before)},
                   {"trials", trials}};
  if (const Status ok = append_journal(services, "recipe.put", offered.by, reply); !ok)
    return refused(ok.error());
  if (Status ok = write_text_file(file, offered.text); !ok) {
    json not_put = reply;
    not_put["error"] = to_string(ok.error());
    services.log->persist({.journal = {{0, services.utc_us(), "", "recipe.not_put", offered.by,
                                        format_text(not_put)}}});
    return refused(ok.error());
  }
  return format_text(reply);
}

void put(const Services& services, const Call& call, const Responder& respond) {
  if (services.one_run)
    return respond(refused({.code = Errc::wrong_state,
                            .what = "recipes cannot be changed by the daemon of a weft run",
                            .hint = "Write the file into the recipe folder"}));
  auto name = plain_name(call.params.at("recipe").get<std::string>());
  if (!name) return respond(refused(name.error()));
  auto text = read_offered_text(call);
  if (!text) return respond(refused(text.error()));
  Offered offered{std::move(*name), std::move(*text), by(call.caller), read_parameters(call), {}};
  if (call.params.contains("if_digest")) offered.replaces = call.params.at("if_digest");
  // Its models are read completely, as for recipe.check, but no start of a run waits for that.
  const bool taken = services.background(
      [s = &services, offered = std::move(offered), respond]() -> Services::Report {
        CampaignRequest request{s->recipes / (offered.name + ".json"), s->rig, {}, {}};
        request.recipe_text = offered.text;
        request.parameters_json = offered.parameters_json;
        return [s, offered, respond, trials = count_trials(request)] {
          respond(trials ? written(*s, offered, *trials) : refused(trials.error()));
        };
      },
      [respond](const Error& escaped) { respond(refused(escaped)); });
  if (!taken)
    respond(refused({.code = Errc::timeout,
                     .what = "too many slow requests are waiting",
                     .hint = "Retry later"}));
}

}  // namespace

void add_recipe_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read("recipe.list", "list the recipes in the daemon's folder", {},
             "recipes (names), parameters (by recipe, as declared; only recipes with parameters), "
             "descriptions (by recipe; only recipes with a description)",
             list_recipes);
  group.read("recipe.get", "get a recipe of the daemon's folder as written",
             {{"recipe", ParamType::text, true, "name of the recipe"}},
             "recipe, text, content (the text as JSON; null: not JSON), file_digest", get);
  group.read("recipe.schema", "get the JSON Schema of a recipe", {},
             "a JSON Schema of draft 2020-12 with x-unit", [](const Services&, const Call&) {
               return format_text(json::parse(recipe_schema_json()));
             });
  group.read(
      "recipe.check", "check a recipe on this rig and list all problems; nothing moves",
      {{"recipe", ParamType::text, true, "name of the recipe"},
       {"seed", ParamType::integer, false, "seed (default: that of the recipe)"},
       parameters_param,
       {"content", ParamType::object, false, "recipe to check instead of the file in the folder"}},
      "ok, digest (of the resolved recipe), file_digest, parameters (as declared), plan "
      "(eta_s including people_s for operator steps, asks, next_attention, envelope of each stage "
      "with its margin, data_bytes of the samples, bytes that must be free on the disk including "
      "the reserve), problems of the recipe, the rig file and the bench built without devices: "
      "file, where, message, expected, got, hint; warnings, disk_ok",
      check);
  group.change(
      "recipe.put", "write a recipe that recipe.check accepts to the daemon's folder",
      Role::engineer,
      {{"recipe", ParamType::text, true, "name of the recipe"},
       {"content", ParamType::object, false, "the recipe as JSON; see recipe.schema"},
       {"text", ParamType::text, false, "the recipe as text, written unchanged; instead of content",
        recipes::max_recipe_bytes},
       {"if_digest", ParamType::text, false,
        "file_digest of the recipe to replace; needed if the name is in use"},
       {"parameters", ParamType::object, false,
        "values used in the check, for parameters without default"}},
      "recipe, digest, replaced (digest, or null), trials", put);
}

}  // namespace weft::daemon::api

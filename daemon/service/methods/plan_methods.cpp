// Methods that compute a recipe's plan, and the differences between two recipes.

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "recipes/engine/plan.hpp"
#include "recipes/schema/diagnostic.hpp"
#include "recipes/schema/object_reader.hpp"

namespace weft::daemon::api {
namespace {

constexpr std::int64_t most_steps = 1000;
constexpr std::size_t most_differences = 1000;

/// Location of a recipe's text; found on the server's thread, read on another.
struct RecipePlace {
  std::filesystem::path file;              ///< recipe file, or a run's campaign file
  std::string run;                         ///< the run that recorded this recipe; empty for a file
  std::optional<std::string> text = {};    ///< recipe text of a run, as the daemon stored it
  std::optional<std::uint64_t> seed = {};  ///< seed of the run, if it replaces the recipe's
};

/// A queued run has no campaign file yet, so the stored text is used. Runs older than the stored
/// texts have only the campaign file.
Result<RecipePlace> place_of_run(const Services& services, const runs::StoredRun& run) {
  RecipePlace place{run.folder / campaign_file_name, run.id()};
  place.seed = run.seed;
  if (run.recipe_sha256.empty()) return place;
  auto text = services.log->recipe_text(run.recipe_sha256);
  if (!text) return pass(text.error(), place.run);
  place.text = std::move(*text);
  return place;
}

Result<RecipePlace> recipe_place(const Services& services, const Call& call, const char* param) {
  const std::string name = call.params.at(param).get<std::string>();
  if (const auto run = services.run_manager->get(name)) return place_of_run(services, run->stored);
  const auto file = recipe_file(services, name);
  if (file) return RecipePlace{*file, {}};
  Error none = file.error();
  none.where = std::string("/params/") + param;
  return pass(std::move(none));
}

Result<std::string> recipe_text(const RecipePlace& place) {
  if (place.text) return *place.text;
  if (place.run.empty()) return read_text_file(place.file, recipes::max_recipe_bytes);
  const auto header = load_header(place.file);
  if (header) return header->info.recipe_json;
  return pass(header.error(), place.run);
}

json point_json(const recipes::Vec2& point) {
  return {{"x_m", point.x_m}, {"y_m", point.y_m}};
}

json phase_json(const recipes::PhaseStep& step) {
  json out{{"phase", std::string(1, to_char(step.phase))}, {"duration_s", step.duration_s}};
  if (step.depth_m > 0) out["press_depth_m"] = step.depth_m;
  if (step.force_band_n > 0) {
    out["force_n"] = step.force_n;
    out["force_band_n"] = step.force_band_n;
  }
  if (step.phase == Phase::motion) {
    out["speed_mps"] = step.speed_mps;
    out["corners"] = json::array();
    for (const recipes::Vec2& corner : step.path_m) out["corners"].push_back(point_json(corner));
  }
  return out;
}

json exploration_json(const recipes::Exploration& exploration) {
  json phases = json::array();
  for (const recipes::PhaseStep& step : exploration.phases) phases.push_back(phase_json(step));
  return {{"exploration", exploration.name},
          {"start", point_json(exploration.start_m)},
          {"phases", std::move(phases)}};
}

json handover_plan(const recipes::Plan& plan) {
  if (!plan.handover) return nullptr;
  return {{"from", to_string(plan.handover->from)},
          {"learner", plan.handover->learner},
          {"groups", plan.handover->groups},
          {"at_most_s", plan.handover->at_most_s}};
}

/// Trials from index `from`, each with its start time if all earlier trials take their expected
/// time.
json steps_json(const recipes::Plan& plan, std::size_t from, std::size_t most) {
  const std::vector<double> lasts_s = recipes::trial_durations_s(plan);
  json out = json::array();
  double begins_s = 0;
  for (std::size_t i = 0; i < plan.trials.size() && out.size() < most; ++i) {
    const recipes::TrialSpec& trial = plan.trials[i];
    if (i >= from)
      out.push_back({{"trial", i},
                     {"fabric", plan.fabrics[trial.fabric]},
                     {"exploration", plan.explorations[trial.exploration].name},
                     {"repetition", trial.repetition},
                     {"mounts", i == 0 || plan.trials[i - 1].fabric != trial.fabric},
                     {"begins_s", begins_s},
                     {"lasts_s", lasts_s[i]}});
    begins_s += lasts_s[i];
  }
  return out;
}

/// Arguments of recipe.plan, copied from the call because another thread uses them.
struct PlanQuestion {
  RecipePlace recipe;
  std::filesystem::path rig;
  std::optional<std::uint64_t> seed;
  std::size_t from = 0, most = 0;  ///< trial indices and count
  std::string parameters_json;
};

Result<PlanQuestion> plan_question(const Services& services, const Call& call) {
  auto recipe = recipe_place(services, call, "recipe");
  if (!recipe) return pass(recipe.error());
  const auto seed = read_seed(call);
  if (!seed) return pass(seed.error());
  const auto from = read_whole_number(call, {"from", 0, 0, unbounded, "trial number out of range"});
  if (!from) return pass(from.error());
  const auto most =
      read_whole_number(call, {"most", 100, 1, most_steps, "number of trials out of range"});
  if (!most) return pass(most.error());
  const auto planned_with = *seed ? *seed : recipe->seed;
  return PlanQuestion{std::move(*recipe),   services.rig, planned_with, *from, *most,
                      read_parameters(call)};
}

Outcome planned(const PlanQuestion& requested) {
  const auto text = recipe_text(requested.recipe);
  if (!text) return refused(text.error());
  const auto rig = open_rig(requested.rig, {});
  if (!rig) return refused(rig.error());
  const recipes::CheckReport report =
      recipes::check_recipe(*text, rig->limits, requested.seed, requested.parameters_json);
  if (!report.plan) {
    const recipes::Diagnostic& first = report.problems.front();
    return refused({.code = Errc::invalid_argument,
                    .where = first.pointer,
                    .what = first.message,
                    .expected = first.expected,
                    .got = first.got,
                    .hint = "List all " + std::to_string(report.problems.size()) +
                            " problems with recipe.check"});
  }
  const recipes::Plan& found = *report.plan;
  json explorations = json::array();
  for (const recipes::Exploration& each : found.explorations)
    explorations.push_back(exploration_json(each));
  json steps = steps_json(found, requested.from, requested.most);
  const std::size_t next = requested.from + steps.size();
  return format_text({{"name", found.name},
                      {"digest", "sha256:" + sha256_hex(report.recipe_json)},
                      {"parameters", json::parse(report.parameters_json)},
                      {"plan_digest", "sha256:" + sha256_hex(found.canonical_json)},
                      {"trials", found.trials.size()},
                      {"duration_s", found.forecast.duration_s},
                      {"people_s", found.forecast.people_s},
                      {"bytes", disk_forecast(found)},
                      {"hand_over", handover_plan(found)},
                      {"explorations", std::move(explorations)},
                      {"steps", std::move(steps)},
                      {"next", next < found.trials.size() ? json(next) : json()}});
}

/// True if both recipes give the same plan on this rig; null if one of them cannot run on it.
json same_campaign(const std::filesystem::path& file, const std::string& a, const std::string& b) {
  const auto rig = open_rig(file, {});
  if (!rig) return nullptr;
  const recipes::CheckReport one = recipes::check_recipe(a, rig->limits);
  const recipes::CheckReport other = recipes::check_recipe(b, rig->limits);
  if (!one.plan || !other.plan) return nullptr;
  return one.plan->canonical_json == other.plan->canonical_json;
}

/// Arguments of recipe.diff.
struct DiffQuestion {
  struct Side {
    const char* param;
    RecipePlace recipe;
  };
  std::array<Side, 2> sides;
  std::filesystem::path rig;
};

/// Limits the depth as for every recipe, because comparing and writing are recursive.
Result<json> parse_document(const std::string& text, const char* param) {
  json document;
  recipes::Problems problems;
  if (recipes::parse_json(text, {.max_bytes = recipes::max_recipe_bytes}, document, problems))
    return document;
  const recipes::Diagnostic first = problems.take().front();
  return fail({.code = Errc::parse,
               .where = std::string("/params/") + param,
               .what = "recipe not readable: " + first.message,
               .expected = first.expected,
               .got = first.got,
               .hint = "List all its problems with recipe.check"});
}

Outcome compared(const DiffQuestion& requested) {
  std::array<std::string, 2> text;
  std::array<json, 2> document;
  for (std::size_t i = 0; i < 2; ++i) {
    auto read = recipe_text(requested.sides[i].recipe);
    if (!read) return refused(read.error());
    text[i] = std::move(*read);
    auto parsed = parse_document(text[i], requested.sides[i].param);
    if (!parsed) return refused(parsed.error());
    document[i] = std::move(*parsed);
  }
  std::size_t all = 0;
  json found = differences(document[0], document[1], most_differences, all);
  return format_text({{"same", all == 0},
                      {"same_campaign", same_campaign(requested.rig, text[0], text[1])},
                      {"count", all},
                      {"differences", std::move(found)}});
}

// A recipe of one megabyte may plan a million trials; computing them here would delay a halt.
void plan(const Services& services, const Call& call, const Responder& respond) {
  const auto requested = plan_question(services, call);
  if (!requested) return respond(refused(requested.error()));
  answer_in_background(services.background, respond,
                       [requested = *requested] { return planned(requested); });
}

void compare(const Services& services, const Call& call, const Responder& respond) {
  const auto one = recipe_place(services, call, "recipe");
  if (!one) return respond(refused(one.error()));
  const auto other = recipe_place(services, call, "other");
  if (!other) return respond(refused(other.error()));
  answer_in_background(services.background, respond,
                       [requested = DiffQuestion{{{{"recipe", *one}, {"other", *other}}},
                                                 services.rig}] { return compared(requested); });
}

class Difference {
 public:
  explicit Difference(std::size_t most) : most_(most) {}

  void compare(const json& was, const json& is, const std::string& where) {
    if (was.is_object() && is.is_object()) return compare_objects(was, is, where);
    if (was.is_array() && is.is_array()) return compare_lists(was, is, where);
    if (was != is) add({{"where", where}, {"change", "changed"}, {"was", was}, {"is", is}});
  }

  json found = json::array();
  std::size_t all = 0;

 private:
  void compare_objects(const json& was, const json& is, const std::string& where) {
    for (const auto& [key, value] : was.items()) {
      const auto other = is.find(key);
      const std::string inner = recipes::child(where, key);
      if (other == is.end())
        removed(value, inner);
      else
        compare(value, *other, inner);
    }
    for (const auto& [key, value] : is.items())
      if (!was.contains(key)) added(value, recipes::child(where, key));
  }

  void compare_lists(const json& was, const json& is, const std::string& where) {
    const std::size_t both = std::min(was.size(), is.size());
    for (std::size_t i = 0; i < both; ++i) compare(was[i], is[i], recipes::child(where, i));
    for (std::size_t i = both; i < was.size(); ++i) removed(was[i], recipes::child(where, i));
    for (std::size_t i = both; i < is.size(); ++i) added(is[i], recipes::child(where, i));
  }

  void removed(const json& value, const std::string& where) {
    add({{"where", where}, {"change", "removed"}, {"was", value}});
  }
  void added(const json& value, const std::string& where) {
    add({{"where", where}, {"change", "added"}, {"is", value}});
  }
  void add(json one) {
    if (++all <= most_) found.push_back(std::move(one));
  }

  std::size_t most_;
};

}  // namespace

json differences(const json& was, const json& is, std::size_t most, std::size_t& all) {
  Difference difference(most);
  difference.compare(was, is, "");
  all = difference.all;
  return std::move(difference.found);
}

void add_plan_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read(
      "recipe.plan", "plan a recipe on this rig: phases, and each trial with its expected time",
      {{"recipe", ParamType::text, true, "name of a recipe, or a run for the recipe it recorded"},
       {"seed", ParamType::integer, false, "seed (default: that of the recipe or run)"},
       {"from", ParamType::integer, false, "index of the first trial (default: 0)"},
       {"most", ParamType::integer, false, "largest number of trials, up to 1000 (default: 100)"},
       parameters_param},
      "name, digest (of the resolved recipe), parameters (as declared), plan_digest, trials, "
      "duration_s, people_s, bytes, hand_over, explorations, steps, next",
      plan);
  group.read(
      "recipe.diff", "compare two recipes; differences are named by JSON pointer",
      {{"recipe", ParamType::text, true, "name of a recipe, or a run for the recipe it recorded"},
       {"other", ParamType::text, true, "the other recipe, in the same form"}},
      "same (as written), same_campaign (planned on this rig with default parameters; null: not "
      "known), count, differences: where, change, was, is; the first 1000",
      compare);
}

}  // namespace weft::daemon::api

#include "daemon/service/methods/helpers.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/service/rpc/session.hpp"
#include "protocols/base/closest.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::api {

Error bad_param(std::string_view name, std::string what, std::string expected, std::string got) {
  return {.code = Errc::invalid_argument,
          .where = "/params/" + std::string(name),
          .what = std::move(what),
          .expected = std::move(expected),
          .got = std::move(got)};
}

Outcome run_outcome(const Result<runs::RunView>& run) {
  if (!run) return refused(run.error());
  return format_text(run_json(*run));
}

namespace {

/// Every call gets an answer: the report that `work` returns answers on the server's thread.
void answer_by(const Services::BackgroundTask& background, const Responder& respond,
               std::function<Services::Report()> work) {
  const bool taken = background(std::move(work), [respond](const Error& escaped) {
    respond(refused(rpc::code::internal, "internal", escaped));
  });
  if (!taken)
    respond(refused(rpc::code::request + 29, "request.too_many",
                    {.code = Errc::wrong_state,
                     .what = "too many slow requests are waiting",
                     .hint = "Retry later"},
                    true));
}

}  // namespace

void answer_in_background(const Services::BackgroundTask& background, const Responder& respond,
                          std::function<Outcome()> work) {
  answer_by(background, respond, [work = std::move(work), respond]() -> Services::Report {
    return [outcome = work(), respond] { respond(outcome); };
  });
}

void check_in_background(const Services& services, const Call& call, const Responder& respond,
                         CampaignRequest request,
                         std::function<Outcome(const Call&, const runs::Checked&)> then) {
  struct CallCopy {
    json params;
    rpc::Caller caller;
  };
  answer_by(services.change_background, respond,
            [copy = std::make_shared<const CallCopy>(CallCopy{call.params, call.caller}), respond,
             request = std::move(request), then = std::move(then)]() -> Services::Report {
              return [checked = std::make_shared<const runs::Checked>(check_quickly(request)), copy,
                      respond, then] {
                respond(then({copy->params, copy->caller}, *checked));
              };
            });
}

tl::unexpected<rpc::RpcError> lease_held(const access::Lease& lease, const rpc::Caller& caller) {
  const std::string note =
      lease.kept_for.empty() ? lease.note : "until " + lease.kept_for + " ends";
  return refused(rpc::code::access + 10, "lease.held",
                 {.code = Errc::wrong_state,
                  .where = lease.scope,
                  .what = "rig controlled by another user",
                  .expected = caller.user,
                  .got = lease.user + (note.empty() ? "" : " (" + note + ")"),
                  .hint = "Use rig.halt, run.stop or run.pause without a lease, or break the lease "
                          "with a reason in break_lease"});
}

tl::expected<void, rpc::RpcError> require_free_lease(const Services& services,
                                                     const rpc::Caller& caller) {
  const std::string scope = "rig:" + services.rig_name;
  const auto lease = services.leases->holder(scope, services.now());
  if (!lease || lease->user == caller.user) return {};
  return lease_held(*lease, caller);
}

tl::expected<void, rpc::RpcError> can_queue(const Services& services, const Call& call) {
  const auto run = services.run_manager->active();
  const auto kept = run ? services.leases->kept_for(*run) : std::nullopt;
  const bool is_kept_by_another = kept && kept->user != call.caller.user;
  if (is_kept_by_another && !call.params.contains("lease"))
    return require_free_lease(services, call.caller);
  return holds_lease(services, call);
}

tl::expected<void, rpc::RpcError> require_unlocked(const Services& services) {
  const auto& lock = services.run_manager->rig_state().facts().lock_out;
  if (!lock) return {};
  return refused(rpc::code::access + 12, "rig.locked",
                 {.code = Errc::wrong_state,
                  .where = "rig",
                  .what = "rig locked out by " + lock->user,
                  .expected = "no lock-out",
                  .got = lock->reason,
                  .hint = "Ask that user, or an engineer with a reason, to call rig.unlock"});
}

tl::expected<void, rpc::RpcError> holds_lease(const Services& services, const Call& call) {
  const std::string scope = "rig:" + services.rig_name;
  const auto lease = services.leases->check(call.params.value("lease", ""), scope, call.caller.user,
                                            services.now());
  if (lease) return {};
  return refused(rpc::code::access + 11, "lease.required", lease.error());
}

std::string run_of(const Call& call) {
  return call.params.at("run").get<std::string>();
}

Status append_journal(const Services& services, std::string_view kind, std::string_view by,
                      const json& payload) {
  return services.log->append_journal(services.utc_us(), "", kind, by, format_text(payload));
}

Result<std::size_t> read_whole_number(const Call& call, const WholeNumber& wanted) {
  const std::int64_t number = call.params.value(wanted.name, wanted.fallback);
  if (number >= wanted.least && number <= wanted.most) return static_cast<std::size_t>(number);
  return fail(
      {.code = Errc::range,
       .where = std::string("/params/") + wanted.name,
       .what = wanted.what,
       .expected = std::to_string(wanted.least) +
                   (wanted.most == unbounded ? " or more" : " to " + std::to_string(wanted.most)),
       .got = call.params.at(wanted.name).dump()});
}

Result<std::optional<std::uint64_t>> read_unsigned(const Call& call, const char* name,
                                                   const char* what) {
  const auto found = call.params.find(name);
  if (found == call.params.end()) return std::optional<std::uint64_t>{};
  // Numbers above the largest signed integer are unsigned in nlohmann::json.
  if (!found->is_number_unsigned() && found->get<std::int64_t>() < 0)
    return fail({.code = Errc::range,
                 .where = std::string("/params/") + name,
                 .what = what,
                 .expected = "0 or more",
                 .got = found->dump()});
  return std::optional(found->get<std::uint64_t>());
}

std::string read_parameters(const Call& call) {
  const auto values = call.params.find("parameters");
  return values == call.params.end() ? std::string() : values->dump();
}

std::vector<rpc::ParamSpec> run_request_params(const std::vector<rpc::ParamSpec>& more) {
  std::vector<rpc::ParamSpec> params{
      {"recipe", ParamType::text, true, "name of the recipe, see recipe.list"},
      {"lease", ParamType::text, false,
       "your lease of the rig; not needed while the lease of another user is kept for an active "
       "run"},
      {"seed", ParamType::integer, false, "seed (default: that of the recipe)"},
      {"name", ParamType::text, false, "text appended to the name of the run's folder"},
      {"digest", ParamType::text, false,
       "expected digest of the resolved recipe, from recipe.check; a changed recipe is refused"},
      {"keep_going", ParamType::flag, false,
       "start the next run even if this one is stopped, aborted or fails"},
      {"repeat", ParamType::integer, false,
       "number of runs, 1 to 100 (default: 1); a seed increases by 1 from run to run"},
      after_param,
      parameters_param};
  params.insert(params.end(), more.begin(), more.end());
  return params;
}

Result<runs::RunRequest> request_for_run(const Services& services, const Call& call) {
  const auto file = recipe_file(services, call.params.at("recipe").get<std::string>());
  if (!file) return pass(file.error());
  const auto seed = read_seed(call);
  if (!seed) return pass(seed.error());
  runs::RunRequest run_request{*file, *seed, call.params.value("name", ""), by(call.caller)};
  run_request.digest = call.params.value("digest", "");
  run_request.keep_going = call.params.value("keep_going", false);
  run_request.user = call.caller.user;
  run_request.after = call.params.value("after", "");
  constexpr auto most = static_cast<std::int64_t>(runs::most_copies);
  const auto copies = read_whole_number(call, {"repeat", 1, 1, most, "number of copies"});
  if (!copies) return pass(copies.error());
  run_request.copies = *copies;
  run_request.parameters_json = read_parameters(call);
  return run_request;
}

Result<std::filesystem::path> recipe_file(const Services& services, const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name.starts_with('.') ||
      name.starts_with('-'))
    return fail({.code = Errc::invalid_argument,
                 .where = "/params/recipe",
                 .what = "invalid recipe name",
                 .expected = "the name of a file in the recipe folder",
                 .got = recipes::clipped(name),
                 .hint = "List the recipes with recipe.list"});
  std::vector<std::string> known;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(services.recipes, ignored))
    if (entry.path().extension() == ".json") known.push_back(entry.path().stem().string());
  const std::string stem = name.ends_with(".json") ? name.substr(0, name.size() - 5) : name;
  if (std::ranges::find(known, stem) != known.end()) return services.recipes / (stem + ".json");
  return fail({.code = Errc::not_found,
               .where = "/params/recipe",
               .what = "unknown recipe",
               .got = recipes::clipped(name),
               .hint = did_you_mean(stem, {known.begin(), known.end()},
                                    "List the recipes with recipe.list")});
}

namespace {

constexpr std::int64_t most_runs = 1000;

/// "R-000318" becomes 318; empty without `from`. Errors: not_found.
Result<std::optional<std::int64_t>> read_first(const Services& services, const Call& call) {
  const auto from = call.params.find("from");
  if (from == call.params.end()) return std::optional<std::int64_t>();
  const auto run = services.run_manager->get(from->get<std::string>());
  if (!run)
    return fail({.code = Errc::not_found,
                 .where = "/params/from",
                 .what = "unknown run",
                 .got = from->dump()});
  return std::optional(run->stored.number);
}

Result<bool> is_newest_first(const Call& call) {
  const std::string order = call.params.value("order", "oldest");
  if (order == "oldest" || order == "newest") return order == "newest";
  return pass(bad_param("order", "unknown order", "oldest or newest", order.substr(0, 100)));
}

}  // namespace

bool ListPage::add(const json& item) {
  std::string text = format_text(item);
  const bool has_space = items_.size() < most_ && bytes_ + text.size() < most_bytes;
  if (!items_.empty() && !has_space) return false;
  bytes_ += text.size() + 1;
  items_.push_back(std::move(text));
  return true;
}

std::string ListPage::text(Order order) const {
  std::string out = "[";
  out.reserve(bytes_ + 2);
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (i > 0) out += ',';
    out += items_[order == Order::as_added ? i : items_.size() - 1 - i];
  }
  return out += ']';
}

const std::vector<rpc::ParamSpec>& page_params() {
  static const std::vector<rpc::ParamSpec> params{
      {"from", ParamType::text, false, "first run of the page: next of the previous page"},
      {"most", ParamType::integer, false, "largest number of runs, up to 1000 and 1 MiB"},
      {"order", ParamType::text, false, "order of the runs (default: oldest; oldest, newest)"}};
  return params;
}

Outcome runs_page(const Services& services, const Call& call, const char* name,
                  const std::function<json(const runs::RunView&)>& callback,
                  runs::RunFilter filter) {
  auto cursor = read_first(services, call);
  if (!cursor) return refused(cursor.error());
  const auto most =
      read_whole_number(call, {"most", most_runs, 1, most_runs, "number of runs out of range"});
  if (!most) return refused(most.error());
  const auto newest_first = is_newest_first(call);
  if (!newest_first) return refused(newest_first.error());
  filter.newest_first = *newest_first;
  ListPage reply(*most);
  json next;
  do {
    const auto page = services.run_manager->page(filter, *cursor, *most);
    if (!page) return refused(page.error());
    *cursor = page->next;
    for (const runs::RunView& run : page->runs) {
      const json one = callback(run);
      if (one.is_null() || reply.add(one)) continue;
      next = run.stored.id();
      break;
    }
  } while (*cursor && next.is_null());
  return std::string("{\"") + name + "\":" + reply.text() + R"(,"next":)" + format_text(next) + "}";
}

namespace {

std::optional<std::string> load_fabric_names(const std::optional<RigFile>& rig,
                                             const std::filesystem::path& file) {
  if (!rig || rig->mode == BenchMode::real) return std::nullopt;
  auto text = read_fabrics(*rig, file);
  return text ? std::optional(std::move(*text)) : std::nullopt;
}

std::vector<std::filesystem::path> list_plugins(const std::optional<RigFile>& rig) {
  return rig ? rig->drivers->plugin_files() : std::vector<std::filesystem::path>();
}

}  // namespace

const std::vector<std::string>& RigWatch::problems(const std::filesystem::path& file,
                                                   const std::string& text) {
  if (text == text_ && load_fabric_names(rig_, file) == fabrics_ && list_plugins(rig_) == plugins_)
    return problems_;
  text_ = text;
  rig_.reset();
  problems_.clear();
  plugins_.clear();
  auto opened = open_rig(file, {});
  if (!opened) {
    problems_.push_back(to_string(opened.error()));
  } else {
    plugins_ = opened->file.drivers->plugin_files();  // read before check_rig()
    for (const recipes::Diagnostic& problem : check_rig(*opened, file, PluginDrivers::unread))
      problems_.push_back(recipes::to_string(problem));
    rig_ = std::move(opened->file);
  }
  fabrics_ = load_fabric_names(rig_, file);
  return problems_;
}

void add_methods(rpc::Methods& methods, const Services& services) {
  server::add_session_open(methods);
  server::add_cancel(methods);
  add_session_methods(methods, services);
  add_system_methods(methods, services);
  add_lease_methods(methods, services);
  add_recipe_methods(methods, services);
  add_run_methods(methods, services);
  add_queue_methods(methods, services);
  add_rig_methods(methods, services);
  add_data_methods(methods, services);
  add_plan_methods(methods, services);
  add_sample_methods(methods, services);
  add_trial_methods(methods, services);
  add_sim_methods(methods, services);
  add_lab_methods(methods, services);
  add_subscription_methods(methods, services);
  add_token_methods(methods, services);
}

}  // namespace weft::daemon::api

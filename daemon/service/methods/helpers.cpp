#include "daemon/service/methods/helpers.hpp"

#include <nlohmann/json.hpp>

#include "daemon/service/methods/services.hpp"
#include "daemon/service/rpc/session.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::api {

using nlohmann::json;
using rpc::ParamType;

std::string format_text(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

tl::unexpected<rpc::RpcError> refused(const Error& error) {
  return tl::unexpected(rpc::from(error));
}

namespace {

/// Nothing is left unanswered: what `work` returns answers on the server's thread.
void answer_by(const Services::BackgroundTask& background, const rpc::Responder& respond,
               std::function<Services::Report()> work) {
  const bool taken = background(std::move(work), [respond](const Error& escaped) {
    respond(tl::unexpected(rpc::rpc_error(rpc::code::internal, "internal", escaped)));
  });
  if (!taken)
    respond(tl::unexpected(rpc::rpc_error(rpc::code::request + 29, "request.too_many",
                                          {.code = Errc::wrong_state,
                                           .what = "too much that takes long waits already",
                                           .hint = "Ask again later"},
                                          true)));
}

}  // namespace

void answer_in_background(const Services::BackgroundTask& background, const rpc::Responder& respond,
                          std::function<rpc::Outcome()> work) {
  answer_by(background, respond, [work = std::move(work), respond]() -> Services::Report {
    return [outcome = work(), respond] { respond(outcome); };
  });
}

void check_in_background(const Services& services, const rpc::Call& call,
                         const rpc::Responder& respond, CampaignRequest request,
                         std::function<rpc::Outcome(const rpc::Call&, const runs::Checked&)> then) {
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

tl::expected<void, rpc::RpcError> require_free_lease(const Services& services,
                                                     const rpc::Caller& caller) {
  const std::string scope = "rig:" + services.rig_name;
  const auto lease = services.leases->holder(scope, services.now());
  if (!lease || lease->user == caller.user) return {};
  return tl::unexpected(rpc::rpc_error(
      rpc::code::access + 10, "lease.held",
      {.code = Errc::wrong_state,
       .where = scope,
       .what = "somebody else holds the rig",
       .expected = caller.user,
       .got = lease->user + (lease->note.empty() ? "" : " (" + lease->note + ")"),
       .hint = "rig.halt needs no lease; lease.break takes one away, with a reason"}));
}

tl::expected<void, rpc::RpcError> holds_lease(const Services& services, const rpc::Call& call) {
  const std::string scope = "rig:" + services.rig_name;
  const auto lease = services.leases->check(call.params.value("lease", ""), scope, call.caller.user,
                                            services.now());
  if (lease) return {};
  return tl::unexpected(rpc::rpc_error(rpc::code::access + 11, "lease.required", lease.error()));
}

std::string run_of(const rpc::Call& call) {
  return call.params.at("run").get<std::string>();
}

Result<std::optional<std::uint64_t>> read_seed(const rpc::Call& call) {
  const auto found = call.params.find("seed");
  if (found == call.params.end()) return std::optional<std::uint64_t>{};
  // Above the largest signed number JSON's are unsigned here.
  if (!found->is_number_unsigned() && found->get<std::int64_t>() < 0)
    return fail({.code = Errc::range,
                 .where = "/params/seed",
                 .what = "negative seed",
                 .expected = "0 or more",
                 .got = found->dump()});
  return std::optional(found->get<std::uint64_t>());
}

Result<runs::RunRequest> request_for_run(const Services& services, const rpc::Call& call) {
  const auto file = recipe_file(services, call.params.at("recipe").get<std::string>());
  if (!file) return pass(file.error());
  const auto seed = read_seed(call);
  if (!seed) return pass(seed.error());
  runs::RunRequest run_request{*file, *seed, call.params.value("name", ""), by(call.caller)};
  run_request.digest = call.params.value("digest", "");
  return run_request;
}

Result<std::filesystem::path> recipe_file(const Services& services, const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name.starts_with('.'))
    return fail({.code = Errc::invalid_argument,
                 .where = "/params/recipe",
                 .what = "not a recipe's name",
                 .expected = "a file's name in the recipe folder",
                 .got = recipes::clipped(name),
                 .hint = "See recipe.list"});
  std::vector<std::string> known;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(services.recipes, ignored))
    if (entry.path().extension() == ".json") known.push_back(entry.path().stem().string());
  const std::string stem = name.ends_with(".json") ? name.substr(0, name.size() - 5) : name;
  for (const std::string& one : known)
    if (one == stem) return services.recipes / (stem + ".json");
  const std::string_view meant = recipes::closest(stem, {known.begin(), known.end()});
  return fail(
      {.code = Errc::not_found,
       .where = "/params/recipe",
       .what = "no such recipe",
       .got = recipes::clipped(name),
       .hint = meant.empty() ? "See recipe.list" : "Did you mean " + std::string(meant) + "?"});
}

namespace {

constexpr std::int64_t most_runs = 1000;

/// "R-000318" is 318; 0 where `from` is left out. Errors: not_found.
Result<std::int64_t> read_first(const Services& services, const rpc::Call& call) {
  const auto from = call.params.find("from");
  if (from == call.params.end()) return 0;
  const auto run = services.run_manager->get(from->get<std::string>());
  if (!run)
    return fail({.code = Errc::not_found,
                 .where = "/params/from",
                 .what = "no such run",
                 .got = from->dump()});
  return run->stored.number;
}

Result<std::size_t> most_of(const rpc::Call& call) {
  const std::int64_t most = call.params.value("most", most_runs);
  if (most >= 1 && most <= most_runs) return static_cast<std::size_t>(most);
  return fail({.code = Errc::range,
               .where = "/params/most",
               .what = "how many runs",
               .expected = "1 to " + std::to_string(most_runs),
               .got = call.params.at("most").dump()});
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
      {"from", ParamType::text, false, "this run on: next of the page before"},
      {"most", ParamType::integer, false, "runs, 1000 at most, and no more than 1 MiB"}};
  return params;
}

rpc::Outcome runs_page(const Services& services, const rpc::Call& call, const char* name,
                       const std::function<json(const runs::RunView&)>& callback) {
  const auto first = read_first(services, call);
  if (!first) return refused(first.error());
  const auto most = most_of(call);
  if (!most) return refused(most.error());
  ListPage page(*most);
  json next;
  for (const runs::RunView& run : services.run_manager->all()) {
    if (run.stored.number < *first) continue;
    const json one = callback(run);
    if (one.is_null() || page.add(one)) continue;
    next = run.stored.id();
    break;
  }
  return std::string("{\"") + name + "\":" + page.text() + R"(,"next":)" + format_text(next) + "}";
}

void add_methods(rpc::Methods& methods, const Services& services) {
  server::add_session_open(methods);
  server::add_cancel(methods);
  add_session_methods(methods, services);
  add_system_methods(methods, services);
  add_lease_methods(methods, services);
  add_recipe_methods(methods, services);
  add_recipe_put(methods, services);
  add_run_methods(methods, services);
  add_queue_methods(methods, services);
  add_rig_methods(methods, services);
  add_rig_description(methods, services);
  add_device_methods(methods, services);
  add_classify_methods(methods, services);
  add_data_methods(methods, services);
  add_plan_methods(methods, services);
  add_handover_methods(methods, services);
  add_sim_methods(methods, services);
  add_subscription_methods(methods, services);
  add_token_methods(methods, services);
}

}  // namespace weft::daemon::api

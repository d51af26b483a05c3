#include "daemon/api/parts.hpp"

#include <nlohmann/json.hpp>

#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::api {

using nlohmann::json;

std::string text_of(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

tl::unexpected<rpc::RpcError> refused(const Error& error) {
  return tl::unexpected(rpc::from(error));
}

namespace {

/// Nothing is left unanswered: what `work` returns answers on the server's thread.
void answer_by(const Services::Errand& errand, const rpc::Responder& respond,
               std::function<Services::Report()> work) {
  const bool taken = errand(std::move(work), [respond](const Error& escaped) {
    respond(tl::unexpected(rpc::rpc_error(rpc::code::internal, "internal", escaped)));
  });
  if (!taken)
    respond(tl::unexpected(rpc::rpc_error(rpc::code::request + 29, "request.too_many",
                                          {Errc::wrong_state,
                                           "too much that takes long waits already",
                                           {},
                                           {},
                                           {},
                                           "Ask again later"},
                                          true)));
}

}  // namespace

void answer_apart(const Services::Errand& errand, const rpc::Responder& respond,
                  std::function<rpc::Outcome()> work) {
  answer_by(errand, respond, [work = std::move(work), respond]() -> Services::Report {
    return [outcome = work(), respond] { respond(outcome); };
  });
}

void check_apart(
    const Services& services, const rpc::Call& call, const rpc::Responder& respond,
    CampaignRequest request,
    std::function<rpc::Outcome(const rpc::Call&, const control::RunDesk::Checked&)> then) {
  struct Kept {
    json params;
    rpc::Caller caller;
  };
  answer_by(
      services.change_errand, respond,
      [kept = std::make_shared<const Kept>(call.params, call.caller), respond,
       request = std::move(request), then = std::move(then)]() -> Services::Report {
        return [checked = std::make_shared<const control::RunDesk::Checked>(check_quickly(request)),
                kept, respond, then] {
          respond(then({kept->params, kept->caller}, *checked));
        };
      });
}

std::string by(const rpc::Caller& caller) {
  return caller.session + " (" + caller.user + ")";
}

tl::expected<void, rpc::RpcError> nobody_else_holds(const Services& services,
                                                    const rpc::Caller& caller) {
  const std::string scope = "rig:" + services.rig_name;
  const auto lease = services.leases->holder(scope, services.now());
  if (!lease || lease->user == caller.user) return {};
  return tl::unexpected(
      rpc::rpc_error(rpc::code::access + 10, "lease.held",
                     {Errc::wrong_state, "somebody else holds the rig", scope, caller.user,
                      lease->user + (lease->note.empty() ? "" : " (" + lease->note + ")"),
                      "rig.halt needs no lease; lease.break takes one away, with a reason"}));
}

tl::expected<void, rpc::RpcError> holds_lease(const Services& services, const rpc::Call& call) {
  const std::string scope = "rig:" + services.rig_name;
  const auto lease = services.leases->check(call.params.value("lease", ""), scope, call.caller.user,
                                            services.now());
  if (lease) return {};
  return tl::unexpected(rpc::rpc_error(rpc::code::access + 11, "lease.required", lease.error()));
}

Result<std::optional<std::uint64_t>> seed_of(const rpc::Call& call) {
  const auto found = call.params.find("seed");
  if (found == call.params.end()) return std::optional<std::uint64_t>{};
  // Above the largest signed number JSON's are unsigned here.
  if (!found->is_number_unsigned() && found->get<std::int64_t>() < 0)
    return fail(Errc::range, "negative seed", "/params/seed", "0 or more", found->dump());
  return std::optional(found->get<std::uint64_t>());
}

Result<control::RunWish> wish_for_run(const Services& services, const rpc::Call& call) {
  const auto file = recipe_file(services, call.params.at("recipe").get<std::string>());
  if (!file) return pass(file.error());
  const auto seed = seed_of(call);
  if (!seed) return pass(seed.error());
  return control::RunWish{*file, *seed, call.params.value("name", ""), by(call.caller)};
}

Result<std::filesystem::path> recipe_file(const Services& services, const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos || name.starts_with('.'))
    return fail(Errc::invalid_argument, "not a recipe's name", "/params/recipe",
                "a file's name in the recipe folder", recipes::clipped(name), "See recipe.list");
  std::vector<std::string> known;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(services.recipes, ignored))
    if (entry.path().extension() == ".json") known.push_back(entry.path().stem().string());
  const std::string stem = name.ends_with(".json") ? name.substr(0, name.size() - 5) : name;
  for (const std::string& one : known)
    if (one == stem) return services.recipes / (stem + ".json");
  const std::string_view meant = recipes::closest(stem, {known.begin(), known.end()});
  return fail(Errc::not_found, "no such recipe", "/params/recipe", {}, recipes::clipped(name),
              meant.empty() ? "See recipe.list" : "Did you mean " + std::string(meant) + "?");
}

}  // namespace weft::daemon::api

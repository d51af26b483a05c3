#include "daemon/service/rpc/session.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/base/file/sha256.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::server {
namespace {

using nlohmann::json;
using rpc::Outcome;
using rpc::rpc_error;
namespace code = rpc::code;

std::string_view without_spaces(std::string_view line) {
  constexpr std::string_view spaces = " \t\r\n";
  const std::size_t first = line.find_first_not_of(spaces);
  if (first == std::string_view::npos) return {};
  return line.substr(first, line.find_last_not_of(spaces) - first + 1);
}

bool is_supported(std::string_view wanted) {
  return wanted.empty() || wanted == "1.x" || wanted == protocol_version;
}

/// The supported features among those that the client wants; all if it names none.
json features_for(const json& params) {
  json out = json::array();
  const auto want = params.find("want");
  for (const char* const feature : {"every-mode", "replay"})
    if (want == params.end() || std::ranges::find(*want, json(feature)) != want->end())
      out.push_back(feature);
  return out;
}

/// Idempotency digest of a request, with a fixed length because it is stored. The lease is excluded
/// (except in lease.*): a client has a new one after a restart.
std::string compute_request_digest(const rpc::MethodSpec& spec, json params) {
  if (!std::string_view(spec.name).starts_with("lease.")) params.erase("lease");
  return sha256_hex(std::string(spec.name) + rpc::format_text(params));
}

// Errors of docs/reference/api.md.

rpc::RpcError role_too_low(access::Role has, access::Role needs, std::string_view method) {
  return rpc_error(code::access + 3, "access.role",
                   {.code = Errc::wrong_state,
                    .where = std::string(method),
                    .what = "role not permitted to call this method",
                    .expected = std::string(access::to_string(needs)),
                    .got = std::string(access::to_string(has)),
                    .hint = "Ask an admin for a token with the expected role"});
}

rpc::RpcError answer_too_long(std::size_t bytes) {
  return rpc_error(code::request + 33, "answer.too_long",
                   {.code = Errc::range,
                    .where = "result",
                    .what = "answer too long",
                    .expected = "at most " + std::to_string(Session::most_answer_bytes) + " bytes",
                    .got = std::to_string(bytes) + " bytes",
                    .hint = "Request less: set most, from or one run"});
}

rpc::RpcError requests_too_fast(std::string_view user) {
  return rpc_error(
      code::request + 34, "request.too_fast",
      {.code = Errc::wrong_state,
       .where = std::string(user),
       .what = "too many requests per second",
       .expected = "at most " + std::to_string(access::RateLimits::per_second) + " per second",
       .hint = "Retry later; rig.halt is never refused for this reason"},
      true);
}

rpc::RpcError too_many_refused(const std::string& address) {
  const std::string most = std::to_string(access::RefusedTokens::most_in_window);
  return rpc_error(code::access + 8, "access.limited",
                   {.code = Errc::wrong_state,
                    .where = address,
                    .what = "too many refused tokens from this address",
                    .expected = "fewer than " + most + " within 10 s",
                    .hint = "Check the token and retry after 10 s; a valid token can still halt"},
                   true);
}

}  // namespace

const rpc::MethodSpec& session_open() {
  static const rpc::MethodSpec spec{
      "session.open",
      "open the session: identify the client, agree on protocol and role (first request)",
      access::Role::observer,
      rpc::Effect::read,
      {{"client", rpc::ParamType::text, true, "name of the client program"},
       {"version", rpc::ParamType::text, false, "version of the client program"},
       {"protocol", rpc::ParamType::text, false, "requested protocol version, \"1.x\""},
       {"token", rpc::ParamType::text, false,
        "token; needed unless the Unix socket identifies the user"},
       {"want", rpc::ParamType::list, false,
        "requested features (default: all); the result lists the supported ones"}},
      "session, user (of a token: see token.add), role, protocol, features, epoch, seq, "
      "ready"};
  return spec;
}

void add_session_open(rpc::Methods& methods) {
  methods.add(session_open(), [](const rpc::Call& call) -> Outcome {
    return rpc::refused(code::access + 7, "session.again",
                        {.code = Errc::wrong_state,
                         .where = "/method",
                         .what = "session already open",
                         .got = call.caller.session,
                         .hint = "Open another connection to use another role"});
  });
}

void add_cancel(rpc::Methods& methods) {
  methods.add({"$/cancel",
               "cancel a pending call of this connection, which is answered with the error "
               "request.cancelled",
               access::Role::observer,
               rpc::Effect::read,
               {{"id", rpc::ParamType::id, true, "id of the pending request"}},
               "cancelled"},
              [](const rpc::Call& call) -> Outcome {
                const std::string id = rpc::format_text(call.params.at("id"));
                const Status done = call.client_session == nullptr
                                        ? fail({.code = Errc::unsupported,
                                                .what = "calls over POST /rpc cannot be cancelled",
                                                .hint = "Close the connection"})
                                        : call.client_session->cancel(id);
                if (!done) return rpc::refused(done.error());
                return R"({"cancelled":)" + id + "}";
              });
}

Session::Session(Shared& shared, Peer peer, std::string session, Send send)
    : shared_(&shared), peer_(std::move(peer)), send_(std::move(send)) {
  caller_.session = std::move(session);
  caller_.user = peer_.user;
  caller_.local = peer_.local;
  shared_->sessions.insert_or_assign(caller_.session, this);
}

Session::~Session() {
  alive_.reset();
  shared_->sessions.erase(caller_.session);
}

void Session::send_hello() {
  json ways = json::array();
  if (peer_.role) ways.push_back("peercred");
  ways.push_back("token");
  send_(rpc::notification_line("hello", json{{"product", "weftd"},
                                             {"protocol", {protocol_version}},
                                             {"auth", std::move(ways)},
                                             {"epoch", shared_->epoch}}
                                            .dump()));
}

bool Session::on_unfinished_message(std::string_view rest) {
  const std::string_view word = without_spaces(rest);
  if (word != rpc::halt_line && word != rpc::emergency_line) return false;
  on_message(word);
  return true;
}

void Session::on_message(std::string_view line) {
  const std::string_view word = without_spaces(line);
  if (word.empty()) return;
  const bool emergency = word == rpc::emergency_line && shared_->emergency_stop;
  if (word == rpc::halt_line || emergency) {
    if (peer_.local)
      return emergency ? halt("estop", shared_->emergency_stop) : halt("halt", shared_->halt);
    return send_(rpc::error_line(
        "null", rpc_error(code::access + 5, "access.local_only",
                          {.code = Errc::wrong_state,
                           .what = std::string(word) + " accepted on the local socket only",
                           .hint = emergency ? "Call rig.estop" : "Call rig.halt"})));
  }
  const auto request = rpc::parse_request(line);
  if (request) return handle(*request);
  const rpc::Refused& refused = request.error();
  if (refused.received)
    if (const auto* const stops = stop_named(refused.received->method))
      return stop(*stops, *refused.received, &refused.error);
  send_(rpc::error_line(refused.id_json, refused.error));
}

// Confirms the halt to its sender, with or without a subscription (docs/reference/api.md,
// rig.halt).
void Session::halt(std::string_view kind, const std::function<void(const rpc::Caller&)>& stop) {
  ++shared_->counts.stops;
  stop(caller_);
  const json latched{{"topic", "rig"},
                     {"seq", shared_->hub->seq()},
                     {"delta", {{"latched", kind}, {"by", rpc::by(caller_)}}}};
  send_(json{{"jsonrpc", "2.0"}, {"method", "event"}, {"params", latched}}.dump());
}

const rpc::Methods::Entry* Session::stop_named(const std::string& method) const {
  if (!is_open_ && !peer_.local) return nullptr;
  const auto entry = shared_->methods->find(method);
  return entry && (*entry)->spec.urgency == rpc::Urgency::stop ? *entry : nullptr;
}

// Executed on every request, even with a key that was used before: a second stop is harmless, a
// missing one is not. Problems of the request are returned as warnings.
void Session::stop(const rpc::Methods::Entry& entry, const rpc::Request& request,
                   const rpc::RpcError* wrong) {
  ++shared_->counts.stops;
  const rpc::Usable usable = rpc::usable_params(entry.spec, *request.params);
  json warnings = json::array();
  const auto warn = [&warnings](const rpc::RpcError& problem) {
    warnings.push_back(json::parse(rpc::to_json(problem)));
  };
  if (wrong != nullptr) warn(*wrong);
  std::ranges::for_each(usable.problems, warn);
  entry.handler({*usable.params, caller_}, [&](const Outcome& outcome) {
    if (!outcome || warnings.empty()) return answer(request.id_json, outcome);
    json reply = json::parse(*outcome);
    reply["warnings"] = warnings;
    answer(request.id_json, rpc::format_text(reply));
  });
}

void Session::handle(const rpc::Request& request) {
  if (const auto* const stops = stop_named(request.method)) return stop(*stops, request, nullptr);
  if (!is_open_) {
    if (request.method != session_open().name)
      return answer(request.id_json, rpc::refused(code::access, "session.required",
                                                  {.code = Errc::wrong_state,
                                                   .where = "/method",
                                                   .what = "session not open",
                                                   .expected = "session.open",
                                                   .got = recipes::clipped(request.method),
                                                   .hint = "Send session.open first"}));
    return answer(request.id_json, open_session(*request.params));
  }
  const auto entry = shared_->methods->find(request.method);
  if (!entry) return answer(request.id_json, tl::unexpected(entry.error()));
  if (auto refused = refusal((*entry)->spec))
    return answer(request.id_json, tl::unexpected(std::move(*refused)));
  if (auto fits = rpc::check_params((*entry)->spec, *request.params); !fits)
    return answer(request.id_json, tl::unexpected(fits.error()));
  dispatch(**entry, request);
}

std::optional<rpc::RpcError> Session::refusal(const rpc::MethodSpec& spec) const {
  if (caller_.role < spec.role) return role_too_low(caller_.role, spec.role, spec.name);
  if (spec.urgency != rpc::Urgency::usual) return std::nullopt;
  if (!peer_.local && !shared_->rates.take(caller_.user, shared_->now()))
    return requests_too_fast(caller_.user);
  if (opened_limited_ && is_limited()) return too_many_refused(peer_.address);
  if (only_urgent_)
    return rpc_error(code::request + 32, "server.full",
                     {.code = Errc::wrong_state,
                      .where = std::string(spec.name),
                      .what = "too many clients; this connection is reserved for stops",
                      .expected = "rig.halt, rig.estop, run.abort or another stop",
                      .hint = "Retry when another client has disconnected"},
                     true);
  if (pending_.size() < most_pending) return std::nullopt;
  return rpc_error(code::request + 29, "request.too_many",
                   {.code = Errc::wrong_state,
                    .what = "too many pending requests",
                    .expected = "at most " + std::to_string(most_pending),
                    .got = std::to_string(pending_.size())},
                   true);
}

bool Session::is_limited() const {
  return shared_->refused_tokens.is_limited(peer_.address, shared_->now());
}

rpc::RpcError Session::wrong_token(const Error& why) {
  ++shared_->counts.wrong_tokens;
  const bool too_many = is_limited();
  rpc::RpcError reply =
      too_many ? too_many_refused(peer_.address) : rpc_error(code::access + 1, "access.token", why);
  if (!peer_.address.empty()) shared_->refused_tokens.add(peer_.address, shared_->now());
  if (shared_->on_token_refused)
    shared_->on_token_refused(peer_.local ? peer_.user : peer_.address);
  if (++wrong_tokens_ >= most_wrong_tokens || too_many) end(reply);
  return reply;
}

Outcome Session::open_session(const json& params) {
  if (auto fits = rpc::check_params(session_open(), params); !fits)
    return tl::unexpected(fits.error());
  if (const std::string wanted = params.value("protocol", ""); !is_supported(wanted))
    return rpc::refused(code::request + 2, "protocol.version",
                        {.code = Errc::unsupported,
                         .where = "/params/protocol",
                         .what = "unsupported protocol version",
                         .expected = std::string(protocol_version) + " or 1.x",
                         .got = wanted});
  if (params.contains("token")) {
    const auto owner = shared_->token_owner(params.at("token").get_ref<const std::string&>());
    if (!owner) return tl::unexpected(wrong_token(owner.error()));
    caller_.user = owner->user;
    caller_.role = owner->role;
    caller_.token = owner->token.name;
    owner_ = *owner;
    opened_limited_ = is_limited();
  } else if (peer_.role) {
    caller_.role = *peer_.role;
  } else {
    return rpc::refused(code::access + 1, "access.token",
                        {.code = Errc::wrong_state,
                         .where = "/params/token",
                         .what = "token missing",
                         .hint = "Create a token with weft token add"});
  }
  caller_.client = params.at("client").get<std::string>();
  is_open_ = true;
  return rpc::format_text({{"session", caller_.session},
                           {"user", caller_.user},
                           {"role", access::to_string(caller_.role)},
                           {"protocol", protocol_version},
                           {"features", features_for(params)},
                           {"epoch", shared_->epoch},
                           {"seq", shared_->hub->seq()},
                           {"ready", json::parse(shared_->readiness_json())}});
}

void Session::dispatch(const rpc::Methods::Entry& entry, const rpc::Request& request) {
  const bool is_change = entry.spec.effect == rpc::Effect::change;
  ++(is_change ? shared_->counts.changes : shared_->counts.reads);
  std::string key;
  if (is_change) key = request.params->value("idem", "");
  if (!key.empty()) {
    using Found = access::IdempotencyCache::Found;
    const auto lookup = shared_->answered->lookup(
        caller_.user, key, compute_request_digest(entry.spec, *request.params),
        entry.spec.memory == rpc::Memory::over_restarts, caller_.token);
    if (lookup.found == Found::answered) return answer(request.id_json, *lookup.outcome);
    if (lookup.found != Found::fresh)
      return answer(request.id_json, tl::unexpected(key_in_use(lookup.found, key)));
  }
  const std::uint64_t number = next_request_++;
  const Pending& requested =
      pending_.emplace(number, Pending{request.id_json, is_change}).first->second;
  const auto respond = [this, alive = std::weak_ptr(alive_), shared = shared_, key, number,
                        user = caller_.user](const Outcome& outcome) {
    if (!key.empty()) shared->answered->answered(user, key, outcome);
    if (alive.expired()) return;
    if (const auto waited = pending_.extract(number)) answer(waited.mapped().id_json, outcome);
  };
  entry.handler({*request.params, caller_, peer_.stays ? this : nullptr, requested.listener},
                respond);
}

Status Session::cancel(const std::string& id_json) {
  const auto found = std::ranges::find_if(
      pending_, [&](const auto& one) { return one.second.id_json == id_json; });
  if (found == pending_.end())
    return fail({.code = Errc::not_found,
                 .where = "/params/id",
                 .what = "no pending call with this id",
                 .got = recipes::clipped(id_json),
                 .hint = "Check whether it has been answered"});
  if (found->second.changes)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/id",
                 .what = "call that changes state cannot be cancelled",
                 .expected = "a call that only reads",
                 .got = recipes::clipped(id_json),
                 .hint = "Revert the change with queue.remove, run.abort or handover.cancel"});
  pending_.erase(found);
  answer(id_json, tl::unexpected(rpc_error(
                      code::request + 31, "request.cancelled",
                      {.code = Errc::wrong_state, .what = "call cancelled by the client"})));
  return {};
}

void Session::answer(const std::optional<std::string>& id_json, const Outcome& outcome) {
  if (!outcome) ++shared_->counts.refused;
  if (!id_json) return;  // a notification gets no answer
  if (outcome && outcome->size() > most_answer_bytes)
    return send_(rpc::error_line(*id_json, answer_too_long(outcome->size())));
  send_(outcome ? rpc::result_line(*id_json, *outcome)
                : rpc::error_line(*id_json, outcome.error()));
}

std::optional<rpc::RpcError> Session::over() const {
  if (ended_) return ended_;
  if (!owner_ || !shared_->is_token_valid || shared_->is_token_valid(*owner_)) return std::nullopt;
  return rpc_error(code::access + 1, "access.token",
                   {.code = Errc::wrong_state,
                    .where = "/params/token",
                    .what = "token expired or removed",
                    .hint = "Create a token with weft token add; runs are not affected"});
}

void Session::pump(const std::function<bool()>& has_space) {
  for (const auto& [id, subscription] : subscriptions_)
    while (has_space()) {
      const std::string params = subscription->take(shared_->now());
      if (params.empty()) break;
      send_(rpc::notification_line("event", params));
    }
}

}  // namespace weft::daemon::server

// Tokens by way of the API: a person at the bench gets one for a browser without ending the daemon.

#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;
using rpc::ParamType;

constexpr std::int64_t day_us = 86'400'000'000;
constexpr std::int64_t most_days = 3660;

Outcome add(const Services& services, const Call& call) {
  const std::string name = call.params.at("name").get<std::string>();
  const std::string wanted = call.params.value("role", "operator");
  const auto role = access::role_from(wanted);
  if (!role)
    return refused({.code = Errc::invalid_argument,
                    .where = "/params/role",
                    .what = "no such role",
                    .expected = "observer, operator, engineer or admin",
                    .got = wanted});
  const std::int64_t days = call.params.value("days", std::int64_t{30});
  if (days < 1 || days > most_days)
    return refused({.code = Errc::range,
                    .where = "/params/days",
                    .what = "how long it is good for",
                    .expected = "1 to " + std::to_string(most_days),
                    .got = std::to_string(days)});
  const std::int64_t expires_us = services.utc_us() + days * day_us;
  const bool own = call.params.value("own", false);
  if (own && !call.caller.token.empty())  // it would outlive the one that he came with
    return refused({.code = Errc::wrong_state,
                    .where = "/params/own",
                    .what = "who came with a token makes none for himself",
                    .expected = "a user of the machine, by the Unix socket",
                    .got = "the token " + call.caller.token,
                    .hint = "Leave it out: who comes with it is token:NAME then"});
  const std::string user = own ? call.caller.user : "";
  const auto token = services.add_token(name, *role, expires_us, user);
  if (!token && token.error().code == Errc::invalid_argument && !name.empty())
    return tl::unexpected(rpc::rpc_error(rpc::code::state + 13, "token.name_taken", token.error()));
  if (!token) return refused(token.error());
  const json reply{{"name", name},
                   {"role", wanted},
                   {"expires_us", expires_us},
                   {"user", access::user_of({name, *role, {}, expires_us, user})}};
  if (const Status ok = services.log->append_journal(services.utc_us(), "", "token.added",
                                                     by(call.caller), format_text(reply));
      !ok) {
    static_cast<void>(services.remove_token(name));  // nobody was told it
    return refused(ok.error());
  }
  json out = reply;
  out["token"] = *token;
  return format_text(out);
}

}  // namespace

void add_token_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add(
      {"token.add",
       "makes a token for TCP and HTTP; it is told once, here",
       access::Role::admin,
       rpc::Effect::change,
       {{"name", ParamType::text, true, "whom it is for, a new name"},
        {"role", ParamType::text, false, "observer, operator (default), engineer or admin"},
        {"days", ParamType::integer, false, "how long it is good for [days], 30"},
        {"own", ParamType::flag, false,
         "it is for yourself, a user of the machine, who came without a token: who comes with it "
         "is you, as far as its role goes, and has your leases and keys; else token:NAME"}},
       "name, role, expires_us, user (who comes with it), token",
       rpc::Memory::while_running},
      [s](const Call& call) { return add(*s, call); });
}

}  // namespace weft::daemon::api

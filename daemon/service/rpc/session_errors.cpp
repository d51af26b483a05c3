#include "daemon/service/rpc/session_errors.hpp"

#include "daemon/service/rpc/rate_limits.hpp"
#include "daemon/service/rpc/session.hpp"

namespace weft::daemon::server {

namespace {

using rpc::rpc_error;
namespace code = rpc::code;

}  // namespace

rpc::RpcError role_too_low(access::Role has, access::Role needs, std::string_view method) {
  return rpc_error(code::access + 3, "access.role",
                   {.code = Errc::wrong_state,
                    .where = std::string(method),
                    .what = "your role may not do that",
                    .expected = std::string(access::to_string(needs)),
                    .got = std::string(access::to_string(has)),
                    .hint = "Ask an admin for a token of that role"});
}

rpc::RpcError key_in_use(access::IdempotencyCache::Found found, const std::string& key) {
  using Found = access::IdempotencyCache::Found;
  if (found == Found::cut_short)
    return rpc_error(
        code::request + 10, "idem.cut_short",
        {.code = Errc::wrong_state,
         .where = "/params/idem",
         .what = "the daemon ended while the first request with this key was under way: "
                 "whether it was done is not known",
         .got = key,
         .hint = "See run.list or log.tail; use a new key to ask again"});
  const bool waits = found == Found::under_way;
  return rpc_error(code::request + 9, "idem.reused",
                   {.code = Errc::wrong_state,
                    .where = "/params/idem",
                    .what = waits ? "the first request with this key is under way"
                                  : "this key belongs to another request",
                    .got = key,
                    .hint = "Use a new key for a new change"},
                   waits);
}

rpc::RpcError answer_too_long(std::size_t bytes) {
  return rpc_error(code::request + 33, "answer.too_long",
                   {.code = Errc::range,
                    .where = "result",
                    .what = "the answer is longer than one line may be",
                    .expected = "at most " + std::to_string(Session::most_answer_bytes) + " bytes",
                    .got = std::to_string(bytes),
                    .hint = "Ask for less of it: most, from, or one run"});
}

rpc::RpcError requests_too_fast(std::string_view user) {
  return rpc_error(
      code::request + 34, "request.too_fast",
      {.code = Errc::wrong_state,
       .where = std::string(user),
       .what = "too many requests a second",
       .expected = "at most " + std::to_string(access::RateLimits::per_second) + " a second",
       .hint = "Ask again later; rig.halt is always heard"},
      true);
}

}  // namespace weft::daemon::server

#include "daemon/service/rpc/rpc_error.hpp"

#include <nlohmann/json.hpp>

namespace weft::daemon::rpc {
namespace {

using nlohmann::json;

}  // namespace

RpcError from(const Error& error) {
  for (const ErrorCode& row : error_codes())
    if (row.code == error.code) return rpc_error(row.number, row.kind, error, row.retryable);
  return rpc_error(code::internal, "internal", error);
}

RpcError rpc_error(int code, std::string_view kind, Error error, bool retryable) {
  constexpr std::size_t longest_got = 500;  // what a client sent may be a line of a megabyte
  if (error.got.size() > longest_got) error.got = error.got.substr(0, longest_got) + "...";
  return {code, std::string(kind), std::move(error), retryable, {}};
}

RpcError error_from_json(std::string_view text) {
  const json reply = json::parse(text, nullptr, false);
  try {
    const json& data = reply.at("data");
    const auto part = [&data](const char* key) { return data.value(key, ""); };
    RpcError out = rpc_error(reply.at("code").get<int>(), part("kind"),
                             {.code = Errc::wrong_state,
                              .where = part("where"),
                              .what = reply.at("message").get<std::string>(),
                              .expected = part("expected"),
                              .got = part("got"),
                              .hint = part("hint")},
                             data.value("retryable", false));
    if (const auto blockers = data.find("blockers"); blockers != data.end())
      out.blockers_json = blockers->dump();
    return out;
  } catch (const json::exception&) {
    return rpc_error(code::internal, "internal",
                     {.code = Errc::corrupt, .what = "this answer was not kept well"});
  }
}

std::string to_json(const RpcError& e) {
  json data{{"kind", e.kind}, {"retryable", e.retryable}};
  const auto put = [&data](const char* key, const std::string& text) {
    if (!text.empty()) data[key] = text;
  };
  put("where", e.error.where);
  put("expected", e.error.expected);
  put("got", e.error.got);
  put("hint", e.error.hint);
  if (!e.blockers_json.empty()) data["blockers"] = json::parse(e.blockers_json);
  const json out{{"code", e.code}, {"message", e.error.what}, {"data", std::move(data)}};
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace weft::daemon::rpc

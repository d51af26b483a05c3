#include "daemon/service/rpc/message.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "protocols/base/closest.hpp"
#include "protocols/base/json_text.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::rpc {
namespace {

using nlohmann::json;

tl::unexpected<Refused> refuse(std::string id_json, int number, std::string_view kind,
                               Error error) {
  return tl::unexpected(Refused{std::move(id_json), rpc_error(number, kind, std::move(error))});
}

tl::unexpected<Refused> not_a_request(std::string id_json, std::string message,
                                      std::string expected, std::string got) {
  return refuse(std::move(id_json), code::invalid_request, "request.invalid",
                {.code = Errc::parse,
                 .what = std::move(message),
                 .expected = std::move(expected),
                 .got = std::move(got)});
}

// A string, a whole number or null; the specification permits fractions but discourages them.
bool usable_id(const json& id) {
  constexpr std::size_t longest = 256;
  if (id.is_string()) return id.get_ref<const std::string&>().size() <= longest;
  return id.is_number_integer() || id.is_null();
}

constexpr std::array<std::string_view, 4> members{"jsonrpc", "id", "method", "params"};

tl::unexpected<Refused> unknown_member(std::string id_json, const std::string& name) {
  const std::vector<std::string_view> known(members.begin(), members.end());
  return refuse(std::move(id_json), code::invalid_request, "request.unknown_member",
                {.code = Errc::invalid_argument,
                 .where = recipes::child("", name),
                 .what = "unknown request member",
                 .hint = did_you_mean(name, known, "Use " + recipes::one_of(known))});
}

}  // namespace

RpcError from(const Error& error) {
  for (const ErrorCode& row : error_codes())
    if (row.code == error.code) return rpc_error(row.number, row.kind, error, row.retryable);
  return rpc_error(code::internal, "internal", error);
}

tl::unexpected<RpcError> refused(const Error& error) {
  return tl::unexpected(from(error));
}

RpcError rpc_error(int code, std::string_view kind, Error error, bool retryable) {
  constexpr std::size_t longest_got = 500;  // a client may send a line of 1 MB
  if (error.got.size() > longest_got) error.got = error.got.substr(0, longest_got) + "...";
  return {code, std::string(kind), std::move(error), retryable};
}

tl::unexpected<RpcError> refused(int code, std::string_view kind, Error error, bool retryable) {
  return tl::unexpected(rpc_error(code, kind, std::move(error), retryable));
}

RpcError error_from_json(std::string_view text) {
  const json reply = json::parse(text, nullptr, false);
  try {
    const json& data = reply.at("data");
    const auto part = [&data](const char* key) { return data.value(key, ""); };
    return rpc_error(reply.at("code").get<int>(), part("kind"),
                     {.code = Errc::wrong_state,
                      .where = part("where"),
                      .what = reply.at("message").get<std::string>(),
                      .expected = part("expected"),
                      .got = part("got"),
                      .hint = part("hint")},
                     data.value("retryable", false));
  } catch (const json::exception&) {
    return rpc_error(code::internal, "internal",
                     {.code = Errc::corrupt, .what = "stored answer corrupt"});
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
  return format_text({{"code", e.code}, {"message", e.error.what}, {"data", std::move(data)}});
}

std::string format_text(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

tl::expected<Request, Refused> parse_request(std::string_view line) {
  json message;
  const std::vector<Error> findings = read_json(line, {line.size(), most_depth}, message);
  const auto unreadable = [](const Error& one) { return one.code != Errc::invalid_argument; };
  if (const auto why = std::ranges::find_if(findings, unreadable); why != findings.end())
    return refuse("null", code::parse_error, "request.unreadable",
                  {.code = Errc::parse,
                   .where = "line",
                   .what = why->what,
                   .expected = "one JSON object per line",
                   .hint = "See rpc.discover"});
  if (!message.is_object())
    return not_a_request("null", "request is not a JSON object", "an object", message.type_name());
  Request request;
  std::optional<Refused> wrong;  // the first problem
  const auto but = [&wrong](const tl::unexpected<Refused>& found) {
    if (!wrong) wrong = found.value();
  };
  if (const auto id = message.find("id"); id != message.end()) {
    if (usable_id(*id))
      request.id_json = format_text(*id);
    else
      but(not_a_request("null", "invalid request id", "a string or an integer", id->type_name()));
  }
  const std::string id_json = request.id_json.value_or("null");
  if (!findings.empty())
    but(refuse(id_json, code::invalid_request, "request.duplicate_key", findings.front()));
  if (message.value("jsonrpc", json()) != "2.0")
    but(not_a_request(id_json, "JSON-RPC version missing or unsupported", "\"jsonrpc\": \"2.0\"",
                      {}));
  const auto method = message.find("method");
  if (method == message.end() || !method->is_string()) {
    but(not_a_request(id_json, "method missing", "\"method\": a string", {}));
    return tl::unexpected(std::move(*wrong));
  }
  request.method = method->get<std::string>();
  for (const auto& [name, value] : message.items())
    if (std::ranges::find(members, name) == members.end()) but(unknown_member(id_json, name));
  json params = message.value("params", json::object());
  if (!params.is_object()) {
    but(refuse(id_json, code::invalid_params, "param.type",
               {.code = Errc::invalid_argument,
                .where = "/params",
                .what = "parameters without names",
                .expected = "an object with named parameters",
                .got = params.type_name()}));
    params = json::object();
  }
  request.params = std::make_shared<const json>(std::move(params));
  if (!wrong) return request;
  request.id_json = wrong->id_json;
  wrong->received = std::move(request);
  return tl::unexpected(std::move(*wrong));
}

std::string result_line(std::string_view id_json, std::string_view result_json) {
  std::string line = R"({"jsonrpc":"2.0","id":)";
  line.append(id_json).append(R"(,"result":)").append(result_json).append("}");
  return line;
}

std::string error_line(std::string_view id_json, const RpcError& error) {
  std::string line = R"({"jsonrpc":"2.0","id":)";
  line.append(id_json).append(R"(,"error":)").append(to_json(error)).append("}");
  return line;
}

std::string notification_line(std::string_view method, std::string_view params_json) {
  std::string line = R"({"jsonrpc":"2.0","method":")";
  line.append(method).append(R"(","params":)").append(params_json).append("}");
  return line;
}

}  // namespace weft::daemon::rpc

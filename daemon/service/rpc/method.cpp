#include "daemon/service/rpc/method.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <optional>

#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::rpc {
namespace {

using nlohmann::json;

constexpr ParamSpec idempotency_key{"idem", ParamType::text, false,
                                    "idempotency key: a repeated request returns the first answer"};

std::vector<ParamSpec> all_params(const MethodSpec& spec) {
  std::vector<ParamSpec> out = spec.params;
  if (spec.effect == Effect::change) out.push_back(idempotency_key);
  return out;
}

struct TypeRow {
  ParamType type;
  std::string_view schema;
  bool (*matches)(const json& value);
};
/// In the order of ParamType.
constexpr std::array<TypeRow, 7> types{{
    {ParamType::text, "string", [](const json& value) { return value.is_string(); }},
    {ParamType::integer, "integer", [](const json& value) { return value.is_number_integer(); }},
    {ParamType::number, "number", [](const json& value) { return value.is_number(); }},
    {ParamType::flag, "boolean", [](const json& value) { return value.is_boolean(); }},
    {ParamType::object, "object", [](const json& value) { return value.is_object(); }},
    {ParamType::list, "array", [](const json& value) { return value.is_array(); }},
    {ParamType::id, "string or integer",
     [](const json& value) { return value.is_string() || value.is_number_integer(); }},
}};

constexpr const TypeRow& row_of(ParamType type) {
  return types[static_cast<std::size_t>(type)];
}
static_assert(types.size() == static_cast<std::size_t>(ParamType::id) + 1 &&
              std::ranges::all_of(types,
                                  [](const TypeRow& row) { return &row == &row_of(row.type); }));

/// Problem of one received parameter; empty if it is valid.
std::optional<RpcError> find_problem(const std::vector<ParamSpec>& known, const std::string& name,
                                     const json& value) {
  const auto wrong = [](std::string_view kind, Error error) {
    return rpc_error(code::invalid_params, kind, std::move(error));
  };
  const std::string where = recipes::child("/params", name);
  const auto param = std::ranges::find(known, name, &ParamSpec::name);
  if (param == known.end()) {
    std::vector<std::string_view> names;
    for (const ParamSpec& one : known) names.push_back(one.name);
    const std::string all = names.empty() ? "Omit it: this method takes no parameters"
                                          : "Use " + recipes::one_of(names);
    return wrong("param.unknown", {.code = Errc::invalid_argument,
                                   .where = where,
                                   .what = "unknown parameter",
                                   .hint = did_you_mean(name, names, all)});
  }
  if (!row_of(param->type).matches(value))
    return wrong("param.type", {.code = Errc::invalid_argument,
                                .where = where,
                                .what = "wrong parameter type",
                                .expected = std::string(row_of(param->type).schema),
                                .got = value.type_name()});
  if (value.is_string() && value.get_ref<const std::string&>().size() > param->longest)
    return wrong("param.range",
                 {.code = Errc::range,
                  .where = where,
                  .what = "text too long",
                  .expected = "at most " + std::to_string(param->longest) + " bytes",
                  .got = std::to_string(value.get_ref<const std::string&>().size()) + " bytes"});
  return std::nullopt;
}

json param_json(const ParamSpec& param) {
  const json type =
      param.type == ParamType::id ? json{"string", "integer"} : json(row_of(param.type).schema);
  return {{"name", param.name},
          {"description", param.summary},
          {"required", param.required},
          {"schema", {{"type", type}}}};
}

json method_json(const MethodSpec& spec) {
  json params = json::array();
  for (const ParamSpec& param : all_params(spec)) params.push_back(param_json(param));
  return {
      {"name", spec.name},
      {"summary", spec.summary},
      {"paramStructure", "by-name"},
      {"params", std::move(params)},
      {"result", {{"name", "result"}, {"description", spec.result}, {"schema", json::object()}}},
      {"x-role", access::to_string(spec.role)},
      {"x-changes", spec.effect == Effect::change}};
}

}  // namespace

std::string by(const Caller& caller) {
  return caller.session + " (" + caller.user + ")";
}

MethodSpec& Methods::add(MethodSpec spec, Handler handler) {
  return add(Entry{std::move(spec), std::move(handler), true});
}

MethodSpec& Methods::add(MethodSpec spec, DirectHandler handler) {
  return add(Entry{std::move(spec),
                   [handler = std::move(handler)](const Call& call, const Responder& respond) {
                     respond(handler(call));
                   },
                   false});
}

MethodSpec& Methods::add(Entry entry) {
  const std::string name(entry.spec.name);
  const auto [added, is_new] = entries_.emplace(name, std::move(entry));
  WEFT_ASSERT(is_new);
  return added->second.spec;
}

tl::expected<const Methods::Entry*, RpcError> Methods::find(std::string_view name) const {
  const auto found = entries_.find(name);
  if (found != entries_.end()) return &found->second;
  std::vector<std::string_view> known;
  for (const auto& [key, entry] : entries_) known.push_back(key);
  return refused(code::method_not_found, "method.unknown",
                 {.code = Errc::not_found,
                  .where = "/method",
                  .what = "unknown method",
                  .got = recipes::clipped(name),
                  .hint = did_you_mean(name, known, "List the methods with rpc.discover")});
}

std::string Methods::open_rpc(std::string_view version) const {
  json methods = json::array();
  for (const auto& [name, entry] : entries_) methods.push_back(method_json(entry.spec));
  const json document{{"openrpc", "1.2.6"},
                      {"info", {{"title", "weftd"}, {"version", version}}},
                      {"methods", std::move(methods)}};
  return document.dump();
}

tl::expected<void, RpcError> check_params(const MethodSpec& spec, const json& params) {
  const std::vector<ParamSpec> known = all_params(spec);
  for (const auto& [name, value] : params.items())
    if (auto problem = find_problem(known, name, value)) return tl::unexpected(std::move(*problem));
  for (const ParamSpec& param : known)
    if (param.required && !params.contains(param.name))
      return refused(code::invalid_params, "param.missing",
                     {.code = Errc::invalid_argument,
                      .where = recipes::child("/params", param.name),
                      .what = "parameter missing",
                      .expected = std::string(param.summary)});
  return {};
}

Usable usable_params(const MethodSpec& spec, const json& params) {
  const std::vector<ParamSpec> known = all_params(spec);
  json fit = json::object();
  Usable out;
  for (const auto& [name, value] : params.items()) {
    if (auto problem = find_problem(known, name, value))
      out.problems.push_back(std::move(*problem));
    else
      fit[name] = value;
  }
  out.params = std::make_shared<const json>(std::move(fit));
  return out;
}

}  // namespace weft::daemon::rpc

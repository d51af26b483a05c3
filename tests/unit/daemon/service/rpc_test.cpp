// Lines to requests and back, and refusals by the table of methods.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "daemon/service/rpc/message.hpp"
#include "daemon/service/rpc/method.hpp"

namespace rpc_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::rpc;
using nlohmann::json;

namespace {

MethodSpec spec_of_move() {
  return {"stage.move",
          "moves",
          access::Role::operator_,
          Effect::change,
          {{"axis", ParamType::text, true, "x, y or z"},
           {"target_m", ParamType::number, true, "where to [m]"},
           {"slowly", ParamType::flag, false, "at half speed"}},
          "where it is"};
}

std::string kind_of(const json& params) {
  const auto checked = check_params(spec_of_move(), params);
  return checked ? "fine" : checked.error().kind;
}

}  // namespace

TEST_CASE("A request line gives its id as it came, its method and its parameters") {
  const auto r = parse_request(
      R"({"jsonrpc":"2.0","id":"a-1","method":"run.get","params":{"run":"R-000001"}})");
  REQUIRE(r);
  CHECK(*r->id_json == "\"a-1\"");
  CHECK(r->method == "run.get");
  CHECK(r->params->at("run") == "R-000001");
}

TEST_CASE("A request without an id is a notification, one without parameters has none") {
  const auto r = parse_request(R"({"jsonrpc":"2.0","method":"system.info"})");
  REQUIRE(r);
  CHECK_FALSE(r->id_json);
  CHECK(r->params->empty());
}

TEST_CASE("Invalid requests are refused with JSON-RPC error numbers and their id, if any") {
  const auto code_and_id = [](const std::string& line) {
    const auto r = parse_request(line);
    REQUIRE_FALSE(r);
    return std::pair(r.error().error.code, r.error().id_json);
  };
  CHECK(code_and_id("{") == std::pair(code::parse_error, std::string("null")));
  CHECK(code_and_id("\xff\xfe") == std::pair(code::parse_error, std::string("null")));
  CHECK(code_and_id("[]") == std::pair(code::invalid_request, std::string("null")));
  CHECK(code_and_id("7") == std::pair(code::invalid_request, std::string("null")));
  CHECK(code_and_id(R"({"jsonrpc":"1.0","id":3,"method":"m"})") ==
        std::pair(code::invalid_request, std::string("3")));
  CHECK(code_and_id(R"({"jsonrpc":"2.0","id":3})") ==
        std::pair(code::invalid_request, std::string("3")));
  CHECK(code_and_id(R"({"jsonrpc":"2.0","id":1.5,"method":"m"})").first == code::invalid_request);
  CHECK(code_and_id(R"({"jsonrpc":"2.0","id":3,"method":"m","params":[1]})") ==
        std::pair(code::invalid_params, std::string("3")));
}

TEST_CASE("Members that a request does not have are refused with the one that was meant") {
  const auto r = parse_request(R"({"jsonrpc":"2.0","id":3,"method":"m","parmas":{"run":"x"}})");
  REQUIRE_FALSE(r);
  CHECK(r.error().id_json == "3");
  CHECK(r.error().error.kind == "request.unknown_member");
  CHECK(r.error().error.error.where == "/parmas");
  CHECK(r.error().error.error.hint == "Did you mean params?");
  REQUIRE(r.error().received);
  CHECK(r.error().received->method == "m");
  const auto other = parse_request(R"({"jsonrpc":"2.0","id":3,"method":"m","zzzzzzzz":1})");
  CHECK_THAT(other.error().error.error.hint,
             Catch::Contains("jsonrpc") && Catch::Contains("method"));
}

TEST_CASE("A key given twice in a request is refused with its pointer, and a stop is known still") {
  const auto twice = [](const std::string& line) {
    const auto r = parse_request(line);
    REQUIRE_FALSE(r);
    CHECK(r.error().error.code == code::invalid_request);
    CHECK(r.error().error.kind == "request.duplicate_key");
    CHECK(r.error().id_json == "3");
    REQUIRE(r.error().received);
    CHECK(r.error().received->method == "rig.halt");
    return r.error().error.error.where;
  };
  CHECK(twice(R"({"jsonrpc":"2.0","id":3,"method":"m","method":"rig.halt"})") == "/method");
  CHECK(
      twice(
          R"({"jsonrpc":"2.0","id":3,"method":"rig.halt","params":{"a":[{"b":1},{"b":1,"b":2}]}})") ==
      "/params/a/1/b");
}

TEST_CASE("A line of a million brackets costs no stack") {
  const auto r = parse_request(std::string(1'000'000, '['));
  REQUIRE_FALSE(r);
  CHECK(r.error().error.code == code::parse_error);
}

TEST_CASE("Parameters that a method does not know are refused with the name that was meant") {
  const auto checked =
      check_params(spec_of_move(), json{{"axis", "x"}, {"target_m", 1}, {"slowy", true}});
  REQUIRE_FALSE(checked);
  CHECK(checked.error().kind == "param.unknown");
  CHECK(checked.error().error.where == "/params/slowy");
  CHECK_THAT(checked.error().error.hint, Catch::Contains("slowly"));
}

TEST_CASE("Missing parameters and wrong types are refused, whole numbers do as numbers") {
  CHECK(kind_of({{"axis", "x"}, {"target_m", 1}}) == "fine");
  CHECK(kind_of({{"axis", "x"}, {"target_m", 0.5}, {"slowly", false}}) == "fine");
  CHECK(kind_of({{"axis", "x"}}) == "param.missing");
  CHECK(kind_of({{"axis", 3}, {"target_m", 1}}) == "param.type");
  CHECK(kind_of({{"axis", "x"}, {"target_m", "1"}}) == "param.type");
  CHECK(kind_of({{"axis", "x"}, {"target_m", 1}, {"slowly", 1}}) == "param.type");
}

TEST_CASE("Changes take a key against being done twice, reads do not") {
  CHECK(kind_of({{"axis", "x"}, {"target_m", 1}, {"idem", "k"}}) == "fine");
  MethodSpec read = spec_of_move();
  read.effect = Effect::read;
  CHECK_FALSE(check_params(read, json{{"axis", "x"}, {"target_m", 1}, {"idem", "k"}}));
}

TEST_CASE("An unknown method is refused with the one that was meant") {
  Methods methods;
  methods.add(spec_of_move(), DirectHandler([](const Call&) -> Outcome { return "{}"; }));
  CHECK(methods.find("stage.move"));
  const auto found = methods.find("stage.mov");
  REQUIRE_FALSE(found);
  CHECK(found.error().code == code::method_not_found);
  CHECK_THAT(found.error().error.hint, Catch::Contains("stage.move"));
}

TEST_CASE("The OpenRPC document has every method with its parameters, role and effect") {
  Methods methods;
  methods.add(spec_of_move(), DirectHandler([](const Call&) -> Outcome { return "{}"; }));
  const json document = json::parse(methods.open_rpc("1.0.0"));
  CHECK(document["openrpc"] == "1.2.6");
  const json& method = document["methods"].at(0);
  CHECK(method["name"] == "stage.move");
  CHECK(method["params"].size() == 4);  // including the key
  CHECK(method["params"].at(1)["schema"]["type"] == "number");
  CHECK(method["x-role"] == "operator");
  CHECK(method["x-changes"] == true);
}

TEST_CASE("An error keeps its parts apart and names its block") {
  const Error error{.code = Errc::range,
                    .where = "/params/target_m",
                    .what = "too far",
                    .expected = "0 to 0.15",
                    .got = "3",
                    .hint = "Look again"};
  const json out = json::parse(to_json(from(error)));
  CHECK(out["code"] == 1012);
  CHECK(out["message"] == "too far");
  CHECK(out["data"]["kind"] == "param.range");
  CHECK(out["data"]["expected"] == "0 to 0.15");
  CHECK(out["data"]["got"] == "3");
  CHECK(out["data"]["hint"] == "Look again");
  CHECK(out["data"]["retryable"] == false);
}

}  // namespace rpc_test

// JSON that is refused although a lenient parser accepts it.

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/base/json_text.hpp"

namespace json_text_test {

using namespace weft;

TEST_CASE("The result equals that of nlohmann's own parser") {
  for (const char* text :
       {"null", "true", "-7", "18446744073709551615", "0.1", "\"a\\u0000b\"", "[]", "{}",
        R"({"a":[1,{"b":{"c":[[],{}]}},"d"],"":false,"a/b":{"~":2.5e-3}})",
        "[[1],[2,[3]],{\"k\":[]}]"}) {
    const auto read = parse_json(text);
    INFO(text);
    REQUIRE(read);
    CHECK(*read == nlohmann::json::parse(text));
  }
}

TEST_CASE("Every key given twice is found, at its own pointer") {
  nlohmann::json document;
  const auto findings = read_json(
      R"({"a":1,"b":{"c":[{"x":0},{"y":{"z":1,"z":2}}],"c":3},"a":2,"s/t":{"~":1,"~":1}})", {},
      document);
  std::vector<std::string> where;
  for (const Error& one : findings) {
    CHECK(one.code == Errc::invalid_argument);
    where.push_back(one.where);
  }
  CHECK(where == std::vector<std::string>{"/b/c/1/y/z", "/b/c", "/a", "/s~1t/~0"});
  CHECK(document["a"] == 2);
}

TEST_CASE("A key given a hundred thousand times is no list of a hundred thousand findings") {
  std::string text = "{\"a\":0";
  for (int i = 0; i < 100'000; ++i) text += ",\"a\":0";
  nlohmann::json document;
  CHECK(read_json(text + "}", {}, document).size() == 100);
}

TEST_CASE("Text that is no JSON, too long or too deep is refused by its code") {
  const auto code_of = [](const std::string& text, const JsonBounds& bounds = {}) {
    const auto read = parse_json(text, bounds);
    REQUIRE_FALSE(read);
    return read.error().code;
  };
  for (const char* text : {"", "{", "[1,]", "{\"a\":NaN}", "1e999", "{} x", "\xff"})
    CHECK(code_of(text) == Errc::parse);
  CHECK(code_of(std::string("{}\0{}", 5)) == Errc::parse);
  CHECK(code_of("[[[1]]]", {100, 2}) == Errc::range);
  CHECK(code_of("[1, 2]", {5, 2}) == Errc::range);
  CHECK(parse_json("[[1]]", {100, 2}));
}

}  // namespace json_text_test

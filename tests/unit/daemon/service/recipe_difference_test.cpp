// Differences between two recipes, by JSON pointer.

#include "daemon/service/methods/helpers.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

namespace recipe_difference_test {

using namespace weft::daemon::api;
using nlohmann::json;

namespace {

json between(const char* was, const char* is) {
  std::size_t all = 0;
  return differences(json::parse(was), json::parse(is), 100, all);
}

}  // namespace

TEST_CASE("Differences name their place, whatever its key") {
  CHECK(between(R"({"a": 1, "b": [1, {"c": 2}]})", R"({"b": [1, {"c": 2}], "a": 1})").empty());
  CHECK(between(R"({"a": 1})", R"({"a": 2})") ==
        json::parse(R"([{"where": "/a", "change": "changed", "was": 1, "is": 2}])"));
  CHECK(between(R"({"x/y": {"~": 1}})", R"({"x/y": {}})") ==
        json::parse(R"([{"where": "/x~1y/~0", "change": "removed", "was": 1}])"));
  CHECK(between(R"([1, 2])", R"([1, 3, 4])") ==
        json::parse(R"([{"where": "/1", "change": "changed", "was": 2, "is": 3},
                        {"where": "/2", "change": "added", "is": 4}])"));
  CHECK(between(R"({"a": [1]})", R"({"a": {"0": 1}})")[0]["where"] == "/a");
  CHECK(between("1", "2")[0]["where"] == "");
}

TEST_CASE("Many differences are counted, and some are listed") {
  json was = json::array(), is = json::array();
  for (int i = 0; i < 50; ++i) {
    was.push_back(i);
    is.push_back(i + 1);
  }
  std::size_t all = 0;
  CHECK(differences(was, is, 7, all).size() == 7);
  CHECK(all == 50);
}

}  // namespace recipe_difference_test

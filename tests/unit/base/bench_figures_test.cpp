// A benchmark reports a figure that misses its limit, and does not fail.

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/bench/figures.hpp"

namespace weft::bench::bench_figures_test {
namespace {

TEST_CASE("A figure misses a limit of its own, or of its ratio to the peer, in its direction") {
  Figure f{"vote", 20.0, "us", "peer", 100.0, "", {}};
  CHECK_FALSE(missed(f));
  CHECK(format_limit(f).empty());
  const auto misses = [&](Limit limit) {
    f.limit = limit;
    return missed(f);
  };
  CHECK_FALSE(misses(at_most(20)));
  CHECK(misses(at_most(19.9)));
  CHECK_FALSE(misses(at_least(20)));
  CHECK(misses(at_least(20.1)));
  CHECK(format_limit(f) == "at least 20.1 us");
  CHECK_FALSE(misses(faster_by(5)));
  CHECK(misses(faster_by(6)));
  CHECK_FALSE(misses(ratio_at_most(0.2)));
  CHECK(misses(ratio_at_most(0.1)));
  CHECK(format_limit(f) == "ratio at most 0.1");
  f.value = std::nan("");
  CHECK(misses(at_most(1e300)));
  CHECK(misses(at_least(-1e300)));
}

TEST_CASE("A report with a miss is written, marks that figure, and ends with 0") {
  const auto here = std::filesystem::current_path();
  const auto folder = std::filesystem::temp_directory_path() / "weft_bench_figures_test";
  std::filesystem::create_directories(folder);
  std::filesystem::current_path(folder);
  const std::vector<Figure> figures{{"kept", 1.0, "s", "", 0.0, "", at_most(2)},
                                    {"missed", 3.0, "s", "", 0.0, "", at_most(2)},
                                    {"free", 3.0, "s", "", 0.0, "", {}}};
  const int status = report("made_up", figures);
  const int nothing = report("nothing", {});
  std::ifstream in("out/bench/made_up.json");
  const auto written = nlohmann::json::parse(in, nullptr, false);
  std::filesystem::current_path(here);
  std::filesystem::remove_all(folder);
  CHECK(status == 0);
  CHECK(nothing == 1);
  REQUIRE(written.is_object());
  const auto& list = written["figures"];
  REQUIRE(list.size() == 3);
  CHECK(list[0]["missed"] == false);
  CHECK(list[1]["missed"] == true);
  CHECK(list[1]["limit"] == "at most 2 s");
  CHECK_FALSE(list[2].contains("missed"));
  CHECK(written["machine"]["threads"].is_number());
}

}  // namespace
}  // namespace weft::bench::bench_figures_test

#include "daemon/campaign/parts.hpp"

#include <catch2/catch.hpp>
#include <set>

namespace parts_test {

using namespace weft;
using namespace weft::daemon;

TEST_CASE("a part is two numbers") {
  CHECK(part_number_from("2/3").value() == PartNumber{2, 3});
  CHECK(part_number_from("1/1").value() == PartNumber{1, 1});
  for (const char* wrong :
       {"", "2", "0/3", "4/3", "/3", "2/", "2/3/4", "-1/3", "2/3 ", "2/2000000"})
    CHECK(part_number_from(wrong).error().code == Errc::invalid_argument);
}

TEST_CASE("every fabric is in one part, whatever the number of parts") {
  for (const std::size_t count : {1, 2, 3, 7, 40}) {
    std::multiset<std::size_t> all;
    std::size_t least = 1000, most = 0;
    for (std::size_t number = 1; number <= count; ++number) {
      const auto fabrics = fabrics_of({number, count}, 17);
      all.insert(fabrics.begin(), fabrics.end());
      least = std::min(least, fabrics.size());
      most = std::max(most, fabrics.size());
    }
    CHECK(all.size() == 17);
    CHECK(std::set<std::size_t>(all.begin(), all.end()).size() == 17);
    CHECK(most - least <= 1);
  }
}

}  // namespace parts_test

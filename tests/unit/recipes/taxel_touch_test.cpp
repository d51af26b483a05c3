#include "recipes/control/taxel_touch.hpp"

#include <array>
#include <catch2/catch.hpp>

namespace taxel_touch_test {

using weft::recipes::TaxelTouch;
using Counts = std::array<std::uint16_t, 4>;

TEST_CASE("Touch is the change from the mean of the baseline's frames") {
  TaxelTouch touch;
  touch.begin();
  touch.add(Counts{100, 200, 300, 400});
  touch.add(Counts{102, 202, 302, 402});
  CHECK(touch.baseline_frames() == 2);
  CHECK(touch.baseline_spread() == 2);
  CHECK(touch.mean_change() == 0);
  touch.settle();
  touch.add(Counts{111, 201, 301, 381});
  CHECK(touch.mean_change() == 2.5);  // the sum changes by 10 over four taxels, regardless of the
                                      // sign
  CHECK(touch.largest_change() == 20);
}

TEST_CASE("A taxel at the end of its range counts as full scale") {
  TaxelTouch touch;
  touch.begin();
  touch.add(Counts{65535, 200, 300, 400});
  touch.settle();
  touch.add(Counts{65535, 200, 300, 400});
  CHECK(touch.largest_change() == 65535);
}

TEST_CASE("Another number of taxels begins the baseline anew") {
  TaxelTouch touch;
  touch.begin();
  touch.add(Counts{100, 200, 300, 400});
  touch.settle();
  touch.add(std::array<std::uint16_t, 2>{500, 600});
  CHECK(touch.baseline_frames() == 1);
  CHECK(touch.mean_change() == 0);
}

}  // namespace taxel_touch_test

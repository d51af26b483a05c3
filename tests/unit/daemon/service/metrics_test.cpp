// The text of metrics, in both formats that Prometheus reads.

#include "daemon/service/daemon/metrics.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace metrics_test {

using namespace weft::daemon::server;

std::string exposed(bool is_open_metrics) {
  Exposition out(is_open_metrics);
  out.family("weft_requests_total", MetricType::counter, "Requests.");
  out.sample(3, {{"class", "read"}});
  out.sample(123456789012, {{"class", "a\"b\\c\nd"}, {"to", "x"}});
  out.family("weft_left_seconds", MetricType::gauge, "Time \\ left\nover.");
  out.sample(0.25);
  out.family("weft_state", MetricType::gauge, "State.");
  out.states(std::vector<std::string>{"safe", "moving"}, "moving");
  return out.text();
}

const std::string samples_of_counter =
    "weft_requests_total{class=\"read\"} 3\n"
    "weft_requests_total{class=\"a\\\"b\\\\c\\nd\",to=\"x\"} 123456789012\n";
const std::string gauges =
    "# TYPE weft_left_seconds gauge\n"
    "# HELP weft_left_seconds Time \\\\ left\\nover.\n"
    "weft_left_seconds 0.25\n"
    "# TYPE weft_state gauge\n"
    "# HELP weft_state State.\n"
    "weft_state{state=\"safe\"} 0\n"
    "weft_state{state=\"moving\"} 1\n"
    "# EOF\n";

TEST_CASE("only OpenMetrics names a counter without the ending of its samples", "[metrics]") {
  CHECK(exposed(true) == "# TYPE weft_requests counter\n# HELP weft_requests Requests.\n" +
                             samples_of_counter + gauges);
  CHECK(exposed(false) ==
        "# TYPE weft_requests_total counter\n# HELP weft_requests_total "
        "Requests.\n" +
            samples_of_counter + gauges);
}

TEST_CASE("values that are no numbers have the names of the format", "[metrics]") {
  Exposition out(true);
  out.family("x", MetricType::gauge, "X.");
  for (const double value : {std::nan(""), HUGE_VAL, -HUGE_VAL, 1e21}) out.sample(value);
  CHECK(out.text() == "# TYPE x gauge\n# HELP x X.\nx NaN\nx +Inf\nx -Inf\nx 1e+21\n# EOF\n");
}

}  // namespace metrics_test

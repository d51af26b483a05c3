#pragma once
// Data sets shared by the tests of the trade-off.

#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace weft::daemon::trade_test {

inline Dataset campaign_set(std::uint32_t repetitions = 6) {
  Dataset set = report_test::small_campaign(repetitions);
  set.info.taxel_rate_hz = 37;
  return set;
}

// Every trial of M1 again as a louder M2.
inline Dataset two_explorations() {
  Dataset set = campaign_set();
  const std::size_t count = set.trials.size();
  for (std::size_t i = 0; i < count; ++i) {
    classifier::Trial trial = set.trials[i];
    TrialRecord record = set.records[i];
    trial.file += "-M2";
    record.spec.exploration = "M2";
    for (double& value : trial.counts) value *= 2;
    set.trials.push_back(std::move(trial));
    set.records.push_back(std::move(record));
  }
  return set;
}

}  // namespace weft::daemon::trade_test

// The force at rest before and after the press, and the range of forces that can be held.

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace rest_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::TemporaryFolder;

namespace {

constexpr double weight_n = 0.2 * 9.80665;

json khan2016(int repetitions) {
  std::ifstream in(test::source / "recipes/library/khan2016.json");
  json recipe = json::parse(in);
  recipe["repetitions"] = repetitions;
  return recipe;
}

json holding(const std::string& fabric, double force_n) {
  json recipe = json::parse(test::short_recipe(fabric));
  for (auto& [name, exploration] : recipe["explorations"].items())
    for (json& phase : exploration["phases"])
      if (phase.contains("force_N")) {
        phase["force_N"] = force_n;
        phase["force_band_N"] = force_n == 0 ? 0.1 : std::min(0.5, 0.8 * force_n);
      }
  return recipe;
}

}  // namespace

TEST_CASE("on every fabric E rests as S does, and both by the weight, after either exploration") {
  const TemporaryFolder folder;
  const auto summary = run_campaign(request_in(folder, khan2016(1).dump(), test::bench17()), {});
  REQUIRE(summary);
  INFO((summary->error ? to_string(*summary->error) : ""));
  REQUIRE(summary->trials_complete == 34);
  const auto data = read_hdf5(summary->dataset_file);
  REQUIRE(data);
  for (const TrialRecord& record : data->records) {
    CAPTURE(record.spec.label, record.spec.exploration);
    REQUIRE(record.quality.rest);
    const RestForces& rest = *record.quality.rest;
    CHECK(rest.weight_n == Approx(weight_n));
    CHECK(rest.after_n == Approx(rest.before_n).epsilon(0.02));
    CHECK(rest.before_n == Approx(weight_n).epsilon(0.05));
    CHECK(rest.after_n == Approx(weight_n).epsilon(0.05));
  }
  const auto certificate = read_certificate(summary->dataset_file.parent_path());
  REQUIRE((certificate && *certificate && (*certificate)->rest));
  CHECK((*certificate)->rest->trials == 34);
  CHECK((*certificate)->rest->worst_after_n == Approx(weight_n).epsilon(0.05));
}

TEST_CASE("forces from nothing to ten newtons settle and are held on soft cloth and on stiff") {
  for (const std::string fabric : {"pile", "nylon"})
    for (const double force_n : {0.0, 0.1, 1.0, 1.9, 2.0, 5.0, 10.0}) {
      CAPTURE(fabric, force_n);
      // Ten counts of noise and the waves of a hard fabric at steps of 1 um: 0.1 N is the minimum.
      const double in_band = force_n == 0.1 ? 0.9 : 0.99;
      const TemporaryFolder folder;
      const auto summary =
          run_campaign(request_in(folder, holding(fabric, force_n).dump(), test::bench17()), {});
      REQUIRE(summary);
      INFO((summary->error ? to_string(*summary->error) : ""));
      CHECK(summary->outcome == recipes::Outcome::complete);
      CHECK(summary->trials_complete == 2);
      CHECK(static_cast<double>(summary->force.in_band) >=
            in_band * static_cast<double>(summary->force.samples));
      const auto data = read_hdf5(summary->dataset_file);
      REQUIRE(data);
      for (const TrialRecord& record : data->records)
        CHECK(record.quality.rest->after_n == Approx(weight_n).epsilon(0.05));
    }
}

TEST_CASE("a probe that does not rest by its weight fails its first trial, with the reason") {
  test::Guarded g(test::short_recipe("nylon"));
  g.bench.checked.plan.limits.probe_weight_n = 1.7;  // a seventh heavier
  g.start();
  g.finish();
  CHECK(g.bench.outcomes == std::vector{recipes::Outcome::failed});
  REQUIRE(g.bench.trial_error);
  CHECK(g.bench.trial_error->code == Errc::measurement);
  CHECK(g.bench.trial_error->expected == "1.70 N");
  CHECK(g.supervisor->result()->rig == recipes::RigFact::safe);
}

TEST_CASE("slack from just over the rest travel to 5 mm rests on its weight, less runs nothing") {
  for (const double slack_mm : {0.1, 0.3, 0.6, 1.0, 2.0, 5.0}) {
    CAPTURE(slack_mm);
    json rig = test::bench17();
    rig["probe"]["slack_mm"] = slack_mm;
    const TemporaryFolder folder;
    const auto summary = run_campaign(request_in(folder, test::short_recipe("nylon"), rig), {});
    if (slack_mm < rig["probe"]["rest_travel_mm"].get<double>()) {
      REQUIRE_FALSE(summary);
      CHECK(to_string(summary.error()).find("/probe/slack_mm") != std::string::npos);
      continue;
    }
    REQUIRE(summary);
    INFO((summary->error ? to_string(*summary->error) : ""));
    CHECK(summary->trials_complete == 2);
    const auto data = read_hdf5(summary->dataset_file);
    REQUIRE(data);
    for (const TrialRecord& record : data->records) {
      CHECK(record.quality.rest->before_n == Approx(weight_n).epsilon(0.05));
      CHECK(record.quality.rest->after_n == Approx(weight_n).epsilon(0.05));
    }
  }
}

}  // namespace rest_test

// The supervisor on a simulated bench: its commands, and its reaction to faults.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace supervisor_test {

using namespace weft;
using namespace weft::daemon;
using test::Guarded;
using test::TrialBench;

namespace {

std::size_t count(const Bytes& in, const Bytes& what) {
  std::size_t found = 0;
  for (auto at = in.begin();; ++at, ++found) {
    at = std::search(at, in.end(), what.begin(), what.end());
    if (at == in.end()) return found;
  }
}

// MGMSG_MOT_MOVE_STOP to channel 1 of a USB unit, APT16 p. 56
const Bytes stop_profiled{0x65, 0x04, 0x01, 0x02, 0x50, 0x01};
const Bytes stop_immediate{0x65, 0x04, 0x01, 0x01, 0x50, 0x01};

// A loop that loses every timer further ahead than `horizon`: those of the engine, not of the scan
// cycle.
class ForgetfulLoop final : public Loop {
 public:
  ForgetfulLoop(Loop& loop, Duration horizon) : loop_(&loop), horizon_(horizon) {}
  [[nodiscard]] TimePoint now() const override { return loop_->now(); }
  TimerId at(TimePoint when, Callback callback) override {
    return when - now() > horizon_ ? 0 : loop_->at(when, std::move(callback));
  }
  void cancel(TimerId id) override { loop_->cancel(id); }

 private:
  Loop* loop_;
  Duration horizon_;
};

}  // namespace

TEST_CASE(
    "every stop of a campaign is along the ramp: at first contact, after the force, at a fault") {
  TrialBench bench(test::short_recipe("denim"));
  Supervisor supervisor(bench.checked.plan, bench.sim.host_time, *bench.sim.bench, *bench.recording,
                        bench.hooks());
  supervisor.start();
  bench.sim.loop.run_until([&] { return supervisor.state().step == recipes::Step::seating; });
  CHECK(count(bench.written["z"], stop_profiled) == 1);
  bench.sim.loop.run_until([&] { return supervisor.state().step == recipes::Step::sliding; });
  bench.sim.loop.run_to(bench.sim.loop.now() + std::chrono::seconds(1));
  supervisor.request(recipes::AbortRequested{});
  bench.sim.loop.run_until([&] { return supervisor.result().has_value(); });
  CHECK(bench.outcomes == std::vector{recipes::Outcome::aborted});
  CHECK(count(bench.written["y"], stop_profiled) == 1);  // it was sliding along y
  for (const auto& [role, bytes] : bench.written) {
    INFO(role);
    CHECK(count(bytes, stop_immediate) == 0);
  }
}

TEST_CASE("an engine's timer that never comes is caught by the deadline guard") {
  TrialBench bench(test::short_recipe("denim"));
  ForgetfulLoop loop(bench.sim.host_time, std::chrono::milliseconds(50));
  Supervisor supervisor(bench.checked.plan, loop, *bench.sim.bench, *bench.recording,
                        bench.hooks());
  supervisor.start();
  const TimePoint limit = bench.sim.loop.now() + std::chrono::minutes(10);
  bench.sim.loop.run_until([&] { return supervisor.result() || bench.sim.loop.now() > limit; });
  REQUIRE(supervisor.result());
  CHECK(bench.outcomes == std::vector{recipes::Outcome::failed});
  REQUIRE(bench.trial_error);
  CHECK_THAT(bench.trial_error->what, Catch::Contains("deadline"));
  CHECK(supervisor.result()->cleanup == recipes::Cleanup::done);
  CHECK(bench.sim.rig->truth(bench.sim.loop.now()).contact_force_n == Approx(0).margin(1e-9));
}

TEST_CASE("a sensor unplugged in mid-slide fails the campaign and the probe is retracted") {
  TrialBench bench(test::short_recipe("wool"));
  Supervisor supervisor(bench.checked.plan, bench.sim.host_time, *bench.sim.bench, *bench.recording,
                        bench.hooks());
  supervisor.start();
  bench.sim.loop.run_until(
      [&] { return supervisor.result() || supervisor.state().step == recipes::Step::sliding; });
  REQUIRE_FALSE(supervisor.result());
  bench.far_end["wrench"]->unplug();
  bench.sim.loop.run_until([&] { return supervisor.result().has_value(); });
  CHECK(supervisor.result()->outcome == recipes::Outcome::failed);
  REQUIRE(supervisor.result()->error);
  CHECK(bench.outcomes == std::vector{recipes::Outcome::failed});
  CHECK(bench.sim.rig->truth(bench.sim.loop.now()).contact_force_n == Approx(0).margin(1e-9));
}

namespace {

// MGMSG_MOT_MOVE_ABSOLUTE with a position, APT16 p. 50
const Bytes move_absolute{0x53, 0x04, 0x06, 0x00, 0xD0, 0x01};
const Bytes set_velocity{0x13, 0x04, 0x0E, 0x00, 0xD0, 0x01};

}  // namespace

TEST_CASE(
    "a campaign without its z stage ends with the stage's fault, not with the retract timer") {
  for (const recipes::Step where : {recipes::Step::approaching, recipes::Step::sliding,
                                    recipes::Step::releasing, recipes::Step::retracting}) {
    INFO(recipes::to_string(where));
    Guarded g(test::short_recipe("wool"));
    g.start();
    g.run_to(where);
    const TimePoint gone_at = g.bench.sim.loop.now();
    g.bench.far_end["z"]->unplug();
    g.finish();
    // A driver reports silence after a second; the retract timer is 80 s.
    CHECK(g.bench.sim.loop.now() - gone_at < std::chrono::seconds(2));
    CHECK(g.supervisor->result()->outcome == recipes::Outcome::failed);
    CHECK(g.supervisor->result()->cleanup == recipes::Cleanup::failed);
    CHECK(g.supervisor->result()->rig == recipes::RigFact::unknown);
    REQUIRE(g.supervisor->result()->error);
    CHECK_THAT(to_string(*g.supervisor->result()->error), Catch::StartsWith("stage.z"));
  }
}

TEST_CASE("readings that are off in the second of the zero begin it anew, and are not in it") {
  constexpr double seconds_off = 0.02;  // with 1 N, which would move the mean of a second by 20 mN
  Guarded g(test::short_recipe("denim"));
  VirtualLoop& loop = g.bench.sim.loop;
  g.start();
  g.run_to(recipes::Step::biasing);
  loop.run_to(loop.now() + std::chrono::milliseconds(600));
  REQUIRE(g.supervisor->state().step == recipes::Step::biasing);
  const TimePoint good_again = loop.now() + from_seconds(seconds_off);
  const nlohmann::json off{
      {"device", "ft"}, {"fault", "bias_jump"}, {"amount", 1}, {"duration_s", seconds_off}};
  REQUIRE(g.bench.sim.rig->inject(off.dump(), loop.now()));
  g.run_to(recipes::Step::approaching);
  CHECK(loop.now() - good_again >= std::chrono::seconds(1));
  const Snapshot& seen = g.bench.sim.bench->snapshot();
  WrenchTotal in_air;
  for (const TimePoint end = loop.now() + std::chrono::milliseconds(300); loop.now() < end;) {
    const auto before = seen.wrench_at;
    REQUIRE(loop.run_one());
    if (seen.wrench_at != before) in_air.add(seen.wrench);
  }
  REQUIRE(in_air.readings > 20);
  CHECK(std::abs(in_air.mean().force_n[2]) < 0.01);  // four deviations: 12 mN a reading
}

namespace {

/// From now on no request reaches the sensor for `seconds`.
void lose_requests(Guarded& g, double seconds) {
  const nlohmann::json lost{{"device", "ft"},
                            {"fault", "drop"},
                            {"towards", "device"},
                            {"probability", 1},
                            {"duration_s", seconds}};
  sim::Rig& rig = *g.bench.sim.rig;
  REQUIRE(rig.clear_faults("ft", "drop"));
  REQUIRE(rig.inject(lost.dump(), g.bench.sim.loop.now()));
}

}  // namespace

TEST_CASE("a bias that is lost on its way is sent again, and the trial goes on") {
  Guarded g(test::short_recipe("denim"));
  g.start();
  g.run_to(recipes::Step::positioning);
  lose_requests(g, 1e3);
  g.run_to(recipes::Step::biasing);
  lose_requests(g, 1.5);  // the first two
  g.run_to(recipes::Step::approaching);
  g.finish();
  CHECK(g.supervisor->result()->outcome == recipes::Outcome::complete);
}

TEST_CASE("a bias that never helps names the sensor, the force that is left and what was wanted") {
  Guarded g(test::short_recipe("denim"));
  g.start();
  g.run_to(recipes::Step::positioning);
  lose_requests(g, 1e3);
  g.finish();
  REQUIRE(g.bench.trial_error);
  const std::string reported = to_string(*g.bench.trial_error);
  CHECK_THAT(reported, Catch::Contains("biasing: ft: "));
  CHECK_THAT(reported, Catch::Contains("within 0.2 N for 1 s"));
  CHECK_THAT(reported, Catch::Contains("2.9"));  // the plate's weight
  CHECK_THAT(reported, Catch::Contains("after 10 requests"));
  CHECK(g.supervisor->result()->rig == recipes::RigFact::safe);
}

TEST_CASE("a saturated force sensor ends a campaign that goes on after failed trials") {
  Guarded g(test::short_recipe("denim"));
  g.bench.checked.plan.on_trial_failure = recipes::OnTrialFailure::carry_on;
  g.start();
  g.run_to(recipes::Step::holding);
  const nlohmann::json full_scale{{"device", "ft"}, {"fault", "saturation"}};
  REQUIRE(g.bench.sim.rig->inject(full_scale.dump(), g.bench.sim.loop.now()));
  g.finish();
  CHECK(g.bench.outcomes == std::vector{recipes::Outcome::failed});
  REQUIRE(g.supervisor->result()->error);
  CHECK(g.supervisor->result()->error->code == Errc::safety);
  CHECK(g.supervisor->result()->error->where.ends_with("wrench"));
  CHECK_THAT(g.supervisor->result()->error->expected, !Catch::Contains(" N"));  // not the cap
  CHECK(g.supervisor->result()->cleanup == recipes::Cleanup::done);
}

TEST_CASE("counts that are no force end the campaign with the sensor's name and a hint") {
  Guarded g(test::short_recipe("denim"));
  g.start();
  g.run_to(recipes::Step::holding);
  const nlohmann::json absurd{{"device", "ft"}, {"fault", "absurd_counts"}};
  REQUIRE(g.bench.sim.rig->inject(absurd.dump(), g.bench.sim.loop.now()));
  g.finish();
  CHECK(g.supervisor->result()->outcome == recipes::Outcome::failed);
  REQUIRE(g.supervisor->result()->error);
  const Error& reported = *g.supervisor->result()->error;
  CHECK(reported.where == "ft");
  CHECK(reported.code == Errc::range);
  CHECK_THAT(reported.what, Catch::Contains("[N]"));
  CHECK_FALSE(reported.hint.empty());
  CHECK(g.supervisor->result()->cleanup == recipes::Cleanup::done);
}

TEST_CASE("in the cycle in which a guard trips only the stop and the retract are sent") {
  Guarded g(test::short_recipe("denim"));
  g.bench.checked.plan.limits.force_cap_n = 4;  // on the way to 5 N
  g.start();
  g.run_to(recipes::Step::pressing);
  Bytes& z = g.bench.written["z"];
  while (g.supervisor->state().step == recipes::Step::pressing) {
    z.clear();
    REQUIRE(g.bench.sim.loop.run_one());
  }
  CHECK(g.supervisor->state().step == recipes::Step::retracting);
  CHECK(count(z, stop_profiled) == 1);
  CHECK(count(z, move_absolute) == 1);  // the retract; the force loop has sent nothing
  CHECK(count(z, set_velocity) == 1);
  z.clear();
  g.finish();
  CHECK(count(z, move_absolute) == 0);
  REQUIRE(g.bench.trial_error);
  CHECK_THAT(g.bench.trial_error->what, Catch::Contains("cap"));
  CHECK(g.bench.sim.rig->truth(g.bench.sim.loop.now()).contact_force_n == Approx(0).margin(1e-9));
}

TEST_CASE("a force sensor that repeats itself ends the campaign before the force does") {
  Guarded g(test::short_recipe("denim"));
  g.bench.checked.plan.limits.frozen_wrench_s = 1e-3;  // two equal readings
  g.start();
  g.finish();
  CHECK(g.supervisor->result()->outcome == recipes::Outcome::failed);
  REQUIRE(g.supervisor->result()->error);
  CHECK_THAT(g.supervisor->result()->error->what, Catch::Contains("frozen"));
}

TEST_CASE("no stage of a good campaign is found slow, fast or off its command") {
  Guarded g(test::short_recipe("fleece"));
  g.start();
  g.finish();
  CHECK(g.supervisor->result()->outcome == recipes::Outcome::complete);
}

TEST_CASE("a stage that goes a tenth of its speed is found while it slides") {
  Guarded g(test::short_recipe("denim"));
  g.start();
  g.run_to(recipes::Step::sliding);
  // Bypassing the supervisor: the same direction at a tenth of the speed.
  auto& y = g.bench.sim.bench->stage(StageAxis::y).driver();
  REQUIRE(y.command(MoveCommand{0.149, 0.2e-3}));
  g.finish();
  REQUIRE(g.supervisor->result()->error);
  CHECK_THAT(g.supervisor->result()->error->what, Catch::Contains("follow"));
  CHECK(g.supervisor->result()->cleanup == recipes::Cleanup::done);
}

TEST_CASE("a dwell of nothing waits for the force all the same") {
  Guarded g(test::with_keys(R"("settle":{"dwell_s":0})"));
  g.start();
  g.run_to(recipes::Step::holding);
  CHECK(g.bench.sim.bench->snapshot().wrench.force_n[2] == Approx(5).margin(0.3));
}

}  // namespace supervisor_test

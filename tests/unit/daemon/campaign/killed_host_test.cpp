// A host that dies between two bytes, 200 times: the behaviour of the stages without it, and the
// state for the next host. The emulators live on; drivers, supervisor and recorder are dropped as
// they are.

#include <random>

#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace killed_host_test {

using namespace weft;
using namespace weft::daemon;
using namespace std::chrono_literals;

namespace {

/// A device's end of a link, into which one host after another is plugged.
class Socket final : public Link {
 public:
  void plug(std::unique_ptr<MemoryLink> end) {
    end_ = std::move(end);
    end_->on_receive([this](ByteView bytes, TimePoint at) {
      if (receiver_) receiver_(bytes, at);
    });
  }
  void pull() { end_->unplug(); }
  Status write(ByteView bytes) override {
    return end_ ? end_->write(bytes) : fail({.code = Errc::io, .what = "no peer"});
  }
  void on_receive(Receiver receiver) override { receiver_ = std::move(receiver); }
  void on_closed(Closed) override {}

 private:
  std::unique_ptr<MemoryLink> end_;
  Receiver receiver_;
};

/// The emulated bench that outlives its hosts.
struct LongLived {
  test::TemporaryFolder folder;
  CheckedRequest checked;
  RigFile file;
  VirtualLoop loop;
  std::unique_ptr<sim::Rig> rig;
  std::map<std::string, std::unique_ptr<Socket>> sockets;
  double peak_n = 0;

  explicit LongLived(const std::string& recipe)
      : checked(check_request(test::request_in(folder, recipe)).value()),
        file(parse_rig_file(checked.rig_text).value()) {
    const std::string fabrics = read_fabrics(file, folder / "rig.json").value();
    rig = std::move(sim::Rig::create(file.text, fabrics, 1).value());
    for (const DeviceEntry& device : file.devices) {
      auto socket = std::make_unique<Socket>();
      REQUIRE(rig->attach(device.name, *socket, loop));
      sockets[device.name] = std::move(socket);
    }
    watch();
  }

  void watch() {
    peak_n = std::max(peak_n, rig->truth(loop.now()).contact_force_n);
    loop.after(4ms, [this] { watch(); });
  }

  std::unique_ptr<Bench> host() {
    const LinkFactory links = [this](const DeviceEntry& entry) -> Result<std::unique_ptr<Link>> {
      auto [near, far] = MemoryLink::make_pair(loop, loop, 1ms);
      sockets[entry.name]->plug(std::move(far));
      return std::unique_ptr<Link>(std::move(near));
    };
    return std::move(Bench::create(file, loop, links).value());
  }

  /// No byte of the host arrives any more, not even those written by its destructors.
  void kill() {
    for (auto& [name, socket] : sockets) socket->pull();
  }
};

/// Runs trial by trial like `weft run`, until `moment` after the start of the bench.
struct Life {
  Recorder recorder;
  TrialRecording recording;
  Supervisor supervisor;
  TimePoint last_sample{};

  Life(LongLived& bench, Bench& host, Recorder opened)
      : recorder(std::move(opened)),
        recording(recorder, bench.checked.plan),
        supervisor(bench.checked.plan, bench.loop, host, recording, hooks(bench)) {}

  static SupervisorHooks hooks(LongLived& bench) {
    SupervisorHooks hooks;
    hooks.mount = [&bench](const recipes::MountFabric& order, const MountDone& done) {
      done(bench.rig->mount(order.fabric, order.seeds.touch, bench.loop.now()));
    };
    return hooks;
  }
};

Recorder recorder_at(const std::filesystem::path& path) {
  CampaignHeader header;
  header.info.axes = {{"x", false}, {"y", false}, {"z", false}, {"rx", true}, {"ry", true}};
  return std::move(Recorder::create(path, header).value());
}

/// The longest motion that a host of these trials commands: from home to the farthest stage
/// position of the plan, at the highest speed, with its ramps.
Duration longest_motion(const recipes::Plan& plan) {
  double farthest_m = 0;
  for (const auto axis : {recipes::Axis::x, recipes::Axis::y, recipes::Axis::z})
    farthest_m = std::max(farthest_m, plan.forecast.envelope[recipes::index(axis)].max);
  return from_seconds(farthest_m / plan.limits.max_speed_mps +
                      plan.limits.max_speed_mps / plan.limits.max_acceleration_mps2);
}

bool bring_up(LongLived& bench, Bench& host) {
  std::optional<Status> up;
  host.bring_up([&](Status s) { up = std::move(s); });
  bench.loop.run_until([&] { return up.has_value(); });
  return up && up->has_value();
}

}  // namespace

TEST_CASE(
    "a host killed 200 times, in every step of a trial: the force stays under its cap, the "
    "stages stop, the next host finds them and homes, and the file opens") {
  constexpr int kills = 200;
  constexpr double cap_n = 10;
  constexpr Duration inspect = 500ms;  ///< interval between checks of a dead host's stages
  std::mt19937_64 random(20161122);
  std::map<recipes::Step, int> killed_in;
  double worst_n = 0, longest_coast_s = 0, bound_s = 0;
  const std::array fabrics{"fleece", "denim", "nylon", "pile"};
  for (int first = 0; first < kills; first += 50) {
    LongLived bench(test::short_recipe(fabrics[static_cast<std::size_t>(first / 50)]));
    for (int kill = first; kill < first + 50; ++kill) {
      auto host = bench.host();
      REQUIRE(bring_up(bench, *host));
      // The truth for the next host: the drivers read the true positions of the stages.
      const auto found = host->snapshot().joints();
      const auto truth = bench.rig->stage_positions(bench.loop.now());
      for (const auto axis : recipes::all_axes) {
        INFO("kill " << kill << ", " << recipes::to_string(axis));
        CHECK(found[axis] == Approx(truth[recipes::index(axis)]).margin(2e-5));  // 20 um, 20 urad
      }
      const auto file = bench.folder / (std::to_string(kill) + ".sqlite");
      std::optional<Life> life(std::in_place, bench, *host, recorder_at(file));
      const TimePoint begun = bench.loop.now();
      life->supervisor.start();
      // From home, the first trial takes some 25 s, including the retract.
      const double moment_s = std::uniform_real_distribution<>(0, 30)(random);
      bench.loop.run_until([&] {
        return bench.loop.now() - begun >= from_seconds(moment_s) ||
               life->supervisor.result().has_value();
      });
      ++killed_in[life->supervisor.state().step];
      bench.kill();
      life.reset();
      host.reset();
      // The host is dead: the last command is carried out, and nothing after it. The test watches
      // for a while longer.
      const TimePoint dead = bench.loop.now();
      const Duration bound = longest_motion(bench.checked.plan) + inspect;
      TimePoint moved = dead;
      auto before = bench.rig->stage_positions(dead);
      while (bench.loop.now() - dead < bound + 10s) {
        bench.loop.run_to(bench.loop.now() + inspect);
        const auto now = bench.rig->stage_positions(bench.loop.now());
        if (now != before) moved = bench.loop.now();
        before = now;
      }
      CHECK(moved - dead <= bound);
      longest_coast_s = std::max(longest_coast_s, to_seconds(moved - dead));
      bound_s = std::max(bound_s, to_seconds(bound));
      CHECK(load_campaign(file, {.all_outcomes = true}));
    }
    worst_n = std::max(worst_n, bench.peak_n);
    CHECK(bench.peak_n < cap_n);
  }
  std::string where;
  for (const auto& [step, count] : killed_in)
    where += (where.empty() ? "" : ", ") + std::string(recipes::to_string(step)) + " " +
             std::to_string(count);
  using enum recipes::Step;
  for (const recipes::Step step : {resting, pressing, holding, sliding, ending, retracting}) {
    INFO(recipes::to_string(step));
    CHECK(killed_in[step] > 0);
  }
  CHECK(killed_in.size() >= 10);
  WARN("SIMULATED, " << kills << " kills: peak force " << worst_n << " N of " << cap_n
                     << ", longest way without a host " << longest_coast_s << " s of " << bound_s
                     << " s; " << where);
}

}  // namespace killed_host_test

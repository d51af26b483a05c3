#pragma once
// Small campaigns for tests, and a simulated bench with trials that a test can inspect and disturb.

#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json_fwd.hpp>

#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/supervisor.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace weft::daemon::test {

inline const std::filesystem::path source = WEFT_SOURCE_DIR;

/// One trial of each exploration, with strokes of 6 mm.
std::string short_recipe(const std::string& fabric, int seed = 1);
/// The text with every `from` replaced by `to`.
std::string changed(std::string text, const std::string& from, const std::string& to);
/// short_recipe() with more keys: `"settle":{"dwell_s":0}`.
std::string with_keys(const std::string& keys, const std::string& fabric = "denim");
/// bench17, with a path to its fabric table that works in any folder.
nlohmann::json bench17();
/// The same with a smaller plate near the home positions: travel is most of a campaign's work.
nlohmann::json bench17_near_home();
/// The device of a rig that has this role.
nlohmann::json& device_of(nlohmann::json& rig, const std::string& role);
/// Recipe and rig as files in the folder; the rig is bench17_near_home() unless given.
CampaignRequest request_in(const TemporaryFolder& folder, const std::string& recipe);
CampaignRequest request_in(const TemporaryFolder& folder, const std::string& recipe,
                           const nlohmann::json& rig);

/// Forwards bytes and keeps those that the host wrote.
class SpyLink final : public Link {
 public:
  SpyLink(std::unique_ptr<Link> to, Bytes& written) : to_(std::move(to)), written_(&written) {}
  Status write(ByteView bytes) override {
    written_->insert(written_->end(), bytes.begin(), bytes.end());
    return to_->write(bytes);
  }
  void on_receive(Receiver receiver) override { to_->on_receive(std::move(receiver)); }
  void on_closed(Closed closed) override { to_->on_closed(std::move(closed)); }

 private:
  std::unique_ptr<Link> to_;
  Bytes* written_;
};

/// A running bench, with a campaign ready to start.
struct TrialBench {
  TemporaryFolder folder;
  std::map<std::string, Bytes> written;  ///< to each device, by role
  std::map<std::string, MemoryLink*> far_end;
  CheckedRequest checked;
  SimulatedBench sim;
  std::optional<Recorder> recorder;
  std::optional<TrialRecording> recording;
  std::vector<recipes::Outcome> outcomes;
  std::optional<Error> trial_error;  ///< of the last trial that ended

  explicit TrialBench(const std::string& recipe);  ///< on bench17
  TrialBench(const std::string& recipe, const nlohmann::json& rig_json);
  /// Mounts on the simulated plate, and keeps the results of trial_done.
  SupervisorHooks hooks();

 private:
  Result<std::unique_ptr<Link>> link(const DeviceEntry& entry);
};

/// A TrialBench under its supervisor.
struct Guarded {
  explicit Guarded(const std::string& recipe) : bench(recipe) {}
  Guarded(const std::string& recipe, const nlohmann::json& rig) : bench(recipe, rig) {}

  void start() {
    supervisor.emplace(bench.checked.plan, bench.sim.host_time, *bench.sim.bench, *bench.recording,
                       bench.hooks());
    supervisor->start();
  }
  void run_to(recipes::Step step) {
    bench.sim.loop.run_until(
        [&] { return supervisor->result() || supervisor->state().step == step; });
    if (const auto& ended = supervisor->result(); ended && ended->error)
      FAIL(to_string(*ended->error));
    REQUIRE(supervisor->state().step == step);
  }
  void finish() {
    bench.sim.loop.run_until([&] { return supervisor->result().has_value(); });
  }

  TrialBench bench;
  std::optional<Supervisor> supervisor;
};

}  // namespace weft::daemon::test

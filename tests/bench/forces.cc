// Quality of the force regulation on every fabric, beside the limit of the stage's quantum:
//   bench_forces RIG OUT.json [FABRIC ...]
// The rig is a simulated bench, or an emulated one that weft-rig already serves. The forces are the
// true ones of the plant. script/bench forces runs both (tests/bench/forces.py). WEFT_BENCH_SEED is
// the seed of the patches and of a simulated bench's sensors; default 2016.

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/supervisor.hpp"
#include "daemon/hardware/link/port_link.hpp"
#include "sim/plant/fabric.hpp"

namespace {

using namespace weft;
using nlohmann::json;
using recipes::Step;

struct ForcePoint {
  TimePoint at;
  recipes::Step step = recipes::Step::ready;
  double force_n = 0;  ///< true force [N]
};

using ForceTrace = std::vector<ForcePoint>;

/// Requests the true force from weft-rig, one request at a time.
class TruthConsole {
 public:
  TruthConsole(std::unique_ptr<Link> link, std::function<void(double, TimePoint)> reported)
      : link_(std::move(link)), reported_(std::move(reported)) {
    link_->on_receive([this](ByteView bytes, TimePoint at) { take(bytes, at); });
  }
  void query() {
    static const std::string order = "{\"order\": \"truth\"}\n";
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(order.data());
    if (!waiting_) waiting_ = link_->write({bytes, order.size()}).has_value();
  }

 private:
  void take(ByteView bytes, TimePoint at) {
    for (const std::uint8_t byte : bytes) {
      line_.push_back(static_cast<char>(byte));
      if (byte != '\n') continue;
      const auto answer = nlohmann::json::parse(line_, nullptr, false);
      line_.clear();
      waiting_ = false;
      if (answer.is_object() && answer.contains("contact_force_n"))
        reported_(answer["contact_force_n"].get<double>(), at);
    }
  }

  std::unique_ptr<Link> link_;
  std::function<void(double, TimePoint)> reported_;
  std::string line_;
  bool waiting_ = false;
};

/// Runs a plan on a session and keeps the true force of each trial.
class ForceRun {
 public:
  ForceRun(const daemon::CheckedRequest& checked, daemon::BenchSession& session,
           const daemon::RigFile& rig)
      : plan_(&checked.plan),
        session_(&session),
        traces_(checked.plan.trials.size()),
        ends_(checked.plan.trials.size()) {
    if (session.plant() != nullptr) return;
    auto& loop = dynamic_cast<daemon::RealLoop&>(session.loop());
    auto link = daemon::open_tcp(loop, rig.console);
    if (link)
      console_ = std::make_unique<TruthConsole>(
          std::move(*link), [this](double force_n, TimePoint at) { keep(force_n, at); });
  }

  /// False if a trial was not complete.
  bool run(const std::filesystem::path& file, const daemon::RigFile& rig) {
    std::optional<Status> up;
    session_->bench().bring_up([&up](Status outcome) { up = std::move(outcome); });
    session_->run_until([&] { return up.has_value(); });
    if (!up || !*up) return complain(up ? to_string(up->error()) : "silence");
    daemon::CampaignHeader header;
    header.info.kind = rig.bench;
    for (const auto axis : recipes::all_axes)
      header.info.axes.push_back(
          {std::string(recipes::to_string(axis)), !recipes::is_linear(axis)});
    auto recorder = daemon::Recorder::create(file, header);
    if (!recorder) return complain(to_string(recorder.error()));
    if (session_->plant() == nullptr) recorder->write_behind();
    daemon::TrialRecording recording(*recorder, *plan_);
    daemon::SupervisorHooks hooks;
    hooks.mount = [this](const recipes::MountFabric& order, daemon::MountDone done) {
      session_->mount(order, std::move(done));
    };
    hooks.trial_done = [this](const recipes::TrialDone& done, const daemon::ForceTally&) {
      if (done.trial < ends_.size()) ends_[done.trial] = done;
    };
    daemon::Supervisor supervisor(*plan_, session_->loop(), session_->bench(), recording, hooks);
    supervisor_ = &supervisor;
    supervisor.start();
    inspect();
    session_->run_until([&] { return supervisor.result().has_value(); });
    supervisor_ = nullptr;
    session_->loop().cancel(timer_);
    if (const auto& error = supervisor.result()->error) return complain(to_string(*error));
    return true;
  }

  [[nodiscard]] const std::vector<ForceTrace>& traces() const { return traces_; }
  /// How a trial ended: "complete", another outcome with its reason, or "not run to its end".
  [[nodiscard]] std::string end_of(std::size_t trial) const {
    if (!ends_[trial]) return "not run to its end";
    const std::string outcome(recipes::to_string(ends_[trial]->outcome));
    return ends_[trial]->error ? outcome + ": " + to_string(*ends_[trial]->error) : outcome;
  }

 private:
  static bool complain(const std::string& what) {
    std::fprintf(stderr, "forces: %s\n", what.c_str());
    return false;
  }
  void inspect() {
    if (sim::Rig* plant = session_->plant())
      keep(plant->truth(session_->loop().now()).contact_force_n, session_->loop().now());
    else if (console_)
      console_->query();
    timer_ = session_->loop().after(period_, [this] { inspect(); });
  }
  void keep(double force_n, TimePoint at) {
    if (supervisor_ == nullptr || supervisor_->state().trial >= traces_.size()) return;
    const recipes::State& state = supervisor_->state();
    traces_[state.trial].push_back({at, state.step, force_n});
  }

  static constexpr Duration period_ = std::chrono::milliseconds(5);
  const recipes::Plan* plan_;
  daemon::BenchSession* session_;
  std::vector<ForceTrace> traces_;
  std::vector<std::optional<recipes::TrialDone>> ends_;
  std::unique_ptr<TruthConsole> console_;
  daemon::Supervisor* supervisor_ = nullptr;
  TimerId timer_ = 0;
};

constexpr double set_point_n = 5, settled_n = 0.02 * set_point_n, quantum_m = 1e-6;

/// A figure is NaN if the trace does not show it.
struct Figures {
  double touch_n = NAN;      ///< peak until the weight rests, minus the weight
  double overshoot_n = NAN;  ///< peak after the press began, minus the set point
  double settle_s = NAN;     ///< from the begin of the press until the force stays within 2 % in
                             ///< phase P
  double rms_n = NAN;        ///< phase M
  double worst_n = NAN;
};

Figures figures_of(const ForceTrace& trace, double weight_n) {
  Figures f;
  double squares = 0;
  std::size_t sliding = 0;
  std::optional<TimePoint> pressed;
  for (const ForcePoint& p : trace) {
    const double error = p.force_n - set_point_n;
    if (p.step >= Step::approaching && p.step <= Step::resting)
      f.touch_n = std::fmax(f.touch_n, p.force_n - weight_n);  // fmax ignores NaN
    if (p.step == Step::pressing && !pressed) {
      pressed = p.at;
      f.settle_s = 0;
    }
    if (pressed && (p.step == Step::pressing || p.step == Step::holding)) {
      f.overshoot_n = std::fmax(f.overshoot_n, error);
      if (std::abs(error) > settled_n) f.settle_s = to_seconds(p.at - *pressed);
    }
    if (p.step != Step::sliding) continue;
    squares += error * error;
    ++sliding;
    f.worst_n = std::fmax(f.worst_n, std::abs(error));
  }
  if (sliding > 0) f.rms_n = std::sqrt(squares / static_cast<double>(sliding));
  return f;
}

/// Fabric and mount in series at the set point [N/m].
double stiffness_npm(const sim::Fabric& fabric, double mount_npm) {
  const auto law = sim::law_from_kes(fabric.kes);
  if (!law) return NAN;
  constexpr double face_m2 = 2.56e-4;
  const double cloth = (set_point_n + face_m2 * law->pressure_pa) / law->lambda_m;
  return 1 / (1 / cloth + 1 / mount_npm);
}

std::uint64_t seed() {
  const char* text = std::getenv("WEFT_BENCH_SEED");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : 2016;
}

std::string recipe(const std::vector<std::string>& fabrics) {
  return json{{"schema_version", 1},
              {"name", "forces"},
              {"source", "bench"},
              {"seed", seed()},
              {"fabrics", fabrics},
              {"repetitions", 1},
              {"on_trial_failure", "continue"},
              {"explorations",
               {{"M1",
                 {{"phases",
                   {{{"phase", "S"}, {"duration_s", 2}},
                    {{"phase", "P"}, {"force_N", 5}, {"force_band_N", 0.25}, {"duration_s", 3}},
                    {{"phase", "M"},
                     {"force_N", 5},
                     {"force_band_N", 0.25},
                     {"speed_mm_s", 2},
                     {"path", {{{"dx_mm", 0}, {"dy_mm", 30}}}}},
                    {{"phase", "E"}, {"duration_s", 1}}}}}}}}}
      .dump();
}

int fail_with(const Error& error) {
  std::fprintf(stderr, "forces: %s\n", to_string(error).c_str());
  return 1;
}

int run(const std::filesystem::path& rig_path, const std::string& out_path,
        std::vector<std::string> fabrics) {
  const std::filesystem::path folder = std::filesystem::path(out_path).parent_path() / "forces";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const auto text = daemon::read_text_file(rig_path);
  if (!text) return fail_with(text.error());
  const auto rig = daemon::parse_rig_file(*text);
  if (!rig) return fail_with(rig.error());
  const auto cloths = daemon::read_fabrics(*rig, rig_path);
  if (!cloths) return fail_with(cloths.error());
  const auto library = sim::parse_fabrics(*cloths);
  if (!library) return fail_with(library.error());
  if (fabrics.empty()) fabrics = library->names();
  std::ofstream(folder / "recipe.json") << recipe(fabrics);
  daemon::CampaignRequest request;
  request.recipe = folder / "recipe.json";
  request.rig = rig_path;
  auto checked = daemon::check_request(request);
  if (!checked) return fail_with(checked.error());
  auto session = daemon::open_session({*rig, rig_path, checked->plan.limits, seed()});
  if (!session) return fail_with(session.error());
  ForceRun bench(*checked, **session, *rig);
  const bool complete = bench.run(folder / "campaign.sqlite", *rig);

  const bool simulated = rig->mode == daemon::BenchMode::simulated;
  const char* label =
      simulated ? "simulated, virtual time" : "emulated, real time (simulated cloth)";
  const json document = json::parse(*text);
  const double mount_npm = document["simulation"].value("mount_stiffness_n_m", 2e4);
  std::printf(
      "forces, %s, %g Hz, wrench %g Hz: 5 N, slide of 30 mm at 2 mm/s; 1 um x stiffness "
      "is the quantum\n",
      label, checked->plan.limits.cycle_hz, checked->plan.limits.wrench_rate_hz);
  std::printf("%-10s %9s %9s %10s %9s %9s %8s %9s %9s %9s\n", "fabric", "K N/m", "quantum", "touch",
              "overshoot", "of 5 N", "settled", "RMS M", "floor", "worst M");
  std::printf("%-10s %9s %9s %10s %9s %9s %8s %9s %9s %9s\n", "", "", "mN", "mN", "mN", "%", "s",
              "mN", "mN", "mN");
  json rows = json::array();
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    const Figures f = figures_of(bench.traces()[i], checked->plan.limits.probe_weight_n);
    const double k = stiffness_npm(*library->find(fabrics[i]), mount_npm);
    const double quantum = k * quantum_m, floor = quantum / std::sqrt(12.0);
    std::printf("%-10s %9.0f %9.2f %10.1f %9.1f %9.2f %8.2f %9.2f %9.2f %9.1f\n",
                fabrics[i].c_str(), k, 1e3 * quantum, 1e3 * f.touch_n, 1e3 * f.overshoot_n,
                100 * f.overshoot_n / set_point_n, f.settle_s, 1e3 * f.rms_n, 1e3 * floor,
                1e3 * f.worst_n);
    rows.push_back({{"fabric", fabrics[i]},
                    {"ended", bench.end_of(i)},
                    {"stiffness_n_m", k},
                    {"quantum_n", quantum},
                    {"quantum_floor_rms_n", floor},
                    {"touch_overshoot_n", f.touch_n},
                    {"press_overshoot_n", f.overshoot_n},
                    {"settled_s", f.settle_s},
                    {"rms_m_n", f.rms_n},
                    {"worst_m_n", f.worst_n}});
  }
  std::ofstream(out_path) << json{{"name", "forces"},
                                  {"bench", label},
                                  {"cycle_hz", checked->plan.limits.cycle_hz},
                                  {"wrench_hz", checked->plan.limits.wrench_rate_hz},
                                  {"complete", complete},
                                  {"fabrics", rows}}
                                 .dump(2)
                          << '\n';
  return complete ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "bench_forces RIG OUT.json [FABRIC ...]\n");
    return 2;
  }
  return run(argv[1], argv[2], {argv + 3, argv + argc});
}

// `weft trade sim`: its scenes, the checks of a run, and the physics that its figures must show.
// Nothing here depends on the speed of the machine.

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"
#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "daemon/analysis/tradeoff/sim/sim_run.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/base/loop/wall_clock.hpp"

namespace trade_sim_test {

using namespace weft;
using namespace weft::daemon;

namespace {

std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string fabrics_path() {
  return WEFT_SOURCE_DIR "/sim/fabrics.json";
}

const sim::FabricLibrary& fabric_library() {
  static const sim::FabricLibrary one = *sim::parse_fabrics(file_text(fabrics_path()));
  return one;
}

SimScene make_scene(const char* name) {
  auto scene = make_sim_scene(name, fabric_library(), true);
  if (!scene) FAIL(to_string(scene.error()));
  return *scene;
}

SimTrace run_of(const SimCase& one, const SimSetting& setting) {
  const auto runner = SimRunner::make(one, setting);
  if (!runner) FAIL(to_string(runner.error()));
  return runner->run();
}

SimSetting l2(int share, sim::Integrator integrator = sim::Integrator::midpoint) {
  return {sim::Level::dynamic, integrator, sim_sample_s / share};
}

SimSetting l1(int share) {
  return {sim::Level::quasistatic, {}, sim_sample_s / share};
}

double force_error(const SimTrace& run, const SimTrace& reference) {
  return measure_error(run, reference).force_n.max;
}

/// Each measurement once, without repetitions: only figures of the physics.
SimSceneResult measured(const char* scene) {
  SimTradeoffOptions options;
  options.scenes = {scene};
  options.quick = true;
  options.timings = 1;
  auto out = measure_sim_tradeoff(fabric_library(), options, process_cpu_seconds);
  if (!out) FAIL(to_string(out.error()));
  REQUIRE(out->size() == 1);
  return out->front();
}

const SimPoint* point_of(const SimSceneResult& scene, const std::string& name) {
  for (const SimPoint& p : scene.points)
    if (p.setting.name() == name) return &p;
  return nullptr;
}

class Folder {
 public:
  Folder()
      : path_(std::filesystem::temp_directory_path() /
              ("weft_trade_sim_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }
  [[nodiscard]] std::string file(const char* name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace

TEST_CASE("the error of L2 falls with the square of the step by both methods") {
  const SimScene scene = make_scene("press_plain");
  const SimCase& one = scene.cases.front();
  const SimTrace truth = run_of(one, l2(9216));
  for (const auto integrator : {sim::Integrator::midpoint, sim::Integrator::tr_bdf2}) {
    const double coarse = force_error(run_of(one, l2(144, integrator)), truth);
    const double fine = force_error(run_of(one, l2(576, integrator)), truth);
    CAPTURE(coarse, fine);
    CHECK(std::log2(coarse / fine) / 2 == Approx(2).margin(0.1));
  }
}

TEST_CASE("L1's own error falls with the step, its distance from L2 does not: a model's floor") {
  const SimScene scene = make_scene("press_plain");
  const SimCase& one = scene.cases.front();
  const SimTrace finest_l1 = run_of(one, l1(2304)), truth = run_of(one, l2(2304));
  const SimTrace coarse = run_of(one, l1(9)), fine = run_of(one, l1(144));
  CHECK(force_error(coarse, finest_l1) > 100 * force_error(fine, finest_l1));
  CHECK(force_error(coarse, finest_l1) < 1e-3 * force_error(coarse, truth));
  CHECK(force_error(fine, truth) == Approx(force_error(coarse, truth)).epsilon(0.01));
}

TEST_CASE("the front of a scene is a front: nothing is better in one and as good in the other") {
  const SimSceneResult scene = measured("press");
  std::size_t on_front = 0;
  for (const SimPoint& p : scene.points) {
    bool beaten = false;
    for (const SimPoint& q : scene.points) {
      const double e = q.total.worst_n.max, f = p.total.worst_n.max;
      beaten = beaten || (e <= f && q.best_s <= p.best_s && (e < f || q.best_s < p.best_s));
    }
    CHECK(p.front == (p.failure.empty() && !beaten));
    on_front += p.front ? 1 : 0;
    CHECK(p.best_s > 0);
    CHECK(p.median_s >= p.best_s);
  }
  CHECK(on_front >= 2);
  REQUIRE(point_of(scene, "L3 midpoint 0.384 ms") != nullptr);
  CHECK(scene.refusals.empty());
}

TEST_CASE("levels without a limit cycle of friction are listed as failures on stick-slip") {
  const SimSceneResult scene = measured("stick_slip");
  CHECK(scene.cycle.peak_to_peak_n == Approx(0.311).margin(0.003));
  CHECK(scene.cycle.frequency_hz == Approx(24.3).margin(0.2));
  for (const SimPoint& p : scene.points) {
    CAPTURE(p.setting.name(), p.failure);
    if (p.setting.level < sim::Level::dynamic) {
      CHECK(p.failure.find("stick-slip lost") != std::string::npos);
      CHECK_FALSE(p.front);
    } else if (p.setting.step_s < 0.4e-3) {
      CHECK(p.failure.empty());
      CHECK(p.cycle.peak_to_peak_n == Approx(scene.cycle.peak_to_peak_n).epsilon(0.02));
    }
  }
  const SimPoint* coarse = point_of(scene, "L2 TR-BDF2 27.65 ms");
  REQUIRE(coarse != nullptr);
  CHECK_FALSE(coarse->failure.empty());
}

TEST_CASE("the force loop of the slide holds 5 N at every level that has a force to hold") {
  const SimScene scene = make_scene("slide");
  const SimCase& one = scene.cases.front();
  for (const SimSetting& setting : {l1(9), l2(72)}) {
    const SimTrace run = run_of(one, setting);
    REQUIRE(run.samples.size() == one.samples);
    const double tail = 0.8 * static_cast<double>(one.samples);
    for (std::size_t i = static_cast<std::size_t>(tail); i < one.samples; ++i) {
      CHECK(run.samples[i].normal_n == Approx(5).margin(0.05));
      CHECK(run.samples[i].friction_n[1] > 0.3);
    }
  }
}

TEST_CASE("contact is found twice where it is lost once, at the time at which L1 finds it") {
  const SimScene scene = make_scene("retouch");
  const SimTrace statics = run_of(scene.cases.front(), l1(144));
  const SimTrace dynamics = run_of(scene.cases.front(), l2(288));
  REQUIRE(statics.touch_s.size() == 2);
  REQUIRE(dynamics.touch_s.size() == 2);
  for (std::size_t i = 0; i < 2; ++i)
    CHECK(dynamics.touch_s[i] == Approx(statics.touch_s[i]).margin(50e-6));
}

TEST_CASE("a step that does not divide a sample is refused by its name") {
  const SimScene scene = make_scene("press");
  const auto refused =
      SimRunner::make(scene.cases.front(), {sim::Level::dynamic, {}, sim_sample_s / 7.3});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where.find("L2 midpoint") != std::string::npos);
  CHECK_FALSE(make_sim_scene("slam", fabric_library()));
}

TEST_CASE("between two looks a cubic's crossing and extreme are found exactly") {
  // (t - 1)(t - 5)(t + 2): crosses at 1
  const auto value = [](double t) { return (t - 1) * (t - 5) * (t + 2); };
  const auto rate = [](double t) {
    return (t - 5) * (t + 2) + (t - 1) * (t + 2) + (t - 1) * (t - 5);
  };
  const ForceSample a{0.5, value(0.5), rate(0.5)}, b{4, value(4), rate(4)};
  CHECK(crossing_s(a, b) == Approx(1).epsilon(1e-12));
  const double at = (4 + std::sqrt(16 + 21)) / 3;  // rate is 3 t^2 - 8 t - 7
  CHECK(extreme_between(a, b) == Approx(value(at)).epsilon(1e-12));
}

TEST_CASE("a sine is seen with its amplitude and frequency however it falls between the looks") {
  for (const double dt_s : {0.4e-3, 3.1e-3}) {
    CycleWatch watch;
    const double w = 2 * std::numbers::pi * 24.7;
    for (double t = 0; t < 2; t += dt_s) watch.see({t, std::sin(w * t), w * std::cos(w * t)});
    CHECK(watch.peak_to_peak() == Approx(2).epsilon(2e-3));
    CHECK(watch.frequency_hz() == Approx(24.7).epsilon(1e-3));
  }
}

TEST_CASE("a file of reference trajectories comes back, and only for the scenes it was made of") {
  const SimScene scene = make_scene("press");
  SimTrace trace = run_of(scene.cases.front(), l2(72));
  const std::vector<SimTrace> traces{trace};
  const ReferenceScene one{scene, traces};
  const std::string text = write_references("a test", {&one, 1});
  const auto back = read_references(text, {&scene, 1});
  REQUIRE(back);
  const SimReference& reference = back->at("press");
  CHECK(reference.words == "a test");
  CHECK(force_error(reference.traces.front(), trace) == 0);
  CHECK(reference.traces.front().touch_s == trace.touch_s);

  SimScene other = scene;
  other.cases.front().mount.mass_kg *= 1.01;
  const auto refused = read_references(text, {&other, 1});
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::invalid_argument);
  CHECK(refused.error().where.find("press") != std::string::npos);
  CHECK_FALSE(read_references("{}", {&scene, 1}));
}

TEST_CASE("weft trade sim writes page and data") {
  const Folder folder;
  const std::string page = folder.file("t.html"), data = folder.file("t.json"),
                    fabrics = fabrics_path();
  const std::vector<const char*> arguments{
      "weft",       "trade",     "sim",           "-o",       page.c_str(),       "--data",
      data.c_str(), "--fabrics", fabrics.c_str(), "--scenes", "slide,stick_slip", "--quick",
      "--timings",  "1"};
  std::ostringstream out, err;
  cli::Console console{out, err};
  INFO(err.str());
  REQUIRE(cli::run(static_cast<int>(arguments.size()), arguments.data(), console) == 0);
  CHECK(out.str().find("SIMULATED  stick_slip") != std::string::npos);

  const std::string html = file_text(page);
  CHECK(html.find("SIMULATED") != std::string::npos);
  CHECK(html.find("Mini40 Fz: 20 mN") != std::string::npos);
  CHECK(html.find("1 LSB") != std::string::npos);
  CHECK(html.find("stick-slip lost") != std::string::npos);
  for (const char* text : {">nan", " nan", "-nan", "\"nan", "NaN"})  // "Provenance" is no match
    CHECK(html.find(text) == std::string::npos);
  CHECK(html.find("<script") == std::string::npos);
  CHECK(html.find("src=") == std::string::npos);

  const auto written = nlohmann::json::parse(file_text(data));
  CHECK(written["bench"] == "simulated");
  CHECK(written["scenes"].size() == 2);
  std::size_t failed = 0;
  for (const auto& p : written["scenes"][1]["points"]) failed += p["failure"] == "" ? 0 : 1;
  CHECK(failed > 0);
}

TEST_CASE("weft trade sim --table writes no table with an unchecked margin") {
  const Folder folder;
  const std::string table = folder.file("f.json"), fabrics = fabrics_path(),
                    rig = std::string(WEFT_SOURCE_DIR) + "/sim/rigs/bench17.json";
  const std::vector<const char*> arguments{
      "weft",      "trade",         "sim",   "--table",   table.c_str(),
      "--fabrics", fabrics.c_str(), "--rig", rig.c_str(), "--table-recipes",
      "1",         "--table-seeds", "1"};
  std::ostringstream out, err;
  cli::Console console{out, err};
  CHECK(cli::run(static_cast<int>(arguments.size()), arguments.data(), console) ==
        cli::exit_failure);
  CHECK(err.str().find("held_share") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(table));
}

TEST_CASE("weft trade sim looks over its files before it measures, and keeps those it reads") {
  const Folder folder;
  const std::string fabrics = folder.file("fab.json"), page = folder.file("t.html"),
                    same = folder.file("./t.html"), table = folder.file("f.json"),
                    reference = folder.file("r.json"), nowhere = folder.file("none/t.html");
  std::filesystem::copy_file(fabrics_path(), fabrics);
  std::ofstream(table) << "a table";
  std::ofstream(reference) << "trajectories";
  const std::string cloths = file_text(fabrics);
  const auto refusal = [&](std::vector<std::string> own) {
    std::vector<const char*> arguments{"weft",          "--json",  "trade",     "sim", "--fabrics",
                                       fabrics.c_str(), "--quick", "--timings", "1"};
    for (const std::string& one : own) arguments.push_back(one.c_str());
    std::ostringstream out, err;
    cli::Console console{out, err};
    CHECK(cli::run(static_cast<int>(arguments.size()), arguments.data(), console) == 1);
    CHECK(err.str().find("trade: ") == std::string::npos);  // nothing was measured
    CHECK_FALSE(std::filesystem::exists(page));
    return nlohmann::json::parse(out.str()).at("error");
  };
  const std::vector<std::string> one_scene{"--scenes", "slide"};
  const auto with = [&](std::vector<std::string> own) {
    own.insert(own.end(), one_scene.begin(), one_scene.end());
    return own;
  };
  CHECK(refusal(with({"-o", fabrics})).at("where") == fabrics);
  CHECK(refusal(with({"-o", page, "--table", fabrics})).at("where") == fabrics);
  CHECK(file_text(fabrics) == cloths);
  CHECK(refusal(with({"--reference", reference, "-o", reference})).at("where") == reference);
  CHECK(file_text(reference) == "trajectories");
  const nlohmann::json page_and_data = refusal(with({"-o", page, "--data", same}));
  CHECK(page_and_data.at("where") == "--data");
  CHECK(page_and_data.at("got") == same);
  const nlohmann::json data_and_table =
      refusal(with({"-o", page, "--data", table, "--table", table}));
  CHECK(data_and_table.at("where") == "--table");
  CHECK(data_and_table.at("got") == table);
  CHECK(refusal(with({"-o", nowhere})).at("code") == "not found");
  CHECK(refusal({"--scenes", "slide"}).at("where") == "--output");
  CHECK(file_text(table) == "a table");
}

}  // namespace trade_sim_test

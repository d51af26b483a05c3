#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"
#include "daemon/base/text/format.hpp"
#include "sim/plant/modal/rubbing.hpp"

namespace weft::daemon {
namespace {

constexpr double absurd_ratio = 10;       // relative to the largest force of the reference
constexpr double least_amplitude = 0.5;   // share of the reference's stick-slip amplitude; below it
                                          // the cycle is lost
constexpr double cycle_tolerance = 0.10;  // largest relative error of a cycle's amplitude and
                                          // frequency

constexpr std::uint64_t rubbing_seed = 1;

class Deviations {
 public:
  void add(double square) {
    most_ = std::max(most_, square);
    sum_ += square;
    ++count_;
  }
  [[nodiscard]] SimDeviation result() const {
    return {std::sqrt(most_),
            std::sqrt(sum_ / static_cast<double>(std::max<std::size_t>(count_, 1)))};
  }

 private:
  double most_ = 0, sum_ = 0;
  std::size_t count_ = 0;
};

double square(double x) {
  return x * x;
}

SimDeviation pad_deviation(const SimTrace& run, const SimTrace& reference) {
  Deviations out;
  for (std::size_t i = 0; i < run.pads.size(); ++i)
    for (std::size_t pad = 0; pad < sim::pad_count; ++pad)
      out.add(square(static_cast<double>(run.pads[i][pad]) - reference.pads[i][pad]));
  return out.result();
}

std::string newtons(double n) {
  return general(n) + " N";
}

std::string cycle_failure(const SimCycle& run, const SimCycle& reference) {
  const double ratio = run.peak_to_peak_n / reference.peak_to_peak_n;
  if (!(ratio >= least_amplitude) || !(run.frequency_hz > 0))
    return "stick-slip lost: " + newtons(run.peak_to_peak_n) + " peak to peak instead of " +
           newtons(reference.peak_to_peak_n);
  if (std::abs(ratio - 1) > cycle_tolerance ||
      std::abs(run.frequency_hz / reference.frequency_hz - 1) > cycle_tolerance)
    return "stick-slip wrong: " + newtons(run.peak_to_peak_n) + " at " +
           fixed(run.frequency_hz, 1) + " Hz instead of " + newtons(reference.peak_to_peak_n) +
           " at " + fixed(reference.frequency_hz, 1) + " Hz";
  return {};
}

using nlohmann::ordered_json;

constexpr int reference_schema_version = 1;

struct Column {
  const char* name;
  double& (*of)(sim::ContactState&);
};

constexpr Column columns[] = {
    {"y_m", [](sim::ContactState& s) -> double& { return s.pose.y_m; }},
    {"z_m", [](sim::ContactState& s) -> double& { return s.pose.z_m; }},
    {"extension_m", [](sim::ContactState& s) -> double& { return s.extension_m; }},
    {"indentation_m", [](sim::ContactState& s) -> double& { return s.indentation_m; }},
    {"lag_y_m", [](sim::ContactState& s) -> double& { return s.lag_m[1]; }},
    {"slope_x", [](sim::ContactState& s) -> double& { return s.slope_x; }},
    {"slope_y", [](sim::ContactState& s) -> double& { return s.slope_y; }},
    {"load_ratio", [](sim::ContactState& s) -> double& { return s.load_ratio; }},
    {"normal_n", [](sim::ContactState& s) -> double& { return s.normal_n; }},
    {"friction_y_n", [](sim::ContactState& s) -> double& { return s.friction_n[1]; }}};

ordered_json case_json(const SimCase& one, const SimTrace& trace) {
  ordered_json samples = ordered_json::array();
  for (sim::ContactState state : trace.samples) {
    ordered_json row = ordered_json::array();
    for (const Column& column : columns) row.push_back(column.of(state));
    samples.push_back(std::move(row));
  }
  return {{"name", one.name},
          {"touch_s", trace.touch_s},
          {"cycle_n", trace.cycle.peak_to_peak_n},
          {"cycle_hz", trace.cycle.frequency_hz},
          {"samples", std::move(samples)}};
}

SimTrace trace_from(const ordered_json& json) {
  SimTrace out;
  out.touch_s = json.at("touch_s").get<std::vector<double>>();
  out.cycle = {json.at("cycle_n").get<double>(), json.at("cycle_hz").get<double>()};
  for (const ordered_json& row : json.at("samples")) {
    sim::ContactState state;
    for (std::size_t i = 0; i < std::size(columns); ++i)
      columns[i].of(state) = row.at(i).get<double>();
    out.samples.push_back(state);
  }
  return out;
}

Result<SimReference> reference_from(const ordered_json& json, const SimScene& scene,
                                    const std::string& made_by) {
  const auto refuse = [&](std::string expected, std::string got) {
    return fail(
        {.code = Errc::invalid_argument,
         .where = scene.name,
         .what = "reference of another scene",
         .expected = std::move(expected),
         .got = std::move(got),
         .hint = "Create the reference again with bench_sim_reference and the same fabric table"});
  };
  const std::string fingerprint = json.at("fingerprint").get<std::string>();
  if (fingerprint != sim_fingerprint(scene))
    return refuse("fingerprint " + sim_fingerprint(scene), fingerprint);
  SimReference out{made_by, {}};
  for (const ordered_json& one : json.at("cases")) out.traces.push_back(trace_from(one));
  if (out.traces.size() != scene.cases.size())
    return refuse(std::to_string(scene.cases.size()) + " cases", std::to_string(out.traces.size()));
  for (std::size_t i = 0; i < scene.cases.size(); ++i)
    if (out.traces[i].samples.size() != scene.cases[i].samples)
      return refuse(std::to_string(scene.cases[i].samples) + " samples",
                    std::to_string(out.traces[i].samples.size()));
  return out;
}

}  // namespace

SimError measure_error(const SimTrace& run, const SimTrace& reference) {
  Deviations force, normal;
  const std::size_t count = std::min(run.samples.size(), reference.samples.size());
  for (std::size_t i = 0; i < count; ++i) {
    const sim::ContactState &a = run.samples[i], &b = reference.samples[i];
    const double across =
        square(a.friction_n[0] - b.friction_n[0]) + square(a.friction_n[1] - b.friction_n[1]);
    normal.add(square(a.normal_n - b.normal_n));
    force.add(square(a.normal_n - b.normal_n) + across);
  }
  SimError out{force.result(), normal.result(), {}, {}};
  if (!run.pads.empty() && run.pads.size() == reference.pads.size())
    out.pads = pad_deviation(run, reference);
  if (run.touch_s.empty() || run.touch_s.size() != reference.touch_s.size()) return out;
  out.touch_s = 0;
  for (std::size_t i = 0; i < run.touch_s.size(); ++i)
    out.touch_s = std::max(*out.touch_s, std::abs(run.touch_s[i] - reference.touch_s[i]));
  return out;
}

Result<SimDeviation> rubbing_force(const SimCase& one, const SimTrace& run) {
  const sim::Patch& patch = one.patch;
  auto rubbing = sim::Rubbing::make({}, patch.field, rubbing_seed, patch.skew_rad);
  if (!rubbing) return pass(rubbing.error(), one.name);
  Deviations out;
  for (const sim::ContactState& s : run.samples) {
    const double lambda_m = patch.material.law.lambda_m;
    const sim::Force force = rubbing->advance(
        {{s.face_x_m(), s.face_y_m()}, s.friction_n, s.normal_n, s.normal_n / lambda_m});
    out.add(one.slides ? square(force[0] - s.friction_n[0]) + square(force[1] - s.friction_n[1]) +
                             square(force[2] - s.normal_n)
                       : 0);
  }
  return out.result();
}

std::string find_failure(const SimCase& one, const SimTrace& run, const SimTrace& reference) {
  double largest_n = 0, worst_n = 0;
  for (std::size_t i = 0; i < run.samples.size(); ++i) {
    const sim::ContactState& a = run.samples[i];
    if (!std::isfinite(a.normal_n) || !std::isfinite(a.friction_n[1]))
      return "force not finite at " + fixed(sim_sample_s * static_cast<double>(i + 1), 3) + " s";
    largest_n = std::max(largest_n, reference.samples[i].normal_n);
    worst_n = std::max(worst_n, std::abs(a.normal_n - reference.samples[i].normal_n));
  }
  if (worst_n > absurd_ratio * largest_n) return "diverged: " + newtons(worst_n) + " error";
  if (one.cycle_to_s > 0) return cycle_failure(run.cycle, reference.cycle);
  if (run.touch_s.size() < reference.touch_s.size())
    return "touch-downs: " + std::to_string(run.touch_s.size()) + " of " +
           std::to_string(reference.touch_s.size());
  return {};
}

std::string write_references(const std::string& made_by, std::span<const ReferenceScene> scenes) {
  ordered_json names = ordered_json::array(), list = ordered_json::array();
  for (const Column& column : columns) names.push_back(column.name);
  for (const ReferenceScene& one : scenes) {
    ordered_json cases = ordered_json::array();
    for (std::size_t i = 0; i < one.traces.size(); ++i)
      cases.push_back(case_json(one.scene.cases[i], one.traces[i]));
    list.push_back({{"scene", one.scene.name},
                    {"fingerprint", sim_fingerprint(one.scene)},
                    {"cases", std::move(cases)}});
  }
  const ordered_json out = {{"schema_version", reference_schema_version},
                            {"bench", "simulated"},
                            {"made_by", made_by},
                            {"sample_s", sim_sample_s},
                            {"columns", std::move(names)},
                            {"scenes", std::move(list)}};
  return out.dump() + "\n";
}

Result<std::map<std::string, SimReference>> read_references(std::string_view json,
                                                            std::span<const SimScene> scenes) {
  std::map<std::string, SimReference> out;
  try {
    const ordered_json file = ordered_json::parse(json);
    if (file.at("schema_version").get<int>() != reference_schema_version)
      return fail({.code = Errc::parse,
                   .where = "schema_version",
                   .what = "unsupported version of the reference",
                   .expected = std::to_string(reference_schema_version),
                   .got = file.at("schema_version").dump()});
    const std::string made_by = file.at("made_by").get<std::string>();
    for (const ordered_json& one : file.at("scenes"))
      for (const SimScene& scene : scenes) {
        if (scene.name != one.at("scene").get<std::string>()) continue;
        auto reference = reference_from(one, scene, made_by);
        if (!reference) return pass(reference.error());
        out.emplace(scene.name, std::move(*reference));
      }
  } catch (const nlohmann::json::exception& e) {
    return fail(
        {.code = Errc::parse, .where = e.what(), .what = "not a file of reference trajectories"});
  }
  return out;
}

}  // namespace weft::daemon

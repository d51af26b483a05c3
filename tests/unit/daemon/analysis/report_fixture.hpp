#pragma once
// A small made-up campaign for the report's tests: three fabrics that differ by construction.

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json_fwd.hpp>
#include <random>
#include <string>
#include <vector>

#include "daemon/analysis/report/report.hpp"

namespace report_test {

inline std::string recipe_text() {
  return R"({"schema_version": 1, "name": "three", "seed": 7,
    "fabrics": ["knitwear1", "wool", "pile"], "repetitions": 6,
    "explorations": {"M1": {"phases": [
      {"phase": "S", "duration_s": 1}, {"phase": "P", "force_N": 5, "force_band_N": 0.5, "duration_s": 2},
      {"phase": "M", "force_N": 5, "force_band_N": 0.5, "speed_mm_s": 2, "path": [{"dx_mm": 0, "dy_mm": 20}]},
      {"phase": "E", "duration_s": 1}]}}})";
}

inline std::string file_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline std::string rig_text() {
  return file_text(WEFT_SOURCE_DIR "/sim/rigs/bench17.json");
}

struct Shape {
  double texture_counts;
  double texture_hz;
};

inline weft::Phase phase_at(double t_s) {
  if (t_s < 1) return weft::Phase::rest;
  if (t_s < 3) return weft::Phase::press;
  return t_s < 13 ? weft::Phase::motion : weft::Phase::end;
}

// Pads at 37 Hz for 14 s; the wrench at 100 Hz, 0.1 N over the set point in phase M for wool, else
// 0.05 N under it.
inline void add_trial(weft::daemon::Dataset& set, const std::string& fabric, Shape shape,
                      std::uint32_t repetition, std::mt19937& engine) {
  std::normal_distribution<double> noise(0, 2);
  weft::classifier::Trial trial;
  weft::daemon::TrialRecord record;
  trial.file = fabric + "-" + std::to_string(repetition);
  trial.label = fabric;
  trial.group = std::to_string(repetition);
  trial.taxels = 4;
  record.spec.index = static_cast<std::uint32_t>(set.trials.size());
  record.spec.label = fabric;
  record.spec.group = trial.group;
  record.spec.exploration = "M1";
  record.spec.repetition = repetition;
  for (int i = 0; i < 14 * 37; ++i) {
    const double t_s = i / 37.0;
    const weft::Phase phase = phase_at(t_s);
    trial.phase.push_back(phase);
    record.t_ns.push_back(std::llround(t_s * 1e9));
    for (std::size_t pad = 0; pad < trial.taxels; ++pad) {
      const double texture = phase == weft::Phase::motion
                                 ? shape.texture_counts * std::sin(6.2832 * shape.texture_hz * t_s)
                                 : 0;
      trial.counts.push_back(
          std::round(1000 + 10 * static_cast<double>(pad) + texture + noise(engine)));
    }
  }
  for (int i = 0; i < 1400; ++i) {
    const double t_s = i / 100.0;
    record.wrench.t_ns.push_back(std::llround(t_s * 1e9));
    const double error_n = fabric == "wool" ? 0.1 : -0.05;
    const double force_n = phase_at(t_s) == weft::Phase::motion ? 5 + error_n : 2;
    for (const double value : {0.3, 0.4, force_n, 0.0, 0.0, 0.0})
      record.wrench.quanta.push_back(static_cast<std::int32_t>(std::lround(value * 1e6)));
  }
  record.quality.force_rms_error_n = fabric == "wool" ? 0.1 : 0.05;
  record.quality.force_in_band_fraction = 1;
  set.trials.push_back(std::move(trial));
  set.records.push_back(std::move(record));
}

inline weft::daemon::Dataset small_campaign(std::uint32_t repetitions = 6) {
  weft::daemon::Dataset set;
  set.info.kind = weft::daemon::BenchKind::simulated;
  set.info.name = "three";
  set.info.source = "campaign";
  set.info.recipe_json = recipe_text();
  set.info.rig_json = rig_text();
  set.info.seed = 7;
  std::mt19937 engine(7);
  for (std::uint32_t repetition = 1; repetition <= repetitions; ++repetition) {
    add_trial(set, "knitwear1", {60, 3}, repetition, engine);
    add_trial(set, "wool", {20, 5}, repetition, engine);
    add_trial(set, "pile", {120, 1}, repetition, engine);
  }
  return set;
}

inline weft::daemon::CampaignSummary make_summary(const weft::daemon::Dataset& set) {
  weft::daemon::CampaignSummary run;
  run.name = set.info.name;
  run.bench = set.info.kind;
  run.level = "L1";
  run.trials_planned = run.trials_complete = set.trials.size();
  run.virtual_s = 1000;
  run.wall_s = 4;
  run.time = {2, 1, 0.5, 0.7};
  run.force.add(0.3, 0.25);
  run.force.add(-0.1, 0.25);
  run.dataset_sha256 = dataset_sha256(set);
  return run;
}

inline std::vector<weft::daemon::ExplorationResult> results_of(const weft::daemon::Dataset& set) {
  double clock_s = 0;
  const auto seconds_now = [&clock_s] { return clock_s += 0.25; };
  weft::daemon::EvaluateOptions options;
  options.repeats = 2;
  options.threads = 1;
  auto results = weft::daemon::evaluate_campaign(set, options, seconds_now);
  REQUIRE(results.has_value());
  return std::move(*results);
}

/// One campaign with its evaluation, made once for all tests.
struct Campaign {
  weft::daemon::Dataset set = small_campaign();
  weft::daemon::CampaignSummary run = make_summary(set);
  std::vector<weft::daemon::ExplorationResult> results = results_of(set);
  [[nodiscard]] weft::daemon::ReportInput input() const {
    return {run, set, results, "test machine", "abc123"};
  }
};
inline const Campaign& campaign() {
  static const Campaign made;
  return made;
}

/// report.html and report.json as made by make_report().
inline std::string report_json(const weft::daemon::ReportInput& input) {
  return record_with_page(report_record(input), report_document(input));
}
inline std::string report_html(const weft::daemon::ReportInput& input) {
  const auto page = weft::daemon::page_of_record(report_json(input));
  REQUIRE(page.has_value());
  return *page;
}

inline std::size_t count_of(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (auto at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

/// Empty if every tag of `markup` is closed in order and every attribute is quoted; else the
/// problem. The report is HTML that is also XML, except for its doctype.
inline std::string unbalanced(const std::string& markup) {
  std::vector<std::string> open;
  for (std::size_t at = markup.find('<'); at != std::string::npos; at = markup.find('<', at)) {
    const std::size_t end = markup.find('>', at);
    if (end == std::string::npos) return "tag without end";
    const std::string tag = markup.substr(at + 1, end - at - 1);
    at = end;
    if (tag.empty() || tag[0] == '!' || tag.back() == '/') continue;
    if (count_of(tag, "\"") % 2 != 0) return "odd quotes in <" + tag + ">";
    if (tag[0] != '/') {
      open.push_back(tag.substr(0, tag.find(' ')));
      continue;
    }
    if (open.empty() || open.back() != tag.substr(1)) return "unexpected <" + tag + ">";
    open.pop_back();
  }
  return open.empty() ? "" : "<" + open.back() + "> is never closed";
}

}  // namespace report_test

#pragma once
// Small recordings with every field in use.

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "tests/unit/temporary_folder.hpp"

namespace weft::daemon::test {

inline CampaignHeader small_header() {
  CampaignHeader header;
  header.taxels = 3;
  header.trials_planned = 2;
  header.created_utc_ns = 1700000000000000000;
  DatasetInfo& info = header.info;
  info.kind = BenchKind::simulated;
  info.name = "small";
  info.source = "campaign";
  info.recipe_json = R"({"name":"m1"})";
  info.rig_json = R"({"bench":"simulated"})";
  info.seed = 0xFEDCBA9876543210;
  info.software_version = "0.1.0";
  info.taxel_rate_hz = 37;
  info.wrench_rate_hz = 100;
  info.stage_rate_hz = 100;
  info.axes = {{"x", false}, {"a", true}};
  info.devices = {{"ft", "ati_netft", R"({"serial":"FT1"})"}};
  return header;
}

inline TimePoint at_ms(std::int64_t ms) {
  return TimePoint(std::chrono::milliseconds(ms));
}

/// Frame i of trial `trial`: a mix-up of rows, columns or trials would change the numbers.
inline std::array<std::uint16_t, 3> frame(std::uint32_t trial, std::uint32_t i) {
  return {static_cast<std::uint16_t>(1000 * trial + i), static_cast<std::uint16_t>(65535 - i),
          static_cast<std::uint16_t>(7 * i)};
}

/// One taxel frame, one wrench and one stage reading every 10 ms; the phases P and M in halves.
inline Status record_samples(Recorder& recorder, std::uint32_t trial, std::uint32_t samples) {
  for (std::uint32_t i = 0; i < samples; ++i) {
    const auto counts = frame(trial, i);
    const Stamp stamp{at_ms(100000 * trial + 10 * i), i, 0};
    TaxelSample taxel;
    taxel.counts = counts;
    taxel.device_us = 4294967000U + 10 * i;  // wraps
    auto done = recorder.taxel(stamp, taxel, i < samples / 2 ? Phase::press : Phase::motion);
    WrenchSample wrench;
    wrench.force_n = {0.1 * i, -0.000001, 5.0 + trial};
    wrench.torque_nm = {0.25, -0.5, 1e-6 * i};
    if (done) done = recorder.wrench(stamp, wrench);
    const std::array positions{1e-6 * i, -0.5};
    if (done) done = recorder.stages(stamp, positions);
    if (!done) return done;
  }
  return {};
}

inline TrialSpec small_spec(std::uint32_t trial) {
  return {trial, 0,         trial % 2 == 0 ? "Denim" : "Silk", std::string(trial < 2 ? "r0" : "r1"),
          "M1",  trial / 2, 0xFFFFFFFFFFFFFFF0 + trial};
}

/// A finished campaign of `trials` complete trials.
inline Status record_campaign(const std::filesystem::path& path, std::uint32_t trials,
                              std::uint32_t samples) {
  auto recorder = Recorder::create(path, small_header());
  if (!recorder) return pass(recorder.error());
  for (std::uint32_t trial = 0; trial < trials; ++trial) {
    auto done = recorder->begin_trial(small_spec(trial), at_ms(100000 * trial));
    if (done) done = record_samples(*recorder, trial, samples);
    if (done)
      done = recorder->end_trial(TrialOutcome::complete, {0.05, 0.99}, at_ms(100000 * trial + 1));
    if (!done) return done;
  }
  return recorder->finish();
}

inline bool same_content(const Dataset& a, const Dataset& b) {
  if (a.info != b.info || a.trials.size() != b.trials.size()) return false;
  for (std::size_t i = 0; i < a.trials.size(); ++i) {
    const classifier::Trial& s = a.trials[i];
    const classifier::Trial& t = b.trials[i];
    const TrialRecord& q = a.records[i];
    const TrialRecord& r = b.records[i];
    if (s.file != t.file || s.label != t.label || s.group != t.group || s.taxels != t.taxels ||
        s.counts != t.counts || s.phase != t.phase)
      return false;
    if (q.spec.index != r.spec.index || q.spec.attempt != r.spec.attempt ||
        q.spec.label != r.spec.label || q.spec.group != r.spec.group ||
        q.spec.exploration != r.spec.exploration || q.spec.repetition != r.spec.repetition ||
        q.spec.patch_seed != r.spec.patch_seed || q.spec.factors != r.spec.factors ||
        q.outcome != r.outcome || q.quality.force_rms_error_n != r.quality.force_rms_error_n ||
        q.quality.force_in_band_fraction != r.quality.force_in_band_fraction ||
        q.lost_samples != r.lost_samples || q.t_ns != r.t_ns || q.device_us != r.device_us ||
        q.wrench != r.wrench || q.stages != r.stages || q.acceleration != r.acceleration ||
        q.sound != r.sound)
      return false;
  }
  return true;
}

}  // namespace weft::daemon::test

#include "daemon/apps/weft/lab_text.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/apps/weft/console.hpp"

namespace weft::daemon::cli {
namespace {

using lab::LabCampaign;
using lab::PartEntry;
using lab::PartState;
using lab::RigEntry;
using lab::RunEntry;
using nlohmann::json;

/// "2026-11-26 06:29"
std::string minute_text(std::int64_t us) {
  constexpr std::size_t characters = 16;
  return utc_text(us).substr(0, characters);
}

/// Empty for anything else, also for a number that PostgreSQL accepts and a double cannot be.
json object_of(const std::string& text) {
  json object = json::parse(text, nullptr, false);
  return object.is_object() ? object : json::object();
}

json status_of(const RigEntry& rig) {
  return object_of(rig.status_json);
}

std::string word_of(const json& status, const char* key) {
  const auto found = status.find(key);
  return found != status.end() && found->is_string() ? found->get<std::string>() : "";
}

std::string number_of(const json& status, const char* key) {
  const auto found = status.find(key);
  return found != status.end() && found->is_number() ? found->dump() : "";
}

std::string time_left(const json& status) {
  const auto found = status.find("eta_s");
  return found != status.end() && found->is_number() ? duration(found->get<double>()) : "";
}

std::string alarms_text(const json& status) {
  std::vector<std::string> alarms;
  if (const auto found = status.find("alarms"); found != status.end() && found->is_array())
    for (const json& one : *found)
      if (one.is_string()) alarms.push_back(one.get<std::string>());
  return joined(alarms, "; ");
}

std::string trials_text(const json& status) {
  const std::string trial = number_of(status, "trial"), trials = number_of(status, "trials");
  return trial.empty() ? "" : trials.empty() ? trial : trial + "/" + trials;
}

json optional_us(const std::optional<std::int64_t>& us) {
  return us ? json(*us) : json();
}

std::string rigs_text(const PartEntry& part, const std::map<std::string, BenchKind>& benches) {
  std::vector<std::string> names;
  for (const std::string& rig : part.rigs) {
    const auto known = benches.find(rig);
    const bool is_simulated = known != benches.end() && known->second == BenchKind::simulated;
    names.push_back(is_simulated ? rig + " (SIMULATED)" : rig);
  }
  return joined(names);
}

std::string part_note(const PartEntry& part) {
  if (!part.error.empty()) return part.error;
  if (part.lease_expired) return "lease expired";
  if (part.lease_until_us) return "lease until " + minute_text(*part.lease_until_us);
  return part.dataset_sha256.substr(0, 12);
}

}  // namespace

std::string format_rigs(const std::vector<RigEntry>& rigs) {
  if (rigs.empty()) return "no rig has published itself\n";
  Table table(Align::left);
  table.row({"rig", "bench", "state", "run", "trial", "left", "next action", "alarms", "seen (UTC)",
             "address"});
  for (const RigEntry& rig : rigs) {
    const json status = status_of(rig);
    table.row({rig.name, std::string(bench_text(rig.bench)), rig.state, word_of(status, "run"),
               trials_text(status), time_left(status), word_of(status, "next_action"),
               alarms_text(status), minute_text(rig.seen_us), rig.address});
  }
  return table.text("");
}

json to_json(const RigEntry& rig) {
  return {{"rig", rig.name},          {"bench", to_string(rig.bench)}, {"state", rig.state},
          {"status", status_of(rig)}, {"address", rig.address},        {"login", rig.login},
          {"seen_us", rig.seen_us},   {"rig_sha256", rig.rig_sha256}};
}

std::string format_runs(const std::vector<RunEntry>& runs) {
  if (runs.empty()) return "no runs\n";
  Table table(Align::left);
  table.row({"rig", "run", "bench", "recipe", "state", "trials", "started (UTC)", "place"});
  for (const RunEntry& run : runs)
    table.row({run.rig, run.run, std::string(bench_text(run.bench)), run.recipe, run.state,
               std::to_string(run.trials_complete) + "/" + std::to_string(run.trials_planned),
               minute_text(run.started_us), run.place});
  return table.text("");
}

json to_json(const RunEntry& run) {
  return {{"key", run.key},
          {"rig", run.rig},
          {"run", run.run},
          {"bench", to_string(run.bench)},
          {"recipe", run.recipe},
          {"recipe_sha256", run.recipe_sha256},
          {"seed", run.seed ? json(*run.seed) : json()},
          {"fabrics", run.fabrics},
          {"state", run.state},
          {"trials_planned", run.trials_planned},
          {"trials_complete", run.trials_complete},
          {"started_us", run.started_us},
          {"ended_us", optional_us(run.ended_us)},
          {"place", run.place}};
}

std::string format_campaign(const LabCampaign& campaign,
                            const std::map<std::string, BenchKind>& benches) {
  const auto done = std::ranges::count(campaign.parts, PartState::done, &PartEntry::state);
  std::string text = lab::campaign_text(campaign.id) + "  " + campaign.state + "  " +
                     campaign.name + "  " + std::to_string(done) + " of " +
                     std::to_string(campaign.parts.size()) + " parts done  submitted by " +
                     campaign.submitted_by + " at " + minute_text(campaign.submitted_us) + " UTC\n";
  Table table(Align::left);
  table.row({"part", "fabric", "state", "rig", "attempt", "run", "note", "allowed"});
  for (const PartEntry& part : campaign.parts) {
    const bool is_simulated = !part.holder.empty() && part.bench == BenchKind::simulated;
    table.row({std::to_string(part.number), part.fabric, std::string(to_string(part.state)),
               part.holder + (is_simulated ? " (SIMULATED)" : ""), std::to_string(part.attempt),
               part.run, part_note(part), rigs_text(part, benches)});
  }
  return text + table.text();
}

json to_json(const LabCampaign& campaign, const std::map<std::string, BenchKind>& benches) {
  json parts = json::array();
  for (const PartEntry& part : campaign.parts) {
    json rigs = json::array();
    for (const std::string& rig : part.rigs) {
      const auto known = benches.find(rig);
      rigs.push_back(
          {{"rig", rig},
           {"bench", to_string(known == benches.end() ? BenchKind::unknown : known->second)}});
    }
    parts.push_back({{"part", part.number},
                     {"fabric", part.fabric},
                     {"state", to_string(part.state)},
                     {"rig", part.holder},
                     {"bench", to_string(part.bench)},
                     {"attempt", part.attempt},
                     {"lease_until_us", optional_us(part.lease_until_us)},
                     {"lease_expired", part.lease_expired},
                     {"run", part.run},
                     {"dataset_sha256", part.dataset_sha256},
                     {"error", part.error},
                     {"rigs", std::move(rigs)}});
  }
  return {{"campaign", lab::campaign_text(campaign.id)},
          {"name", campaign.name},
          {"state", campaign.state},
          {"recipe_sha256", campaign.recipe_sha256},
          {"seed", campaign.seed ? json(*campaign.seed) : json()},
          {"parameters", object_of(campaign.parameters_json)},
          {"submitted_by", campaign.submitted_by},
          {"submitted_us", campaign.submitted_us},
          {"parts", std::move(parts)}};
}

}  // namespace weft::daemon::cli

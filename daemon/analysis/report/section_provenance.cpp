#include <nlohmann/json.hpp>

#include "daemon/analysis/report/figures.hpp"
#include "daemon/analysis/report/paper.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t longest_recipe = 40'000;  // keeps the page small

std::string item(std::string_view name, const std::string& value_html) {
  return "<dt>" + std::string(name) + "</dt><dd>" +
         (value_html.empty() ? std::string(no_value) : value_html) + "</dd>\n";
}

std::string code(const std::string& text) {
  return text.empty() ? std::string() : "<code>" + escape(text) + "</code>";
}

std::string device_list(const DatasetInfo& info) {
  std::string out;
  for (const DeviceInfo& device : info.devices)
    out += (out.empty() ? "" : ", ") + escape(device.name) + " (" + escape(device.driver) + ")";
  return out;
}

std::size_t lost_samples(const Dataset& dataset) {
  std::size_t lost = 0;
  for (const TrialRecord& record : dataset.records) lost += record.lost_samples;
  return lost;
}

std::string rate_of(std::string_view name, const BlockFormat& format) {
  return format.readings == 0 ? std::string()
                              : ", " + std::string(name) + " " + fixed(format.rate_hz, 1) + " Hz";
}

std::string rates(const DatasetInfo& info) {
  return "taxels " + fixed(info.taxel_rate_hz, 1) + " Hz, wrench " + fixed(info.wrench_rate_hz, 1) +
         " Hz, stages " + fixed(info.stage_rate_hz, 1) + " Hz" +
         rate_of("acceleration", info.acceleration) + rate_of("sound", info.sound);
}

/// Pages that the hand-over writes after this report, by name: it stands alone.
std::string handover_links(const Dataset& dataset) {
  const auto recipe = nlohmann::json::parse(dataset.info.recipe_json, nullptr, false);
  if (!recipe.is_object() || !recipe.contains("hand_over") || !recipe["hand_over"].is_object())
    return {};
  const auto from = recipe["hand_over"].value("from", nlohmann::json("taxels"));
  if (from == "imprints")
    return code("handover/imprints.html") + ", " + code("handover/imprints.model") + " (imprints)";
  const bool from_vibration = from == "vibration";
  std::string out;
  for (const std::string& exploration : list_explorations(dataset))
    out += (out.empty() ? "" : ", ") + code("handover/" + exploration + ".html") +
           (from_vibration ? " (sound and vibration)" : " (model)");
  return out;
}

}  // namespace

std::string provenance_section(const ReportInput& input) {
  const DatasetInfo& info = input.dataset.info;
  std::string out = "<section>\n<h2>Where this came from</h2>\n<figure><dl>\n";
  out += item("bench", escape(to_string(info.kind)) + " " + badge_html(input));
  out += item("data set SHA-256", code(input.run.dataset_sha256));
  out += item("recipe SHA-256", code(info.recipe_sha256));
  out += item("rig SHA-256", code(info.rig_sha256));
  out += item("seed", std::to_string(info.seed));
  const SimulationNote& simulation = input.run.simulation;
  out += item("plant level",
              escape(simulation.empty() ? input.run.level
                                        : simulation.setting + ", because " + simulation.because));
  out += item("software",
              "recorded by weft " + escape(info.software_version) +
                  (input.commit.empty() ? "" : ", reported by commit " + code(input.commit)));
  out += item("machine", escape(input.machine));
  out += item("devices", device_list(info));
  out += item("rates", rates(info));
  if (const std::string pages = handover_links(input.dataset); !pages.empty())
    out += item("evaluated on, once handed over", pages);
  out += item("lost taxel frames", thousands(lost_samples(input.dataset)));
  out += item("campaign file", code(input.run.campaign_file.filename().string()));
  out += item("data set", code(input.run.dataset_file.filename().string()));
  out += item("paper", escape(paper::citation));
  out += "</dl>\n";
  if (!info.recipe_json.empty() && info.recipe_json.size() <= longest_recipe)
    out += "<details><summary>Recipe, run with the seed above</summary><pre>" +
           escape(info.recipe_json) + "</pre></details>\n";
  return out + "</figure>\n</section>\n";
}

}  // namespace weft::daemon

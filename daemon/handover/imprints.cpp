#include "daemon/handover/imprints.hpp"

#include <nlohmann/json.hpp>

#include "daemon/imprint/tables.hpp"

namespace weft::daemon {

using nlohmann::ordered_json;

Result<HandedImprints> hand_over_imprints(const Dataset& data, const std::string& dataset_sha256,
                                          const recipes::HandOver& wanted,
                                          const HandOverHooks& hooks, std::function<bool()> stop) {
  if (hooks.progress) hooks.progress({0, 1, "imprints: four experiments at all scales"});
  TableOptions options;
  options.threads = hooks.threads;
  options.stop = std::move(stop);
  const auto tables = measure_tables(data, options);
  if (!tables) return pass(tables.error());
  const ordered_json figures = tables_json(*tables);
  const DatasetInfo& info = data.info;
  const ordered_json evaluation{
      {"bench", to_string(info.kind)},
      {"campaign", info.name},
      {"dataset_sha256", dataset_sha256},
      {"recipe_sha256", info.recipe_sha256},
      {"rig_sha256", info.rig_sha256},
      {"software_version", WEFT_VERSION},
      {"hand_over", {{"from", "imprints"}, {"at_most_s", wanted.at_most_s}}},
      {"meaning",
       "The experiments of Ellis 1986 on the last scan of phase P of each trial: right "
       "answers of rules that were trained without the imprints they are asked about."},
      {"models", ordered_json::array()},
      {"imprints", figures}};
  HandedImprints out{evaluation.dump(), {}};
  out.texts = {{"imprints.html", tables_html(*tables)}, {"imprints.json", figures.dump(2) + "\n"}};
  return out;
}

}  // namespace weft::daemon

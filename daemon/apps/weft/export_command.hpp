#pragma once
// `weft export`: a file of a campaign's complete trials beside it, as data.export of weftd makes
// it.

#include <filesystem>
#include <string>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct CampaignExportArgs {
  std::filesystem::path folder;
  std::string format = "hdf5";
  std::string exploration;
};
void add_options(CLI::App& command, CampaignExportArgs& args);

Result<int> run_campaign_export(const CampaignExportArgs& args, Console& console);

}  // namespace weft::daemon::cli

#pragma once
// Commands on data sets: `weft dataset`, `export`, `features`, `imprint`, `verify`.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/trial_choice.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

// `weft imprint search`.

struct ImprintSearchArgs {
  std::filesystem::path dataset;
  std::vector<std::string> groups;  ///< to learn from; empty: all
  std::string scales = "0,0.5,1,1.5,2,2.5,3,3.5,4,5,6";
  std::size_t most_scales = 3;
  std::string form = "10";
  std::string rule = "least-squares";
  std::string evaluated_by = "2/N";
  std::size_t shown = 10;
};
void add_options(CLI::App& command, ImprintSearchArgs& args);
/// The sets of scales that tell the classes of a data set apart best.
Result<int> run_imprint_search(const ImprintSearchArgs& args, Console& console);

// `weft imprint scene` and `weft imprint tables`.

struct ImprintSceneArgs {
  std::filesystem::path out;
  std::string level = "Z+";
  std::size_t side = 32;
  std::size_t presses = 1;
  std::uint64_t seed = 1;
};
void add_options(CLI::App& command, ImprintSceneArgs& args);
/// Makes a data set of simulated imprints.
Result<int> run_imprint_scene(const ImprintSceneArgs& args, Console& console);

struct ImprintTablesArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;  ///< page; empty: none
  std::vector<std::string> experiments;
  std::vector<std::string> rules;
  std::vector<std::string> scales;  ///< "1,2,4"; empty: the paper's
  bool no_laws = false;
};
void add_options(CLI::App& command, ImprintTablesArgs& args);
/// The tables of Ellis 1986 on a data set of imprints.
Result<int> run_imprint_tables(const ImprintTablesArgs& args, Console& console);

// `weft verify`: whether a campaign or a data set is what was recorded.

struct VerifyArgs {
  std::filesystem::path path;
};
void add_options(CLI::App& command, VerifyArgs& args);

/// exit_failure when something is not as it was recorded.
Result<int> run_verify(const VerifyArgs& args, Console& console);

// `weft export`: a file of a campaign's complete trials beside it, as data.export of weftd makes
// it.

struct CampaignExportArgs {
  std::filesystem::path folder;
  std::string format = "hdf5";
  std::string exploration;
};
void add_options(CLI::App& command, CampaignExportArgs& args);

Result<int> run_campaign_export(const CampaignExportArgs& args, Console& console);

// `weft dataset import`, `weft dataset export` and `weft dataset info`.

struct ImportArgs {
  std::filesystem::path source;  ///< a manifest or a folder
  std::filesystem::path out;
  std::string format = "manifest";
  std::string filter = "*";
  std::string shape;                  ///< imprint-table: "28x50"
  std::string group;                  ///< fabricslide: empty is "repetition"
  std::string order;                  ///< icub20: empty is "time"
  std::vector<std::string> channels;  ///< vibtac12; empty: X, Y, Z
  double rate_hz = 0;                 ///< tables with times; 0: as they tell
};
void add_options(CLI::App& command, ImportArgs& args);
Result<int> run_import(const ImportArgs& args, Console& console);

struct ExportArgs {
  std::filesystem::path campaign;
  std::filesystem::path out;
  bool without_log = false;
};
void add_options(CLI::App& command, ExportArgs& args);
/// The complete trials of a campaign file; says how many were left out.
Result<int> run_export(const ExportArgs& args, Console& console);

struct InfoArgs {
  std::filesystem::path dataset;  ///< or a campaign file
};
void add_options(CLI::App& command, InfoArgs& args);
Result<int> run_info(const InfoArgs& args, Console& console);

struct FeaturesArgs {
  std::filesystem::path dataset;
  std::filesystem::path out;
  TrialChoice trials;
};
void add_options(CLI::App& command, FeaturesArgs& args);
Result<int> run_features(const FeaturesArgs& args, Console& console);

}  // namespace weft::daemon::cli

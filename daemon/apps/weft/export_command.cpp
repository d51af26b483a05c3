#include "daemon/apps/weft/data_commands.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/apps/weft/table.hpp"
#include "daemon/storage/certificate/exports.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

std::string format_text(const ExportedFile& made, const std::filesystem::path& file) {
  Table facts(Align::left);
  facts.row({"file", file.string()});
  facts.row({"trials", std::to_string(made.trials) + " of " + std::to_string(made.planned)});
  facts.row({"bytes", std::to_string(made.bytes)});
  facts.row({"sha256", made.sha256});
  facts.row({"bench", made.bench});
  return "Exported\n" + facts.text();
}

}  // namespace

void add_options(CLI::App& command, CampaignExportArgs& args) {
  command
      .add_option("FOLDER", args.folder,
                  "of a campaign, by weft run or weftd, whole or cut short; the file goes into its "
                  "folder export, with its digest in list.json")
      ->required()
      ->check(CLI::ExistingDirectory);
  command
      .add_option("--format", args.format,
                  "hdf5, a data set, or features-csv, the table of its features")
      ->check(CLI::IsMember({"hdf5", "features-csv"}))
      ->capture_default_str();
  command.add_option("--exploration", args.exploration,
                     "with features-csv: whose, where the campaign has several");
}

Result<int> run_campaign_export(const CampaignExportArgs& args, Console& console) {
  const ExportFormat format = export_format_from(args.format).value_or(ExportFormat::hdf5);
  if (format == ExportFormat::hdf5 && !args.exploration.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "--exploration",
                 .what = "a data set has all explorations",
                 .expected = "with --format features-csv",
                 .got = args.exploration});
  const auto made = export_campaign(args.folder, {format, args.exploration});
  if (!made) return pass(made.error());
  const auto file = args.folder / export_folder_name / made->name;
  print(console, format_text(*made, file),
        {{"command", "export"},
         {"file", file.string()},
         {"format", to_string(format)},
         {"bytes", made->bytes},
         {"sha256", made->sha256},
         {"dataset_sha256", made->dataset_sha256},
         {"bench", made->bench},
         {"trials", made->trials},
         {"trials_planned", made->planned}});
  return exit_ok;
}

}  // namespace weft::daemon::cli

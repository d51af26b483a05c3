#include <cctype>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "daemon/analysis/calibration/calibrate.hpp"
#include "daemon/analysis/calibration/calibration_page.hpp"
#include "daemon/analysis/calibration/calibration_pictures.hpp"
#include "daemon/analysis/calibration/minimise.hpp"
#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "daemon/analysis/calibration/write_fabrics.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/apps/weft/sim_command.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/installed_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/pages/plot/style.hpp"

namespace weft::daemon::cli {
namespace {

using namespace weft::daemon::calibration;

struct CalibrateArgs {
  std::vector<std::filesystem::path> recordings;
  std::filesystem::path output, held_out, page, pictures;
  std::filesystem::path fabrics = "sim/fabrics.json";
  std::string name;  ///< of the recordings; empty: the first file's
  double speed_mm_s = 0;
  int seed = 1, threads = 2;
};

void add_options(CLI::App& command, CalibrateArgs& args) {
  command.add_option("recordings", args.recordings, "data sets to fit (HDF5)")->required();
  command.add_option("-o,--output", args.output, "write the fabric table to this file (JSON)")
      ->required();
  command.add_option("--held-out", args.held_out,
                     "check the fit with this data set, not with a held-out part");
  command.add_option("--page", args.page, "write a page to this file (HTML)");
  command.add_option("--pictures", args.pictures,
                     "write the pictures (calibration-NAME.svg) to this existing folder");
  command.add_option("--fabrics", args.fabrics, "start from this fabric table")
      ->capture_default_str();
  command.add_option("--name", args.name,
                     "start the names of the calibrated fabrics with this text");
  add_number(command, "--speed-mm-s", args.speed_mm_s, 0.01, 1000,
             "set the speed of the strokes if the recordings do not state it")
      ->default_str("");
  add_count(command, "--seed", args.seed, 0, 1'000'000'000,
            "set the seed of bootstrap and simulation");
  add_count(command, "--threads", args.threads, 1, 64,
            "use this number of threads; the result does not depend on it");
}

Result<std::vector<Dataset>> read_datasets(const std::vector<std::filesystem::path>& files) {
  std::vector<Dataset> datasets;
  for (const std::filesystem::path& file : files) {
    auto dataset = open_dataset(file);
    if (!dataset) return pass(dataset.error());
    datasets.push_back(std::move(*dataset));
  }
  return datasets;
}

Result<RecordingView> make_view(const std::vector<Dataset>& datasets, const CalibrateArgs& args) {
  ViewOptions options;
  if (args.speed_mm_s > 0) options.speed_mps = 1e-3 * args.speed_mm_s;
  return make_recording_view(datasets, options);
}

Status check_files(const CalibrateArgs& args) {
  std::vector<std::filesystem::path> inputs = args.recordings;
  inputs.push_back(args.fabrics);
  if (!args.held_out.empty()) inputs.push_back(args.held_out);
  const std::filesystem::path record = args.page.empty() ? args.page : record_beside(args.page);
  if (Status ok = check_outputs(
          inputs,
          std::vector<Output>{{"output", args.output}, {"page", args.page}, {"page", record}});
      !ok)
    return ok;
  return check_page(inputs, args.page);
}

/// Refuses strokes given twice: they make intervals too short, and as held-out data check nothing.
Status check_distinct(const std::vector<Dataset>& datasets, const CalibrateArgs& args,
                      const Dataset* held_out) {
  std::map<std::string, std::string> files;  // by digest
  const auto add = [&](const Dataset& dataset, const std::filesystem::path& file) -> Status {
    const auto [at, is_new] =
        files.try_emplace(compute_digest(dataset).dataset_sha256, file.string());
    if (is_new) return {};
    return fail({.code = Errc::invalid_argument,
                 .where = file.string(),
                 .what = "same data set as " + at->second,
                 .expected = "each data set once, fitted or held out"});
  };
  for (std::size_t i = 0; i < datasets.size(); ++i)
    if (Status ok = add(datasets[i], args.recordings[i]); !ok) return ok;
  return held_out != nullptr ? add(*held_out, args.held_out) : Status{};
}

CalibrationSource make_source(const CalibrateArgs& args, const std::vector<Dataset>& datasets) {
  CalibrationSource source;
  source.prefix = args.name.empty() ? args.recordings.front().stem().string() : args.name;
  source.command = "weft sim calibrate";
  for (const std::filesystem::path& file : args.recordings) {
    source.files.push_back(file.filename().string());
    source.command += " " + file.filename().string();
  }
  source.bench = datasets.front().info.kind;
  for (const Dataset& dataset : datasets) {
    if (dataset.info.kind != source.bench) source.bench = BenchKind::unknown;
    source.dataset_sha256.push_back(compute_digest(dataset).dataset_sha256);
  }
  source.command += " --fabrics " + args.fabrics.filename().string() + " --name " + source.prefix;
  if (!args.held_out.empty()) source.command += " --held-out " + args.held_out.filename().string();
  if (args.speed_mm_s > 0) source.command += " --speed-mm-s " + general(args.speed_mm_s);
  source.command += " --seed " + std::to_string(args.seed);
  source.held_out_file = args.held_out.filename().string();
  source.software = software_version();
  source.commit = software_commit();
  source.nlopt = nlopt_version();
  return source;
}

struct Views {
  RecordingView fitted;
  std::optional<RecordingView> held_out;
};

Result<Views> read_views(const std::vector<Dataset>& datasets, const CalibrateArgs& args) {
  if (Status ok = check_distinct(datasets, args, nullptr); !ok) return pass(ok.error());
  auto fitted = make_view(datasets, args);
  if (!fitted) return pass(fitted.error());
  if (args.held_out.empty()) {
    SplitView split = split_held_out(*fitted);
    return Views{std::move(split.fitted), std::move(split.held_out)};
  }
  const auto others = read_datasets({args.held_out});
  if (!others) return pass(others.error(), "--held-out");
  if (Status ok = check_distinct(datasets, args, &others->front()); !ok) return pass(ok.error());
  auto held_out = make_view(*others, args);
  if (!held_out) return pass(held_out.error(), "--held-out");
  return Views{std::move(*fitted), std::move(*held_out)};
}

std::string natural_text(const std::optional<double>& value, Scale scale) {
  return value ? general(from_scale(*value, scale)) : "-";
}

std::string interval_text(double low, double high) {
  return low < high ? " [" + general(low) + ", " + general(high) + "]" : "";
}

std::string statistics_text(const CalibrationResult& result) {
  std::string out = "SIMULATED beside recorded   real [95 % interval]   before   after\n";
  for (const ComparedStatistic& s : result.statistics) {
    if (!s.real.cloth.empty()) continue;
    const Scale scale = s.real.scale;
    out += "  " + s.real.name + "  " + general(s.real.shown) +
           interval_text(from_scale(s.low, scale), from_scale(s.high, scale)) + "  " +
           natural_text(s.before, scale) + "  " + natural_text(s.after, scale) + "\n";
  }
  return out;
}

std::string parameters_text(const CalibrationResult& result) {
  std::string out = "parameters\n";
  for (const CalibratedParameter& p : result.parameters)
    out += "  " + p.parameter.label() + "  " + general(p.value) + interval_text(p.low, p.high) +
           "  " + std::string(to_string(p.standing)) + "\n";
  for (const std::string& direction : result.blind_directions) out += "  " + direction + "\n";
  return out;
}

std::string held_out_text(const HeldOutCheck& check) {
  if (!check.is_checked()) return "not checked. " + check.why_not + "\n";
  return std::string(check.passes() ? "passes" : "DOES NOT PASS") + ": " +
         std::to_string(check.inside) + " of " + std::to_string(check.statistics.size()) +
         " statistics of held-out recordings lie within the central 95 % of the simulated ones (80 "
         "% required)\n";
}

/// Labels are any text; in the file name only letters and digits stay.
std::filesystem::path picture_file(const std::filesystem::path& folder, std::string name) {
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '-';
  return folder / ("calibration-" + name + ".svg");
}

Status write_pictures(const std::filesystem::path& folder, const CalibrationResult& result) {
  if (folder.empty()) return {};
  std::set<std::filesystem::path> files;
  for (const CalibrationPicture& picture : draw_calibration(result)) {
    std::filesystem::path file = picture_file(folder, picture.name);
    // Labels such as "a b" and "a-b" give the same name: the second gets a number.
    for (std::size_t again = 2; !files.insert(file).second; ++again)
      file = picture_file(folder, picture.name + "-" + std::to_string(again));
    if (Status ok = write_text_file(file, standalone_svg(chart::draw(picture.plot))); !ok)
      return ok;
  }
  return {};
}

Status check_folder(const std::filesystem::path& folder) {
  std::error_code error;
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return {};
  return fail({.code = Errc::not_found,
               .where = "--pictures",
               .what = "folder not found",
               .got = folder.string()});
}

Result<int> run_calibrate(const CalibrateArgs& given, Console& console) {
  CalibrateArgs args = given;
  args.fabrics = find_installed(given.fabrics);
  if (Status ok = check_files(args); !ok) return pass(ok.error());
  if (Status ok = check_folder(args.pictures); !ok) return pass(ok.error());
  const auto table = read_text_file(args.fabrics);
  if (!table) return pass(table.error(), "--fabrics");
  const auto library = sim::parse_fabrics(*table);
  if (!library) return pass(library.error(), args.fabrics.string());
  const auto datasets = read_datasets(args.recordings);
  if (!datasets) return pass(datasets.error());
  const auto views = read_views(*datasets, args);
  if (!views) return pass(views.error());
  const CalibrationSource source = make_source(args, *datasets);
  CalibrationOptions options;
  options.seed = static_cast<std::uint64_t>(args.seed);
  options.threads = static_cast<std::size_t>(args.threads);
  const auto result = calibrate(
      views->fitted, views->held_out, *library, options,
      [&](const std::string& what) { console.err << "calibrate: " << what << std::endl; });
  if (!result) return pass(result.error());
  const auto written = calibrated_table(*table, *result, source);
  if (!written) return pass(written.error());
  if (Status ok = write_text_file(args.output, table_text(*written)); !ok) return pass(ok.error());
  if (!args.page.empty())
    if (Status ok = write_page_files(args.page, calibration_json(*result, source),
                                     calibration_document(*result, source));
        !ok)
      return pass(ok.error());
  if (Status ok = write_pictures(args.pictures, *result); !ok) return pass(ok.error());
  std::string text = statistics_text(*result) + parameters_text(*result);
  for (const std::string& remark : result->remarks) text += remark + "\n";
  text += held_out_text(result->held_out) + "table: " + args.output.string() + "\n";
  print(console, text, nlohmann::json(calibration_json(*result, source)));
  return result->held_out.passes() || !result->held_out.is_checked() ? exit_ok
                                                                     : exit_promise_missed;
}

}  // namespace

void add_sim_commands(const CommandGroup& weft) {
  const CommandGroup sim = weft.group("sim");
  sim.add<CalibrateArgs>("calibrate", run_calibrate);
  add_sim_strokes_command(sim);
}

}  // namespace weft::daemon::cli

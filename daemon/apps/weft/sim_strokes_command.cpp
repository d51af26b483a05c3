#include <nlohmann/json.hpp>

#include "daemon/analysis/calibration/scene.hpp"
#include "daemon/analysis/calibration/simulated_strokes.hpp"
#include "daemon/analysis/calibration/write_fabrics.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/sim_command.hpp"
#include "daemon/base/file/installed_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"

namespace weft::daemon::cli {
namespace {

using namespace weft::daemon::calibration;
using nlohmann::json;

constexpr std::size_t bootstrap_draws = 400;

struct StrokesArgs {
  std::filesystem::path recordings, output, beside;
  std::filesystem::path fabrics = "sim/fabrics.json";
  std::string name;  ///< of the recordings; empty: the file's
  double speed_mm_s = 0;
  int seed = 1, threads = 2;
};

void add_options(CLI::App& command, StrokesArgs& args) {
  command.add_option("recordings", args.recordings, "data set with the strokes to simulate (HDF5)")
      ->required();
  command.add_option("-o,--output", args.output, "write the SIMULATED strokes to this file (HDF5)")
      ->required();
  command.add_option("--beside", args.beside,
                     "write recorded and SIMULATED strokes together to this file (HDF5)");
  command.add_option("--fabrics", args.fabrics, "use this fabric table")->capture_default_str();
  command.add_option("--name", args.name,
                     "use the calibrated fabrics with names that start with this text");
  add_number(command, "--speed-mm-s", args.speed_mm_s, 0.01, 1000,
             "set the speed of the strokes if the recordings do not state it")
      ->default_str("");
  add_count(command, "--seed", args.seed, 0, 1'000'000'000, "set the seed of the simulation");
  add_count(command, "--threads", args.threads, 1, 64,
            "use this number of threads; the result does not depend on it");
}

struct Sides {
  RecordingView recorded, simulated;
  json cloths = json::object();  ///< label -> cloth of the table
};

/// The table's calibrations with exactly these recordings, oldest first.
std::vector<nlohmann::ordered_json> own_calibrations(const std::string& table,
                                                     const Dataset& recordings) {
  std::vector<nlohmann::ordered_json> out;
  const auto root = nlohmann::ordered_json::parse(table, nullptr, false);
  if (!root.contains("calibrations")) return out;
  const nlohmann::ordered_json digest = {compute_digest(recordings).dataset_sha256};
  for (const auto& calibration : root["calibrations"])
    if (calibration.contains("dataset_sha256") && calibration["dataset_sha256"] == digest)
      out.push_back(calibration);
  return out;
}

/// Scale of counts of the newest calibration, in which its values are given.
std::optional<double> scale_of(const std::vector<nlohmann::ordered_json>& calibrations) {
  if (calibrations.empty() || !calibrations.back().contains("counts_scale")) return {};
  return calibrations.back()["counts_scale"].get<double>();
}

/// Parameters from the table. Calibrations with exactly these recordings override those that they
/// could determine, the newest last: some belong to the recordings and are in no cloth table.
std::vector<double> values_of(const ClothModel& model,
                              const std::vector<nlohmann::ordered_json>& calibrations) {
  std::vector<double> out = model.start();
  for (const auto& calibration : calibrations)
    for (const auto& p : calibration.value("parameters", nlohmann::ordered_json::array())) {
      const std::size_t i = model.find(p["name"].get<std::string>(), p["cloth"].get<std::string>());
      if (i < out.size() && p["standing"] != "not_seen") out[i] = p["value"].get<double>();
    }
  return out;
}

Result<Sides> simulate(const Dataset& recordings, const std::string& table,
                       const StrokesArgs& args) {
  ViewOptions options;
  if (args.speed_mm_s > 0) options.speed_mps = 1e-3 * args.speed_mm_s;
  auto view = make_recording_view(std::span(&recordings, 1), options);
  if (!view) return pass(view.error());
  const auto library = sim::parse_fabrics(table);
  if (!library) return pass(library.error(), args.fabrics.string());
  const std::string prefix = args.name.empty() ? args.recordings.stem().string() : args.name;
  const auto calibrations = own_calibrations(table, recordings);
  const auto model =
      ClothModel::make(*view, with_own_cloths(*library, *view, prefix), scale_of(calibrations));
  if (!model) return pass(model.error(), args.fabrics.string());
  auto scene = Scene::make(*view, *model);
  if (!scene) return pass(scene.error());
  auto made =
      scene->simulate(values_of(*model, calibrations), static_cast<std::uint64_t>(args.seed),
                      static_cast<std::size_t>(args.threads));
  if (!made) return pass(made.error());
  Sides out{std::move(*view), std::move(*made), json::object()};
  for (const BaseCloth& cloth : model->cloths()) {
    const std::string own = name_in_table(prefix, cloth.label);
    out.cloths[cloth.label] = library->find(own) == nullptr ? cloth.taken : own;
  }
  return out;
}

/// Device entry of the simulated data set.
DeviceInfo plant_info(const std::string& table, const StrokesArgs& args) {
  return {"plant", "weft sim strokes",
          json{{"fabrics_sha256", sha256_hex(table)}, {"seed", args.seed}}.dump()};
}

json statistic_json(const SidedStatistic& s) {
  const Scale scale = s.recorded.scale;
  json out = {{"name", s.recorded.name},
              {"cloth", s.recorded.cloth},
              {"strokes_of", s.strokes_of},
              {"recorded", s.recorded.shown},
              {"simulated", nullptr}};
  if (s.interval)
    out["interval"] = {from_scale(s.interval->first, scale), from_scale(s.interval->second, scale)};
  if (s.simulated) out["simulated"] = from_scale(*s.simulated, scale);
  return out;
}

Status write_sides(const Dataset& recordings, const std::string& table, const Sides& sides,
                   const StrokesArgs& args) {
  Dataset simulated = stroke_dataset(recordings, sides.simulated, BenchKind::simulated);
  simulated.info.name += ", SIMULATED";
  simulated.info.seed = static_cast<std::uint64_t>(args.seed);
  simulated.info.software_version = software_version();
  simulated.info.devices = {plant_info(table, args)};
  if (const auto written = write_hdf5(simulated, args.output); !written)
    return pass(written.error());
  if (args.beside.empty()) return {};
  Dataset both = both_sides(stroke_dataset(recordings, sides.recorded, recordings.info.kind),
                            std::move(simulated));
  both.info.software_version = software_version();
  both.info.devices = {plant_info(table, args)};
  if (const auto written = write_hdf5(both, args.beside); !written) return pass(written.error());
  return {};
}

Result<int> run_strokes(const StrokesArgs& given, Console& console) {
  StrokesArgs args = given;
  args.fabrics = find_installed(given.fabrics);
  if (Status ok =
          check_outputs(std::vector{args.recordings, args.fabrics},
                        std::vector<Output>{{"output", args.output}, {"beside", args.beside}});
      !ok)
    return pass(ok.error());
  const auto table = read_text_file(args.fabrics);
  if (!table) return pass(table.error(), "--fabrics");
  const auto recordings = open_dataset(args.recordings);
  if (!recordings) return pass(recordings.error());
  const auto sides = simulate(*recordings, *table, args);
  if (!sides) return pass(sides.error());
  if (Status ok = write_sides(*recordings, *table, *sides, args); !ok) return pass(ok.error());
  json object = {{"bench", "simulated"},
                 {"recordings_bench", std::string(to_string(recordings->info.kind))},
                 {"file", args.output.string()},
                 {"cloths", sides->cloths},
                 {"strokes", sides->simulated.strokes.size()},
                 {"remarks", sides->recorded.remarks},
                 {"statistics", json::array()}};
  for (const SidedStatistic& s : compare_strokes(sides->recorded, sides->simulated, bootstrap_draws,
                                                 static_cast<std::uint64_t>(args.seed)))
    object["statistics"].push_back(statistic_json(s));
  std::string text = "SIMULATED: " + std::to_string(sides->simulated.strokes.size()) +
                     " strokes in " + args.output.string() + "\n";
  for (const auto& [label, cloth] : sides->cloths.items())
    text += "  " + label + "  as " + cloth.get<std::string>() + "\n";
  for (const std::string& remark : sides->recorded.remarks) text += remark + "\n";
  print(console, text, object);
  return exit_ok;
}

}  // namespace

void add_sim_strokes_command(const CommandGroup& sim) {
  sim.add<StrokesArgs>("strokes", run_strokes);
}

}  // namespace weft::daemon::cli

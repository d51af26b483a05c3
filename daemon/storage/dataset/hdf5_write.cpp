// Dataset to HDF5 file; layout in docs/dataset.md, "HDF5 layout".
#include <array>
#include <limits>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/storage/dataset/digest.hpp"
#include "daemon/storage/dataset/hdf5_derived.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/hdf5_handle.hpp"
#include "daemon/storage/dataset/hdf5_writer.hpp"

namespace weft::daemon {
namespace {

using hdf5::Writer;

void write_root(Writer& out, const Dataset& dataset, const std::string& digest) {
  const DatasetInfo& info = dataset.info;
  out.attribute("/", "format", hdf5::format_name);
  out.attribute("/", "format_version", hdf5::format_version);
  out.attribute("/", "bench_kind", to_string(info.kind));
  out.attribute("/", "name", info.name);
  out.attribute("/", "source", info.source);
  out.attribute("/", "seed", info.seed);
  out.attribute("/", "software_version", info.software_version);
  out.attribute("/", "recipe_sha256", info.recipe_sha256);
  out.attribute("/", "rig_sha256", info.rig_sha256);
  out.attribute("/", "dataset_sha256", digest);
}

void write_provenance(Writer& out, const DatasetInfo& info) {
  out.group("/provenance");
  out.document("/provenance/recipe_json", info.recipe_json);
  out.document("/provenance/rig_json", info.rig_json);
  std::vector<std::string> names;
  std::vector<std::string> drivers;
  std::vector<std::string> identities;
  for (const DeviceInfo& device : info.devices) {
    names.push_back(device.name);
    drivers.push_back(device.driver);
    identities.push_back(device.identity_json);
  }
  out.column("/provenance/device_name", names);
  out.column("/provenance/device_driver", drivers);
  out.column("/provenance/device_identity_json", identities);
}

/// A set of which nothing was left out for this reason has no group for it.
void write_selection(Writer& out, const DatasetInfo& info) {
  if (info.ended_early.empty()) return;
  std::vector<std::string> labels, explorations;
  std::vector<std::uint32_t> trials;
  for (const EndedEarly& some : info.ended_early) {
    labels.push_back(some.label);
    explorations.push_back(some.exploration);
    trials.push_back(some.trials);
  }
  out.group("/ended_early");
  out.attribute("/ended_early", "meaning", format_selection(info));
  out.column("/ended_early/label", labels);
  out.column("/ended_early/exploration", explorations);
  out.column("/ended_early/trials", trials);
}

/// The values of all trials one behind the other, as wide as there are factors. A set without a
/// sweep has no group for it.
void write_factors(Writer& out, const Dataset& dataset) {
  if (dataset.info.factors.empty()) return;
  std::vector<double> values;
  for (const TrialRecord& record : dataset.records)
    values.insert(values.end(), record.spec.factors.begin(), record.spec.factors.end());
  out.group("/factors");
  out.column("/factors/name", dataset.info.factors);
  out.column("/factors/values", values, dataset.info.factors.size());
  out.attribute("/factors/values", "unit", "SI, as the names say");
}

/// One value of every trial.
template <class Value>
auto gather(const Dataset& dataset, Value value) {
  std::vector<std::invoke_result_t<Value, std::size_t>> column;
  column.reserve(dataset.trials.size());
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) column.push_back(value(i));
  return column;
}

double or_nan(const std::optional<double>& value) {
  return value.value_or(std::numeric_limits<double>::quiet_NaN());
}

void write_trial_table(Writer& out, const Dataset& dataset, const DatasetDigest& digest) {
  const auto& trials = dataset.trials;
  const auto& records = dataset.records;
  const auto text = [&](const char* name, auto value) {
    out.column(name, gather(dataset, [&](std::size_t i) { return std::string(value(i)); }));
  };
  out.group("/trials");
  text("/trials/file", [&](std::size_t i) { return trials[i].file; });
  text("/trials/label", [&](std::size_t i) { return trials[i].label; });
  text("/trials/group", [&](std::size_t i) { return trials[i].group; });
  text("/trials/exploration", [&](std::size_t i) { return records[i].spec.exploration; });
  text("/trials/outcome", [&](std::size_t i) { return to_string(records[i].outcome); });
  out.column("/trials/sha256", digest.trial_sha256);
  const auto number = [&](const char* name, auto value) {
    out.column(name, gather(dataset, value));
  };
  number("/trials/index", [&](std::size_t i) { return records[i].spec.index; });
  number("/trials/attempt", [&](std::size_t i) { return records[i].spec.attempt; });
  number("/trials/repetition", [&](std::size_t i) { return records[i].spec.repetition; });
  number("/trials/patch_seed", [&](std::size_t i) { return records[i].spec.patch_seed; });
  number("/trials/lost_samples", [&](std::size_t i) { return records[i].lost_samples; });
  number("/trials/force_rms_error_n",
         [&](std::size_t i) { return or_nan(records[i].quality.force_rms_error_n); });
  number("/trials/force_in_band_fraction",
         [&](std::size_t i) { return or_nan(records[i].quality.force_in_band_fraction); });
  out.attribute("/trials/force_rms_error_n", "unit", "N");
  out.attribute("/trials/force_in_band_fraction", "unit", "1");
}

/// `name`_samples of every trial; trial i starts where the earlier ones end, in `name`_first.
template <class Size>
void write_extents(Writer& out, const Dataset& dataset, const std::string& name, Size size) {
  std::vector<std::uint64_t> samples;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) samples.push_back(size(i));
  out.column(("/trials/" + name + "_first").c_str(), hdf5::compute_begins(samples));
  out.column(("/trials/" + name + "_samples").c_str(), samples);
}

/// The lists of all trials, one behind the other.
template <class List>
auto concatenate(const Dataset& dataset, List list) {
  std::remove_cvref_t<std::invoke_result_t<List, std::size_t>> all;
  std::size_t total = 0;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) total += list(i).size();
  all.reserve(total);
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    all.insert(all.end(), list(i).begin(), list(i).end());
  return all;
}

void write_counts(Writer& out, const Dataset& dataset) {
  const std::size_t taxels = dataset.trials.front().taxels;
  const auto counts = concatenate(dataset, [&](std::size_t i) -> const std::vector<double>& {
    return dataset.trials[i].counts;
  });
  if (const auto exact = as_u16(counts)) {
    out.column("/taxel/counts", *exact, taxels);
  } else {
    out.column("/taxel/counts", counts, taxels);
  }
  out.attribute("/taxel/counts", "unit", "count");
}

void write_taxels(Writer& out, const Dataset& dataset) {
  const auto& trials = dataset.trials;
  const auto& records = dataset.records;
  out.group("/taxel");
  out.attribute("/taxel", "rate_hz", dataset.info.taxel_rate_hz);
  write_counts(out, dataset);
  const auto phases = concatenate(
      dataset, [&](std::size_t i) -> const std::vector<Phase>& { return trials[i].phase; });
  std::vector<std::uint8_t> letters;
  letters.reserve(phases.size());
  for (const Phase phase : phases) letters.push_back(static_cast<std::uint8_t>(phase));
  out.column("/taxel/phase", letters);
  out.attribute("/taxel/phase", "meaning",
                "ASCII: S rest, P pressure, M motion, E rest at the end, - transfer");
  out.column("/taxel/t_ns",
             concatenate(
                 dataset, [&](std::size_t i) -> const auto& { return records[i].t_ns; }));
  out.attribute("/taxel/t_ns", "unit", "ns");
  // The device's clock is kept per trial: a set may join sources with and without one.
  out.column("/taxel/device_us",
             concatenate(
                 dataset, [&](std::size_t i) -> const auto& { return records[i].device_us; }));
  out.attribute("/taxel/device_us", "unit", "us");
  write_extents(out, dataset, "taxel", [&](std::size_t i) { return trials[i].samples(); });
  write_extents(out, dataset, "device_us",
                [&](std::size_t i) { return records[i].device_us.size(); });
}

void write_phase_runs(Writer& out, const Dataset& dataset) {
  const hdf5::PhaseRuns runs = hdf5::phase_runs(dataset);
  out.group("/phases");
  out.column("/phases/trial", runs.trial);
  out.column("/phases/phase", runs.phase);
  out.column("/phases/first", runs.first);
  out.column("/phases/samples", runs.samples);
}

void write_wrench(Writer& out, const Dataset& dataset) {
  const auto& records = dataset.records;
  out.group("/wrench");
  out.attribute("/wrench", "rate_hz", dataset.info.wrench_rate_hz);
  out.attribute("/wrench", "frame", "sensor; +Fz pushes the plate down; bias removed");
  out.column("/wrench/t_ns",
             concatenate(
                 dataset, [&](std::size_t i) -> const auto& { return records[i].wrench.t_ns; }));
  out.attribute("/wrench/t_ns", "unit", "ns");
  out.column("/wrench/quanta",
             concatenate(
                 dataset, [&](std::size_t i) -> const auto& { return records[i].wrench.quanta; }),
             6);
  out.attribute("/wrench/quanta", "columns", "Fx Fy Fz Tx Ty Tz");
  out.attribute("/wrench/quanta", "unit", "N N N N.m N.m N.m, after division by per_unit");
  out.attribute("/wrench/quanta", "per_unit", force_quanta_per_n);
  write_extents(out, dataset, "wrench", [&](std::size_t i) { return records[i].wrench.samples(); });
}

void write_stages(Writer& out, const Dataset& dataset) {
  const auto& records = dataset.records;
  std::vector<std::string> names;
  std::vector<std::string> units;
  std::vector<double> per_unit;
  for (const Axis& axis : dataset.info.axes) {
    names.push_back(axis.name);
    units.emplace_back(axis.rotary ? "rad" : "m");
    per_unit.push_back(axis.quanta_per_unit());
  }
  out.group("/stages");
  out.attribute("/stages", "rate_hz", dataset.info.stage_rate_hz);
  out.column("/stages/axis", names);
  out.column("/stages/unit", units);
  out.column("/stages/per_unit", per_unit);
  out.column("/stages/t_ns",
             concatenate(
                 dataset, [&](std::size_t i) -> const auto& { return records[i].stages.t_ns; }));
  out.attribute("/stages/t_ns", "unit", "ns");
  out.column("/stages/quanta",
             concatenate(
                 dataset, [&](std::size_t i) -> const auto& { return records[i].stages.quanta; }),
             names.size());
  write_extents(out, dataset, "stages", [&](std::size_t i) { return records[i].stages.samples(); });
}

/// What differs between acceleration and sound.
struct BlockLayout {
  std::string group;  ///< "/sound"
  BlockStream TrialRecord::*stream;
  BlockFormat DatasetInfo::*format;
  std::size_t axes;
  const char* unit;
  double per_unit;
};

void write_block_columns(Writer& out, const Dataset& dataset, const BlockLayout& layout) {
  const auto column = [&](const char* name, auto member) {
    out.column((layout.group + name).c_str(), concatenate(
                                                  dataset, [&](std::size_t i) -> const auto& {
                                                    return dataset.records[i].*layout.stream.*
                                                           member;
                                                  }));
  };
  column("/t_ns", &BlockStream::t_ns);
  out.attribute((layout.group + "/t_ns").c_str(), "unit", "ns");
  column("/device_us", &BlockStream::device_us);
  out.attribute((layout.group + "/device_us").c_str(), "unit", "us");
  column("/lost", &BlockStream::lost);
  column("/clipped", &BlockStream::clipped);
  const std::string quanta = layout.group + "/quanta";
  out.column(
      quanta.c_str(),
      concatenate(
          dataset,
          [&](std::size_t i) -> const auto& { return (dataset.records[i].*layout.stream).quanta; }),
      layout.axes == 1 ? 0 : layout.axes);
  out.attribute(quanta.c_str(), "unit", std::string(layout.unit) + ", after division by per_unit");
  out.attribute(quanta.c_str(), "per_unit", layout.per_unit);
}

/// A set without the stream has no group for it.
void write_blocks(Writer& out, const Dataset& dataset, const BlockLayout& layout) {
  const BlockFormat& format = dataset.info.*layout.format;
  if (format.readings == 0) return;
  out.group(layout.group.c_str());
  out.attribute(layout.group.c_str(), "rate_hz", format.rate_hz);
  out.attribute(layout.group.c_str(), "block_readings", format.readings);
  write_block_columns(out, dataset, layout);
  write_extents(out, dataset, layout.group.substr(1) + "_blocks",
                [&](std::size_t i) { return (dataset.records[i].*layout.stream).blocks(); });
}

void write_vibrations(Writer& out, const Dataset& dataset) {
  write_blocks(out, dataset,
               {"/acceleration", &TrialRecord::acceleration, &DatasetInfo::acceleration,
                acceleration_axes, "m/s2", acceleration_quanta_per_mps2});
  write_blocks(out, dataset,
               {"/sound", &TrialRecord::sound, &DatasetInfo::sound, 1, "Pa", sound_quanta_per_pa});
}

/// The file, whole and closed. Nothing of HDF5 is left open behind it.
Status write_columns(const Dataset& dataset, const DatasetDigest& digest,
                     const std::filesystem::path& path, const Hdf5Options& options) {
  const hdf5::QuietErrors quiet;
  Writer out = Writer::create(path, options.deflate_level);
  write_root(out, dataset, digest.dataset_sha256);
  write_provenance(out, dataset.info);
  write_selection(out, dataset.info);
  write_trial_table(out, dataset, digest);
  write_factors(out, dataset);
  constexpr std::array groups{write_taxels, write_phase_runs, write_wrench, write_stages,
                              write_vibrations};
  for (const auto write_group : groups) {
    if (options.stop_requested && options.stop_requested()) return pass(stopped_early("columns"));
    write_group(out, dataset);
  }
  return out.close();
}

}  // namespace

Result<std::string> write_hdf5(const Dataset& dataset, const std::filesystem::path& path,
                               const Hdf5Options& options) {
  if (auto fine = check(dataset); !fine) return pass(std::move(fine).error(), path.string());
  auto digest = compute_digest(dataset, options.stop_requested);
  if (!digest) return pass(std::move(digest).error(), path.string());
  AtomicFile atomic(path);
  if (auto done = write_columns(dataset, *digest, atomic.temporary(), options); !done)
    return pass(std::move(done).error(), path.string());
  if (auto done = atomic.publish(); !done) return pass(std::move(done).error());
  return std::move(digest->dataset_sha256);
}

}  // namespace weft::daemon

// Dataset to HDF5 file; layout in docs/reference/dataset.md, "HDF5 layout".
#include <array>
#include <functional>
#include <limits>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/dataset/hdf5_derived.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"

namespace weft::daemon {
namespace {

using hdf5::concatenate;
using hdf5::gather;
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
  out.column("/provenance/device_name", gather(info.devices, &DeviceInfo::name));
  out.column("/provenance/device_driver", gather(info.devices, &DeviceInfo::driver));
  out.column("/provenance/device_identity_json", gather(info.devices, &DeviceInfo::identity_json));
}

/// Creates no group if no trial ended early.
void write_selection(Writer& out, const DatasetInfo& info) {
  if (info.ended_early.empty()) return;
  out.group("/ended_early");
  out.attribute("/ended_early", "meaning", format_selection(info));
  out.column("/ended_early/label", gather(info.ended_early, &EndedEarly::label));
  out.column("/ended_early/exploration", gather(info.ended_early, &EndedEarly::exploration));
  out.column("/ended_early/trials", gather(info.ended_early, &EndedEarly::trials));
}

/// Values of all trials, one column per factor. Without a sweep, no group is created.
void write_factors(Writer& out, const Dataset& dataset) {
  if (dataset.info.factors.empty()) return;
  const auto values = concatenate(
      dataset.records, [](const TrialRecord& record) -> auto& { return record.spec.factors; });
  out.group("/factors");
  out.column("/factors/name", dataset.info.factors);
  out.column("/factors/values", values, dataset.info.factors.size());
  out.attribute("/factors/values", "unit", "SI, as in the names");
}

void write_columns_of_groups(Writer& out, const Dataset& dataset) {
  write_group_columns(out, dataset.info.group_columns,
                      concatenate(
                          dataset.records, [](const TrialRecord& record) -> auto& {
                            return record.spec.group_values;
                          }));
}

/// Writes separate columns if the place of any trial is known.
void write_places(Writer& out, const std::vector<TrialRecord>& records) {
  const auto column = [&](const char* name, std::uint32_t TrialPlace::*member) {
    out.column(name, gather(records, [&](const TrialRecord& r) { return r.spec.place.*member; }));
  };
  if (std::ranges::all_of(records, [](const auto& r) { return r.spec.place == TrialPlace{}; }))
    return;
  column("/trials/piece", &TrialPlace::piece);
  column("/trials/mounting", &TrialPlace::mounting);
  column("/trials/patch", &TrialPlace::patch);
}

/// Writes separate columns if the rest of any trial was measured.
void write_rests(Writer& out, const std::vector<TrialRecord>& records) {
  const auto column = [&](const char* name, double RestForces::*member) {
    out.column(name, gather(records, [&](const TrialRecord& record) {
                 return record.quality.rest ? (*record.quality.rest).*member
                                            : std::numeric_limits<double>::quiet_NaN();
               }));
    out.attribute(name, "unit", "N");
  };
  if (std::ranges::none_of(records, [](const auto& r) { return r.quality.rest.has_value(); }))
    return;
  column("/trials/weight_n", &RestForces::weight_n);
  column("/trials/rest_before_n", &RestForces::before_n);
  column("/trials/rest_after_n", &RestForces::after_n);
}

void write_trial_table(Writer& out, const Dataset& dataset, const DatasetDigest& digest) {
  const auto& trials = dataset.trials;
  const auto& records = dataset.records;
  const auto spec = [&](const std::string& name, auto member) {
    out.column("/trials/" + name,
               gather(records, [&](const TrialRecord& record) { return record.spec.*member; }));
  };
  const auto quality = [&](const std::string& name, std::optional<double> TrialQuality::*member) {
    out.column("/trials/" + name, gather(records, [&](const TrialRecord& record) {
                 return (record.quality.*member).value_or(std::numeric_limits<double>::quiet_NaN());
               }));
  };
  out.group("/trials");
  out.column("/trials/file", gather(trials, &classifier::Trial::file));
  out.column("/trials/label", gather(trials, &classifier::Trial::label));
  out.column("/trials/group", gather(trials, &classifier::Trial::group));
  spec("exploration", &TrialSpec::exploration);
  out.column("/trials/outcome", gather(records, [](const TrialRecord& record) {
               return std::string(to_string(record.outcome));
             }));
  out.column("/trials/sha256", digest.trial_sha256);
  spec("index", &TrialSpec::index);
  spec("attempt", &TrialSpec::attempt);
  spec("repetition", &TrialSpec::repetition);
  spec("patch_seed", &TrialSpec::patch_seed);
  out.column("/trials/lost_samples", gather(records, &TrialRecord::lost_samples));
  quality("force_rms_error_n", &TrialQuality::force_rms_error_n);
  quality("force_in_band_fraction", &TrialQuality::force_in_band_fraction);
  out.attribute("/trials/force_rms_error_n", "unit", "N");
  out.attribute("/trials/force_in_band_fraction", "unit", "1");
  write_places(out, records);
  write_rests(out, records);
}

/// Writes `name`_samples and `name`_first of every trial; trials follow each other without gaps.
/// `list`: the rows, or one column of them.
template <class List>
void write_extents(Writer& out, const Dataset& dataset, const std::string& name, List list) {
  const auto samples = gather(dataset.records, [&](const TrialRecord& record) {
    return std::uint64_t{std::invoke(list, record).size()};
  });
  out.column("/trials/" + name + "_first", hdf5::compute_begins(samples));
  out.column("/trials/" + name + "_samples", samples);
}

/// The lists of all trials as one column; `unit`: its attribute, if given.
template <class List>
void write_lists(Writer& out, const Dataset& dataset, const std::string& name, List list,
                 std::string_view unit = {}, std::size_t width = 0) {
  out.column(name, concatenate(dataset.records, list), width);
  if (!unit.empty()) out.attribute(name, "unit", unit);
}

void write_counts(Writer& out, const std::vector<double>& counts, std::size_t taxels) {
  if (const auto exact = as_u16(counts)) {
    out.column("/taxel/counts", *exact, taxels);
  } else {
    out.column("/taxel/counts", counts, taxels);
  }
  out.attribute("/taxel/counts", "unit", "count");
}

void write_taxels(Writer& out, const Dataset& dataset) {
  const std::size_t taxels = dataset.trials.front().taxels;
  out.group("/taxel");
  out.attribute("/taxel", "rate_hz", dataset.info.taxel_rate_hz);
  if (taxels > 0)
    write_counts(out, concatenate(dataset.trials, &classifier::Trial::counts), taxels);
  out.column("/taxel/phase", gather(concatenate(dataset.trials, &classifier::Trial::phase),
                                    [](Phase phase) { return static_cast<std::uint8_t>(phase); }));
  out.attribute("/taxel/phase", "meaning",
                "ASCII: S rest, P pressure, M motion, E rest at the end, - transfer");
  write_lists(out, dataset, "/taxel/t_ns", &TrialRecord::t_ns, "ns");
  // The device's clock is stored per trial: a set may join sources with and without one.
  write_lists(out, dataset, "/taxel/device_us", &TrialRecord::device_us, "us");
  write_extents(out, dataset, "taxel", &TrialRecord::t_ns);
  write_extents(out, dataset, "device_us", &TrialRecord::device_us);
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
  const auto t_ns = [](const TrialRecord& record) -> auto& {
    return record.wrench.t_ns;
  };
  const auto quanta = [](const TrialRecord& record) -> auto& {
    return record.wrench.quanta;
  };
  out.group("/wrench");
  out.attribute("/wrench", "rate_hz", dataset.info.wrench_rate_hz);
  out.attribute("/wrench", "frame", "sensor; +Fz pushes the plate down; bias removed");
  write_lists(out, dataset, "/wrench/t_ns", t_ns, "ns");
  write_lists(out, dataset, "/wrench/quanta", quanta, {}, 6);
  out.attribute("/wrench/quanta", "columns", "Fx Fy Fz Tx Ty Tz");
  out.attribute("/wrench/quanta", "unit", "N N N N.m N.m N.m, after division by per_unit");
  out.attribute("/wrench/quanta", "per_unit", force_quanta_per_n);
  write_extents(out, dataset, "wrench", t_ns);
}

void write_stages(Writer& out, const Dataset& dataset) {
  const auto t_ns = [](const TrialRecord& record) -> auto& {
    return record.stages.t_ns;
  };
  const auto quanta = [](const TrialRecord& record) -> auto& {
    return record.stages.quanta;
  };
  const std::vector<Axis>& axes = dataset.info.axes;
  out.group("/stages");
  out.attribute("/stages", "rate_hz", dataset.info.stage_rate_hz);
  out.column("/stages/axis", gather(axes, &Axis::name));
  out.column("/stages/unit",
             gather(axes, [](const Axis& axis) { return std::string(axis.rotary ? "rad" : "m"); }));
  out.column("/stages/per_unit", gather(axes, &Axis::quanta_per_unit));
  write_lists(out, dataset, "/stages/t_ns", t_ns, "ns");
  write_lists(out, dataset, "/stages/quanta", quanta, {}, axes.size());
  write_extents(out, dataset, "stages", t_ns);
}

/// The differences between acceleration and sound.
struct BlockLayout {
  std::string group;  ///< "/sound"
  BlockStream TrialRecord::*stream;
  BlockFormat DatasetInfo::*format;
  std::size_t axes;
  std::string unit;
  double per_unit;
};

/// Creates no group for a set without the stream.
void write_blocks(Writer& out, const Dataset& dataset, const BlockLayout& layout) {
  const BlockFormat& format = dataset.info.*layout.format;
  const std::string& group = layout.group;
  if (format.readings == 0) return;
  const auto list = [&](auto member) {
    return [&layout, member ](const TrialRecord& record) -> auto& {
      return record.*layout.stream.*member;
    };
  };
  out.group(group);
  out.attribute(group, "rate_hz", format.rate_hz);
  out.attribute(group, "block_readings", format.readings);
  write_lists(out, dataset, group + "/t_ns", list(&BlockStream::t_ns), "ns");
  write_lists(out, dataset, group + "/device_us", list(&BlockStream::device_us), "us");
  write_lists(out, dataset, group + "/lost", list(&BlockStream::lost));
  write_lists(out, dataset, group + "/clipped", list(&BlockStream::clipped));
  write_lists(out, dataset, group + "/quanta", list(&BlockStream::quanta),
              layout.unit + ", after division by per_unit", layout.axes == 1 ? 0 : layout.axes);
  out.attribute(group + "/quanta", "per_unit", layout.per_unit);
  write_extents(out, dataset, group.substr(1) + "_blocks", list(&BlockStream::t_ns));
}

void write_vibrations(Writer& out, const Dataset& dataset) {
  write_blocks(out, dataset,
               {"/acceleration", &TrialRecord::acceleration, &DatasetInfo::acceleration,
                acceleration_axes, "m/s2", acceleration_quanta_per_mps2});
  write_blocks(out, dataset,
               {"/sound", &TrialRecord::sound, &DatasetInfo::sound, 1, "Pa", sound_quanta_per_pa});
}

/// Writes and closes the whole file. No HDF5 handle stays open.
Status write_columns(const Dataset& dataset, const DatasetDigest& digest,
                     const std::filesystem::path& path, const StopRequested& stop_requested) {
  const hdf5::QuietErrors quiet;
  Writer out = Writer::create(path);
  write_root(out, dataset, digest.dataset_sha256);
  write_provenance(out, dataset.info);
  write_selection(out, dataset.info);
  write_trial_table(out, dataset, digest);
  write_factors(out, dataset);
  write_columns_of_groups(out, dataset);
  constexpr std::array groups{write_taxels, write_phase_runs, write_wrench, write_stages,
                              write_vibrations};
  for (const auto write_group : groups) {
    if (stop_requested && stop_requested()) return pass(stopped_early("columns"));
    write_group(out, dataset);
  }
  return out.close();
}

}  // namespace

Status write_hdf5(const Dataset& dataset, const DatasetDigest& digest,
                  const std::filesystem::path& path, const StopRequested& stop_requested) {
  if (auto fine = check(dataset); !fine) return pass(std::move(fine).error(), path.string());
  AtomicFile atomic(path);
  if (auto done = write_columns(dataset, digest, atomic.temporary(), stop_requested); !done)
    return pass(std::move(done).error(), path.string());
  return atomic.publish();
}

Result<std::string> write_hdf5(const Dataset& dataset, const std::filesystem::path& path,
                               const StopRequested& stop_requested) {
  if (auto fine = check(dataset); !fine) return pass(std::move(fine).error(), path.string());
  auto digest = compute_digest(dataset, stop_requested);
  if (!digest) return pass(std::move(digest).error(), path.string());
  if (auto done = write_hdf5(dataset, *digest, path, stop_requested); !done)
    return pass(std::move(done).error());
  return std::move(digest->dataset_sha256);
}

}  // namespace weft::daemon

// Trials to an HDF5 file; layout in docs/reference/dataset.md, "HDF5 layout".
#include <algorithm>
#include <limits>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/storage/dataset/dataset_hasher.hpp"
#include "daemon/storage/dataset/dataset_writer.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/dataset/hdf5_derived.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"

namespace weft::daemon {
namespace {

using hdf5::concatenate;
using hdf5::gather;
using hdf5::GrowingColumn;
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

}  // namespace

namespace writing {

/// Numbers of rows that the trials have in one family of columns.
struct Extents {
  std::string family;  ///< "taxel": /trials/taxel_first and /trials/taxel_samples
  std::vector<std::uint64_t> samples = {};

  /// Trials follow each other without gaps.
  void write(Writer& out) const {
    out.column("/trials/" + family + "_first", hdf5::compute_begins(samples));
    out.column("/trials/" + family + "_samples", samples);
  }
};

/// The columns of /taxel, and /phases, which follows from them.
class TaxelColumns {
 public:
  explicit TaxelColumns(CountFormat format) : format_(format) {}

  void begin(Writer& out, const DatasetInfo& info, std::size_t taxels) {
    out.group("/taxel");
    out.attribute("/taxel", "rate_hz", info.taxel_rate_hz);
    if (taxels > 0)
      counts_ = format_ == CountFormat::whole
                    ? GrowingColumn::of<std::uint16_t>("/taxel/counts", taxels)
                    : GrowingColumn::of<double>("/taxel/counts", taxels);
  }

  /// `counts`: as whole numbers; unused with CountFormat::real.
  void add(Writer& out, const classifier::Trial& trial, const TrialRecord& record,
           const std::vector<std::uint16_t>& counts) {
    if (counts_ && format_ == CountFormat::whole) counts_->add(out, counts);
    if (counts_ && format_ == CountFormat::real) counts_->add(out, trial.counts);
    phase_.add(out,
               gather(trial.phase, [](Phase phase) { return static_cast<std::uint8_t>(phase); }));
    t_ns_.add(out, record.t_ns);
    device_us_.add(out, record.device_us);
    runs_.add(trial.phase);
    samples_.samples.push_back(record.t_ns.size());
    clocked_.samples.push_back(record.device_us.size());
  }

  void finish(Writer& out) {
    if (counts_) {
      counts_->finish(out);
      out.attribute("/taxel/counts", "unit", "count");
    }
    phase_.finish(out);
    out.attribute("/taxel/phase", "meaning",
                  "ASCII: S rest, P pressure, M motion, E rest at the end, - transfer");
    t_ns_.finish(out);
    out.attribute("/taxel/t_ns", "unit", "ns");
    device_us_.finish(out);
    out.attribute("/taxel/device_us", "unit", "us");
    samples_.write(out);
    clocked_.write(out);
    out.group("/phases");
    out.column("/phases/trial", runs_.trial);
    out.column("/phases/phase", runs_.phase);
    out.column("/phases/first", runs_.first);
    out.column("/phases/samples", runs_.samples);
  }

 private:
  CountFormat format_;
  std::optional<GrowingColumn> counts_;  ///< none without taxels
  GrowingColumn phase_ = GrowingColumn::of<std::uint8_t>("/taxel/phase");
  GrowingColumn t_ns_ = GrowingColumn::of<std::int64_t>("/taxel/t_ns");
  // The device's clock has its own extents: a set may join sources with and without one.
  GrowingColumn device_us_ = GrowingColumn::of<std::uint32_t>("/taxel/device_us");
  hdf5::PhaseRuns runs_;
  Extents samples_{"taxel"}, clocked_{"device_us"};
};

/// Times and quanta of the wrench or of the stages.
class StreamColumns {
 public:
  StreamColumns(const std::string& group, std::size_t width)
      : t_ns_(GrowingColumn::of<std::int64_t>(group + "/t_ns")),
        quanta_(GrowingColumn::of<std::int32_t>(group + "/quanta", width)),
        group_(group),
        samples_{group.substr(1)} {}

  template <class StreamData>
  void add(Writer& out, const StreamData& stream) {
    t_ns_.add(out, stream.t_ns);
    quanta_.add(out, stream.quanta);
    samples_.samples.push_back(stream.t_ns.size());
  }

  void finish(Writer& out) {
    t_ns_.finish(out);
    out.attribute(group_ + "/t_ns", "unit", "ns");
    quanta_.finish(out);
    samples_.write(out);
  }

 private:
  GrowingColumn t_ns_, quanta_;
  std::string group_;
  Extents samples_;
};

void begin_wrench(Writer& out, const DatasetInfo& info) {
  out.group("/wrench");
  out.attribute("/wrench", "rate_hz", info.wrench_rate_hz);
  out.attribute("/wrench", "frame", "sensor; +Fz pushes the plate down; bias removed");
}

void describe_wrench(Writer& out) {
  out.attribute("/wrench/quanta", "columns", "Fx Fy Fz Tx Ty Tz");
  out.attribute("/wrench/quanta", "unit", "N N N N.m N.m N.m, after division by per_unit");
  out.attribute("/wrench/quanta", "per_unit", force_quanta_per_n);
}

void begin_stages(Writer& out, const DatasetInfo& info) {
  const std::vector<Axis>& axes = info.axes;
  out.group("/stages");
  out.attribute("/stages", "rate_hz", info.stage_rate_hz);
  out.column("/stages/axis", gather(axes, &Axis::name));
  out.column("/stages/unit",
             gather(axes, [](const Axis& axis) { return std::string(axis.rotary ? "rad" : "m"); }));
  out.column("/stages/per_unit", gather(axes, &Axis::quanta_per_unit));
}

/// The columns of acceleration or sound.
class BlockColumns {
 public:
  struct Layout {
    std::string group;  ///< "/sound"
    std::size_t axes;
    std::string unit;
    double per_unit;
  };
  explicit BlockColumns(Layout layout) : layout_(std::move(layout)) {}

  /// Creates no group for a set without the stream.
  void begin(Writer& out, const BlockFormat& format) {
    if (format.readings == 0) return;
    out.group(layout_.group);
    out.attribute(layout_.group, "rate_hz", format.rate_hz);
    out.attribute(layout_.group, "block_readings", format.readings);
    is_used_ = true;
  }

  void add(Writer& out, const BlockStream& stream) {
    if (!is_used_) return;
    t_ns_.add(out, stream.t_ns);
    device_us_.add(out, stream.device_us);
    lost_.add(out, stream.lost);
    clipped_.add(out, stream.clipped);
    quanta_.add(out, stream.quanta);
    blocks_.samples.push_back(stream.blocks());
  }

  void finish(Writer& out) {
    if (!is_used_) return;
    for (GrowingColumn* column : {&t_ns_, &device_us_, &lost_, &clipped_, &quanta_})
      column->finish(out);
    out.attribute(layout_.group + "/t_ns", "unit", "ns");
    out.attribute(layout_.group + "/device_us", "unit", "us");
    out.attribute(layout_.group + "/quanta", "unit", layout_.unit + ", after division by per_unit");
    out.attribute(layout_.group + "/quanta", "per_unit", layout_.per_unit);
    blocks_.write(out);
  }

 private:
  Layout layout_;
  bool is_used_ = false;
  GrowingColumn t_ns_ = GrowingColumn::of<std::int64_t>(layout_.group + "/t_ns");
  GrowingColumn device_us_ = GrowingColumn::of<std::uint32_t>(layout_.group + "/device_us");
  GrowingColumn lost_ = GrowingColumn::of<std::uint32_t>(layout_.group + "/lost");
  GrowingColumn clipped_ = GrowingColumn::of<std::uint32_t>(layout_.group + "/clipped");
  GrowingColumn quanta_ = GrowingColumn::of<std::int32_t>(layout_.group + "/quanta",
                                                          layout_.axes == 1 ? 0 : layout_.axes);
  Extents blocks_{layout_.group.substr(1) + "_blocks"};
};

}  // namespace writing

struct DatasetWriter::Impl {
  /// Within QuietErrors.
  Impl(const std::filesystem::path& target, DatasetInfo about, CountFormat counts)
      : path(target),
        atomic(target),
        format(counts),
        hasher(about),
        taxels(counts),
        stages("/stages", about.axes.size()) {
    listed.info = std::move(about);
    out.emplace(Writer::create(atomic.temporary()));
  }

  /// Before the first trial's samples; the layout is known then.
  void begin(std::size_t taxels_of_trial) {
    taxels.begin(*out, listed.info, taxels_of_trial);
    writing::begin_wrench(*out, listed.info);
    writing::begin_stages(*out, listed.info);
    acceleration.begin(*out, listed.info.acceleration);
    sound.begin(*out, listed.info.sound);
  }

  void write_lists(const DatasetDigest& digest) {
    write_root(*out, listed, digest.dataset_sha256);
    write_provenance(*out, listed.info);
    write_selection(*out, listed.info);
    write_trial_table(*out, listed, digest);
    write_factors(*out, listed);
    write_columns_of_groups(*out, listed);
    taxels.finish(*out);
    wrench.finish(*out);
    writing::describe_wrench(*out);
    stages.finish(*out);
    acceleration.finish(*out);
    sound.finish(*out);
  }

  /// Keeps the first error.
  template <class Value>
  Result<Value> fail_for_good(Error error) {
    if (!failed) failed = std::move(error);
    return pass(*failed, path.string());
  }

  std::filesystem::path path;
  AtomicFile atomic;
  CountFormat format;
  DatasetHasher hasher;
  Dataset listed;  ///< trials without samples
  TrialSequence sequence;
  std::optional<Writer> out;
  writing::TaxelColumns taxels;
  writing::StreamColumns wrench{"/wrench", 6}, stages;
  writing::BlockColumns acceleration{
      {"/acceleration", acceleration_axes, "m/s2", acceleration_quanta_per_mps2}};
  writing::BlockColumns sound{{"/sound", 1, "Pa", sound_quanta_per_pa}};
  std::optional<Error> failed;
};

DatasetWriter::DatasetWriter(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DatasetWriter::DatasetWriter(DatasetWriter&&) noexcept = default;
DatasetWriter::~DatasetWriter() {
  const hdf5::QuietErrors quiet;  // handles close
  impl_.reset();
}

Result<DatasetWriter> DatasetWriter::create(const std::filesystem::path& path, DatasetInfo info,
                                            CountFormat counts) {
  if (auto fine = check_group_names(info.group_columns); !fine)
    return pass(fine.error(), path.string());
  const hdf5::QuietErrors quiet;
  return DatasetWriter(std::make_unique<Impl>(path, std::move(info), counts));
}

Result<std::string> DatasetWriter::add(const classifier::Trial& trial, const TrialRecord& record) {
  Impl& impl = *impl_;
  if (impl.failed) return pass(*impl.failed, impl.path.string());
  Status fine = impl.sequence.check(trial);
  if (fine) fine = check_trial(trial, record, impl.listed.info);
  if (!fine) return impl.fail_for_good<std::string>(fine.error());
  auto counts = as_u16(trial.counts);
  if (!counts && impl.format == CountFormat::whole)
    return impl.fail_for_good<std::string>({.where = "trial " + trial.file,
                                            .what = "count does not fit the file",
                                            .expected = "whole numbers from 0 to 65535"});
  std::string digest = impl.hasher.add(trial, record);
  const hdf5::QuietErrors quiet;
  if (impl.listed.trials.empty()) impl.begin(trial.taxels);
  impl.taxels.add(*impl.out, trial, record, counts.value_or(std::vector<std::uint16_t>{}));
  impl.wrench.add(*impl.out, record.wrench);
  impl.stages.add(*impl.out, record.stages);
  impl.acceleration.add(*impl.out, record.acceleration);
  impl.sound.add(*impl.out, record.sound);
  impl.listed.trials.push_back(without_samples(trial));
  impl.listed.records.push_back(without_samples(record));
  if (const Status& written = impl.out->status(); !written)
    return impl.fail_for_good<std::string>(written.error());
  return digest;
}

Result<DatasetDigest> DatasetWriter::finish(std::vector<EndedEarly> ended_early) {
  Impl& impl = *impl_;
  if (!impl.failed && impl.listed.trials.empty())
    impl.failed = Error{.what = "data set without trials"};
  if (impl.failed) return pass(*impl.failed, impl.path.string());
  impl.listed.info.ended_early = std::move(ended_early);
  DatasetDigest digest = impl.hasher.finish();
  {
    const hdf5::QuietErrors quiet;
    impl.write_lists(digest);
    if (const Status closed = impl.out->close(); !closed)
      return impl.fail_for_good<DatasetDigest>(closed.error());
  }
  if (Status published = impl.atomic.publish(); !published) return pass(published.error());
  return digest;
}

Result<std::string> write_hdf5(const Dataset& dataset, const std::filesystem::path& path,
                               const StopRequested& stop_requested) {
  if (auto fine = check(dataset); !fine) return pass(std::move(fine).error(), path.string());
  const bool whole = std::ranges::all_of(dataset.trials, [](const classifier::Trial& trial) {
    return as_u16(trial.counts).has_value();
  });
  auto out =
      DatasetWriter::create(path, dataset.info, whole ? CountFormat::whole : CountFormat::real);
  if (!out) return pass(out.error());
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    if (stop_requested && stop_requested()) return pass(stopped_early("digests"));
    if (const auto added = out->add(dataset.trials[i], dataset.records[i]); !added)
      return pass(added.error());
  }
  auto digest = out->finish(dataset.info.ended_early);
  if (!digest) return pass(digest.error());
  return std::move(digest->dataset_sha256);
}

}  // namespace weft::daemon

// HDF5 file to Dataset. The file's own metadata is checked before use.
#include <cmath>
#include <functional>
#include <new>
#include <type_traits>

#include "daemon/storage/dataset/dataset_hasher.hpp"
#include "daemon/storage/dataset/dataset_reader.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/dataset/hdf5_derived.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "drivers/api/sample.hpp"

namespace weft::daemon {
namespace {

using hdf5::Reader;
using hdf5::SlicedColumn;

double rate_of(Reader& in, const std::string& group) {
  const double rate_hz = in.real_attribute(group, "rate_hz");
  in.require(std::isfinite(rate_hz) && rate_hz >= 0, group, "rate_hz out of range");
  return rate_hz;
}

Status read_root(Reader& in, DatasetInfo& info) {
  const std::string format = in.text_attribute("/", "format");
  if (!in.status() || format != hdf5::format_name)
    return fail({.code = Errc::parse,
                 .what = "not a Weft data set, but another HDF5 file",
                 .expected = hdf5::format_name,
                 .got = format,
                 .hint = "Import tables and sound files with `weft dataset import`"});
  const std::uint64_t version = in.integer_attribute("/", "format_version");
  if (in.status() && version != hdf5::format_version)
    return fail({.code = Errc::unsupported,
                 .what = "unsupported data set version",
                 .expected = std::to_string(hdf5::format_version),
                 .got = std::to_string(version)});
  const auto kind = bench_kind_from(in.text_attribute("/", "bench_kind"));
  info.kind = kind.value_or(BenchKind::unknown);
  in.require(kind.has_value(), "bench_kind", "unknown bench kind");
  info.name = in.text_attribute("/", "name");
  info.source = in.text_attribute("/", "source");
  info.seed = in.integer_attribute("/", "seed");
  info.software_version = in.text_attribute("/", "software_version");
  info.recipe_sha256 = in.text_attribute("/", "recipe_sha256");
  info.rig_sha256 = in.text_attribute("/", "rig_sha256");
  info.taxel_rate_hz = rate_of(in, "/taxel");
  info.wrench_rate_hz = rate_of(in, "/wrench");
  info.stage_rate_hz = rate_of(in, "/stages");
  return in.status();
}

Status read_provenance(Reader& in, DatasetInfo& info) {
  info.recipe_json = in.document("/provenance/recipe_json");
  info.rig_json = in.document("/provenance/rig_json");
  const auto names = in.texts("/provenance/device_name");
  const auto drivers = in.texts("/provenance/device_driver");
  const auto identities = in.texts("/provenance/device_identity_json");
  in.require(drivers.size() == names.size() && identities.size() == names.size(), "/provenance",
             "columns differ in length");
  if (!in.status()) return in.status();
  for (std::size_t i = 0; i < names.size(); ++i)
    info.devices.push_back({names[i], drivers[i], identities[i]});
  return {};
}

Status read_selection(Reader& in, DatasetInfo& info) {
  if (!in.has("/ended_early")) return {};
  const auto labels = in.texts("/ended_early/label");
  const auto explorations = in.texts("/ended_early/exploration");
  const auto trials = in.column<std::uint32_t>("/ended_early/trials");
  in.require(explorations.size() == labels.size() && trials.size() == labels.size(), "/ended_early",
             "columns differ in length");
  if (!in.status()) return in.status();
  for (std::size_t i = 0; i < labels.size(); ++i)
    info.ended_early.push_back({labels[i], explorations[i], trials[i]});
  return {};
}

Status read_axes(Reader& in, DatasetInfo& info) {
  const auto names = in.texts("/stages/axis");
  const auto units = in.texts("/stages/unit");
  in.require(units.size() == names.size(), "/stages", "columns differ in length");
  if (!in.status()) return in.status();
  for (std::size_t i = 0; i < names.size(); ++i) {
    in.require(units[i] == "m" || units[i] == "rad", "/stages/unit", "unit is neither m nor rad");
    info.axes.push_back({names[i], units[i] == "rad"});
  }
  hdf5::compare_axes(in, info.axes);
  return in.status();
}

/// A column of the trial table; `place`: destination of trial i's value.
template <class Place>
void read_trial_column(Reader& in, const std::string& name, std::size_t trials, Place place) {
  using Value = std::remove_cvref_t<std::invoke_result_t<Place, std::size_t>>;
  auto column = in.column<Value>(name);
  if (!in.require(column.size() == trials, name, "length differs from /trials/file")) return;
  for (std::size_t i = 0; i < trials; ++i) place(i) = std::move(column[i]);
}

/// Read if the file has them, like the rests.
void read_places(Reader& in, std::vector<TrialRecord>& records) {
  if (!in.has("/trials/mounting")) return;
  const auto place = [&](const std::string& name, std::uint32_t TrialPlace::*member) {
    read_trial_column(
        in, "/trials/" + name,
        records.size(), [&](std::size_t i) -> auto& { return records[i].spec.place.*member; });
  };
  place("piece", &TrialPlace::piece);
  place("mounting", &TrialPlace::mounting);
  place("patch", &TrialPlace::patch);
}

void read_rests(Reader& in, std::vector<TrialRecord>& records) {
  if (!in.has("/trials/weight_n")) return;
  std::vector<RestForces> rests(records.size());
  const auto rest = [&](const std::string& name, double RestForces::*member) {
    read_trial_column(
        in, "/trials/" + name,
        records.size(), [&](std::size_t i) -> auto& { return rests[i].*member; });
  };
  rest("weight_n", &RestForces::weight_n);
  rest("rest_before_n", &RestForces::before_n);
  rest("rest_after_n", &RestForces::after_n);
  for (std::size_t i = 0; i < records.size(); ++i)
    if (!std::isnan(rests[i].weight_n)) records[i].quality.rest = rests[i];
}

Status read_trial_table(Reader& in, Dataset& dataset) {
  const auto files = in.texts("/trials/file");
  const std::size_t n = files.size();
  dataset.trials.resize(n);
  dataset.records.resize(n);
  auto& records = dataset.records;
  const auto spec = [&](const std::string& name, auto member) {
    read_trial_column(
        in, "/trials/" + name, n, [&](std::size_t i) -> auto& { return records[i].spec.*member; });
  };
  const auto quality = [&](const std::string& name, std::optional<double> TrialQuality::*member) {
    std::vector<double> values(n);
    read_trial_column(
        in, "/trials/" + name, n, [&](std::size_t i) -> auto& { return values[i]; });
    for (std::size_t i = 0; i < n; ++i)
      if (!std::isnan(values[i])) records[i].quality.*member = values[i];
  };
  spec("label", &TrialSpec::label);
  spec("group", &TrialSpec::group);
  spec("exploration", &TrialSpec::exploration);
  std::vector<std::string> outcomes(n);
  read_trial_column(
      in, "/trials/outcome", n, [&](std::size_t i) -> auto& { return outcomes[i]; });
  for (std::size_t i = 0; i < n; ++i) {
    const auto outcome = trial_outcome_from(outcomes[i]);
    in.require(outcome.has_value(), "/trials/outcome", "unknown outcome");
    records[i].outcome = outcome.value_or(TrialOutcome::failed);
    dataset.trials[i].file = files[i];
    dataset.trials[i].label = records[i].spec.label;
    dataset.trials[i].group = records[i].spec.group;
  }
  spec("index", &TrialSpec::index);
  spec("attempt", &TrialSpec::attempt);
  spec("repetition", &TrialSpec::repetition);
  read_trial_column(
      in, "/trials/lost_samples",
      n, [&](std::size_t i) -> auto& { return records[i].lost_samples; });
  spec("patch_seed", &TrialSpec::patch_seed);
  quality("force_rms_error_n", &TrialQuality::force_rms_error_n);
  quality("force_in_band_fraction", &TrialQuality::force_in_band_fraction);
  read_places(in, records);
  read_rests(in, records);
  return in.status();
}

Status read_factors(Reader& in, Dataset& dataset) {
  if (!in.has("/factors")) return in.status();
  auto& names = dataset.info.factors;
  names = in.texts("/factors/name");
  const auto values = in.column<double>("/factors/values", names.size());
  in.require(values.size() == names.size() * dataset.records.size(), "/factors/values",
             "length differs from /trials/file");
  if (!in.status()) return in.status();
  auto row = values.begin();
  for (TrialRecord& record : dataset.records) {
    const auto end = row + static_cast<std::ptrdiff_t>(names.size());
    record.spec.factors.assign(row, end);
    row = end;
  }
  return {};
}

Status read_columns_of_groups(Reader& in, Dataset& dataset) {
  StoredGroupColumns stored = read_group_columns(in, dataset.records.size());
  dataset.info.group_columns = std::move(stored.names);
  for (std::size_t i = 0; i < stored.of_row.size(); ++i)
    dataset.records[i].spec.group_values = std::move(stored.of_row[i]);
  return in.status();
}

/// Format of the blocks, if the file has the stream.
void read_block_format(Reader& in, const std::string& group, BlockFormat& format) {
  if (!in.has(group)) return;
  format.rate_hz = rate_of(in, group);
  const std::uint64_t readings = in.integer_attribute(group, "block_readings");
  in.require(readings > 0 && readings <= most_block_values && format.rate_hz > 0, group,
             "block_readings or rate_hz out of range");
  format.readings = static_cast<std::uint32_t>(readings);
}

}  // namespace

namespace reading {

/// The rows of each trial in one family of columns.
struct Extents {
  std::vector<std::uint64_t> first, samples;

  /// `rows`: of the columns.
  static Extents read(Reader& in, const std::string& family, std::size_t trials,
                      std::uint64_t rows) {
    Extents out;
    out.samples = hdf5::read_extents(in, family, trials, rows);
    out.first = hdf5::compute_begins(out.samples);
    return out;
  }
  template <class Number>
  std::vector<Number> slice(Reader& in, const SlicedColumn& column, std::size_t trial,
                            std::size_t rows_per_sample = 1) const {
    return in.slice<Number>(column, first[trial] * rows_per_sample,
                            samples[trial] * rows_per_sample);
  }
};

/// A column with `per_time` rows for each row of `times`.
template <class Number>
SlicedColumn open_beside(Reader& in, const SlicedColumn& times, const std::string& name,
                         std::size_t width = 0, std::size_t per_time = 1,
                         const char* complaint = "length differs from its times") {
  SlicedColumn out = in.sliced<Number>(name, width);
  in.require(out.rows == times.rows * per_time, name, complaint);
  return out;
}

/// Times and quanta of the wrench or of the stages.
struct StreamColumns {
  SlicedColumn t_ns, quanta;
  Extents extents;

  static StreamColumns open(Reader& in, const std::string& group, std::size_t width,
                            std::size_t trials) {
    StreamColumns out;
    out.t_ns = in.sliced<std::int64_t>(group + "/t_ns");
    if (width > 0) out.quanta = open_beside<std::int32_t>(in, out.t_ns, group + "/quanta", width);
    out.extents = Extents::read(in, group.substr(1), trials, out.t_ns.rows);
    return out;
  }
  template <class StreamData>
  void load(Reader& in, std::size_t trial, StreamData& stream) const {
    stream.t_ns = extents.slice<std::int64_t>(in, t_ns, trial);
    if (quanta.width > 0) stream.quanta = extents.slice<std::int32_t>(in, quanta, trial);
  }
};

/// The columns of acceleration or sound; none if the file has no such stream.
struct BlockColumns {
  std::size_t readings = 0;
  SlicedColumn t_ns, device_us, lost, clipped, quanta;
  Extents extents;

  static BlockColumns open(Reader& in, const std::string& group, std::size_t axes,
                           const BlockFormat& format, std::size_t trials) {
    BlockColumns out;
    if (format.readings == 0) return out;
    out.readings = format.readings;
    out.t_ns = in.sliced<std::int64_t>(group + "/t_ns");
    out.quanta = open_beside<std::int32_t>(in, out.t_ns, group + "/quanta", axes == 1 ? 0 : axes,
                                           out.readings);
    out.device_us = open_beside<std::uint32_t>(in, out.t_ns, group + "/device_us");
    out.lost = open_beside<std::uint32_t>(in, out.t_ns, group + "/lost");
    out.clipped = open_beside<std::uint32_t>(in, out.t_ns, group + "/clipped");
    out.extents = Extents::read(in, group.substr(1) + "_blocks", trials, out.t_ns.rows);
    return out;
  }
  void load(Reader& in, std::size_t trial, BlockStream& stream) const {
    if (readings == 0) return;
    stream.t_ns = extents.slice<std::int64_t>(in, t_ns, trial);
    stream.device_us = extents.slice<std::uint32_t>(in, device_us, trial);
    stream.lost = extents.slice<std::uint32_t>(in, lost, trial);
    stream.clipped = extents.slice<std::uint32_t>(in, clipped, trial);
    stream.quanta = extents.slice<std::int32_t>(in, quanta, trial, readings);
  }
};

/// The columns of /taxel.
struct TaxelColumns {
  std::size_t taxels = 0;  ///< 0 if none were recorded: the rows then have times and phases only
  bool is_whole = true;
  SlicedColumn t_ns, phase, counts, device_us;
  Extents extents, clocked;

  static TaxelColumns open(Reader& in, std::size_t trials) {
    constexpr const char* complaint = "length differs from /taxel/t_ns";
    TaxelColumns out;
    if (in.has("/taxel/counts")) {
      out.taxels = in.text_width("/taxel/counts");
      in.require(out.taxels > 0 && out.taxels <= most_taxels, "/taxel/counts",
                 "number of taxels out of range");
      out.is_whole = in.is_integer("/taxel/counts");
    }
    out.t_ns = in.sliced<std::int64_t>("/taxel/t_ns");
    out.extents = Extents::read(in, "taxel", trials, out.t_ns.rows);
    out.phase = open_beside<std::uint8_t>(in, out.t_ns, "/taxel/phase", 0, 1, complaint);
    if (out.taxels > 0 && out.is_whole)
      out.counts =
          open_beside<std::uint16_t>(in, out.t_ns, "/taxel/counts", out.taxels, 1, complaint);
    if (out.taxels > 0 && !out.is_whole)
      out.counts = open_beside<double>(in, out.t_ns, "/taxel/counts", out.taxels, 1, complaint);
    out.device_us = in.sliced<std::uint32_t>("/taxel/device_us");
    out.clocked = Extents::read(in, "device_us", trials, out.device_us.rows);
    return out;
  }
  void load(Reader& in, std::size_t index, TrialData& out) const {
    auto& [trial, record] = out;
    trial.taxels = taxels;
    for (const std::uint8_t letter : extents.slice<std::uint8_t>(in, phase, index)) {
      const auto read = phase_from_char(static_cast<char>(letter));
      if (!in.require(read.has_value(), "/taxel/phase", "unknown phase")) return;
      trial.phase.push_back(*read);
    }
    record.t_ns = extents.slice<std::int64_t>(in, t_ns, index);
    if (taxels > 0 && is_whole) {
      const auto whole = extents.slice<std::uint16_t>(in, counts, index);
      trial.counts.assign(whole.begin(), whole.end());
    } else if (taxels > 0) {
      trial.counts = extents.slice<double>(in, counts, index);
    }
    record.device_us = clocked.slice<std::uint32_t>(in, device_us, index);
  }
};

}  // namespace reading

struct DatasetReader::Impl {
  std::filesystem::path path;
  Reader in;
  Dataset listed = {};
  DatasetDigest digest = {};
  reading::TaxelColumns taxels = {};
  reading::StreamColumns wrench = {}, stages = {};
  reading::BlockColumns acceleration = {}, sound = {};

  Status open_streams() {
    DatasetInfo& info = listed.info;
    const std::size_t trials = listed.trials.size();
    taxels = reading::TaxelColumns::open(in, trials);
    for (classifier::Trial& trial : listed.trials) trial.taxels = taxels.taxels;
    read_block_format(in, "/acceleration", info.acceleration);
    read_block_format(in, "/sound", info.sound);
    wrench = reading::StreamColumns::open(in, "/wrench", 6, trials);
    hdf5::compare_quantum(in, "/wrench/quanta", force_quanta_per_n);
    stages = reading::StreamColumns::open(in, "/stages", info.axes.size(), trials);
    acceleration = reading::BlockColumns::open(in, "/acceleration", acceleration_axes,
                                               info.acceleration, trials);
    hdf5::compare_quantum(in, "/acceleration/quanta", acceleration_quanta_per_mps2);
    sound = reading::BlockColumns::open(in, "/sound", 1, info.sound, trials);
    hdf5::compare_quantum(in, "/sound/quanta", sound_quanta_per_pa);
    return in.status();
  }

  Status read_digests() {
    digest.trial_sha256 = in.texts("/trials/sha256");
    in.require(digest.trial_sha256.size() == listed.trials.size(), "/trials/sha256",
               "length differs from /trials/file");
    digest.dataset_sha256 = in.text_attribute("/", "dataset_sha256");
    return in.status();
  }

  /// Everything but the samples.
  Status read_lists() {
    Status done = read_root(in, listed.info);
    if (done) done = read_provenance(in, listed.info);
    if (done) done = read_selection(in, listed.info);
    if (done) done = read_axes(in, listed.info);
    if (done) done = read_trial_table(in, listed);
    if (done) done = read_factors(in, listed);
    if (done) done = read_columns_of_groups(in, listed);
    if (done) done = open_streams();
    if (done) done = read_digests();
    if (!done) return pass(hdf5::with_damaged_trials(std::move(done).error(), path, listed));
    return {};
  }
};

DatasetReader::DatasetReader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DatasetReader::DatasetReader(DatasetReader&&) noexcept = default;
DatasetReader& DatasetReader::operator=(DatasetReader&& other) noexcept {
  impl_.swap(other.impl_);  // the other's destructor locks the library
  return *this;
}
DatasetReader::~DatasetReader() {
  const hdf5::QuietErrors quiet;  // handles close
  impl_.reset();
}

const Dataset& DatasetReader::listed() const {
  return impl_->listed;
}

const DatasetDigest& DatasetReader::digest() const {
  return impl_->digest;
}

namespace {

Status compare_digests(std::string where, std::string_view whose, const std::string& recorded,
                       const std::string& got) {
  if (got == recorded) return {};
  return fail({.code = Errc::corrupt,
               .where = std::move(where),
               .what = std::string(whose) + " altered, SHA-256 differs",
               .expected = recorded,
               .got = got});
}

Status corrupt(Status found) {
  if (!found) found.error().code = Errc::corrupt;
  return found;
}

}  // namespace

Result<DatasetReader> DatasetReader::open(const std::filesystem::path& path) {
  const hdf5::QuietErrors quiet;
  auto in = Reader::open(path);
  if (!in) return pass(std::move(in).error());
  DatasetReader out(std::make_unique<Impl>(Impl{path, std::move(*in)}));
  if (Status done = out.impl_->read_lists(); !done) return pass(done.error(), path.string());
  return out;
}

Result<TrialData> DatasetReader::read(std::size_t trial) {
  const hdf5::QuietErrors quiet;
  Impl& file = *impl_;
  TrialData out{file.listed.trials[trial], file.listed.records[trial]};
  file.taxels.load(file.in, trial, out);
  file.wrench.load(file.in, trial, out.record.wrench);
  file.stages.load(file.in, trial, out.record.stages);
  file.acceleration.load(file.in, trial, out.record.acceleration);
  file.sound.load(file.in, trial, out.record.sound);
  if (const Status& done = file.in.status(); !done)
    return pass(hdf5::with_damaged_trials(done.error(), file.path, file.listed),
                file.path.string());
  return out;
}

Result<TrialData> DatasetReader::load(std::size_t trial) {
  auto out = read(trial);
  if (!out) return out;
  Status fine = corrupt(check_trial(out->trial, out->record, impl_->listed.info));
  if (fine)
    fine = compare_digests("trial " + out->trial.file, "trial", impl_->digest.trial_sha256[trial],
                           trial_sha256(out->trial, out->record));
  if (!fine) return pass(fine.error(), impl_->path.string());
  return out;
}

Status DatasetReader::check_digest() const {
  DatasetHasher hasher(impl_->listed.info);
  bool known = true;
  for (const std::string& trial : impl_->digest.trial_sha256)
    known = hasher.add_digest(trial) && known;
  const Status same = compare_digests("dataset_sha256", "data set", impl_->digest.dataset_sha256,
                                      known ? hasher.finish().dataset_sha256 : std::string());
  if (!same) return pass(same.error(), impl_->path.string());
  return {};
}

namespace {

Result<Dataset> read_columns(const std::filesystem::path& path, DatasetDigest& digest) {
  auto file = DatasetReader::open(path);
  if (!file) return pass(file.error());
  digest = file->digest();
  Dataset out;
  out.info = file->listed().info;
  for (std::size_t i = 0; i < file->listed().trials.size(); ++i) {
    auto one = file->read(i);
    if (!one) return pass(one.error());
    out.trials.push_back(std::move(one->trial));
    out.records.push_back(std::move(one->record));
  }
  return out;
}

/// Compares the trials first, so that the error can name one.
Status verify_digests(const DatasetDigest& expected, const Dataset& dataset,
                      const StopRequested& stop_requested) {
  const auto got = compute_digest(dataset, stop_requested);
  if (!got) return pass(got.error());
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    if (Status same = compare_digests("trial " + dataset.trials[i].file, "trial",
                                      expected.trial_sha256[i], got->trial_sha256[i]);
        !same)
      return same;
  return compare_digests("dataset_sha256", "data set", expected.dataset_sha256,
                         got->dataset_sha256);
}

/// `runs`: of /taxel/phase, from which /phases follows.
Status verify_phases(const std::filesystem::path& path, const hdf5::PhaseRuns& runs) {
  const hdf5::QuietErrors quiet;
  auto in = Reader::open(path);
  if (!in) return pass(in.error());
  const auto phases = hdf5::read_phase_runs(*in);
  if (!in->status()) return in->status();
  if (!phases || *phases == runs) return {};
  return fail(
      {.code = Errc::corrupt, .where = "/phases", .what = "phases differ from /taxel/phase"});
}

Result<Dataset> read_all(const std::filesystem::path& path, bool verify_digest,
                         const StopRequested& stop_requested) {
  DatasetDigest digest;
  auto dataset = read_columns(path, digest);
  if (!dataset) return dataset;
  Status done = corrupt(check(*dataset));
  if (done && verify_digest) done = verify_digests(digest, *dataset, stop_requested);
  // After the digests, which can name the trial with an altered phase.
  if (done && verify_digest) done = verify_phases(path, hdf5::phase_runs(*dataset));
  if (!done) return pass(std::move(done).error(), path.string());
  return dataset;
}

}  // namespace

Result<CheckedDataset> check_hdf5(const std::filesystem::path& path,
                                  const StopRequested& stop_requested) {
  auto file = DatasetReader::open(path);
  if (!file) return pass(file.error());
  const Dataset& listed = file->listed();
  DatasetHasher hasher(listed.info);
  TrialSequence sequence;
  hdf5::PhaseRuns runs;
  Status done;
  if (listed.trials.empty()) done = corrupt(check(listed));
  for (std::size_t i = 0; done && i < listed.trials.size(); ++i) {
    if (stop_requested && stop_requested()) return pass(stopped_early("digests"));
    const auto one = file->read(i);
    if (!one) return pass(one.error());
    done = sequence.check(one->trial);
    if (done) done = check_trial(one->trial, one->record, listed.info);
    done = corrupt(std::move(done));
    if (done)
      done = compare_digests("trial " + one->trial.file, "trial", file->digest().trial_sha256[i],
                             hasher.add(one->trial, one->record));
    runs.add(one->trial.phase);
  }
  CheckedDataset out{listed, hasher.finish()};
  if (done)
    done = compare_digests("dataset_sha256", "data set", file->digest().dataset_sha256,
                           out.digest.dataset_sha256);
  if (done) done = verify_phases(path, runs);
  if (!done) return pass(done.error(), path.string());
  return out;
}

Result<Dataset> read_hdf5(const std::filesystem::path& path, bool verify_digest,
                          const StopRequested& stop_requested) {
  try {
    return read_all(path, verify_digest, stop_requested);
  } catch (const std::bad_alloc&) {
    return fail(
        {.code = Errc::io, .where = path.string(), .what = "data set too large for the memory"});
  }
}

}  // namespace weft::daemon

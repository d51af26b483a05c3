// HDF5 file to Dataset. The file's own metadata is checked before use.
#include <cmath>
#include <functional>
#include <new>
#include <numeric>
#include <type_traits>

#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/dataset/group_columns.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/dataset/hdf5_derived.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "drivers/api/sample.hpp"

namespace weft::daemon {
namespace {

using hdf5::Reader;

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

/// Cuts a column of all trials, `width` numbers per row, into trials; `list`: destination in an
/// item.
template <class Number, class Item, class List>
void split(const std::vector<Number>& all, const std::vector<std::uint64_t>& extents,
           std::size_t width, std::vector<Item>& items, List list) {
  auto at = all.begin();
  for (std::size_t i = 0; i < extents.size(); ++i) {
    const auto end = at + static_cast<std::ptrdiff_t>(extents[i] * width);
    std::invoke(list, items[i]).assign(at, end);
    at = end;
  }
}

Status read_factors(Reader& in, Dataset& dataset) {
  if (!in.has("/factors")) return in.status();
  auto& names = dataset.info.factors;
  names = in.texts("/factors/name");
  const auto values = in.column<double>("/factors/values", names.size());
  in.require(values.size() == names.size() * dataset.records.size(), "/factors/values",
             "length differs from /trials/file");
  if (!in.status()) return in.status();
  const std::vector<std::uint64_t> one_row(dataset.records.size(), 1);
  split(
      values, one_row, names.size(), dataset.records,
      [](TrialRecord & record) -> auto& { return record.spec.factors; });
  return {};
}

Status read_columns_of_groups(Reader& in, Dataset& dataset) {
  StoredGroupColumns stored = read_group_columns(in, dataset.records.size());
  dataset.info.group_columns = std::move(stored.names);
  for (std::size_t i = 0; i < stored.of_row.size(); ++i)
    dataset.records[i].spec.group_values = std::move(stored.of_row[i]);
  return in.status();
}

Status read_phases(Reader& in, const std::vector<std::uint64_t>& extents, Dataset& dataset) {
  const auto letters = in.column<std::uint8_t>("/taxel/phase");
  std::vector<Phase> phases;
  phases.reserve(letters.size());
  for (const std::uint8_t letter : letters) {
    const auto phase = phase_from_char(static_cast<char>(letter));
    if (!in.require(phase.has_value(), "/taxel/phase", "unknown phase")) return in.status();
    phases.push_back(*phase);
  }
  const std::uint64_t rows = std::accumulate(extents.begin(), extents.end(), std::uint64_t{0});
  in.require(letters.size() == rows, "/taxel/phase", "length differs from /taxel/t_ns");
  if (!in.status()) return in.status();
  split(phases, extents, 1, dataset.trials, &classifier::Trial::phase);
  return {};
}

/// 0 if no taxels were recorded: the rows then have times and phases only.
std::size_t read_taxel_count(Reader& in) {
  if (!in.has("/taxel/counts")) return 0;
  const std::size_t taxels = in.text_width("/taxel/counts");
  in.require(taxels > 0 && taxels <= most_taxels, "/taxel/counts", "number of taxels out of range");
  return taxels;
}

Status read_taxels(Reader& in, Dataset& dataset) {
  const std::size_t taxels = read_taxel_count(in);
  if (!in.status()) return in.status();
  const auto t_ns = in.column<std::int64_t>("/taxel/t_ns");
  const auto extents = hdf5::read_extents(in, "taxel", dataset.trials.size(), t_ns.size());
  if (auto done = read_phases(in, extents, dataset); !done) return done;
  split(t_ns, extents, 1, dataset.records, &TrialRecord::t_ns);
  const auto place = [&](const auto& counts) {
    if (in.require(counts.size() == t_ns.size() * taxels, "/taxel/counts",
                   "length differs from /taxel/t_ns"))
      split(counts, extents, taxels, dataset.trials, &classifier::Trial::counts);
  };
  if (taxels > 0 && in.is_integer("/taxel/counts")) {
    place(in.column<std::uint16_t>("/taxel/counts", taxels));
  } else if (taxels > 0) {
    place(in.column<double>("/taxel/counts", taxels));
  }
  for (classifier::Trial& trial : dataset.trials) trial.taxels = taxels;

  const auto device_us = in.column<std::uint32_t>("/taxel/device_us");
  const auto clocked = hdf5::read_extents(in, "device_us", dataset.trials.size(), device_us.size());
  if (!in.status()) return in.status();
  split(device_us, clocked, 1, dataset.records, &TrialRecord::device_us);
  return {};
}

/// The times and quanta of one stream. A row has `row_values` numbers, and the file's column has
/// `width`. `family`: family of the extents, which are returned.
template <class StreamData>
std::vector<std::uint64_t> read_stream(Reader& in, const std::string& group,
                                       const std::string& family, std::size_t row_values,
                                       std::size_t width, Dataset& dataset,
                                       StreamData TrialRecord::*member) {
  const auto t_ns = in.column<std::int64_t>(group + "/t_ns");
  const auto quanta = in.column<std::int32_t>(group + "/quanta", width);
  in.require(quanta.size() == t_ns.size() * row_values, group + "/quanta",
             "length differs from its times");
  auto extents = hdf5::read_extents(in, family, dataset.trials.size(), t_ns.size());
  if (!in.status()) return extents;
  split(
      t_ns, extents, 1,
      dataset.records, [&](TrialRecord & record) -> auto& { return (record.*member).t_ns; });
  split(
      quanta, extents, row_values,
      dataset.records, [&](TrialRecord & record) -> auto& { return (record.*member).quanta; });
  return extents;
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

void read_blocks(Reader& in, const std::string& group, std::size_t axes, const BlockFormat& format,
                 Dataset& dataset, BlockStream TrialRecord::*member) {
  if (format.readings == 0) return;
  const auto extents = read_stream(in, group, group.substr(1) + "_blocks", format.readings * axes,
                                   axes == 1 ? 0 : axes, dataset, member);
  const std::uint64_t blocks = std::accumulate(extents.begin(), extents.end(), std::uint64_t{0});
  const auto numbers = [&](const std::string& name,
                           std::vector<std::uint32_t> BlockStream::*column) {
    const auto all = in.column<std::uint32_t>(group + name);
    in.require(all.size() == blocks, group + name, "length differs from its times");
    if (in.status())
      split(
          all, extents, 1,
          dataset.records, [&](TrialRecord & record) -> auto& { return record.*member.*column; });
  };
  if (!in.status()) return;
  numbers("/device_us", &BlockStream::device_us);
  numbers("/lost", &BlockStream::lost);
  numbers("/clipped", &BlockStream::clipped);
}

Status read_streams(Reader& in, Dataset& dataset) {
  const DatasetInfo& info = dataset.info;
  const std::size_t axes = info.axes.size();
  read_stream(in, "/wrench", "wrench", 6, 6, dataset, &TrialRecord::wrench);
  hdf5::compare_quantum(in, "/wrench/quanta", force_quanta_per_n);
  read_stream(in, "/stages", "stages", axes, axes, dataset, &TrialRecord::stages);
  read_blocks(in, "/acceleration", acceleration_axes, info.acceleration, dataset,
              &TrialRecord::acceleration);
  hdf5::compare_quantum(in, "/acceleration/quanta", acceleration_quanta_per_mps2);
  hdf5::compare_quantum(in, "/sound/quanta", sound_quanta_per_pa);
  read_blocks(in, "/sound", 1, info.sound, dataset, &TrialRecord::sound);
  return in.status();
}

/// Digests and phase runs stored in the file.
struct ReportedCounts {
  DatasetDigest digest;
  std::optional<hdf5::PhaseRuns> phases;
};

Status read_reported_counts(Reader& in, const Dataset& dataset, ReportedCounts& out) {
  auto& trials = out.digest.trial_sha256;
  trials = in.texts("/trials/sha256");
  in.require(trials.size() == dataset.trials.size(), "/trials/sha256",
             "length differs from /trials/file");
  out.digest.dataset_sha256 = in.text_attribute("/", "dataset_sha256");
  out.phases = hdf5::read_phase_runs(in);
  return in.status();
}

/// Compares the trials first, so that the error can name one.
Status verify_digests(const DatasetDigest& expected, const Dataset& dataset,
                      const StopRequested& stop_requested) {
  const auto compare = [](std::string where, std::string_view whose, const std::string& recorded,
                          const std::string& got) -> Status {
    if (got == recorded) return {};
    return fail({.code = Errc::corrupt,
                 .where = std::move(where),
                 .what = std::string(whose) + " altered, SHA-256 differs",
                 .expected = recorded,
                 .got = got});
  };
  const auto got = compute_digest(dataset, stop_requested);
  if (!got) return pass(got.error());
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    if (Status same = compare("trial " + dataset.trials[i].file, "trial", expected.trial_sha256[i],
                              got->trial_sha256[i]);
        !same)
      return same;
  return compare("dataset_sha256", "data set", expected.dataset_sha256, got->dataset_sha256);
}

/// All work inside the HDF5 library.
Result<Dataset> read_columns(const std::filesystem::path& path, bool verify_digest,
                             ReportedCounts& reported) {
  const hdf5::QuietErrors quiet;
  auto in = Reader::open(path);
  if (!in) return pass(std::move(in).error());
  Dataset dataset;
  Status done = read_root(*in, dataset.info);
  if (done) done = read_provenance(*in, dataset.info);
  if (done) done = read_selection(*in, dataset.info);
  if (done) done = read_axes(*in, dataset.info);
  if (done) done = read_trial_table(*in, dataset);
  if (done) done = read_factors(*in, dataset);
  if (done) done = read_columns_of_groups(*in, dataset);
  if (done) done = read_taxels(*in, dataset);
  if (done) {
    read_block_format(*in, "/acceleration", dataset.info.acceleration);
    read_block_format(*in, "/sound", dataset.info.sound);
    done = in->status();
  }
  if (done) done = read_streams(*in, dataset);
  if (done && verify_digest) done = read_reported_counts(*in, dataset, reported);
  if (!done)
    return pass(hdf5::with_damaged_trials(std::move(done).error(), path, dataset), path.string());
  return dataset;
}

Result<Dataset> read_all(const std::filesystem::path& path, bool verify_digest,
                         const StopRequested& stop_requested) {
  ReportedCounts reported;
  auto dataset = read_columns(path, verify_digest, reported);
  if (!dataset) return dataset;
  Status done = check(*dataset);
  if (!done) done.error().code = Errc::corrupt;
  if (done && verify_digest) done = verify_digests(reported.digest, *dataset, stop_requested);
  // After the digests, which can name the trial with an altered phase.
  if (done && reported.phases && *reported.phases != hdf5::phase_runs(*dataset))
    done = fail(
        {.code = Errc::corrupt, .where = "/phases", .what = "phases differ from /taxel/phase"});
  if (!done) return pass(std::move(done).error(), path.string());
  return dataset;
}

}  // namespace

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

#include "daemon/storage/dataset/dataset.hpp"

#include "daemon/storage/dataset/dataset_hasher.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <map>
#include <span>
#include <unordered_set>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/dataset/group_columns.hpp"

namespace weft::daemon {
namespace {

constexpr std::array<std::string_view, 7> outcome_names{
    "complete", "stopped", "aborted", "failed", "interrupted", "rejected", "ended_early"};

Status sizes_disagree(std::string_view what, std::size_t expected, std::size_t got) {
  return fail({.what = "wrong number of " + std::string(what),
               .expected = std::to_string(expected),
               .got = std::to_string(got)});
}

Status check_taxels(const classifier::Trial& trial) {
  if (trial.samples() == 0) return fail({.what = "trial without samples"});
  if (trial.counts.size() != trial.samples() * trial.taxels)
    return sizes_disagree("counts", trial.samples() * trial.taxels, trial.counts.size());
  const auto odd = std::ranges::find_if(trial.counts, [](double c) { return !std::isfinite(c); });
  if (odd != trial.counts.end())
    return fail(
        {.where = "sample " + std::to_string(static_cast<std::size_t>(odd - trial.counts.begin()) /
                                             trial.taxels),
         .what = "count not a finite number"});
  const auto phase = std::ranges::find_if(
      trial.phase, [](Phase p) { return !phase_from_char(to_char(p)).has_value(); });
  if (phase != trial.phase.end())
    return fail({.where = "sample " + std::to_string(phase - trial.phase.begin()),
                 .what = "unknown phase",
                 .expected = "S, P, M, E or -"});
  return {};
}

Status check_blocks(const BlockStream& stream, const BlockFormat& format, std::size_t axes,
                    const std::string& what) {
  const std::size_t blocks = stream.blocks();
  if (stream.quanta.size() != blocks * format.readings * axes)
    return sizes_disagree("values of " + what, blocks * format.readings * axes,
                          stream.quanta.size());
  for (const std::vector<std::uint32_t>* column :
       {&stream.device_us, &stream.lost, &stream.clipped})
    if (column->size() != blocks)
      return sizes_disagree("blocks of " + what, blocks, column->size());
  if (blocks > 0 && (format.readings == 0 || !(format.rate_hz > 0)))
    return fail({.what = "blocks of " + what + " without readings or rate"});
  return {};
}

Status check_record(const TrialRecord& record, std::size_t samples, const DatasetInfo& info) {
  const std::size_t axes = info.axes.size();
  const TrialQuality& quality = record.quality;
  if (!std::isfinite(quality.force_rms_error_n.value_or(0)) ||
      !std::isfinite(quality.force_in_band_fraction.value_or(0)))
    return fail({.what = "quality value not a finite number"});
  if (record.spec.factors.size() != info.factors.size())
    return sizes_disagree("factors", info.factors.size(), record.spec.factors.size());
  if (!std::ranges::all_of(record.spec.factors, [](double x) { return std::isfinite(x); }))
    return fail({.what = "factor value not a finite number"});
  if (auto fine = check_group_values(record.spec.group_values, info.group_columns.size()); !fine)
    return fine;
  if (record.t_ns.size() != samples) return sizes_disagree("times", samples, record.t_ns.size());
  if (!record.device_us.empty() && record.device_us.size() != samples)
    return sizes_disagree("device times", samples, record.device_us.size());
  if (record.wrench.quanta.size() != record.wrench.samples() * 6)
    return sizes_disagree("wrench values", record.wrench.samples() * 6,
                          record.wrench.quanta.size());
  if (record.stages.quanta.size() != record.stages.samples() * axes)
    return sizes_disagree("stage positions", record.stages.samples() * axes,
                          record.stages.quanta.size());
  Status fine =
      check_blocks(record.acceleration, info.acceleration, acceleration_axes, "acceleration");
  return fine ? check_blocks(record.sound, info.sound, 1, "sound") : fine;
}

void add_optional(Sha256& hash, const std::optional<double>& value) {
  hash.number(static_cast<std::uint8_t>(value.has_value() ? 1 : 0)).number(value.value_or(0.0));
}

void add_description(Sha256& hash, const classifier::Trial& trial, const TrialRecord& record) {
  for (const std::string_view text :
       {std::string_view(trial.file), std::string_view(trial.label), std::string_view(trial.group),
        std::string_view(record.spec.exploration), to_string(record.outcome)})
    hash.sized_text(text);
  hash.number(record.spec.index).number(record.spec.attempt).number(record.spec.repetition);
  hash.number(record.spec.patch_seed).number(record.lost_samples);
  add_optional(hash, record.quality.force_rms_error_n);
  add_optional(hash, record.quality.force_in_band_fraction);
}

void add_counts(Sha256& hash, const classifier::Trial& trial) {
  hash.number(static_cast<std::uint32_t>(trial.taxels));
  hash.number(static_cast<std::uint64_t>(trial.samples()));
  if (const auto exact = as_u16(trial.counts)) {
    hash.text("u").numbers(std::span<const std::uint16_t>(*exact));
  } else {
    hash.text("f").numbers(std::span<const double>(trial.counts));
  }
  hash.numbers(std::span<const Phase>(trial.phase));
}

template <class Number>
void add_list(Sha256& hash, const std::vector<Number>& values) {
  hash.number(static_cast<std::uint64_t>(values.size())).numbers(std::span<const Number>(values));
}

/// Hashes nothing for a trial without a sweep, so that its digest equals that of earlier versions.
void add_factors(Sha256& hash, const std::vector<double>& factors) {
  if (factors.empty()) return;
  hash.text("weft factors 1\n");
  add_list(hash, factors);
}

/// Hashes nothing for a trial without group columns, for the same reason.
void add_group_values(Sha256& hash, const std::vector<std::string>& values) {
  if (values.empty()) return;
  hash.text("weft group columns 1\n").number(static_cast<std::uint32_t>(values.size()));
  for (const std::string& value : values) hash.sized_text(value);
}

/// Hashes nothing for a trial without a known place, for the same reason.
void add_place(Sha256& hash, const TrialPlace& place) {
  if (place == TrialPlace{}) return;
  hash.text("weft place 1\n").number(place.piece).number(place.mounting).number(place.patch);
}

/// Hashes nothing for a trial without a measured rest, for the same reason.
void add_rest(Sha256& hash, const std::optional<RestForces>& rest) {
  if (!rest) return;
  hash.text("weft rest 1\n").number(rest->weight_n).number(rest->before_n).number(rest->after_n);
}

/// Hashes nothing for a trial without the stream, for the same reason.
void add_blocks(Sha256& hash, std::string_view heading, const BlockStream& stream) {
  if (stream.blocks() == 0) return;
  hash.text(heading);
  add_list(hash, stream.t_ns);
  add_list(hash, stream.device_us);
  add_list(hash, stream.lost);
  add_list(hash, stream.clipped);
  add_list(hash, stream.quanta);
}

Sha256Digest trial_digest(const classifier::Trial& trial, const TrialRecord& record) {
  Sha256 hash;
  hash.text("weft trial 1\n");
  add_description(hash, trial, record);
  add_counts(hash, trial);
  add_list(hash, record.t_ns);
  add_list(hash, record.device_us);
  add_list(hash, record.wrench.t_ns);
  add_list(hash, record.wrench.quanta);
  add_list(hash, record.stages.t_ns);
  add_list(hash, record.stages.quanta);
  add_blocks(hash, "weft acceleration 1\n", record.acceleration);
  add_blocks(hash, "weft sound 1\n", record.sound);
  add_factors(hash, record.spec.factors);
  add_place(hash, record.spec.place);
  add_rest(hash, record.quality.rest);
  add_group_values(hash, record.spec.group_values);
  return hash.finish();
}

std::string content_of(const classifier::Trial& trial) {
  Sha256 hash;
  hash.number(static_cast<std::uint64_t>(trial.taxels));
  for (const Phase phase : trial.phase) hash.number(to_char(phase));
  hash.numbers(std::span<const double>(trial.counts));
  return to_hex(hash.finish());
}

}  // namespace

std::string format_selection(const DatasetInfo& info) {
  std::map<std::string, std::uint64_t> by_label;
  std::uint64_t all = 0;
  for (const EndedEarly& some : info.ended_early) {
    by_label[some.label] += some.trials;
    all += some.trials;
  }
  if (all == 0) return {};
  std::string labels;
  for (const auto& [label, trials] : by_label)
    labels += (labels.empty() ? "" : ", ") + label + " " + std::to_string(trials);
  return "Selected: " + std::to_string(all) +
         (all == 1 ? " slide that a live vote ended early is"
                   : " slides that a live vote ended early are") +
         " left out (" + labels +
         "). The remaining slides of these fabrics are those with an uncertain vote. "
         "A model or an accuracy from them does not represent all slides.";
}

std::string_view to_string(TrialOutcome outcome) {
  return outcome_names.at(static_cast<std::size_t>(outcome));
}

bool is_done(TrialOutcome outcome) {
  return outcome == TrialOutcome::complete || outcome == TrialOutcome::ended_early;
}

std::optional<TrialOutcome> trial_outcome_from(std::string_view word) {
  return enum_named<TrialOutcome>(outcome_names, word);
}

double WrenchStream::force_n(std::size_t i, std::size_t axis) const {
  return quanta[6 * i + axis] / force_quanta_per_n;
}

double WrenchStream::torque_nm(std::size_t i, std::size_t axis) const {
  return quanta[6 * i + 3 + axis] / torque_quanta_per_nm;
}

std::string trial_name(const TrialSpec& spec) {
  const auto padded = [](std::uint32_t number, std::size_t width) {
    const std::string digits = std::to_string(number);
    return std::string(width - std::min(width, digits.size()), '0') + digits;
  };
  std::string name = padded(spec.index, 4) + "-" + spec.label;
  if (!spec.exploration.empty()) name += "-" + spec.exploration;
  name += "-r" + padded(spec.repetition, 2);
  if (spec.attempt > 0) name += "-a" + std::to_string(spec.attempt);
  return name;
}

classifier::Trial without_samples(const classifier::Trial& trial) {
  classifier::Trial out;
  out.file = trial.file;
  out.label = trial.label;
  out.group = trial.group;
  out.taxels = trial.taxels;
  return out;
}

TrialRecord without_samples(const TrialRecord& record) {
  TrialRecord out;
  out.spec = record.spec;
  out.outcome = record.outcome;
  out.quality = record.quality;
  out.lost_samples = record.lost_samples;
  return out;
}

Status check_trial(const classifier::Trial& trial, const TrialRecord& record,
                   const DatasetInfo& info) {
  const std::string where = "trial " + trial.file;
  if (trial.label.empty()) return fail({.where = where, .what = "trial without label"});
  if (auto fine = check_taxels(trial); !fine) return pass(std::move(fine).error(), where);
  auto fine = check_record(record, trial.samples(), info);
  if (!fine) return pass(std::move(fine).error(), where);
  return {};
}

Status TrialSequence::check(const classifier::Trial& trial) {
  const std::string where = "trial " + trial.file;
  if (trial.file.empty() || !files_.insert(trial.file).second)
    return fail({.where = where, .what = "trial name missing or repeated"});
  if (!taxels_) taxels_ = trial.taxels;
  if (trial.taxels == *taxels_) return {};
  return fail({.where = where,
               .what = "number of taxels differs between trials",
               .expected = std::to_string(*taxels_),
               .got = std::to_string(trial.taxels)});
}

Status check(const Dataset& dataset) {
  if (dataset.trials.empty()) return fail({.what = "data set without trials"});
  if (dataset.records.size() != dataset.trials.size())
    return sizes_disagree("records", dataset.trials.size(), dataset.records.size());
  if (auto fine = check_group_names(dataset.info.group_columns); !fine) return fine;
  TrialSequence sequence;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    Status fine = sequence.check(dataset.trials[i]);
    if (fine) fine = check_trial(dataset.trials[i], dataset.records[i], dataset.info);
    if (!fine) return fine;
  }
  return {};
}

std::vector<std::string> list_explorations(const Dataset& dataset) {
  std::vector<std::string> names;
  for (const TrialRecord& record : dataset.records)
    if (record.outcome == TrialOutcome::complete &&
        std::ranges::find(names, record.spec.exploration) == names.end())
      names.push_back(record.spec.exploration);
  return names;
}

Result<std::vector<std::string>> explorations_in(std::string_view sum) {
  std::vector<std::string> out;
  for (std::size_t from = 0, to = 0; to != std::string_view::npos; from = to + 1) {
    to = sum.find('+', from);
    std::string name(sum.substr(from, to == std::string_view::npos ? to : to - from));
    if (!sum.empty() && (name.empty() || std::ranges::find(out, name) != out.end()))
      return fail({.where = "--exploration",
                   .what = "invalid sum of explorations",
                   .expected = "different names with + between them, such as M1+M2",
                   .got = std::string(sum)});
    out.push_back(std::move(name));
  }
  return out;
}

std::vector<classifier::Trial> complete_trials(const Dataset& dataset,
                                               std::optional<std::string_view> exploration) {
  std::vector<classifier::Trial> chosen;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    if (record.outcome != TrialOutcome::complete) continue;
    if (!exploration || record.spec.exploration == *exploration)
      chosen.push_back(dataset.trials[i]);
  }
  return chosen;
}

// The canonical serialisation behind the digests, specified in docs/reference/dataset.md, "Digest".

std::string trial_sha256(const classifier::Trial& trial, const TrialRecord& record) {
  return to_hex(trial_digest(trial, record));
}

DatasetDigest compute_digest(const Dataset& dataset) {
  return *compute_digest(dataset, {});  // without a stop request there is no error
}

DatasetHasher::DatasetHasher(const DatasetInfo& info) {
  hash_.text("weft dataset 1\n");
  hash_.sized_text(to_string(info.kind));
  hash_.number(static_cast<std::uint32_t>(info.axes.size()));
  for (const Axis& axis : info.axes) {
    hash_.sized_text(axis.name);
    hash_.number(static_cast<std::uint8_t>(axis.rotary ? 1 : 0));
  }
  if (!info.factors.empty()) {
    hash_.text("weft factors 1\n");
    hash_.number(static_cast<std::uint32_t>(info.factors.size()));
    for (const std::string& factor : info.factors) hash_.sized_text(factor);
  }
  add_group_values(hash_, info.group_columns);
}

std::string DatasetHasher::add(const classifier::Trial& trial, const TrialRecord& record) {
  trials_.push_back(trial_digest(trial, record));
  return to_hex(trials_.back());
}

bool DatasetHasher::add_digest(std::string_view hex) {
  Sha256Digest digest{};
  if (hex.size() != 2 * digest.size()) return false;
  for (std::size_t i = 0; i < digest.size(); ++i) {
    const char* const byte = hex.data() + 2 * i;
    const auto [end, error] = std::from_chars(byte, byte + 2, digest[i], 16);
    if (error != std::errc{} || end != byte + 2) return false;
  }
  trials_.push_back(digest);
  return true;
}

DatasetDigest DatasetHasher::finish() {
  DatasetDigest out;
  hash_.number(static_cast<std::uint64_t>(trials_.size()));
  for (const Sha256Digest& digest : trials_) {
    hash_.update(digest);
    out.trial_sha256.push_back(to_hex(digest));
  }
  out.dataset_sha256 = to_hex(hash_.finish());
  return out;
}

Result<DatasetDigest> compute_digest(const Dataset& dataset, const StopRequested& stop_requested) {
  DatasetHasher hasher(dataset.info);
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    if (stop_requested && stop_requested()) return pass(stopped_early("digests"));
    hasher.add(dataset.trials[i], dataset.records[i]);
  }
  return hasher.finish();
}

std::string dataset_sha256(const Dataset& dataset) {
  return compute_digest(dataset).dataset_sha256;
}

std::optional<std::vector<std::uint16_t>> as_u16(std::span<const double> counts) {
  std::vector<std::uint16_t> whole;
  whole.reserve(counts.size());
  for (const double count : counts) {
    if (!(count >= 0.0 && count <= 65535.0)) return std::nullopt;
    const auto rounded = static_cast<std::uint16_t>(count);
    // Compares bits, because -0.0 equals 0 and would not be restored.
    if (std::bit_cast<std::uint64_t>(static_cast<double>(rounded)) !=
        std::bit_cast<std::uint64_t>(count))
      return std::nullopt;
    whole.push_back(rounded);
  }
  return whole;
}

Copies copies_among(const std::vector<std::string>& names,
                    const std::vector<std::string>& contents) {
  Copies all;
  std::map<std::string, std::size_t> place;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto [at, is_new] = place.emplace(contents[i], all.size());
    if (is_new) all.emplace_back();
    all[at->second].push_back(names[i]);
  }
  std::erase_if(all, [](const auto& own) { return own.size() < 2; });
  return all;
}

Copies copies_in(const Dataset& dataset) {
  std::vector<std::string> names, contents;
  for (const classifier::Trial& trial : dataset.trials) {
    if (trial.taxels == 0)
      continue;  // without taxels only the phases are compared, and these are alike in all trials
    names.push_back(trial.file);
    contents.push_back(content_of(trial));
  }
  return copies_among(names, contents);
}

std::string copies_text(const Copies& copies) {
  constexpr std::size_t most_named = 5;
  if (copies.empty()) return {};
  std::string out = "COPIES: identical samples under several names: ";
  for (std::size_t i = 0; i < std::min(copies.size(), most_named); ++i)
    out += (i > 0 ? "; " : "") + joined(copies[i], " = ");
  if (copies.size() > most_named)
    out += "; and " + std::to_string(copies.size() - most_named) + " more";
  return out + ". Keep one of each: a copy in the training part falsifies the test of the other.\n";
}

}  // namespace weft::daemon

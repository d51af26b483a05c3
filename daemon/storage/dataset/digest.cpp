// The canonical serialisation behind the digests, specified in docs/dataset.md, "Digest".
#include "daemon/storage/dataset/digest.hpp"

#include <algorithm>
#include <bit>
#include <map>
#include <span>

#include "daemon/base/file/sha256.hpp"

namespace weft::daemon {
namespace {

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

/// A trial that is no part of a sweep has the digest that it had before there were any.
void add_factors(Sha256& hash, const std::vector<double>& factors) {
  if (factors.empty()) return;
  hash.text("weft factors 1\n");
  add_list(hash, factors);
}

/// A trial without the stream has the digest that it had before there were such streams.
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

std::string trial_sha256(const classifier::Trial& trial, const TrialRecord& record) {
  return to_hex(trial_digest(trial, record));
}

DatasetDigest compute_digest(const Dataset& dataset) {
  return *compute_digest(dataset, {});  // nothing else stops it
}

Result<DatasetDigest> compute_digest(const Dataset& dataset, const StopRequested& stop_requested) {
  DatasetDigest digest;
  Sha256 hash;
  hash.text("weft dataset 1\n");
  hash.sized_text(to_string(dataset.info.kind));
  hash.number(static_cast<std::uint32_t>(dataset.info.axes.size()));
  for (const Axis& axis : dataset.info.axes) {
    hash.sized_text(axis.name);
    hash.number(static_cast<std::uint8_t>(axis.rotary ? 1 : 0));
  }
  if (!dataset.info.factors.empty()) {
    hash.text("weft factors 1\n");
    hash.number(static_cast<std::uint32_t>(dataset.info.factors.size()));
    for (const std::string& factor : dataset.info.factors) hash.sized_text(factor);
  }
  hash.number(static_cast<std::uint64_t>(dataset.trials.size()));
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    if (stop_requested && stop_requested()) return pass(stopped_early("digests"));
    const Sha256Digest trial = trial_digest(dataset.trials[i], dataset.records[i]);
    hash.update(trial);
    digest.trial_sha256.push_back(to_hex(trial));
  }
  digest.dataset_sha256 = to_hex(hash.finish());
  return digest;
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
    // By bits, because -0.0 equals 0 and would not come back.
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
    names.push_back(trial.file);
    contents.push_back(content_of(trial));
  }
  return copies_among(names, contents);
}

std::string copies_text(const Copies& copies) {
  constexpr std::size_t most_named = 5;
  if (copies.empty()) return {};
  std::string out = "COPIES: the same samples under several names: ";
  for (std::size_t i = 0; i < std::min(copies.size(), most_named); ++i) {
    if (i > 0) out += "; ";
    for (std::size_t k = 0; k < copies[i].size(); ++k) out += (k > 0 ? " = " : "") + copies[i][k];
  }
  if (copies.size() > most_named)
    out += "; and " + std::to_string(copies.size() - most_named) + " more";
  return out + ". Leave all but one of each out: a copy that trains answers for one that tests.\n";
}

}  // namespace weft::daemon

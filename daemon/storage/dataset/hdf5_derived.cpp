#include "daemon/storage/dataset/hdf5_derived.hpp"

#include <algorithm>
#include <numeric>

namespace weft::daemon::hdf5 {
namespace {

constexpr std::size_t most_named = 6;

/// The family of /trials/<family>_samples to which a column belongs.
std::string family_of(const std::string& column) {
  if (column == "/taxel/device_us") return "device_us";
  const std::string group = column.substr(1, column.find('/', 1) - 1);
  return group == "acceleration" || group == "sound" ? group + "_blocks" : group;
}

/// `name`: a column that may be absent.
template <class Number>
void compare(Reader& in, const std::string& name, const std::vector<Number>& expected,
             const char* complaint) {
  if (in.has(name)) in.require(in.column<Number>(name) == expected, name, complaint);
}

}  // namespace

void PhaseRuns::add(const std::vector<Phase>& phases) {
  bool new_run = true;
  for (const Phase p : phases) {
    const auto letter = static_cast<std::uint8_t>(p);
    if (new_run || phase.back() != letter) {
      trial.push_back(trials_);
      phase.push_back(letter);
      first.push_back(rows_);
      samples.push_back(0);
      new_run = false;
    }
    ++samples.back();
    ++rows_;
  }
  ++trials_;
}

PhaseRuns phase_runs(const Dataset& dataset) {
  PhaseRuns out;
  for (const classifier::Trial& trial : dataset.trials) out.add(trial.phase);
  return out;
}

std::optional<PhaseRuns> read_phase_runs(Reader& in) {
  if (!in.has("/phases")) return std::nullopt;
  PhaseRuns out;
  out.trial = in.column<std::uint32_t>("/phases/trial");
  out.phase = in.column<std::uint8_t>("/phases/phase");
  out.first = in.column<std::uint64_t>("/phases/first");
  out.samples = in.column<std::uint64_t>("/phases/samples");
  return out;
}

std::vector<std::uint64_t> compute_begins(const std::vector<std::uint64_t>& samples) {
  std::vector<std::uint64_t> out(samples.size());
  std::exclusive_scan(samples.begin(), samples.end(), out.begin(), std::uint64_t{0});
  return out;
}

std::vector<std::uint64_t> read_extents(Reader& in, const std::string& family, std::size_t trials,
                                        std::size_t rows) {
  const std::string name = "/trials/" + family + "_samples";
  auto samples = in.column<std::uint64_t>(name);
  std::uint64_t left = rows;
  bool fits = samples.size() == trials;
  for (const std::uint64_t count : samples) {
    fits = fits && count <= left;
    if (fits) left -= count;
  }
  if (in.require(fits && left == 0, name, "sum differs from the length of its columns"))
    compare(in, "/trials/" + family + "_first", compute_begins(samples),
            "trial does not begin at the end of the previous trial");
  return samples;
}

void compare_quantum(Reader& in, const std::string& column, double per_unit) {
  if (in.has_attribute(column, "per_unit"))
    in.require(in.real_attribute(column, "per_unit") == per_unit, column,
               "per_unit differs from this layout");
}

void compare_axes(Reader& in, const std::vector<Axis>& axes) {
  std::vector<double> per_unit;
  for (const Axis& axis : axes) per_unit.push_back(axis.quanta_per_unit());
  compare(in, "/stages/per_unit", per_unit, "per_unit differs from this layout");
}

Error with_damaged_trials(Error error, const std::filesystem::path& file, const Dataset& dataset) {
  const std::string column = error.where;
  if (error.what != Reader::damaged_column || !column.starts_with('/')) return error;
  auto in = Reader::open(file);
  if (!in) return error;
  const auto samples = in->column<std::uint64_t>("/trials/" + family_of(column) + "_samples");
  const std::uint64_t all = std::accumulate(samples.begin(), samples.end(), std::uint64_t{0});
  if (samples.size() != dataset.trials.size() || all == 0) return error;
  const std::uint64_t rows_per_sample = in->rows_of(column) / all;  // a block stream has several
                                                                    // readings per sample
  std::vector<std::string> damaged;
  std::uint64_t first = 0;
  for (std::size_t i = 0; i < samples.size(); first += samples[i++] * rows_per_sample)
    if (!in->can_read(column, first, samples[i] * rows_per_sample))
      damaged.push_back(dataset.trials[i].file);
  for (std::size_t i = 0; i < std::min(damaged.size(), most_named); ++i)
    error.where += (i > 0 ? ", " : damaged.size() > 1 ? " of trials " : " of trial ") + damaged[i];
  if (damaged.size() > most_named)
    error.where += " and " + std::to_string(damaged.size() - most_named) + " more";
  return error;
}

}  // namespace weft::daemon::hdf5
